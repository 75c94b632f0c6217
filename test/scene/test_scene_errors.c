// TEST quick seconds=60
/* test_scene_errors.c: invalid scenes, overrides and states give one message that says where and what; no text makes
 * the reader fail in any other way. */
#include "scene_files.h"

#include <sys/stat.h>

/* Invalid scenes, and parts of the message that they must give. */
typedef struct bad_scene {
  const char *text;
  const char *parts[3];
} bad_scene;

#define BODY           "body: {mesh: bar.node}\n"
#define GRAVITY        "effects: [gravity]\n"
#define MATERIAL(keys) "body:\n  mesh: bar.node\n  material: " keys "\n"

static const bad_scene scenes[] = {
    /* Not a scene at all. */
    {"", {"bad.yaml:1:1: ", "empty", "title, body, bodies, effects"}},
    {"# nothing\n", {"bad.yaml:1:1: ", "empty"}},
    {"just words\n", {"bad.yaml:1:1: ", "the scene is just words", "a mapping of the keys"}},
    {"- a\n- b\n", {"bad.yaml:1:", "the scene is [a, b]", "a mapping of the keys"}},
    {"body: {mesh: bar.node\n", {"bad.yaml:2:1: ", "not valid YAML or JSON", "flow mapping"}},
    {"body:\n  mesh: a\n   density: 3\n", {"bad.yaml:2:9: ", "not valid YAML or JSON"}},
    {"body: \"open\n", {"bad.yaml:", "not valid YAML or JSON"}},
    {"%YAML 9.9\n---\n" BODY, {"bad.yaml:1:1: %YAML 9.9: versions 1.1 to 1.3 of YAML are read"}},
    {"# a version\n%YAML  1.4 # of the future\n---\n" BODY, {"bad.yaml:2:1: %YAML 1.4: versions 1.1 to 1.3"}},
    {"%YAML 1\n---\n" BODY, {"bad.yaml:1:8: ", "not valid YAML or JSON"}},
    {"{\"body\": {\"mesh\": \"bar.node\"},}]", {"bad.yaml:1:", "not valid YAML or JSON"}},
    {BODY GRAVITY "---\nbody: 1\n", {"bad.yaml:", "more than one YAML document"}},
    {"? [a, b]\n: 3\n", {"bad.yaml:1:3: ", "a key is a list or mapping"}},
    {"body: *nothing\n", {"bad.yaml:1:7: ", "*nothing names no anchor"}},
    {"body: &a [*a]\n", {"bad.yaml:1:11: ", "*a names no anchor"}},
    {"title: \"a\\0b\"\n", {"bad.yaml:1:8: an escape in these quotes"}},
    {"\"a\\e[1m\\u009b\": 3\n", {"bad.yaml:1:1: a?[1m?? is unknown"}},
    {"a: &a b\n*a : 3\n", {"bad.yaml:", "is an alias"}},
    {"body: \x01\n", {"bad.yaml:1:7: ", "byte 0x01 is not text"}},
    {"body: 3\n# \xff\n", {"bad.yaml:2:3: ", "byte 0xff is not text", "UTF-8"}},
    {"\xed\xa0\x80", {"bad.yaml:1:1: ", "byte 0xed is not text"}},
    /* Keys. */
    {"body:\n  mesh: bar.node\n  densty: 3\n",
     {"bad.yaml:3:3: body.densty is unknown", "did you mean density?", "mesh, density, mass"}},
    {"boddy: {}\n", {"bad.yaml:1:1: boddy is unknown", "did you mean body?", "effects, time"}},
    {BODY "zzzzzzz: 3\n", {"bad.yaml:2:1: zzzzzzz is unknown; known here: title, body"}},
    {BODY "time:\n  stpe: 1\n", {"bad.yaml:3:3: time.stpe is unknown", "did you mean step?"}},
    {"body:\n  mesh: a\n  mesh: b\n", {"bad.yaml:3:3: body.mesh stands twice, first in line 2"}},
    {BODY "effects:\n  - pin:\n      axes: [x]\n      axes: [y]\n",
     {"bad.yaml:5:7: effects[0].pin.axes stands twice"}},
    {"{\"body\": 1, \"body\": 2}", {"bad.yaml:1:13: body stands twice"}},
    {"body:\n  mesh: a\n  \"\": 3\n", {"bad.yaml:3:3: a key of this mapping is empty; keys are words"}},
    {BODY ": 3\n", {"bad.yaml:2:1: a key of this mapping is empty"}},
    {GRAVITY, {"bad.yaml:1:1: body is missing"}},
    {GRAVITY "body:\n", {"bad.yaml:2:", "body.mesh is missing; it must be the path of a file"}},
    {GRAVITY "body:\n  density: 3\n", {"bad.yaml:3:3: body.mesh is missing; it must be the path of a file"}},
    /* Values. */
    {GRAVITY "body: 3\n", {"bad.yaml:2:7: body is 3; it must be a mapping of the keys mesh, density"}},
    {GRAVITY "body: [3]\n", {"bad.yaml:2:7: body is [3]; it must be a mapping"}},
    {GRAVITY "body: {mesh: bar.node, density: heavy}\n",
     {"bad.yaml:2:33: body.density is heavy; it must be a number > 0 [kg/m^3]"}},
    {GRAVITY "body: {mesh: bar.node, density: -1}\n", {"body.density is -1; it must be a number > 0 [kg/m^3]"}},
    {GRAVITY "body: {mesh: bar.node, density: 0}\n", {"body.density is 0; it must be"}},
    {GRAVITY "body: {mesh: bar.node, density: 1e999}\n", {"body.density is 1e999; it must be a number > 0"}},
    {GRAVITY "body: {mesh: bar.node, density: .inf}\n", {"body.density is .inf; it must be a number > 0"}},
    {GRAVITY "body: {mesh: bar.node, density: .nan}\n", {"body.density is .nan"}},
    {GRAVITY "body: {mesh: bar.node, density: nan}\n", {"body.density is nan"}},
    {GRAVITY "body: {mesh: bar.node, density: 0x10}\n", {"body.density is 0x10"}},
    {GRAVITY "body: {mesh: bar.node, density: 1_000}\n", {"body.density is 1_000"}},
    {GRAVITY "body: {mesh: bar.node, density: '1,5'}\n", {"body.density is \"1,5\"; it must be a number > 0"}},
    {GRAVITY "body: {mesh: bar.node, density: 1/0}\n", {"body.density is 1/0"}},
    {GRAVITY "body: {mesh: bar.node, density: 1/2/3}\n", {"body.density is 1/2/3"}},
    {GRAVITY "body: {mesh: bar.node, density: 3 kg}\n", {"body.density is 3 kg"}},
    {GRAVITY "body: {mesh: bar.node, density: }\n", {"body.density is empty; it must be a number > 0"}},
    {GRAVITY "body: {mesh: bar.node, density: [3]}\n", {"body.density is [3]; it must be a number"}},
    {GRAVITY "body: {mesh: bar.node, density: {a: 3}}\n", {"body.density is a mapping; it must be a number"}},
    {GRAVITY "body: {mesh: bar.node, mass: heavy}\n",
     {"bad.yaml:2:30: body.mass is heavy; it must be one of lumped, consistent"}},
    {GRAVITY "body: {mesh: [a]}\n", {"body.mesh is [a]; it must be the path of a file"}},
    {GRAVITY "body: {mesh: }\n", {"body.mesh is empty; it must be the path of a file"}},
    {BODY GRAVITY "time: {step: 0}\n", {"bad.yaml:3:14: time.step is 0; it must be a number > 0 [s]"}},
    {BODY GRAVITY "time: {method: rk4}\n",
     {"time.method is rk4; it must be one of backward-euler, static, bdf2, midpoint"}},
    {BODY GRAVITY "time: {end: 1, method: hht, alpha: 0.2}\n",
     {"bad.yaml:3:", "time.alpha is 0.2; it must be in [-1/3, 0]"}},
    {BODY "effects:\n  - inertia\n  - gravity\ntime: {end: 1, method: midpoint, adaptive: true}\n",
     {"bad.yaml:5:", "time.adaptive is true; with method midpoint, whose error is not estimated, it must be false"}},
    {BODY "effects:\n  - inertia\n  - gravity\ntime: {end: 1, method: adaptive, adaptive: false}\n",
     {"bad.yaml:5:", "time.adaptive is false; with method adaptive, whose error chooses steps, it must be true"}},
    {BODY GRAVITY "time: {end: 1, max_order: 6}\n", {"bad.yaml:3:27: time.max_order is 6; it must be 1 to 5"}},
    {BODY GRAVITY "time: {end: 1, tolerance: 1e-300}\n", {"bad.yaml:3:27: time.tolerance is 1e-300; it must be at least 2.2"}},
    {BODY GRAVITY "time: {end: 1, method: runge-kutta, table: rk4}\n",
     {"time.table is rk4; it must be one of auto, esdirk325, esdirk324, trbdf2"}},
    {BODY GRAVITY "time: {end: 1}\noutput: {camera: {up: [0, 0, 0]}}\n",
     {"bad.yaml:4:23: output.camera.up is zero; it must be a direction, such as [0, 1, 0]"}},
    {BODY GRAVITY "time:\n  end: 1\n  gamma: 0.4\n", {"bad.yaml:5:10: time.gamma is 0.4; it must be in [1/2, 1]"}},
    {BODY GRAVITY "time: {end: 1, gamma: 0.7}\n", {"time.beta is 0.25; it must be in [gamma/2, 1] = [0.35, 1]"}},
    {BODY GRAVITY "time: {end: 1, method: newmark, gamma: 5}\n", {"bad.yaml:3:40: time.gamma is 5; it must be in [1/2, 1]"}},
    {BODY GRAVITY "time: {end: 1, beta: 0}\n", {"time.beta is 0; it must be in [gamma/2, 1] = [0.25, 1]"}},
    {BODY GRAVITY "time: {end: -1}\n", {"time.end is -1; it must be a number >= 0 [s]"}},
    {BODY GRAVITY "solver: {newton_tolerance: 1}\n",
     {"bad.yaml:3:28: solver.newton_tolerance is 1; it must be a number > 0 and < 1"}},
    {BODY GRAVITY "solver: {max_newton: 2.5}\n", {"solver.max_newton is 2.5; it must be a whole number > 0"}},
    {BODY GRAVITY "solver: {max_newton: 3000000000}\n",
     {"solver.max_newton is 3000000000; it must be a whole number > 0, at most 2147483647"}},
    {BODY GRAVITY "solver: {max_newton: 3, threads: 257}\n", {"bad.yaml:3:34: solver.threads is 257; it must be in 0 to 256"}},
    {BODY GRAVITY "solver: {max_cutbacks: 31}\n", {"bad.yaml:3:24: solver.max_cutbacks is 31; it must be in 0 to 30"}},
    {BODY GRAVITY "output: {frame_interval: -1}\n", {"output.frame_interval is -1; it must be a whole number >= 0"}},
    {BODY GRAVITY "start: {velocity: [1, 2]}\n",
     {"bad.yaml:3:19: start.velocity is [1, 2]; it must be three numbers [x, y, z] [m/s]"}},
    {BODY GRAVITY "start: {velocity: [1, 2, x]}\n", {"start.velocity is [1, 2, x]; it must be three numbers"}},
    {BODY GRAVITY "start: {velocity: 3}\n", {"start.velocity is 3; it must be three numbers"}},
    {BODY GRAVITY "title: [a]\n", {"title is [a]; it must be text"}},
    /* Material. */
    {MATERIAL("{}"),
     {"bad.yaml:3:13: body.material.energy is missing; it must be one of Neo, A, B, C, M, D, E, "
      "S"}},
    {MATERIAL("{energy: F}"), {"bad.yaml:3:22: body.material.energy is F; it must be one of Neo"}},
    {MATERIAL("{energy: B}"),
     {"bad.yaml:3:13: body.material gives no constants; it must give mu and lambda, or young and "
      "poisson"}},
    {MATERIAL("{energy: B, mu: 3}"),
     {"body.material gives mu; it must give mu and lambda, or young and poisson"}},
    {MATERIAL("{energy: B, mu: 3, poisson: 0.3}"),
     {"body.material gives mu, poisson; it must give"}},
    {MATERIAL("{energy: B, mu: 3, lambda: 4, young: 5}"),
     {"body.material gives mu, lambda, young; it must give"}},
    {MATERIAL("{energy: B, mu: 3, lambda: 4, young: 5, poisson: 0.1}"),
     {"gives mu, lambda, young, poisson", "exactly one"}},
    {MATERIAL("{energy: B, young: 3, poisson: 0.6}"),
     {"bad.yaml:3:44: body.material.poisson is 0.6; it must be a number in (-1, 0.5]"}},
    {MATERIAL("{energy: B, young: 3, poisson: 0.5}"),
     {"bad.yaml:3:44: body.material.poisson is 0.5", "the element tet4 cannot hold; set body.element to tet10-mean"}},
    {MATERIAL("{energy: C, young: 3, poisson: 0.5}"), {"poisson is 0.5 with energy C, which has no volume term"}},
    {MATERIAL("{energy: B, young: -3, poisson: 0.4}"),
     {"body.material.young is -3; it must be a number > 0 [Pa]"}},
    {MATERIAL("{energy: E, constants: raw, mu: 3, lambda: 1}"),
     {"bad.yaml:3:13: body.material: ", "lambda"}},
    {MATERIAL("{energy: D, constants: matched, mu: 3, lambda: 1}"),
     {"bad.yaml:3:36: body.material: ", "matched"}},
    {BODY "effects:\n  - elasticity\n",
     {"bad.yaml:3:5: effects[0].elasticity needs body.material"}},
    /* Regions. */
    {GRAVITY "body:\n  mesh: bar.node\n  regions: 3\n",
     {"bad.yaml:4:12: body.regions is 3; it must be a list of mappings"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [3]\n",
     {"bad.yaml:4:13: body.regions[0] is 3; it must be a mapping of the keys tags"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{density: 3}]\n", {"body.regions[0] chooses no tets; it must give tags, set or box"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: []}]\n",
     {"body.regions[0].tags is an empty list; it must be a list of whole numbers"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7, x]}]\n",
     {"bad.yaml:4:24: body.regions[0].tags[1] is x; it must be a whole number"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7, -3e9]}]\n",
     {"tags[1] is -3e9; it must be a whole number, at least -2147483647"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7, 8]}]\n",
     {"bad.yaml:4:24: body.regions[0].tags[1] is 8", "a region tag of the mesh: 3, 7"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7]}, {tags: [3, 7]}]\n",
     {"bad.yaml:4:26: body.regions[1] chooses tet", "which body.regions[0] has; regions must not overlap"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7], material: {energy: S, young: 3, "
             "poisson: .3}}]\n",
     {"bad.yaml:3:3: ", "region tag 3 have no material"}},
    {GRAVITY "body:\n  mesh: bar.node\n  regions: [{tags: [7], material: {energy: S, young: 3}}]\n",
     {"bad.yaml:4:35: body.regions[0].material gives young; it must give"}},
    /* Effects. */
    {BODY, {"bad.yaml:1:1: ", "neither effects nor a material"}},
    {BODY "effects: {gravity: {}}\n",
     {"bad.yaml:2:10: effects is a mapping; it must be a list of effects"}},
    {BODY "effects:\n  - gravty\n",
     {"bad.yaml:3:5: effects[0] is gravty, which is no effect; did you mean gravity?",
      "inertia, elasticity"}},
    {BODY "effects:\n  - gravty: {}\n", {"bad.yaml:3:5: effects[0] is gravty"}},
    {BODY "effects:\n  - 'gravty'\n", {"bad.yaml:3:5: effects[0] is gravty"}},
    {BODY "effects:\n  - gravity: {}\n    pin: {}\n",
     {"bad.yaml:3:5: effects[0] is a mapping of several keys; it must be one effect"}},
    {BODY "effects:\n  - spring: {point: [300, 0, 0], stiffness: 1, target: [{time: 0, position: [0, 0, 0]}]}\n",
     {"bad.yaml:3:21: effects[0].spring: point is [300, 0, 0], ", " m away from the body; it must be no farther than the longest "}},
    {BODY "effects:\n  - [gravity]\n",
     {"bad.yaml:3:5: effects[0] is [gravity]; it must be one effect"}},
    {BODY "effects:\n  -\n", {"effects[0] is empty; it must be one effect"}},
    {BODY "effects:\n  - {}\n", {"effects[0] is a mapping; it must be one effect"}},
    {BODY "effects:\n  - gravity: 9.81\n",
     {"bad.yaml:3:14: effects[0].gravity is 9.81; it must be a mapping of the keys acceleration"}},
    {BODY "effects:\n  - gravity: {aceleration: 3}\n",
     {"bad.yaml:3:15: effects[0].gravity.aceleration is unknown; did you mean acceleration?"}},
    {BODY "effects:\n  - inertia: {mass: 3}\n",
     {"bad.yaml:3:15: effects[0].inertia.mass is unknown", "no keys here"}},
    {BODY "effects:\n  - inertia: 3\n",
     {"bad.yaml:3:14: effects[0].inertia is 3; it must be {}: it has no keys"}},
    {BODY GRAVITY "start: {velocity: [[], \"a\", {b: 1}]}\n",
     {"start.velocity is a list of 3; it must be three numbers"}},
    {BODY GRAVITY "start: {velocity: [[], \"a\", 1]}\n",
     {"start.velocity is [[], \"a\", 1]; it must be three numbers"}},
    {BODY "effects:\n  - inertia\n  - gravity\n  - inertia: {}\n",
     {"bad.yaml:5:5: effects[2] is inertia again; it stands in effects[0] already, and a second "
      "one would count twice"}},
    {MATERIAL("{energy: S, young: 1, poisson: 0}") "effects: [elasticity, elasticity]\n",
     {"effects[1] is elasticity again; it stands in effects[0] already"}},
    {BODY "effects:\n  - gravity\n  - inertia\n",
     {"time.end is missing; it must be a number >= 0 [s] when the scene has inertia"}},
    {BODY "effects:\n  - pin: {}\n", {"bad.yaml:3:10: effects[0].pin: ", "box"}},
    {BODY "effects:\n  - pin: {box: [[9, 9, 9], [10, 10, 10]]}\n",
     {"bad.yaml:3:10: effects[0].pin: "}},
    {BODY "effects:\n  - pin: {nodes: [20]}\n", {"bad.yaml:3:18: effects[0].pin: ", "20"}},
    {BODY "effects:\n  - pin: {box: [[1, 0, 0], [0, 1, 1]]}\n",
     {"effects[0].pin.box is [[1, 0, 0], [0, 1, 1]]; it must be two corners", "the low one first [m]"}},
    {BODY "effects:\n  - pin: {box: [0, 1]}\n",
     {"effects[0].pin.box is [0, 1]; it must be two corners"}},
    {BODY "effects:\n  - pin: {box: [[0, 0, .nan], [1, 1, 1]]}\n", {"effects[0].pin.box"}},
    {BODY "effects:\n  - pin: {nodes: [0], axes: [w]}\n",
     {"effects[0].pin.axes is [w]; it must be a list of some of x, y, z"}},
    {BODY "effects:\n  - pin: {nodes: [0], axes: []}\n", {"effects[0].pin.axes is an empty list"}},
    {BODY "effects:\n  - pin: {nodes: [0], axes: x}\n", {"effects[0].pin.axes is x"}},
    {BODY "effects:\n  - pin: {nodes: [0], until: .nan}\n",
     {"effects[0].pin.until is .nan; it must be a number, .inf or -.inf [s]"}},
    {BODY "effects:\n  - pin: {sphere: {radius: 1}}\n",
     {"bad.yaml:3:19: effects[0].pin.sphere.centre is missing"}},
    {BODY "effects:\n  - prescribed_motion: {nodes: [0], motion: [{time: 0}, {tme: 1}]}\n",
     {"bad.yaml:3:58: effects[0].prescribed_motion.motion[1].tme is unknown; did you mean time?"}},
    {BODY "effects:\n  - prescribed_motion: {nodes: [0], motion: []}\n",
     {"bad.yaml:3:24: effects[0].prescribed_motion: "}},
    {BODY "effects:\n  - prescribed_motion: {nodes: [0]}\n",
     {"effects[0].prescribed_motion.motion is missing; it must be a list of mappings"}},
    {BODY "effects:\n  - weld: {first: {nodes: [0]}, second: {nodes: [1]}}\n",
     {"bad.yaml:3:11: effects[0].weld: no surface triangle of the mesh lies in the given nodes"}},
    {BODY "effects:\n  - calm: {rate: 3}\n",
     {"bad.yaml:3:5: effects[0] is calm, which is no effect; "}},
    {BODY GRAVITY "solver: {eigenvalue_filtr: clamp}\n",
     {"bad.yaml:3:10: solver.eigenvalue_filtr is unknown; did you mean eigenvalue_filter?"}},
