// TEST full seconds=20
/* test_checkpoints.c: steps recomputed from checkpoints have the same bits: gradients of motions with few kept states
 * equal those with all states, bit by bit, with all methods, through events, impacts with friction, between bodies,
 * with muscles, viscosity, follower loads, breaking welds and incompressible tets. A thousand steps need no more memory
 * than was requested. */
#include "body.h"
#include "gradients.h"

#define BODY "body: {name: bar, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, constants: matched, "
#define CLAMP "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
#define UPPER "bodies:\n  - {name: upper, mesh: ../meshes/cube_3x3x3.mesh, density: 500, translation: [0, 0, 0.1],\n" \
              "     material: {energy: S, constants: matched, young: 2e4, poisson: 0.4}}\n"
#define TIME(step, end, more) "time: {step: " step ", end: " end more "}\nsolver: {newton_tolerance: 1e-8}\n"

typedef struct kept_case {
  const char *name, *text;
} kept_case;

static const kept_case swing = {
    "swing and release",
    BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0, 0.3, 0.1]}\n"
    "effects:\n  - inertia: {}\n  - gravity: {acceleration: [0, 0, -9.81]}\n  - damping: {mass: 0.5, stiffness: 0.002}\n"
    "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], until: 0.313}\n" TIME("0.01", "0.4", "")};

static const kept_case by_errors = {
    "steps that errors choose",
    BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0.5, 0, -1]}\n"
    "effects:\n  - inertia: {}\n  - gravity: {acceleration: [0, 0, -9.81]}\n"
    "  - contact: {plane: {point: [0, 0, -0.012]}, friction: 0.3, thickness: 0.01, stiffness: 1e5}\n"
    TIME("0.05", "0.1", ", adaptive: true, tolerance: 0.1")};

static const kept_case others[] = {
    {"impact with friction",
     BODY "young: 2e4, poisson: 0.4}}\nstart: {velocity: [0.5, 0, -1]}\n"
     "effects:\n  - inertia: {}\n  - gravity: {acceleration: [0, 0, -9.81]}\n"
     "  - contact: {plane: {point: [0, 0, -0.012]}, friction: 0.3, thickness: 0.01, stiffness: 1e5}\n" TIME("1/240", "0.2", "")},
    {"bodies that touch",
     BODY "young: 1e4, poisson: 0.4}}\nbodies:\n  - {name: upper, mesh: ../meshes/cube_3x3x3.mesh, density: 500,\n"
     "     translation: [0.031, 0.012, 0.104], material: {energy: S, constants: matched, young: 2e4, poisson: 0.4}}\n"
     "effects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [0, 0, -9.81]}\n  - contact: {between: all, thickness: 2e-3, stiffness: 1e5, friction: 0.4}\n"
     TIME("1/200", "0.12", "")},
    {"weld that breaks",
     BODY "young: 1e4, poisson: 0.4}}\n" UPPER "effects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [2, 1, 9.81]}\n"
     "  - weld: {bodies: [bar, upper], stiffness: 1e6, breaks_at: 700}\n" TIME("1/200", "0.25", "")},
    {"follower pressure, muscle and viscosity",
     BODY "young: 1e4, poisson: 0.4}}\neffects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [0, 0, -9.81]}\n  - viscosity: {shear: 20, bulk: 30}\n"
     "  - pressure: {box: [[-1, -1, 0.099], [5, 2, 2]], pressure: 200}\n"
     "  - muscle: {fibres: {direction: [1, 0.3, 0]}, peak_stress: 3e3, activation: [{time: 0, value: 0.5}]}\n"
     TIME("0.01", "0.2", "")},
};

static const kept_case equilibria = {
    "equilibria with friction",
    BODY "young: 2e4, poisson: 0.4}}\neffects:\n  - gravity: {acceleration: [0, 0, -9.81]}\n"
    "  - prescribed_motion: {box: [[-1, -1, 0.099], [2, 2, 2]], motion: [{time: 0}, {time: 40, translation: [0.004, 0.002, -0.012]}]}\n"
    "  - contact: {plane: {point: [0, 0, -0.008]}, motion: [{time: 0}, {time: 40, translation: [0.02, 0, 0]}], friction: 0.3,\n"
    "      thickness: 0.01, stiffness: 1e5}\n" TIME("1", "40", "")};

