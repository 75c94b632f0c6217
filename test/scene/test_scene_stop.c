// TEST full memory seconds=60
/* test_scene_stop.c: reading scenes that the caller no longer wants stops wherever the caller is asked. */
#include "scene_files.h"

typedef struct question {
  int asked, last, status; /* the last question is answered with the status */
} question;

static int answer(void *data)
{
  question *q = data;
  return ++q->asked < q->last ? FLESH_OK : q->status;
}

/* Every question in turn is the last. */
static void check(const char *text)
{
  const char *path = write_text("scene.yaml", text);
  int done = 0, last = 1;
  for (; !done && last < 500; last++) {
    flesh_scene *scene = NULL;
    question q = {.last = last, .status = last % 2 ? FLESH_ERR_INTERRUPTED : FLESH_ERR_BUDGET};
    flesh_scene_set_stop(answer, &q);
    const int status = flesh_scene_read(path, 0, NULL, &scene);
    done = q.asked < last;
    CHECK(status == (done ? FLESH_OK : q.status) && !scene == !done);
    CHECK(q.asked <= last); /* a caller who has stopped is not asked again */
    if (!done) CHECK(strstr(flesh_error_text(), "scene.yaml: ") && strstr(flesh_error_text(), "while the scene was set up"));
    flesh_scene_destroy(&scene);
  }
  printf("# asked %d times\n", last - 2);
  CHECK(done && last > 15);
  flesh_scene_set_stop(NULL, NULL);
}

static void every_question_ends_a_scene(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){4, 5, 6}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_mesh_write(mesh, file_path("box.mesh")));
  flesh_mesh_destroy(&mesh);
  check("body: {mesh: box.mesh, element: tet10-mean, refine: 1, material: {energy: S, young: 1e5, poisson: 0.45}}\n"
        "effects: [gravity: {}]\n");
}

/* The caller is not asked for small scenes, nor after scenes. */
static void nobody_is_asked_elsewhere(void)
{
  flesh_mesh *mesh = NULL, *finer = NULL;
  flesh_scene *scene = NULL;
  question q = {.last = 1, .status = FLESH_ERR_INTERRUPTED};
  flesh_scene_set_stop(answer, &q);
  CHECK_OK(flesh_mesh_box((int[]){10, 10, 10}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_mesh_refine(mesh, &finer));
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&finer);
  CHECK_OK(flesh_scene_read(write_text("small.yaml", "body: {mesh: box.mesh}\neffects: [gravity: {}]\n"), 0, NULL, &scene));
  flesh_scene_destroy(&scene);
  CHECK(!q.asked);
  flesh_scene_set_stop(NULL, NULL);
}

static void missing_overrides_are_refused(void)
{
  flesh_scene *scene;
  CHECK(flesh_scene_read_text("title: none", "none.yaml", 2, NULL, &scene) == FLESH_ERR_ARGUMENT && !scene);
  CHECK_TEXT(flesh_error_text(), "the count is 2 overrides");
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  int failed = RUN_TESTS(argc, argv, TEST(every_question_ends_a_scene), TEST(nobody_is_asked_elsewhere),
                         TEST(missing_overrides_are_refused));
  test_folder_remove(folder);
  return failed;
}