#ifndef FLESH_HAVE_CHOLMOD
    {BODY GRAVITY "solver: {linear_solver: cholmod}\n",
     {"bad.yaml:3:25: solver.linear_solver is cholmod, which is not built in; it must be pcg or "
      "klu"}},
#endif
};

/* Valid scenes that name invalid files. */
static const bad_scene scenes_of_bad_files[] = {
    {GRAVITY "body: {mesh: nowhere.node}\n",
     {"bad.yaml:2:14: body.mesh: ", "nowhere.node", "No such file"}},
    {GRAVITY "body: {mesh: .}\n", {"bad.yaml:2:14: body.mesh: "}},
    {GRAVITY "body: {mesh: bad.yaml}\n", {"bad.yaml:2:14: body.mesh: "}},
    {BODY GRAVITY "start: {state: nowhere.txt}\n",
     {"bad.yaml:3:16: start.state: ", "nowhere.txt", "No such file"}},
    {BODY GRAVITY "start: {state: bar.node}\n", {"bad.yaml:3:16: start.state: ", "bar.node:1: "}},
};

static void check_failure(const char *what, int got, int wanted, const flesh_scene *scene,
                          const char *const parts[3])
{
  int before = test_failures;
  CHECK(got == wanted);
  CHECK(!scene);
  for (int i = 0; i < 3 && parts[i]; i++) CHECK_TEXT(flesh_error_text(), parts[i]);
  if (test_failures > before) printf("# in:\n# %s\n# -> %s\n", what, flesh_error_text());
}

