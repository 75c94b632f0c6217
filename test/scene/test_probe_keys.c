// TEST quick
/* test_probe_keys.c: invalid probes give one message that says where and what; valid ones are written and read back. */
#include "scene_files.h"

#define SCENE "body: {mesh: bar.node}\neffects: [gravity]\ntime: {end: 1}\noutput: {probes: [{%s}]}\n"

/* Invalid probes, and parts of the message that they must give. */
static const struct {
  const char *probe, *parts[3];
} bad[] = {
    {"name: tip, point: [9, 0, 0]",
     {"bad.yaml:4:38: output.probes[0]: point is [9, 0, 0], which no tet holds at rest; the nearest is 5 m away"}},
    {"name: 3, point: [1, 0, 0]",
     {"output.probes[0]: name is '3'; it must be a letter, then letters, digits, _ and -"}},
    {"point: [1, 0, 0]",
     {"output.probes[0].name is missing"}},
    {"name: a",
     {"output.probes[0]: nothing is chosen; give point, effect, box, sphere, nodes, regions, set or body"}},
    {"name: a, effect: pin",
     {"output.probes[0]: effect is 'pin', but the scene has no pin, prescribed_motion, contact, weld or joint"}},
    {"name: a, effect: gravity, point: [1, 0, 0]",
     {"output.probes[0]: effect is given beside point, box, sphere, nodes, regions, set or body; give one of them"}},
    {"name: a, point: [1, 0, 0], nodes: [3]",
     {"output.probes[0]: point is given beside box, sphere, nodes, regions, set or body"}},
    {"name: a, nodes: [99]",
     {"output.probes[0]: nodes[0] is 99; the mesh has the nodes 0 to 19"}},
    {"name: a, point: [1, 0, 0], quantities: [reaction]",
     {"output.probes[0]: quantities has reaction, which a point does not have"}},
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

#define HELD                                                                                                            \
  "body: {mesh: bar.node, material: {energy: S, young: 1e5, poisson: 0.3}}\neffects:\n  - pin: {nodes: [0]}\n"          \
  "  - contact: {plane: {point: [0, 0, -1]}}\n  - pin: {nodes: [1, 2], axes: [z]}\ntime: {end: 1}\n"

static void what_bears_is_found_by_its_name(void)
{
  static const char *const wrong[][2] = {
      {"{probes: [{name: a, effect: 'pin[2]'}]}",
       "effect is 'pin[2]'; of this scene it must be one of pin, contact, pin[1]"},
      {"{probes: [{name: a, effect: 'pin[1'}]}", "effect is 'pin[1'; of this scene"},
      {"{probes: [{name: a, effect: elasticity}]}", "effect is 'elasticity'; of this scene"},
      {"{probes: [{name: a, effect: contact, quantities: [reaction]}]}",
       "bad.yaml:7:58: output.probes[0]: quantities has reaction, but contact has contact_force"},
      {"{probes: [{name: pin, nodes: [1]}], reactions: true}",
       "output.reactions: the probe pin: its name is pin, as that of probes[0]; names must differ"}};
  char text[1000];
  int count = -1;
  flesh_scene *scene = NULL, *again = NULL;
  for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
    snprintf(text, sizeof text, "%soutput: %s\n", HELD, wrong[k][0]);
    CHECK(read_scene("bad.yaml", text, 0, NULL, &scene) == FLESH_ERR_ARGUMENT && !scene);
    CHECK_TEXT(flesh_error_text(), wrong[k][1]);
  }
  snprintf(text, sizeof text, "%soutput: {reactions: true, probes: [{name: a, effect: 'pin[1]'}]}\n", HELD);
  CHECK_OK(read_scene("held.yaml", text, 0, NULL, &scene));
  CHECK_OK(flesh_scene_write(scene, file_path("resolved.yaml")));
  CHECK_OK(flesh_scene_read(file_path("resolved.yaml"), 0, NULL, &again));
  for (int pass = 0; pass < 2; pass++) {
    const flesh_probe *p = flesh_scene_probes(pass ? again : scene, &count);
    CHECK(count == 4 && p[0].holder == 2 && p[0].node_count == 2 && p[0].nodes[1] == 2 && !p[0].contact);
    CHECK(!strcmp(p[1].name, "pin") && p[1].holder == 1 && p[1].quantities == FLESH_PROBE_REACTION);
    CHECK(p[1].about[0] == 0 && p[1].about[1] == 0 && p[1].about[2] == 0);
    CHECK(!strcmp(p[2].name, "contact") && p[2].contact == 1 && !p[2].holder && p[2].node_count == 20);
    CHECK(!strcmp(p[3].name, "pin_2") && p[3].holder == 2 && p[3].nodes[0] == 1);
  }
  flesh_scene_destroy(&scene);
  flesh_scene_destroy(&again);
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
                         TEST(what_bears_is_found_by_its_name), TEST(good_probes_are_found_and_written));
  test_folder_remove(folder);
  return failed;
}