static const kept_case incompressible = {
    "incompressible",
    "body: {name: bar, mesh: ../meshes/cube_of_six_tets.mesh, element: tet10-mean, density: 1000, material: {energy: S,\n"
    "  constants: matched, young: 1e4, poisson: 0.5}}\nstart: {velocity: [0, 0.3, 0.1]}\neffects:\n  - inertia: {}\n  - gravity: {acceleration: [0, 0, -9.81]}\n"
    "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], until: 0.113}\n" TIME("0.01", "0.2", "")};

/* A gradient of a run with this number of kept states. */
typedef struct kept {
  int n, steps, broken;
  double values[2], *start, *tangent;
  flesh_trajectory_costs costs;
} kept;

/* Runs it; the gradient is computed at the end and, if `twice`, also half-way. */
static kept run(const kept_case *c, flesh_method method, int states, int twice)
{
  kept result = {0};
  flesh_scene *scene = gradient_scene(c->text, NULL, 0);
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_scene_time *time = flesh_scene_times(scene);
  const int n = flesh_system_unknowns(system), steps = (int)(time->end / time->step + 0.5);
  gradient_parameter p[2] = {gradient_parameter_of(c->text, (gradient_key){"body.density", 1000, 2, 1}),
                             gradient_parameter_of(c->text, (gradient_key){"effects.gravity.acceleration[2]", -9.81, 0.02, 0.01})};
  const flesh_parameter parameters[2] = {p[0].parameter, p[1].parameter};
  flesh_integrator *integrator = NULL;
  flesh_trajectory *trajectory = NULL;
  const int internals = flesh_system_internal_count(system);
  flesh_state state = {.x = calloc(4 * (size_t)n + (size_t)internals, sizeof(double)), .internal_count = internals};
  state.v = state.x + n;
  double *by = state.v + n;
  state.internal = internals ? by + 2 * n : NULL;
  for (int d = 0; d < 2 * n; d++) by[d] = sin(0.7 + d);
  const flesh_motion_quantity quantity = {.by_x = by, .by_v = by + n, .over = twice ? FLESH_MEAN : FLESH_AT_END};
  result.n = n;
  result.start = calloc(2 * (size_t)n, sizeof(double));
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(system, method, flesh_scene_solver(scene), &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &time->adaptive));
  CHECK_OK(flesh_trajectory_create(integrator, 1e-10, states, &trajectory));
  for (int k = 0; k < steps && trajectory; k++) {
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &state, time->step, &stats));
    result.steps += stats.steps;
    if (twice && k == steps / 2)
      CHECK_OK(flesh_trajectory_gradient(trajectory, &quantity, 2, parameters, result.values, result.start));
  }
  CHECK_OK(flesh_trajectory_gradient(trajectory, &quantity, 2, parameters, result.values, result.start));
  result.tangent = calloc(2 * (size_t)n, sizeof(double));
  CHECK_OK(flesh_trajectory_tangent(trajectory, &parameters[0], result.tangent, result.tangent + n));
  for (int k = 0; k < internals; k++) result.broken += state.internal[k] != 0;
  result.costs = flesh_trajectory_get_costs(trajectory);
  flesh_trajectory_destroy(&trajectory);
  flesh_integrator_destroy(&integrator);
  for (int k = 0; k < 2; k++) gradient_parameter_clear(&p[k]);
  flesh_scene_destroy(&scene);
  free(state.x);
  return result;
}

static void compare(const kept_case *c, flesh_method method, int states)
{
  for (int twice = 0; twice < 1 + (c == &swing); twice++) {
    kept all = run(c, method, 1000000, twice), few = run(c, method, states, twice);
    printf("# %s, %s: %d steps, %d taken again; %.1f states instead of %.1f\n", c->name, flesh_method_name(method), all.steps,
           few.costs.repeated, (double)few.costs.bytes / (16. * few.n), (double)all.costs.bytes / (16. * few.n));
    CHECK(all.costs.repeated == 0 && few.costs.repeated > few.costs.parts);
    CHECK(all.costs.parts == few.costs.parts && all.steps == few.steps);
    CHECK((all.broken > 0) == (strstr(c->name, "breaks") != NULL));
    CHECK(all.values[0] != 0 && isfinite(all.values[0]));
    CHECK(!memcmp(all.values, few.values, sizeof all.values));
    CHECK(!memcmp(all.start, few.start, 2 * (size_t)all.n * sizeof *all.start));
    CHECK(!memcmp(all.tangent, few.tangent, 2 * (size_t)all.n * sizeof *all.tangent));
    free(all.start);
    free(all.tangent);
    free(few.tangent);
    free(few.start);
  }
}

