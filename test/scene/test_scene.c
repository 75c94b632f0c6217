// TEST quick seconds=60
/* test_scene.c: valid scenes: their numbers, overrides, resolved form, states and documentation. */
#include "scene_files.h"

#include <libfyaml.h>
#include <limits.h>
#include <stdint.h>
#include <sys/stat.h>

#include "effect/effect.h"
#include "scene/effect_list.h"
#include "scene/keys.h"
#include "scene/scene.h"
#include "scene/scene_keys.h"
#include "scene/schema.h"
#include "material/form.h"

static void check_example(const flesh_scene *scene)
{
  const flesh_body *body = flesh_scene_body(scene);
  const flesh_system *system = flesh_scene_system(scene);
  int tets = flesh_mesh_tet_count(flesh_scene_mesh(scene)), nodes = 20;
  CHECK(tets == 24 && flesh_mesh_node_count(flesh_scene_mesh(scene)) == nodes);
  CHECK(body->mass == FLESH_MASS_LUMPED && flesh_scene_material_count(scene) == 1);
  for (int t = 0; t < tets; t++) CHECK(body->density[t] == 1000);
  CHECK(body->materials[0].energy == FLESH_ENERGY_B);
  CHECK(body->materials[0].constants == FLESH_CONSTANTS_RAW);
  CHECK(body->materials[0].mu == 34000 && body->materials[0].lambda == 306000);
  CHECK(flesh_system_effect_count(system) == 3);
  CHECK(flesh_system_has_role(system, FLESH_ROLE_INERTIA) &&
        flesh_system_has_role(system, FLESH_ROLE_ELASTICITY));
  const flesh_scene_time *time = flesh_scene_times(scene);
  CHECK(time->method == FLESH_METHOD_BACKWARD_EULER && time->step == 1.0 / 60 && time->end == 2);
  flesh_solver_options solver, *given = (flesh_solver_options *)flesh_scene_solver(scene);
  flesh_solver_options_default(&solver);
  CHECK(given->newton_tolerance == 1e-10);
  CHECK(given->linear_tolerance == solver.linear_tolerance);
  CHECK(given->max_newton == solver.max_newton && given->max_linear == solver.max_linear);
  CHECK(given->max_cutbacks == solver.max_cutbacks);
  CHECK(given->linear_solver == solver.linear_solver);
  CHECK(given->preconditioner == solver.preconditioner && given->eigenvalue_filter == solver.eigenvalue_filter);
  CHECK(given->line_search == solver.line_search && given->eigenvalue_filter == solver.eigenvalue_filter);
  CHECK(given->techniques == solver.techniques && solver.techniques == FLESH_TECHNIQUES_ALL);
  CHECK(given->threads == solver.threads);
  CHECK(flesh_scene_outputs(scene)->frame_interval == 1 && flesh_scene_outputs(scene)->seed == 0);
  CHECK_TEXT(flesh_scene_mesh_path(scene), "/bar.node");
  CHECK(flesh_scene_mesh_path(scene)[0] == '/');

  /* The face x = 0 is held, and gravity pulls with the bar's weight. */
  uint8_t fixed[60];
  CHECK(flesh_system_fixed(system, 0, fixed) == 12);
  double x[60], v[60], zero[60] = {0}, r[60] = {0}, sum[3] = {0};
  flesh_state state = {.x = x, .v = v, .t = 5};
  flesh_scene_start(scene, &state);
  CHECK(state.t == 0);
  CHECK(!memcmp(x, flesh_mesh_positions(flesh_scene_mesh(scene)), sizeof x));
  CHECK(!memcmp(v, zero, sizeof v));
  const flesh_point point = flesh_point_at(0, x, v, zero);
  CHECK_OK(flesh_system_residual(system, &point, r));
  for (int i = 0; i < 60; i++) sum[i % 3] += r[i];
  CHECK_NEAR(sum[0], 0, 1e-9);
  CHECK_NEAR(sum[2], 4 * 1000 * 9.81, 1e-9);
}

