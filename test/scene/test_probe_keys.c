/* test_probe_keys.c: probes that are wrong give one sentence that says where and what; those that are right are written
 * and read back. */
#include "scene_files.h"

#define SCENE "body: {mesh: bar.node}\neffects: [gravity]\ntime: {end: 1}\noutput: {probes: [{%s}]}\n"

/* What is wrong, and parts of the sentence that must say so. */
static const struct {
  const char *probe, *parts[3];
} bad[] = {
    {"name: tip, point: [9, 0, 0]",
     {"bad.yaml:4:19: output.probes[0]: point is [9, 0, 0], which no tet holds at rest; the nearest is 5 m away"}},
    {"name: 3, point: [1, 0, 0]",
     {"output.probes[0]: name is '3'; it must be a letter, then letters, digits, _ and -"}},
    {"point: [1, 0, 0]",
     {"output.probes[0].name is missing"}},
    {"name: a",
     {"output.probes[0]: nothing is chosen; give point, box, sphere, nodes, regions or body"}},
    {"name: a, point: [1, 0, 0], nodes: [3]",
     {"output.probes[0]: point stands beside box, sphere, nodes, regions or body"}},
    {"name: a, nodes: [99]",
     {"output.probes[0]: nodes[0] is 99; the mesh has the nodes 0 to 19"}},
    {"name: a, point: [1, 0, 0], quantities: [reaction]",
     {"output.probes[0]: quantities has reaction, which a point has not"}},
    {"name: a, point: [1, 0, 0], quantities: [weight]",
     {"output.probes[0].quantities", "it must be", "position, velocity, reaction, J"}},
    {"name: a, nodes: [1], quantities: [J]",
     {"output.probes[0]: quantities has some of J, stretch, stress and energy, but no tet has all", "the 1 chosen"}},
    {"name: a, point: [1, 0, 0], quantities: [stress]",
     {"output.probes[0]: quantities has stress, but the body has no material"}},
    {"name: a, nodes: [1], quantities: [contact_force]",
     {"output.probes[0]: quantities has contact_force, but nothing touches"}},
    {"name: a, nodes: [1]}, {name: a, nodes: [2]",
     {"output.probes[1]: name is a, as that of probes[0]; names must differ"}},
    {"nmae: a",
     {"output.probes[0].nmae is unknown", "did you mean name?"}},
};

static void bad_probes_are_refused_with_place_and_reason(void)
{
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    char text[1000];
    flesh_scene *scene = NULL;
    snprintf(text, sizeof text, SCENE, bad[k].probe);
    CHECK(read_scene("bad.yaml", text, 0, NULL, &scene) == FLESH_ERR_ARGUMENT && !scene);
    for (int p = 0; p < 3 && bad[k].parts[p]; p++) CHECK_TEXT(flesh_error_text(), bad[k].parts[p]);
  }
}

static void good_probes_are_found_and_written(void)
{
  char text[1000];
  int count = -1;
  flesh_scene *scene;
  snprintf(text, sizeof text, SCENE,
           "name: tip, point: [4, 1, 1]}, {name: end-1_b, regions: [3], about: [1, 2, 3], quantities: [J, stretch]");
  CHECK_OK(read_scene("good.yaml", text, 0, NULL, &scene));
  const flesh_probe *probes = flesh_scene_probes(scene, &count);
  CHECK(count == 2 && probes[0].quantities == FLESH_PROBE_POSITION && probes[0].tet >= 0);
  CHECK(probes[1].quantities == (FLESH_PROBE_J | FLESH_PROBE_STRETCH) && probes[1].node_count == 12);
  CHECK(probes[1].tet == -1 && probes[1].about[2] == 3);
  char *written = resolved(scene);
  CHECK_TEXT(written, "      regions: [3]\n");
  flesh_scene_destroy(&scene);
  CHECK_OK(read_scene("again.yaml", written, 0, NULL, &scene));
  char *again = resolved(scene);
  CHECK(!strcmp(written, again));
  free(written);
  free(again);
  flesh_scene_destroy(&scene);
  snprintf(text, sizeof text, "%s", "body: {mesh: bar.node}\neffects: [gravity]\ntime: {end: 1}\n");
  CHECK_OK(read_scene("none.yaml", text, 0, NULL, &scene));
  CHECK(!flesh_scene_probes(scene, &count) && count == 0);
  flesh_scene_destroy(&scene);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(bad_probes_are_refused_with_place_and_reason),
                         TEST(good_probes_are_found_and_written));
  test_folder_remove(folder);
  return failed;
}