static int is_fixed_step(flesh_method method) { return method != FLESH_METHOD_STATIC && method != FLESH_METHOD_IDA; }

static void by_every_method(void)
{
  for (int k = 0; flesh_method_name((flesh_method)k); k++)
    if (is_fixed_step((flesh_method)k)) compare(&swing, (flesh_method)k, 20);
}

static void by_steps_that_errors_choose(void)
{
  const flesh_method methods[] = {FLESH_METHOD_RUNGE_KUTTA, FLESH_METHOD_BDF2, FLESH_METHOD_NEWMARK,
                                  FLESH_METHOD_BACKWARD_EULER};
  for (int k = 0; k < 4; k++) compare(&by_errors, methods[k], 30);
}

static void of_every_kind(void)
{
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_HHT, FLESH_METHOD_RUNGE_KUTTA};
  for (size_t k = 0; k < sizeof others / sizeof *others; k++)
    for (int m = 0; m < 3; m++) compare(&others[k], methods[m], 20);
  compare(&equilibria, FLESH_METHOD_STATIC, 20);
  for (int m = 0; m < 3; m++) compare(&incompressible, methods[m], 30);
}

static void a_thousand_steps_fit_into_forty_states(void)
{
  static const kept_case thousand = {
      "a thousand steps",
      "body: {name: bar, mesh: ../meshes/bar_8x2x2.mesh, density: 1000, material: {energy: S, constants: matched, young: 1e5, "
      "poisson: 0.4}}\neffects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [0, 0, -9.81]}\n" TIME("1e-3", "1", "")};
  for (int k = 0; k < 2; k++) {
    kept few = run(&thousand, k ? FLESH_METHOD_BDF2 : FLESH_METHOD_NEWMARK, FLESH_TRAJECTORY_STATES, 0);
    printf("# %d steps, %d taken again, %.2f states\n", few.steps, few.costs.repeated, (double)few.costs.bytes / (16. * few.n));
    CHECK(few.steps == 1000);
    CHECK(few.costs.bytes <= 16 * (size_t)few.n * FLESH_TRAJECTORY_STATES + 16 * 1000);
    CHECK(few.costs.repeated <= (k ? 5 : 4) * few.steps);
    free(few.start);
    free(few.tangent);
  }
}

static void what_cannot_be_taken_again_is_refused(void)
{
  flesh_scene *scene = gradient_scene(swing.text, NULL, 0);
  const int n = flesh_system_unknowns(flesh_scene_system(scene));
  double *all = calloc(5 * (size_t)n, sizeof *all), gradient;
  flesh_state state = {.x = all, .v = all + n};
  flesh_integrator *integrator = NULL;
  flesh_trajectory *trajectory = NULL;
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_NEWMARK, flesh_scene_solver(scene), &integrator));
  CHECK(flesh_trajectory_create(integrator, 1e-10, 19, &trajectory) == FLESH_ERR_ARGUMENT && !trajectory);
  CHECK_TEXT(flesh_error_text(), "is 19; it must be at least 20");
  CHECK_OK(flesh_trajectory_create(integrator, 1e-10, 20, &trajectory));
  for (int k = 0; k < 30; k++) CHECK_OK(flesh_integrator_step(integrator, &state, 0.01, NULL));
  state.v[n - 1] += 1e-3;
  CHECK(flesh_integrator_step(integrator, &state, 0.01, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the state is not the end of the last step");
  flesh_integrator_destroy(&integrator);
  CHECK(flesh_trajectory_gradient(trajectory, &(flesh_motion_quantity){0}, 0, &(flesh_parameter){0}, &gradient, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the integrator is gone");
  flesh_trajectory_destroy(&trajectory);
  flesh_scene_destroy(&scene);
  free(all);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(by_every_method), TEST(by_steps_that_errors_choose), TEST(of_every_kind),
                   TEST(a_thousand_steps_fit_into_forty_states), TEST(what_cannot_be_taken_again_is_refused));
}