static void the_example_reads_as_written(void)
{
  flesh_scene *scene = NULL;
  CHECK_OK(read_scene("example.yaml", example, 0, NULL, &scene));
  if (!scene) return;
  check_example(scene);
  flesh_scene_destroy(&scene);
  CHECK(!scene);
  flesh_scene_destroy(&scene);
}

static void json_gives_the_same_scene(void)
{
  static const char json[] =
      "{\n\t\"body\": {\"mesh\": \"bar.node\", \"density\": 1e3, \"mass\": \"lumped\",\n"
      "\t\t\"material\": {\"energy\": \"B\", \"constants\": \"raw\", \"mu\": 34000, \"lambda\": "
      "306000}},\n"
      "\t\"effects\": [{\"inertia\": {}}, {\"gravity\": {\"acceleration\": [0, 0, -9.81]}},\n"
      "\t\t{\"pin\": {\"box\": [[-1, -1, -1], [1e-9, 2, 2]]}}],\n"
      "\t\"time\": {\"method\": \"backward-euler\", \"step\": \"1/60\", \"end\": 2},\n"
      "\t\"solver\": {\"newton_tolerance\": 1e-10}\n}\n";
  flesh_scene *yaml_scene = NULL, *json_scene = NULL;
  CHECK_OK(read_scene("example.yaml", example, 0, NULL, &yaml_scene));
  CHECK_OK(read_scene("example.json", json, 0, NULL, &json_scene));
  if (yaml_scene && json_scene) {
    check_example(json_scene);
    char *a = resolved(yaml_scene), *b = resolved(json_scene);
    CHECK(!strcmp(a, b));
    free(a);
    free(b);
  }
  flesh_scene_destroy(&yaml_scene);
  flesh_scene_destroy(&json_scene);
}

/* Reads the example with overrides and compares a line of the resolved scene. */
static void check_override(const char *wanted, int count, const char *const *overrides)
{
  flesh_scene *scene = NULL;
  CHECK_OK(read_scene("example.yaml", example, count, overrides, &scene));
  if (!scene) return;
  char *text = resolved(scene);
  CHECK_TEXT(text, wanted);
  free(text);
  flesh_scene_destroy(&scene);
}
#define CHECK_OVERRIDE(wanted, ...)                                                                \
  check_override(wanted, sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *),                   \
                 (const char *[]){__VA_ARGS__})

static void overrides_change_what_they_name(void)
{
  CHECK_OVERRIDE("  density: 900\n", "body.density=900");
  CHECK_OVERRIDE("  density: 900\n", "body.density=800", "body.density=900");
  CHECK_OVERRIDE("  density: 1000\n", "body.density=800", "body.density=null");
  CHECK_OVERRIDE("  step: 0.25\n", "time.step=1/4");
  CHECK_OVERRIDE("acceleration: [0, 0, -2]", "effects.gravity.acceleration=[0, 0, -2]");
  CHECK_OVERRIDE("acceleration: [0, 0, -3]", "effects.gravity.acceleration[2]=-3");
  CHECK_OVERRIDE("acceleration: [0, 0, -4]", "effects[1].gravity.acceleration.2=-4");
  CHECK_OVERRIDE("acceleration: [0, 5, -9.81]", "effects.gravity={}", "effects.gravity.acceleration[1]=5"); /* of the default */
  CHECK_OVERRIDE("acceleration: [0, 0, 5]", "effects[1].gravity.acceleration=null", "effects[1].gravity.acceleration[2]=5");
  CHECK_OVERRIDE("axes: [x, z]", "effects.pin.axes=[z, x]");
  CHECK_OVERRIDE("  - pin:\n      nodes: [3, 4]\n", "effects.pin[1].nodes=[3, 4]");
  CHECK_OVERRIDE("  - pin:\n      nodes: [5]\n", "effects[3]={pin: {nodes: [5]}}");
  CHECK_OVERRIDE("  seed: 4\n", "output.seed=4");
  CHECK_OVERRIDE("velocity: [1, 2, 3]", "start={velocity: [1, 2, 3]}");
  CHECK_OVERRIDE("  method: static\n", "effects.inertia=null");
  CHECK_OVERRIDE("effects:\n  - gravity:", "effects[0]=null");
  CHECK_OVERRIDE("effects:\n  - elasticity:\n      instructions: auto\ntime:", "effects=null");
  CHECK_OVERRIDE("  - inertia: {}\n  - elasticity:\n      instructions: auto\n", "effects=null",
                 "effects.inertia={}");
  CHECK_OVERRIDE("      until: .inf\n  - elasticity:\n      instructions: auto\ntime:",
                 "effects.spring=null");
  CHECK_OVERRIDE("      until: .inf\ntime:", "body.material=null", "body.regions=null");
  CHECK_OVERRIDE(
      "  mass: lumped\n  element: auto\n  refine: 0\n  material:\n    energy: S\n    constants: matched\n    young: 7\n",
      "body.material=null", "body.material.energy=S", "body.material.young=7",
      "body.material.poisson=0");
  CHECK_OVERRIDE("velocity: [0, 0, 0]", "start.velocity=null", "start.state=null");
  CHECK_OVERRIDE("velocity: [0, 4, 0]", "start.velocity=null", "start.velocity=[0, 4, 0]");
  CHECK_OVERRIDE("    - tags: [7]\n      density: 10\n", "body.regions[0].tags=[7]",
                 "body.regions[0].density=10");
  CHECK_OVERRIDE("title: \"a: b\"", "title='a: b'");
}

