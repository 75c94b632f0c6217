// TEST quick
/* test_scene_text.c: scenes from text in memory. */
#include "scene_files.h"

#include <sys/stat.h>

static void text_in_memory_reads_as_its_file_would(void)
{
  static const char text[] = "body: {mesh: ../bar.node, density: 7}\neffects: [gravity]\n";
  flesh_scene *scene = NULL;
  mkdir(file_path("below"), 0777);
  CHECK_OK(flesh_scene_read(write_text("below/scene.yaml", text), 1, (const char *[]){"body.density=9"}, &scene));
  char *read = resolved(scene);
  flesh_scene_destroy(&scene);
  if (remove(file_path("below/scene.yaml"))) abort(); /* the folder counts, not the file */
  CHECK_OK(flesh_scene_read_text(text, file_path("below/scene.yaml"), 1, (const char *[]){"body.density=9"}, &scene));
  char *given = resolved(scene);
  CHECK_TEXT(read, "density: 9");
  CHECK(!strcmp(read, given));
  free(read);
  free(given);
  flesh_scene_destroy(&scene);
  CHECK(flesh_scene_read_text("body: {mesh: bar.node,\n  densty: 7}\n", "note", 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  CHECK(!scene);
  CHECK_TEXT(flesh_error_text(), "note:2:3: body.densty");
}

static void what_is_too_long_is_refused(void)
{
  const size_t size = ((size_t)64 << 20) + 1;
  char *text = malloc(size + 1);
  flesh_scene *scene = NULL;
  if (!text) abort();
  memset(text, ' ', size);
  text[size] = 0;
  CHECK(flesh_scene_read_text(text, "note", 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "note: the text has 67108865 bytes; a scene has at most 67108864");
  free(text);
}

static void nothing_is_no_scene(void)
{
  flesh_scene *scene = NULL;
  CHECK(flesh_scene_read_text("", "note", 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "note:1:1: the scene is empty");
}

/* Keys without a text, and tags, have a position of their own. */
static void what_is_no_word_is_refused_at_its_place(void)
{
  static const struct {
    const char *text, *error;
  } rows[] = {{"body:\n  mesh:\n  # a: b\n  : 3\n", "note:4:3: a key of this mapping is empty"},
              {"body: {mesh: \"a:b\", density: [1, {x: 3}],\n  : 3}\n", "note:2:3: a key of this mapping is empty"},
              {"body:\n  mesh: a # b: c\n\n  ? # d\n  : 3\n", "note:4:3: a key of this mapping is empty"},
              {"title: 3\nbody: !pin {mesh: a}\n", "note:2:7: a tag of YAML (!name), which means nothing in a scene"},
              {"title: 3\nbody:\n  mesh: !!str a\n", "note:3:9: a tag of YAML"},
              {"title: 3\n!x body: 3\n", "note:2:1: a tag of YAML"},
              {"bodies:\n- ! [3]\n", "note:2:3: a tag of YAML"}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    flesh_scene *scene = NULL;
    CHECK(flesh_scene_read_text(rows[k].text, "note", 0, NULL, &scene) == FLESH_ERR_ARGUMENT && !scene);
    CHECK_TEXT(flesh_error_text(), rows[k].error);
  }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(text_in_memory_reads_as_its_file_would), TEST(what_is_too_long_is_refused),
                         TEST(nothing_is_no_scene), TEST(what_is_no_word_is_refused_at_its_place));
  test_folder_remove(folder);
  return failed;
}
