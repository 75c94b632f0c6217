// TEST quick needs=drivers
/* test_stability.c: the look at how stiff a body is in its equilibria ends when the run's budget is spent. */
#include "scene_files.h"

#include "error/companion.h"

static const char scene_text[] =
    "body: {mesh: bar.mesh, material: {energy: S, young: 1e5, poisson: 0.4}}\n"
    "effects:\n  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
    "  - traction: {box: [[3.99, -1, -1], [5, 2, 2]], traction: [0, 0, 200]}\n"
    "time: {end: 1}\n";

/* Runs the scene with a budget of `seconds`, which counts from long ago; checks the status and the last sentence. */
static void run(double seconds, int expected, const char *sentence)
{
  flesh_scene *scene = NULL;
  flesh_integrator *integrator = NULL;
  double x[108], v[108];
  flesh_state state = {.x = x, .v = v};
  CHECK_OK(flesh_scene_read_text(scene_text, file_path("scene.yaml"), 0, NULL, &scene));
  CHECK_OK(flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_STATIC, flesh_scene_solver(scene), &integrator));
  flesh_scene_start(scene, &state);
  const flesh_runner_options options = {.begun = 1e-3, .max_seconds = seconds};
  flesh_error_stability stability = {.scene = scene, .options = &options, .from_rest = 1};
  const flesh_observer observer = {flesh_error_watch_stability, &stability};
  const flesh_run_options of_run = {.h = 1, .end = 1, .observer_count = 1, .observers = &observer};
  CHECK(flesh_run(flesh_scene_system(scene), integrator, &of_run, &state, NULL) == expected);
  if (sentence) CHECK_TEXT(flesh_error_text(), sentence);
  CHECK(expected || (stability.at_rest > 0 && !*stability.words));
  flesh_integrator_destroy(&integrator);
  flesh_scene_destroy(&scene);
}

static void a_spent_budget_ends_it(void)
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){8, 1, 1}, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &mesh));
  CHECK(flesh_mesh_node_count(mesh) == 36);
  CHECK_OK(flesh_mesh_write(mesh, file_path("bar.mesh")));
  flesh_mesh_destroy(&mesh);
  run(0, FLESH_OK, NULL);
  run(1e-3, FLESH_ERR_BUDGET, "the budget is spent before it is known how stiff");
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int failed = RUN_TESTS(argc, argv, TEST(a_spent_budget_ends_it));
  test_folder_remove(folder);
  return failed;
}