static void the_last_whole_pair_of_constants_counts(void)
{
  CHECK_OVERRIDE("    young: 100000\n    poisson: 0.4\n", "body.material.young=1e5",
                 "body.material.poisson=0.4");
  CHECK_OVERRIDE("    mu: 5\n    lambda: 306000\n", "body.material.young=1e5",
                 "body.material.poisson=0.4", "body.material.mu=5");
  CHECK_OVERRIDE("    young: 100000\n    poisson: 0.4\n", "body.material.mu=null",
                 "body.material.lambda=null", "body.material.young=1e5",
                 "body.material.poisson=0.4");
  CHECK_OVERRIDE("    mu: 34000\n    lambda: 306000\n", "body.material.poisson=0.4",
                 "body.material.poisson=null");
}

static void raw_constants_take_a_negative_poisson_ratio(void)
{
  CHECK_OVERRIDE("    young: 100000\n    poisson: -0.3\n", "body.material.energy=Neo", "body.material.constants=raw",
                 "body.material.mu=null", "body.material.lambda=null", "body.material.young=1e5",
                 "body.material.poisson=-0.3");
}

static void constants_are_matched_where_the_form_can_be(void)
{
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    char override[64];
    snprintf(override, sizeof override, "body.material.energy=%s", flesh_forms[e].name);
    const char *wanted = flesh_form_takes((flesh_energy)e, FLESH_CONSTANTS_MATCHED) ? "constants: matched"
                                                                                    : "constants: raw";
    CHECK_OVERRIDE(wanted, override, "body.material.constants=null");
  }
}

static void a_form_has_a_full_name_too(void)
{
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    char override[96], wanted[64];
    snprintf(override, sizeof override, "body.material.energy=%s", flesh_forms[e].full_name);
    snprintf(wanted, sizeof wanted, "energy: %s\n", flesh_forms[e].name);
    CHECK_OVERRIDE(wanted, override, "body.material.constants=null");
  }
}