static void check_scenes(const bad_scene *bad, size_t count, int wanted)
{
  for (size_t i = 0; i < count; i++) {
    flesh_scene *scene = NULL;
    int status = read_scene("bad.yaml", bad[i].text, 0, NULL, &scene);
    check_failure(bad[i].text, status, wanted, scene, bad[i].parts);
    flesh_scene_destroy(&scene);
  }
}

static void bad_scenes_are_refused_with_place_and_reason(void)
{
  check_scenes(scenes, sizeof scenes / sizeof *scenes, FLESH_ERR_ARGUMENT);
  check_scenes(scenes_of_bad_files, sizeof scenes_of_bad_files / sizeof *scenes_of_bad_files,
               FLESH_ERR_FILE);
}

static void bad_overrides_are_refused_by_name(void)
{
  static const struct {
    const char *overrides[3], *parts[3];
  } bad[] = {
      {{"body.density"}, {"--set body.density: no = follows the key; it must be KEY=VALUE"}},
      {{"=3"}, {"--set =3: the path is not of the form"}},
      {{"body..density=3"}, {"--set body..density=3: the path is not"}},
      {{"body.regions[x]=3"}, {"--set body.regions[x]=3: the path is not"}},
      {{"body.regions[0=3"}, {"the path is not"}},
      {{"[0]=3"}, {"the path is not"}},
      {{"body.regions[99999999999]=3"}, {"the path is not"}},
      {{"body.density=-3"},
       {"--set body.density=-3: body.density is -3; it must be a number > 0 [kg/m^3]"}},
      {{"body.densty=3"}, {"--set body.densty=3: body.densty is unknown; did you mean density?"}},
      {{"body.matrial.mu=3"},
       {"--set body.matrial.mu=3: body.matrial is unknown; did you mean material?"}},
      {{"body.matrial.mu=null"}, {"body.matrial is unknown"}},
      {{"body.rho=3"}, {"--set body.rho=3: body.rho is unknown; did you mean density? Known here: mesh"}},
      {{"body.material.E=3"}, {"body.material.E is unknown; did you mean young?"}},
      {{"body.material.youngs_modulus=3"}, {"did you mean young?"}},
      {{"body.material.nu=0.4"}, {"did you mean poisson?"}},
      {{"body.material.poisson_ratio=0.4"}, {"did you mean poisson?"}},
      {{"body.material.G=3"}, {"did you mean mu?"}},
      {{"time.dt=3"}, {"time.dt is unknown; did you mean step?"}},
      {{"time.time_step=3"}, {"did you mean step?"}},
      {{"time.t_end=3"}, {"did you mean end?"}},
      {{"time.duration=3"}, {"did you mean end?"}},
      {{"time.tol=3"}, {"did you mean tolerance?"}},
      {{"effects.gravity.g=3"}, {"did you mean acceleration?"}},
      {{"start.velocty=null"},
       {"--set start.velocty=null: start.velocty is unknown; did you mean velocity?"}},
      {{"effects.gravty.acceleration=[0, 0, 1]"},
       {"effects[3] is gravty, which is no effect; did you mean gravity?"}},
      {{"effects.inertai=null"}, {"is inertai, which is no effect; did you mean inertia?"}},
      {{"solver.eigenvalue_filtr=clamp"}, {"solver.eigenvalue_filtr is unknown; did you mean eigenvalue_filter?"}},
      {{"solver.techniques=[watch]"}, {"solver.techniques is [watch]; it must be a list of some of negative_curvature"}},
      {{"body.calm=3"}, {"body.calm is unknown"}},
      {{"effects.gravity.acceleration=3"},
       {"--set effects.gravity.acceleration=3: effects[1].gravity.acceleration is 3; it must be "
        "three numbers"}},
      {{"effects.gravity.acceleration[3]=3"}, {"effects[1].gravity.acceleration is [0, 0, -9.81, 3]"}},
      {{"effects.gravity.acceleration[4]=3"},
       {"effects.gravity.acceleration[4] does not exist; there are 3, counted from 0"}},
      {{"effects.gravity.acceleration.x=3"},
       {"effects.gravity.acceleration is [0, 0, -9.81]; nothing below it can be set by name"}},
      {{"effects.pin[2].axes=[x]"},
       {"effects.pin[2] does not exist; there is 1 named pin, counted from 0"}},
      {{"effects[4].pin.axes=[x]"}, {"effects[4] does not exist; there are 3"}},
      {{"effects[3]=null"}, {"effects[3] does not exist; there are 3"}},
      {{"body.density.x=3"},
       {"--set body.density.x=3: body.density is 1000; nothing below it can be set by name"}},
      {{"body.density[0]=3"}, {"body.density is 1000; nothing below it can be set by index"}},
      {{"body={mesh: [}"}, {"--set body={mesh: [}: not valid YAML or JSON"}},
      {{"body.material.poisson=0.4"}, {"body.material gives mu, lambda, poisson; it must give"}},
      {{"body.material.young=1e5"}, {"body.material gives mu, lambda, young; it must give"}},
      {{"body.material.mu=null"}, {"body.material gives lambda; it must give"}},
      {{"body.material.energy=E", "body.material.lambda=1"}, {"body.material: ", "lambda"}},
      {{"body.material=null", "effects=[elasticity]"},
       {"effects[0].elasticity needs body.material"}},
      {{"body=null"}, {"body is missing"}},
      {{"time.end=null"}, {"time.end is missing"}},
      {{"body.density=3", "body.density=4", "body.density=\x01"}, {"byte 0x01 is not text"}},
      {{"a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a=1"}, {"the path is not"}},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    int count = 0;
    while (count < 3 && bad[i].overrides[count]) count++;
    flesh_scene *scene = NULL;
    int status = read_scene("example.yaml", example, count, bad[i].overrides, &scene);
    check_failure(bad[i].overrides[0], status, FLESH_ERR_ARGUMENT, scene, bad[i].parts);
    flesh_scene_destroy(&scene);
  }
}

