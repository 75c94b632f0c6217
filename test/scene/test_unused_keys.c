// TEST quick
/* test_unused_keys.c: keys and effects that have no effect beside other choices of a scene are reported, others are
 * not. */
#include "scene_files.h"

enum { SETS = 4 };

#define OWN "material: {energy: E, young: 2, poisson: 0.3}"
#define MUSCLE(peak, keys) "effects[1]={muscle: {fibres: {direction: [1, 0, 0]}, peak_stress: " peak ", " keys "}}"

/* Values of a scene in motion, and the warning about those without effect; NULL: none. */
static const struct {
  const char *sets[SETS], *warning;
} rows[] = {
    {{"title=x"}, NULL},
    {{"time.alpha=-0.1", "time.max_order=2", "solver.linear_tolerance=1/100"}, NULL}, /* defaults */
    {{"time.method=hht", "time.alpha=-0.2"}, NULL},
    {{"time.alpha=-0.2"}, "time.alpha has no effect: it is for method hht"},
    {{"time.method=newmark", "time.beta=1/2"}, NULL},
    {{"time.beta=1/2"}, "time.beta has no effect: it is for method newmark"},
    {{"time.beta=1/2", "time.gamma=0.6"}, "time.gamma has no effect: it is for method newmark"},
    {{"time.spectral_radius=0.5"}, "time.spectral_radius has no effect: it is for method generalized-alpha"},
    {{"time.method=generalized-alpha", "time.spectral_radius=0.5"}, NULL},
    {{"time.table=trbdf2"}, "time.table has no effect: it is for methods runge-kutta and adaptive"},
    {{"time.method=runge-kutta", "time.table=trbdf2"}, NULL},
    {{"time.method=adaptive", "time.table=trbdf2", "time.max_steps=9"}, NULL},
    {{"time.method=adaptive", "time.max_order=3"}, "time.max_order has no effect: it is for method ida"},
    {{"time.tolerance=1e-3"}, "time.tolerance has no effect: it is for steps that errors choose"},
    {{"time.tolerance=1e-3", "time.adaptive=true"}, NULL},
    {{"time.tolerance=1e-3", "time.method=runge-kutta"}, NULL},
    {{"time.tolerance=1e-3", "time.method=runge-kutta", "time.adaptive=false"}, "time.tolerance has no effect"},
    {{"time.max_step=0.01"}, "time.max_step has no effect"},
    {{"time.max_steps=7"}, "time.max_steps has no effect"},
    {{"time.method=ida", "time.tolerance=1e-3", "time.max_order=3"}, NULL},
    {{"time.method=ida", "time.adaptive=true", "time.max_step=0.01"}, NULL},
    {{"time.method=ida", "time.adaptive=false"}, "time.adaptive has no effect: ida always chooses its steps"},
    {{"time.method=ida", "solver.max_newton=7"}, "solver.max_newton has no effect: ida has its own Newton iteration"},
    {{"time.method=ida", "solver.newton_tolerance=1e-6"}, "solver.newton_tolerance has no effect: time.tolerance ends"},
    {{"time.method=adaptive", "solver.newton_tolerance=1e-6"}, "solver.newton_tolerance has no effect: time.tolerance ends"},
    {{"time.method=adaptive", "solver.newton_tolerance=1e-6", "body.element=tet10-mean", "body.material.poisson=0.5"}, NULL},
    {{"time.method=ida", "solver.linear_tolerance=1e-6"}, NULL},
    {{"solver.linear_solver=klu", "solver.linear_tolerance=1e-6"}, "solver.linear_tolerance has no effect"},
    {{"solver.linear_solver=klu", "solver.max_linear=7"}, "solver.max_linear has no effect: it is for linear_solver pcg"},
    {{"solver.linear_solver=klu", "solver.preconditioner=ic"}, "solver.preconditioner has no effect"},
    {{"solver.preconditioner=ic", "solver.max_linear=7"}, NULL},
    {{"time.method=static", "time.end=0"}, NULL},
    {{"time.method=static", "time.step=1/9"}, "time.step has no effect: an equilibrium in which nothing changes with time"},
    {{"time.method=static", "time.adaptive=true"}, "time.adaptive has no effect: "},
    {{"time.method=static", "time.max_energy_gain=1"}, "time.max_energy_gain has no effect: "},
    {{"time.method=static", "start.velocity=[1, 0, 0]"}, "start.velocity has no effect: an equilibrium has no velocities"},
    {{"start.velocity=[1, 0, 0]"}, NULL},
    {{"body.mass=consistent"}, NULL},
    {{"body.regions=[{tags: [3, 7], " OWN "}]"}, "body.material has no effect: regions and bodies have materials of their own"},
    {{"body.regions=[{tags: [3, 7], " OWN "}]", "body.material=null"}, NULL},
    {{"body.regions=[{tags: [7], " OWN "}]"}, NULL},
    {{"body.regions=[{tags: [3, 7], density: 7}]"}, NULL},
    {{"body.regions=[{tags: [3, 7], density: 7}]", "body.density=9"}, "body.density has no effect: regions and bodies have"},
    {{"body.regions=[{tags: [7], density: 7}]", "body.density=9"}, NULL},
    {{"body.mass=consistent", "time.method=static"}, "body.mass has no effect: nothing accelerates in an equilibrium"},
    {{"solver.lag_iterations=2"}, "solver.lag_iterations has no effect: it is for motions with friction, "},
    {{"solver.lag_iterations=2", "effects[1]={contact: {plane: {point: [0, 0, -9]}, friction: 1}}"}, NULL},
    {{"solver.lag_iterations=2", "effects[1]={settling_damping: {rate: 1, speed: 1}}"}, NULL},
    {{"solver.lag_iterations=2", "effects[1]={drag: {body: body, density: 1}}"}, NULL},
    {{"solver.lag_iterations=2", "effects[1]={drag: {body: body, density: 1, velocity: [0, 1, 0]}}", "time.method=static"},
     "solver.lag_iterations has no effect"},
    {{"solver.lag_iterations=2", "time.method=ida"}, "solver.lag_iterations has no effect: ida has its own Newton"},
    {{"output.frame_interval=0", "output.fields=[J]"}, "output.fields has no effect: frame_interval is 0"},
    {{"output.fields=[reaction]", "output.fields_at=[tets]"}, "output.fields_at has no effect: no field of the frames uses it"},
    {{"output.fields=[J]", "output.fields_at=[tets]"}, NULL},
    {{"output.reactions=true"}, NULL},
    {{"output.reactions=true", "effects[2]=gravity"}, "output.reactions has no effect: there is no pin"},
    {{"output.probes=[{name: a, nodes: [1], about: [0, 0, 0]}]"}, "output.probes[0].about has no effect: "},
    {{"output.probes=[{name: a, nodes: [1], about: [0, 0, 0], quantities: [reaction]}]"}, NULL},
    /* Effects. */
    {{"effects[2].pin.until=-1"}, "effects[2].pin has no effect: it ends at -1 s, and the run begins at 0 s"},
    {{"effects[2].pin.until=0"}, "effects[2].pin has no effect: it ends at 0 s"},
    {{"effects[2].pin.until=1/2"}, NULL},
    {{"effects[2].pin.from=3"}, "effects[2].pin has no effect: it begins at 3 s, and the run ends at 1 s"},
    {{"effects[2].pin.from=1"}, NULL},
    {{"effects[1]={force: {nodes: [3], force: [1, 0, 0], interpolation: smooth}}"},
     "effects[1].force.interpolation has no effect: there are no two points"},
    {{"effects[1]={force: {nodes: [3], force: [1, 0, 0], amplitude: [{time: 1, value: 0}, {time: 2, value: 1}]}}"},
     "effects[1].force.amplitude changes nothing: the first point is at 1 s, and the run ends at 1 s"},
    {{"effects[1]={force: {nodes: [3], force: [1, 0, 0], interpolation: smooth, amplitude: [{time: 0.5, value: 0}, {time: "
      "2, value: 1}]}}"}, NULL},
    {{"effects[1]={force: {nodes: [3], force: [1, 0, 0], amplitude: [{time: 2, value: 3}]}}"}, NULL},
    {{"effects[1]={prescribed_motion: {nodes: [3], centre: [1, 0, 0], motion: [{time: 0}]}}"},
     "effects[1].prescribed_motion.centre has no effect: nothing turns about it"},
    {{"effects[1]={prescribed_motion: {nodes: [3], centre: [1, 0, 0], motion: [{time: 0, rotation: [0, 0, 1]}]}}"}, NULL},
    {{"effects[1]={contact: {plane: {point: [0, 0, -9]}, slip_speed: 3}}"},
     "effects[1].contact.slip_speed has no effect: there is no friction"},
    {{"effects[1]={contact: {plane: {point: [0, 0, -9]}, slip_speed: 3, friction: 1}}"}, NULL},
    {{"effects[1]={contact: {plane: {point: [0, 0, -9]}, friction: 1}}", "time.method=static"},
     "effects[1].contact.friction has no effect: in statics there is friction on obstacles that move only"},
    {{"effects[1]={damping: {mass: 1, stiffness_at: current}}"}, "effects[1].damping.stiffness_at has no effect"},
    {{"effects[1]={damping: {stiffness: 1, stiffness_at: current}}"}, NULL},
    {{"effects[1]={damping: {mass: 1}}", "time.method=static"}, "effects[1].damping has no effect: an equilibrium has no"},
    {{"effects[1]={viscosity: {shear: 1}}", "time.method=static"}, "effects[1].viscosity has no effect"},
    {{"effects[1]={settling_damping: {rate: 1}}", "time.method=static"}, "effects[1].settling_damping has no effect"},
    {{"effects[1]={drag: {body: body, density: 1}}", "time.method=static"}, "effects[1].drag has no effect: an equilibrium"},
    {{"effects[1]={drag: {body: body, density: 1, velocity: [0, 1, 0]}}", "time.method=static"}, NULL},
    {{"effects[1]={drag: {body: body, density: 1}}"}, NULL},
    {{MUSCLE("0", "passive: {c1: 3, c2: 2, limit: 1}")}, NULL},
    {{MUSCLE("0", "curve: thelen")}, "effects[1].muscle has no effect: peak_stress is 0, and there is no passive part"},
    {{MUSCLE("5", "passive: {c1: 0}")}, NULL},
    {{MUSCLE("5", "passive: {c2: 2, limit: 1}")}, NULL},
    {{MUSCLE("5", "passive: {c1: 0, c2: 2}")}, "effects[1].muscle.passive.c2 has no effect: there is no passive part"},
    {{MUSCLE("5", "passive: {c1: 0, limit: 2}")}, "effects[1].muscle.passive.limit has no effect: there is no"},
    {{MUSCLE("0", "passive: {c1: 3}, activation: [{time: 0, value: 1/2}]")},
     "effects[1].muscle.activation has no effect: peak_stress is 0"},
    {{MUSCLE("0", "passive: {c1: 3}, max_shortening_velocity: 5"), "time.method=static"},
     "muscle.max_shortening_velocity has no effect: it"},
    {{MUSCLE("1", "max_shortening_velocity: 5"), "time.method=static"}, "muscle.max_shortening_velocity has no effect: it"},
    {{MUSCLE("0", "passive: {c1: 3}, max_shortening_velocity: 5")},
     "muscle.max_shortening_velocity has no effect: it is for muscles"},
    {{MUSCLE("1", "activation: [{time: 0, value: 1/2}], max_shortening_velocity: 5")}, NULL}};