static void regions_have_their_own_density_and_material(void)
{
  static const char text[] =
      "body:\n  mesh: bar.node\n  density: 500\n  mass: consistent\n"
      "  material: {energy: S, young: 1e5, poisson: 0.3}\n"
      "  regions:\n"
      "    - {tags: [7], density: 2000, material: {energy: D, mu: 1e4, lambda: 1e5}}\n"
      "effects: [gravity]\n";
  flesh_scene *scene = NULL;
  CHECK_OK(read_scene("regions.yaml", text, 0, NULL, &scene));
  if (!scene) return;
  const flesh_body *body = flesh_scene_body(scene);
  const int *tags = flesh_mesh_regions(flesh_scene_mesh(scene));
  CHECK(flesh_scene_material_count(scene) == 2 && body->mass == FLESH_MASS_CONSISTENT);
  CHECK(body->materials[0].energy == FLESH_ENERGY_S && body->materials[1].energy == FLESH_ENERGY_D);
  CHECK(body->materials[0].young == 1e5 && body->materials[1].mu == 1e4);
  int changed = 0;
  for (int t = 0; t < 24; t++) {
    CHECK(body->density[t] == (tags[t] == 7 ? 2000 : 500));
    CHECK(body->tet_material[t] == (tags[t] == 7));
    changed += tags[t] == 7;
  }
  CHECK(changed == 12);
  flesh_scene_destroy(&scene);
  /* Materials for every region and none for the body. */
  CHECK_OK(read_scene("regions.yaml",
                      "body:\n  mesh: bar.node\n  regions:\n"
                      "    - {tags: [3], material: {energy: E, young: 1, poisson: 0.1}}\n"
                      "    - {tags: [7], material: {energy: S, young: 2, poisson: 0.1}}\n",
                      0, NULL, &scene));
  if (!scene) return;
  CHECK(flesh_scene_material_count(scene) == 2);
  tags = flesh_mesh_regions(flesh_scene_mesh(scene));
  for (int t = 0; t < 24; t++) CHECK(flesh_scene_body(scene)->tet_material[t] == (tags[t] == 7));
  flesh_scene_destroy(&scene);
}

static void without_inertia_the_scene_is_static(void)
{
  flesh_scene *scene = NULL;
  CHECK_OK(
      read_scene("static.yaml", "body: {mesh: bar.node}\neffects: [gravity: ]\n", 0, NULL, &scene));
  if (!scene) return;
  CHECK(flesh_scene_times(scene)->method == FLESH_METHOD_STATIC);
  CHECK(flesh_scene_times(scene)->end == 0);
  CHECK(!flesh_scene_body(scene)->materials && flesh_scene_material_count(scene) == 0);
  CHECK(flesh_system_effect_count(flesh_scene_system(scene)) == 1);
  flesh_scene_destroy(&scene);
}

/* body.element adds mid-edge nodes to a four-node mesh, after its own; statics use gravity's exact load. */
static void elements_are_chosen(void)
{
  static const char text[] = "body: {mesh: bar.node, material: {energy: S, young: 1e5, poisson: 0.49}}\n"
                             "effects: [inertia, gravity]\ntime: {method: backward-euler, end: 1}\n";
  const char *const mean[] = {"body.element=tet10-mean"}, *const still[] = {"body.element=tet10", "time.method=static"};
  flesh_scene *scene = NULL, *raised = NULL;
  CHECK_OK(read_scene("element.yaml", text, 0, NULL, &scene));
  CHECK_OK(read_scene("element.yaml", text, 1, mean, &raised));
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  CHECK(flesh_mesh_order(flesh_scene_mesh(scene)) == 1 && flesh_mesh_order(flesh_scene_mesh(raised)) == 2);
  CHECK(flesh_mesh_node_count(flesh_scene_mesh(raised)) > nodes);
  CHECK(!memcmp(flesh_mesh_positions(flesh_scene_mesh(scene)), flesh_mesh_positions(flesh_scene_mesh(raised)),
                3 * (size_t)nodes * sizeof(double)));
  CHECK(flesh_scene_body(raised)->element == FLESH_ELEMENT_TET10_MEAN);
  CHECK(flesh_scene_body(raised)->mass == FLESH_MASS_LUMPED);
  flesh_scene_destroy(&raised);
  CHECK_OK(read_scene("element.yaml", text, 2, still, &raised));
  CHECK(flesh_scene_body(raised)->element == FLESH_ELEMENT_TET10);
  CHECK(flesh_scene_body(raised)->mass == FLESH_MASS_CONSISTENT);
  flesh_scene_destroy(&raised);
  flesh_scene_destroy(&scene);
}