static void files_that_are_no_scenes_are_refused(void)
{
  flesh_scene *scene = NULL;
  CHECK(flesh_scene_read(folder, 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "is a directory");
  CHECK(flesh_scene_read(file_path("nowhere.yaml"), 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "nowhere.yaml: cannot be opened: No such file");
  CHECK(!mkfifo(file_path("pipe"), 0600));
  CHECK(flesh_scene_read(file_path("pipe"), 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "not a regular file");
  write_text("huge.yaml", "a: b\n");
  CHECK(!truncate(file_path("huge.yaml"), (off_t)1 << 33)); /* a hole: occupies no disk space */
  CHECK(flesh_scene_read(file_path("huge.yaml"), 0, NULL, &scene) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "8589934592 bytes");
  CHECK(flesh_scene_read(write_bytes("zeros", "body\0: 3", 8), 0, NULL, &scene) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "zeros:1:5: byte 0x00 is not text");
  CHECK(!scene);
}

/* `count` times `piece`. */
static char *repeat(const char *before, const char *piece, int count, const char *after)
{
  size_t size = strlen(piece);
  char *text = malloc(strlen(before) + size * (size_t)count + strlen(after) + 1);
  if (!text) abort();
  char *at = stpcpy(text, before);
  for (int i = 0; i < count; i++) at = stpcpy(at, piece);
  strcpy(at, after);
  return text;
}

static void bombs_are_defused(void)
{
  static const struct {
    const char *before, *piece;
    int count;
    const char *after, *part;
  } bombs[] = {
      {"a: ", "[", 100000, "", "bomb.yaml:1:"},
      {"a: ", "{a: ", 100000, "", "bomb.yaml:1:"},
      {"", "- ", 50000, "", "bomb.yaml:1:"},
      {"a: ", "[", 60, "", "nested deeper than 48 levels"},
      {"a: &a [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]\nb: ", "[", 30, "*a",
       "nested deeper"},
      {"x: [", "1,", 1100000, "1]\n", "more than 1000000 values"},
      {"", "a: b\n", 2, "", "a stands twice"},
      {"body: {mesh: \"", "x", 100000, "\"}\neffects: [gravity]\n", "body.mesh: "},
  };
  for (size_t i = 0; i < sizeof bombs / sizeof *bombs; i++) {
    flesh_scene *scene = NULL;
    char *text = repeat(bombs[i].before, bombs[i].piece, bombs[i].count, bombs[i].after);
    int status = read_scene("bomb.yaml", text, 0, NULL, &scene);
    CHECK(status == FLESH_ERR_ARGUMENT || status == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), bombs[i].part);
    CHECK(!scene);
    free(text);
  }
  /* Ten lists of ten aliases each of the previous one: 10^10 values when expanded. */
  char text[4096] = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; i++) {
    size_t used = strlen(text);
    used += (size_t)snprintf(text + used, sizeof text - used, "a%d: &a%d [", i, i);
    for (int k = 0; k < 10; k++)
      used += (size_t)snprintf(text + used, sizeof text - used, "%s*a%d", k ? ", " : "", i - 1);
    snprintf(text + used, sizeof text - used, "]\n");
  }
  flesh_scene *scene = NULL;
  CHECK(read_scene("bomb.yaml", text, 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "more than 1000000 values, aliases written out");
  /* More keys than any mapping has. */
  char *keys = calloc(1, 20000);
  if (!keys) abort();
  for (int i = 0, used = 0; i < 1500; i++) used += sprintf(keys + used, "k%d: 1\n", i);
  CHECK(read_scene("bomb.yaml", keys, 0, NULL, &scene) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "bomb.yaml:1001:1: a mapping of more than 1000 keys");
  free(keys);
}

static void bad_states_are_refused_with_the_line(void)
{
  static const struct {
    const char *text, *part;
  } bad[] = {
      {"", "the file ends after 0 rows; a state has one for each of the mesh's 2 nodes"},
      {"1 2 3 4 5 6\n", "state.txt:2: the file ends after 1 rows"},
      {"1 2 3 4 5 6\n1 2 3 4 5 6\n1 2 3 4 5 6\n", "state.txt:3: more than 2 rows"},
      {"# t 1\n1 2 3 4 5\n1 2 3 4 5 6\n", "state.txt:2: "},
      {"1 2 3 4 5 6 7\n1 2 3 4 5 6\n", "state.txt:1: "},
      {"1 2 3 4 5 6\n1 2 x 4 5 6\n",
       "state.txt:2: node 1: 'x' is not a number; `x y z vx vy vz` is expected"},
      {"1 2 3 4 5 6\n1 2 3 4 5 nan\n", "state.txt:2: node 1: 'nan' is not finite"},
      {"1 2 3 4 5 6\n1 2 3 4 5 1e999\n", "state.txt:2: node 1: '1e999' is not finite"},
      {"# t soon\n1 2 3 4 5 6\n1 2 3 4 5 6\n", "state.txt:1: time: 'soon' is not a number"},
      {"\n# t inf\n", "state.txt:2: time: 'inf' is not finite"},
      {"# t 1 2\n", "state.txt:1: "},
  };
  double x[6], v[6];
  flesh_state state = {.t = 0, .x = x, .v = v};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    CHECK(flesh_state_read(write_text("state.txt", bad[i].text), 2, &state) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), bad[i].part);
  }
  CHECK(flesh_state_read(folder, 2, &state) == FLESH_ERR_FILE);
  /* If a state cannot be written, the old file stays. */
  for (int i = 0; i < 6; i++) x[i] = v[i] = 1;
  v[4] = NAN;
  write_text("state.txt", "kept");
  CHECK(flesh_state_write(file_path("state.txt"), 2, &state) == FLESH_ERR_NONFINITE);
  CHECK_TEXT(flesh_error_text(), "node 1");
  char *text = read_text(file_path("state.txt"));
  CHECK(!strcmp(text, "kept"));
  free(text);
  v[4] = 0;
  CHECK(flesh_state_write(file_path("nowhere/state.txt"), 2, &state) == FLESH_ERR_FILE);
}