static const char moving[] = "body: {mesh: bar.node, material: {energy: S, young: 1, poisson: 0.3}}\n"
                             "effects: [inertia, gravity, pin: {nodes: [1, 2]}]\ntime: {end: 1}\n";

/* The scene as written by a run, with all defaults, has the same warning. */
static void what_means_nothing_is_told(void)
{
  for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
    flesh_scene *scene = NULL, *again = NULL;
    int count = 0;
    while (count < SETS && rows[k].sets[count]) count++;
    CHECK_OK(read_scene("moving.yaml", moving, count, rows[k].sets, &scene));
    if (!scene) continue;
    const char *warning = flesh_scene_warning(scene);
    if (rows[k].warning) CHECK_TEXT(warning ? warning : "-", rows[k].warning);
    else CHECK_TEXT(warning ? warning : "none", "none");
    CHECK(!warning || !strstr(warning, "; ") || rows[k].sets[1]);
    /* Once. */
    const char *told = warning ? strstr(warning, " has no effect") : NULL;
    char first[100];
    snprintf(first, sizeof first, "%.*s", told ? (int)(told - warning) : 0, warning ? warning : "");
    CHECK(!told || !strstr(told, first));
    CHECK_OK(flesh_scene_write(scene, file_path("again.yaml")));
    CHECK_OK(flesh_scene_read(file_path("again.yaml"), 0, NULL, &again));
    CHECK(again && !strcmp(warning ? warning : "", flesh_scene_warning(again) ? flesh_scene_warning(again) : ""));
    flesh_scene_destroy(&scene);
    flesh_scene_destroy(&again);
  }
}