/* Elasticity's key applies to all effects, including those before it. */
static void instructions_are_the_scenes(void)
{
  flesh_scene *scene = NULL;
  CHECK_OK(read_scene("instructions.yaml",
                      "body: {mesh: bar.node, density: 1000, mass: consistent,\n"
                      "  material: {energy: S, young: 1e5, poisson: 0.4}}\n"
                      "effects: [inertia, viscosity: {shear: 1}, damping: {stiffness: 1}, gravity,\n"
                      "  elasticity: {instructions: portable}]\n"
                      "time: {method: backward-euler, step: 1/60, end: 1}\n",
                      0, NULL, &scene));
  if (!scene) return;
  const flesh_system *system = flesh_scene_system(scene);
  CHECK(flesh_system_effect_count(system) == 5);
  for (int k = 0; k < 5; k++)
    CHECK(flesh_effect_instructions(flesh_system_effect(system, k)) ==
          (k == 3 ? FLESH_INSTRUCTIONS_AUTO : FLESH_INSTRUCTIONS_PORTABLE));
  flesh_scene_destroy(&scene);
}

static void aliases_repeat_what_they_name(void)
{
  static const char text[] = "body: {mesh: bar.node}\n"
                             "effects:\n"
                             "  - gravity\n"
                             "  - pin: &held {box: &face [[0, 0, 0], [0, 1, 1]], axes: [x]}\n"
                             "  - pin: *held\n"
                             "  - pin: {box: *face, axes: [y]}\n";
  flesh_scene *scene = NULL;
  CHECK_OK(
      read_scene("aliases.yaml", text, 1, (const char *[]){"effects.pin[1].axes=[z]"}, &scene));
  if (!scene) return;
  uint8_t fixed[60];
  CHECK(flesh_system_fixed(flesh_scene_system(scene), 0, fixed) == 12);
  char *whole = resolved(scene);
  CHECK_TEXT(whole, "axes: [x]"); /* changing the alias's copy leaves the anchor unchanged */
  CHECK_TEXT(whole, "axes: [z]");
  free(whole);
  flesh_scene_destroy(&scene);
}

static void paths_start_at_the_scene_or_the_working_directory(void)
{
  char before[PATH_MAX];
  flesh_scene *scene = NULL;
  mkdir(file_path("below"), 0777);
  const char *path =
      write_text("below/scene.yaml", "body: {mesh: ../bar.node}\neffects: [gravity]\n");
  CHECK_OK(flesh_scene_read(path, 0, NULL, &scene));
  flesh_scene_destroy(&scene);
  CHECK(flesh_scene_read(path, 1, (const char *[]){"body.mesh=nowhere/bar.node"}, &scene) ==
        FLESH_ERR_FILE);
  if (!getcwd(before, sizeof before) || chdir(folder)) abort();
  CHECK_OK(flesh_scene_read("below/scene.yaml", 1, (const char *[]){"body.mesh=bar.node"}, &scene));
  flesh_scene_destroy(&scene);
  CHECK_OK(flesh_scene_read("regions.yaml", 0, NULL, &scene));
  flesh_scene_destroy(&scene);
  if (chdir(before)) abort();
}