/* Damages the text: bytes are replaced, inserted, removed, or a piece is repeated. */
static size_t mutate(char *text, size_t size, size_t room, unsigned long long *seed)
{
  static const char alphabet[] = " \n\t:-[]{},&*!|>'\"%@`#?=/.0123456789eExyz~<\\\x00\x80\xc3\xff";
#define BELOW(n) ((size_t)(test_uniform(seed) * (double)(n)))
  for (int changes = 1 + (int)(BELOW(2) * BELOW(3)); changes > 0 && size > 8 && size + 40 < room;
       changes--) {
    size_t at = BELOW(size);
    char letter = alphabet[BELOW(sizeof alphabet - 1)];
    switch (BELOW(4)) {
    case 0:
      text[at] = letter;
      break;
    case 1:
      memmove(text + at + 1, text + at, size - at);
      text[at] = letter;
      size++;
      break;
    case 2: {
      size_t cut = 1 + BELOW(6) % (size - at);
      if (at + cut > size) cut = size - at;
      memmove(text + at, text + at + cut, size - at - cut);
      size -= cut;
      break;
    }
    default: {
      size_t piece = 1 + BELOW(30);
      if (at + piece > size) piece = size - at;
      memmove(text + at + piece, text + at, size - at);
      size += piece;
    }
    }
  }
#undef BELOW
  return size;
}

