// TEST quick
/* test_techniques.c: the list of a solver's techniques in a scene. */
#include "scene_files.h"

#include "newton/mechanisms.h"

/* A list of techniques names those that are on, or those that are off; written and read again it is the same. */
static void techniques_are_named_or_left_out(void)
{
  static const struct {
    const char *list, *written;
    unsigned set;
  } rows[] = {
      {"[all]", "[all]", FLESH_TECHNIQUES_ALL},
      {"[]", "[]", 0},
      {"[watchdog]", "[watchdog]", FLESH_TECHNIQUE_WATCHDOG},
      {"[-watchdog, -rigid_guess]", "[-watchdog, -rigid_guess]",
       FLESH_TECHNIQUES_ALL & ~(FLESH_TECHNIQUE_WATCHDOG | FLESH_TECHNIQUE_RIGID_GUESS)},
      {"[all, -untangle]", "[-untangle]", FLESH_TECHNIQUES_ALL & ~FLESH_TECHNIQUE_UNTANGLE},
      {"[watchdog, untangle, -watchdog]", "[untangle]", FLESH_TECHNIQUE_UNTANGLE}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    char set[80], line[80];
    flesh_scene *scene = NULL;
    snprintf(set, sizeof set, "solver.techniques=%s", rows[k].list);
    CHECK_OK(read_scene("example.yaml", example, 1, (const char *[]){set}, &scene));
    if (!scene) continue;
    CHECK(flesh_scene_solver(scene)->techniques == rows[k].set);
    snprintf(line, sizeof line, "techniques: %s\n", rows[k].written);
    char *text = resolved(scene);
    CHECK_TEXT(text, line);
    free(text);
    flesh_scene_destroy(&scene);
  }
}

static void an_unknown_technique_is_named(void)
{
  flesh_scene *scene = NULL;
  CHECK(read_scene("example.yaml", example, 1, (const char *[]){"solver.techniques=[-watch]"}, &scene) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "solver.techniques is [-watch]; it must be a list of some of negative_curvature");
  CHECK_TEXT(flesh_error_text(), "or [-negative_curvature] for all but that");
}

/* Names and docs are in the order of the enum's bits. */
static void every_bit_has_a_name_and_a_doc(void)
{
  for (int k = 0; k < 32; k++) {
    const flesh_technique bit = (flesh_technique)(1u << k);
    const int known = (FLESH_TECHNIQUES_ALL >> k & 1) != 0;
    CHECK((flesh_technique_name(bit) != NULL) == known && (flesh_technique_doc(bit) != NULL) == known);
    if (known) CHECK(!strcmp(flesh_technique_name(bit), flesh_mechanism_names[k]));
  }
  CHECK(!strcmp(flesh_technique_name(FLESH_TECHNIQUE_WATCHDOG), "watchdog"));
  CHECK(!flesh_technique_name(FLESH_TECHNIQUES_ALL) && !flesh_technique_doc((flesh_technique)0));
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(techniques_are_named_or_left_out), TEST(an_unknown_technique_is_named),
                         TEST(every_bit_has_a_name_and_a_doc));
  test_folder_remove(folder);
  return failed;
}