static void resolving_again_changes_nothing(void)
{
  static const char text[] =
      "title: \"quotes \\\" and \\\\ and\\ttabs: # é\"\n"
      "body:\n  mesh: bar.node\n  density: 1/3\n  mass: consistent\n"
      "  material: {energy: S, young: 1e5, poisson: 1/3}\n"
      "  regions:\n"
      "    - {tags: [7], density: 0.1}\n"
      "    - tags: [3]\n      material: {energy: D, constants: as_e, mu: 1e-300, lambda: 2e-292}\n"
      "effects:\n"
      "  - inertia\n"
      "  - gravity: {acceleration: [1e-7, -0.30000000000000004, 12345678901234567890]}\n"
      "  - pin: {box: [[-.inf, -1, -1], [0, .inf, 2]], axes: [y], until: 1/7}\n"
      "  - pin: {nodes: [19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0], "
      "axes: [z]}\n"
      "  - pin: {sphere: {centre: [0, 0, 0], radius: 0}, from: 3}\n"
      "  - prescribed_motion: {box: [[4, 0, 0], [4, 1, 1]], interpolation: smooth, axes: [x, z], until: 2,\n"
      "             motion: [{time: 0}, {time: 0.1, translation: [0.7, 0, 0], rotation: [0, 0, "
      "1/9]}]}\n"
      "  - spring: {point: [3.9, 0.5, 0.5], stiffness: 1e4, target: [{time: 0, position: [9, 0, "
      "0]}]}\n"
      "time: {step: 1/60, end: 1/3}\n"
      "start: {velocity: [1/7, 0, -1e-17]}\n"
      "solver: {linear_solver: klu, eigenvalue_filter: none, line_search: residual, preconditioner: "
      "none, techniques: []}\n"
      "output: {frame_interval: 0, seed: 77}\n";
  flesh_scene *scene = NULL, *again = NULL;
  CHECK_OK(read_scene("rich.yaml", text, 0, NULL, &scene));
  if (!scene) return;
  char *first = resolved(scene);
  CHECK(flesh_scene_solver(scene)->techniques == 0);
  CHECK_OK(flesh_scene_read(file_path("resolved.yaml"), 0, NULL, &again));
  if (again) {
    CHECK(flesh_scene_solver(again)->techniques == 0);
    char *second = resolved(again);
    CHECK(!strcmp(first, second));
    CHECK(flesh_scene_times(again)->end == 1.0 / 3);
    CHECK(flesh_scene_body(again)->materials[0].poisson == 1.0 / 3);
    double x[60], v[60];
    flesh_scene_start(again, &(flesh_state){.x = x, .v = v});
    CHECK(v[57] == 1.0 / 7 && v[59] == -1e-17);
    free(second);
  }
  CHECK_TEXT(first, "title: \"quotes \\\" and \\\\ and\\ttabs: # é\"");
  CHECK_TEXT(first, "until: 0.14285714285714285\n"); /* the shortest decimal that reads back exactly */
  free(first);
  flesh_scene_destroy(&scene);
  flesh_scene_destroy(&again);
}

static void states_come_back_bit_for_bit(void)
{
  unsigned long long seed = 7;
  double x[60], v[60], x2[60], v2[60];
  for (int i = 0; i < 60; i++) {
    x[i] = ldexp(test_uniform(&seed) - 0.5, (int)(600 * test_uniform(&seed)) - 300);
    v[i] = ldexp(test_uniform(&seed) - 0.5, (int)(2000 * test_uniform(&seed)) - 1000);
  }
  v[0] = -0.0;
  v[1] = 5e-324;
  x[2] = 1.7976931348623157e308;
  flesh_state state = {.t = 1.0 / 3, .x = x, .v = v}, back = {.t = 0, .x = x2, .v = v2};
  CHECK_OK(flesh_state_write(file_path("state.txt"), 20, &state));
  CHECK_OK(flesh_state_read(file_path("state.txt"), 20, &back));
  CHECK(back.t == state.t && !memcmp(x, x2, sizeof x) && !memcmp(v, v2, sizeof v));

  /* The file can be a scene's start; its velocity is then ignored, whoever reads the scene. */
  flesh_scene *scene = NULL, *again = NULL;
  char text[2048];
  snprintf(text, sizeof text, "%sstart: {state: state.txt, velocity: [1, 1, 1]}\n", example);
  CHECK_OK(read_scene("start.yaml", text, 0, NULL, &scene));
  if (!scene) return;
  memset(v2, 0, sizeof v2);
  flesh_scene_start(scene, &back);
  CHECK(back.t == state.t && !memcmp(x, x2, sizeof x) && !memcmp(v, v2, sizeof v));
  free(resolved(scene));
  CHECK_OK(flesh_scene_read(file_path("resolved.yaml"), 0, NULL, &again));
  if (again) flesh_scene_start(again, &back);
  CHECK(again && !memcmp(x, x2, sizeof x) && !memcmp(v, v2, sizeof v));
  flesh_scene_destroy(&scene);
  flesh_scene_destroy(&again);

  /* Hand-written rows, without a time and with comments. */
  CHECK_OK(flesh_state_read(
      write_text("two.txt", "\n# made by hand\n1 2 3  4 5 6 # first\n\n-1 .5 1e3 0 0 0"), 2,
      &back));
  CHECK(back.t == 0 && x2[0] == 1 && v2[2] == 6 && x2[4] == .5 && x2[5] == 1000);
}