static void no_text_makes_the_reader_fail_otherwise(void)
{
  static const char *const seeds[] = {
      example,
      "{\"body\": {\"mesh\": \"bar.node\", \"material\": {\"energy\": \"S\", \"young\": \"1e5\", "
      "\"poisson\": 0.4},\n"
      "\"regions\": [{\"tags\": [7], \"density\": 3}]}, \"effects\": [\"inertia\", {\"prescribed_motion\": "
      "{\"nodes\": [1, 2],\n"
      "\"motion\": [{\"time\": 0}, {\"time\": 1, \"translation\": [1, 2, 3]}]}}], \"time\": "
      "{\"end\": \"1/60\"}}",
      "body: &b\n  mesh: bar.node\neffects:\n- gravity: &g {acceleration: [0, 0, -1]}\n- gravity: "
      "*g\n"
      "- pin: {sphere: {centre: [0, 0, 0], radius: 1}, axes: [x, 'y'], until: .inf}\n"
      "- spring:\n    point: [0, 0, 0]\n    stiffness: 1e3\n    target:\n      - time: 0\n        "
      "position: [0, 0, 1]\n"
      "title: >\n  folded\n  text\nstart: {velocity: [1/3, 0, 0]}\n",
  };
  enum { TRIALS = 3000, ROOM = 4096 };
  unsigned long long seed = 20;
  int good = 0, bad = 0;
  for (int i = 0; i < TRIALS; i++) {
    char text[ROOM];
    const char *from = seeds[i % 3];
    size_t size = strlen(from);
    memcpy(text, from, size);
    if (i >= 3) size = mutate(text, size, ROOM, &seed);
    const char *path = write_bytes("mutant.yaml", text, size);
    flesh_scene *scene = NULL;
    int status = flesh_scene_read(path, 0, NULL, &scene);
    if (status == FLESH_OK) {
      good++;
      CHECK(scene != NULL);
    } else {
      bad++;
      CHECK(status == FLESH_ERR_ARGUMENT || status == FLESH_ERR_FILE);
      CHECK(!scene);
      CHECK(i >= 3);
      CHECK_TEXT(flesh_error_text(), "mutant.yaml:");
      CHECK(strlen(flesh_error_text()) > strlen(path) + 8);
    }
    flesh_scene_destroy(&scene);
    if (test_failures) {
      printf("# trial %d: %s\n", i, flesh_error_text());
      return;
    }
  }
  CHECK(good > TRIALS / 20 && bad > TRIALS / 4);
  printf("# %d good, %d bad\n", good, bad);
}