/* A state has its own velocities; an effect that ended before it has acted in the run that made it. */
static void what_a_state_replaces_is_told(void)
{
  flesh_scene *scene = NULL;
  CHECK_OK(read_scene("moving.yaml", moving, 0, NULL, &scene));
  flesh_state state;
  char set[600];
  const int nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  double *x = calloc(6 * (size_t)nodes, sizeof *x);
  if (!x) abort();
  state = (flesh_state){.x = x, .v = x + 3 * nodes};
  flesh_scene_start(scene, &state);
  state.t = 0.5;
  CHECK_OK(flesh_state_write(file_path("state.txt"), nodes, &state));
  free(x);
  flesh_scene_destroy(&scene);
  snprintf(set, sizeof set, "start.state=%s", file_path("state.txt"));
  CHECK_OK(read_scene("moving.yaml", moving, 2, (const char *[]){set, "effects[2].pin.until=1/4"}, &scene));
  CHECK(scene && !flesh_scene_warning(scene));
  flesh_scene_destroy(&scene);
  CHECK_OK(read_scene("moving.yaml", moving, 2, (const char *[]){set, "time.method=static"}, &scene));
  CHECK(scene && !flesh_scene_warning(scene));
  flesh_scene_destroy(&scene);
  /* The scene as written by a run, from which the run is resumed, has the same warning. */
  for (int k = 0; k < 2; k++) {
    if (k) CHECK_OK(flesh_scene_read(file_path("again.yaml"), 0, NULL, &scene));
    else CHECK_OK(read_scene("moving.yaml", moving, 2, (const char *[]){set, "start.velocity=[0, 1, 0]"}, &scene));
    CHECK_TEXT(scene && flesh_scene_warning(scene) ? flesh_scene_warning(scene) : "-",
               "start.velocity has no effect: start.state has velocities");
    if (scene) CHECK_OK(flesh_scene_write(scene, file_path("again.yaml")));
    flesh_scene_destroy(&scene);
  }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(what_means_nothing_is_told), TEST(what_a_state_replaces_is_told));
  test_folder_remove(folder);
  return failed;
}