static void every_sample_of_an_effect_makes_a_scene(void)
{
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  CHECK(count >= 6);
  for (int i = 0; i < count; i++) {
    char text[1024];
    snprintf(text, sizeof text,
             "body: {mesh: bar.node, material: {energy: S, young: 1, poisson: 0.4}}\n"
             "effects:\n  - %s: %s\ntime: {end: 1}\n",
             rows[i]->name, rows[i]->sample);
    flesh_scene *scene = NULL;
    CHECK_OK(read_scene("sample.yaml", text, 0, NULL, &scene));
    flesh_scene_destroy(&scene);
  }
}

static flesh_arena paths;

/* Calls `visit` for every row below `keys`. */
static int walk(const flesh_key *keys, const char *path,
                int (*visit)(const flesh_key *, const char *))
{
  int rows = 0;
  for (const flesh_key *key = keys; key->name; key++) {
    const char *below = flesh_key_path(&paths, path, key->name);
    rows += visit(key, below);
    if (key->children) rows += walk(key->children, below, visit);
  }
  return rows;
}

static int walk_everything(int (*visit)(const flesh_key *, const char *))
{
  int count, rows = walk(flesh_scene_table, "", visit);
  const flesh_effect_row *const *effects = flesh_effect_registry(&count);
  for (int i = 0; i < count; i++) {
    rows += walk(effects[i]->keys, flesh_key_path(&paths, "effects", effects[i]->name), visit);
  }
  flesh_arena_free(&paths);
  return rows;
}

static char *markdown;

static int check_markdown(const flesh_key *key, const char *path)
{
  char row[128];
  snprintf(row, sizeof row, "\n| `%s` | ", key->name);
  CHECK_TEXT(markdown, row);
  CHECK(key->doc && *key->doc);
  if (key->doc) CHECK_TEXT(markdown, key->doc);
  /* And on its own. */
  char *text = NULL;
  CHECK_OK(flesh_scene_schema_section(FLESH_SCHEMA_MARKDOWN, path, &text));
  if (text) CHECK_TEXT(text, key->name);
  free(text);
  return 1;
}

static void the_schema_lists_every_key(void)
{
  CHECK_OK(flesh_scene_schema(FLESH_SCHEMA_MARKDOWN, &markdown));
  if (!markdown) return;
  CHECK(walk_everything(check_markdown) > 50);
  free(markdown);
}

static struct fy_document *json;

static int check_json(const flesh_key *key, const char *path)
{
  /* JSON pointer of the key: properties, and items of lists. */
  char pointer[512] = "";
  const flesh_key *keys = flesh_scene_table;
  char copy[256];
  snprintf(copy, sizeof copy, "%s", path);
  for (char *word = strtok(copy, "."); word; word = strtok(NULL, ".")) {
    size_t used = strlen(pointer);
    snprintf(pointer + used, sizeof pointer - used, "/properties/%s", word);
    const flesh_key *row = flesh_key_named(keys, word);
    const flesh_effect_row *effect = flesh_effect_row_named(word);
    used = strlen(pointer);
    if (row && row->type == FLESH_KEY_EFFECTS)
      snprintf(pointer + used, sizeof pointer - used, "/items/anyOf/1");
    if (row && row->type == FLESH_KEY_OBJECTS && row != key)
      snprintf(pointer + used, sizeof pointer - used, "/items");
    keys = row && row->children ? row->children : !row && effect ? effect->keys : keys;
  }
  if (key->type == FLESH_KEY_EFFECTS) *strstr(pointer, "/items") = 0;
  size_t used = strlen(pointer);
  snprintf(pointer + used, sizeof pointer - used, "/description");
  struct fy_node *node = fy_node_by_path(fy_document_root(json), pointer, FY_NT, FYNWF_DONT_FOLLOW);
  CHECK(node != NULL);
  if (!node) printf("# no %s\n", pointer);
  size_t size;
  const char *text = node ? fy_node_get_scalar(node, &size) : NULL;
  CHECK(text && size >= strlen(key->doc) && !strncmp(text, key->doc, strlen(key->doc)));
  return 1;
}