static void no_override_makes_the_reader_fail_otherwise(void)
{
  static const char *const seeds[] = {
      "effects.pin[0].box=[[0, 0, 0], [0, 1, 1]]", "body.regions[0].tags=[3, 7]",
      "effects[1].gravity.acceleration[2]=-1/3", "body.material.mu=null"};
  unsigned long long seed = 21;
  int good = 0, bad = 0;
  for (int i = 0; i < 2000; i++) {
    char texts[2][256];
    const char *overrides[2] = {texts[0], texts[1]};
    for (int k = 0; k < 2; k++) {
      const char *from = seeds[(i + k * (i / 4)) % 4];
      strcpy(texts[k], from);
      if (k == i % 2 || i % 3) texts[k][mutate(texts[k], strlen(from), sizeof texts[k], &seed)] = 0;
    }
    flesh_scene *scene = NULL;
    int status = read_scene("example.yaml", example, 2, overrides, &scene);
    good += !status;
    bad += !!status;
    CHECK(!status == (scene != NULL));
    CHECK(!status || status == FLESH_ERR_ARGUMENT || status == FLESH_ERR_FILE);
    if (status)
      CHECK(strstr(flesh_error_text(), "--set ") || strstr(flesh_error_text(), "example.yaml:"));
    flesh_scene_destroy(&scene);
    if (test_failures) {
      printf("# trial %d: %s %s: %s\n", i, overrides[0], overrides[1], flesh_error_text());
      return;
    }
  }
  CHECK(good > 20 && bad > 500);
  printf("# %d good, %d bad\n", good, bad);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed =
      RUN_TESTS(argc, argv, TEST(bad_scenes_are_refused_with_place_and_reason),
                TEST(bad_overrides_are_refused_by_name), TEST(files_that_are_no_scenes_are_refused),
                TEST(bombs_are_defused), TEST(bad_states_are_refused_with_the_line),
                TEST(no_text_makes_the_reader_fail_otherwise),
                TEST(no_override_makes_the_reader_fail_otherwise));
  test_folder_remove(folder);
  return failed;
}