static void the_json_schema_is_json_and_lists_every_key(void)
{
  char *text = NULL;
  CHECK_OK(flesh_scene_schema(FLESH_SCHEMA_JSON, &text));
  if (!text) return;
  struct fy_parse_cfg strict = {.flags = FYPCF_JSON_FORCE | FYPCF_QUIET};
  json = fy_document_build_from_string(&strict, text, FY_NT);
  CHECK(json != NULL);
  if (json) CHECK(walk_everything(check_json) > 50);
  fy_document_destroy(json);
  free(text);
}

static int check_default(const flesh_key *key, const char *path)
{
  if (!key->default_value || !*key->default_value) return 1;
  /* A table of only this row reads its default. */
  flesh_key table[2] = {*key, {0}};
  flesh_arena arena = {0};
  flesh_key_reader reader = {.arena = &arena};
  if (key->type == FLESH_KEY_OBJECT)
    table[0].default_value = ""; /* its children are visited separately */
  char target[4096];
  int status = flesh_keys_read(&reader, table, NULL, NULL, "", target);
  CHECK_OK(status);
  if (status) printf("# default of %s\n", path);
  flesh_arena_free(&arena);
  return 1;
}

/* Pictures are upright: as the scene says, else opposite to gravity, else along z. */
static void up_is_against_gravity(void)
{
  static const struct {
    const char *scene;
    flesh_up_origin origin;
    double up[3];
  } rows[] = {{"", FLESH_UP_Z, {0, 0, 1}},
              {"effects: [gravity]\n", FLESH_UP_GRAVITY, {0, 0, 1}},
              {"effects: [gravity: {acceleration: [0, -9.81, 0]}]\n", FLESH_UP_GRAVITY, {0, 1, 0}},
              {"effects: [gravity: {acceleration: [1e-300, 0, 0]}]\n", FLESH_UP_GRAVITY, {-1, 0, 0}},
              {"effects: [gravity: {acceleration: [0, -3, 0]}, gravity: {acceleration: [4, 0, 0]}]\n",
               FLESH_UP_GRAVITY, {-0.8, 0.6, 0}},
              {"effects: [gravity: {acceleration: [0, -3, 0]}, gravity: {acceleration: [0, 3, 0]}]\n",
               FLESH_UP_Z, {0, 0, 1}},
              {"effects: [gravity]\noutput: {camera: {up: [0, 3e200, 4e200]}}\n", FLESH_UP_GIVEN, {0, 0.6, 0.8}}};
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    char text[512];
    snprintf(text, sizeof text, "body: {mesh: bar.node, material: {energy: S, young: 1, poisson: 0}}\n%s",
             rows[k].scene);
    flesh_scene *scene = NULL;
    double up[3] = {0};
    CHECK_OK(flesh_scene_read(write_text("up.yaml", text), 0, NULL, &scene));
    if (!scene) continue;
    CHECK(flesh_scene_up(scene, up) == rows[k].origin);
    for (int d = 0; d < 3; d++) CHECK_NEAR(up[d], rows[k].up[d], 1e-15);
    flesh_scene_destroy(&scene);
  }
}

static void every_default_is_valid(void) { CHECK(walk_everything(check_default) > 50); }

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(
      argc, argv, TEST(the_example_reads_as_written), TEST(json_gives_the_same_scene),
      TEST(overrides_change_what_they_name), TEST(the_last_whole_pair_of_constants_counts),
      TEST(raw_constants_take_a_negative_poisson_ratio),
                   TEST(constants_are_matched_where_the_form_can_be),
                   TEST(a_form_has_a_full_name_too),
      TEST(regions_have_their_own_density_and_material), TEST(without_inertia_the_scene_is_static),
      TEST(elements_are_chosen), TEST(instructions_are_the_scenes), TEST(aliases_repeat_what_they_name),
      TEST(paths_start_at_the_scene_or_the_working_directory),
      TEST(resolving_again_changes_nothing), TEST(states_come_back_bit_for_bit),
      TEST(every_sample_of_an_effect_makes_a_scene), TEST(the_schema_lists_every_key),
      TEST(the_json_schema_is_json_and_lists_every_key), TEST(every_default_is_valid),
      TEST(up_is_against_gravity));
  test_folder_remove(folder);
  return failed;
}
