// TEST full memory seconds=10
/* test_motion.c: gradients of motions, by one adjoint, agree with fourth-order differences of complete runs: with all
 * methods of fixed steps, through an impact with friction, with follower loads, muscles and welds. */
#include "body.h"
#include "gradients.h"

#define BODY "body: {name: bar, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, constants: matched, "
#define CLAMP "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\n"
#define TIME(step, end) "time: {step: " step ", end: " end "}\nsolver: {newton_tolerance: 1e-13, linear_tolerance: 1e-4}\n"

/* A motion, its keys, terminated by one of 0, and its number of steps. */
typedef struct motion_case {
  const char *name, *text;
  gradient_key keys[7];
  int kinked; /* start without a derivative by positions (1), or by velocities (2) */
} motion_case;

static const motion_case swing = {
    "swing",
    BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0, 0.3, 0.1]}\n"
    "effects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [0, 0, -9.81]}\n  - damping: {mass: 0.5, stiffness: 0.002}\n" TIME("0.01", "0.12"),
    {{"body.material.young", 1e4, 20, 10}, {"body.material.poisson", 0.4, 1e-4, 1e-4}, {"body.density", 1000, 2, 1},
     {"effects.damping.mass", 0.5, 1e-3, 1e-3}, {"effects.damping.stiffness", 0.002, 4e-6, 2e-6},
     {"effects.gravity.acceleration[2]", -9.81, 0.02, 0.01}}, 0};

static const motion_case incompressible = {
    "incompressible",
    "body: {mesh: ../meshes/cube_of_six_tets.mesh, element: tet10-mean, density: 1000, material: {energy: S, "
    "constants: matched, young: 1e4, poisson: 0.5}}\nstart: {velocity: [0, 0.3, 0.1]}\n"
    "effects:\n  - inertia: {}\n  - damping: {stiffness: 0.002}\n  - gravity: {acceleration: [0, 0, -9.81]}\n"
    "  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], until: 0.035, motion: [{time: 0}, {time: 0.1, translation: [0, "
    "0.03, 0]}]}\n"
    "time: {step: 0.01, end: 0.06}\nsolver: {newton_tolerance: 1e-11, linear_tolerance: 1e-4}\n",
    {{"body.material.young", 1e4, 100, 10}, {"body.density", 1000, 10, 1}, {"effects.damping.stiffness", 0.002, 1e-4, 2e-6},
     {"effects.gravity.acceleration[2]", -9.81, 0.02, 0.01},
     {"effects.prescribed_motion.motion[1].translation[1]", 0.03, 1e-4, 1e-5}}, 0};

/* A clamp that turns under pressure and is released; masses, which parameters change, share its jumps. */
static const motion_case driven = {
    "driven",
    "body: {name: bar, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, mass: consistent, material: {energy: S, constants: matched, "
    "young: 1e4, poisson: 0.4}, regions: [{box: [[-1, -1, -1], [2, 2, 0.06]], density: 800}]}\nstart: {velocity: [0, 0.3, 0.1]}\n"
    "effects:\n  - inertia: {}\n  - damping: {stiffness: 0.002}\n"
    "  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], until: 0.075, motion: [{time: 0}, {time: 0.035, translation: "
    "[0.004, 0.01, 0], rotation: [0.2, 0, 0.1]}, {time: 0.1, translation: [0, 0, 0.01]}]}\n"
    "  - pressure: {box: [[-1, -1, 0.099], [5, 2, 2]], pressure: 300}\n" TIME("0.01", "0.1"),
    {{"effects.prescribed_motion.motion[1].translation[1]", 0.01, 1e-4, 1e-5},
     {"effects.prescribed_motion.motion[1].rotation[0]", 0.2, 1e-3, 1e-4}, {"body.material.young", 1e4, 20, 10},
     {"body.density", 1000, 2, 1}, {"body.regions[0].density", 800, 2, 1}}, 0};

/* Sequences of equilibria. A constant quantity, known at once in later steps, still changes with a parameter over
 * time. */
static const motion_case equilibria[] = {
    {"pressed onto a ground that moves to the side",
     BODY "young: 2e4, poisson: 0.4}}\neffects:\n"
     "  - prescribed_motion: {box: [[-1, -1, 0.099], [2, 2, 2]], motion: [{time: 0}, {time: 8, translation: [0.008, 0.004, -0.024]}]}\n"
     "  - contact: {plane: {point: [0, 0, -0.008]}, motion: [{time: 0}, {time: 8, translation: [0.04, 0, 0]}], friction: 0.3,\n"
     "      thickness: 0.01, stiffness: 1e5}\n" TIME("1", "4"),
     {{"body.material.young", 2e4, 20, 10}, {"effects.contact.friction", 0.3, 1e-5, 1e-3},
      {"effects.contact.thickness", 0.01, 2e-6, 2e-7}, {"effects.prescribed_motion.motion[1].translation[2]", -0.024, 1e-5, 1e-5}}, 0},
    {"held on a ground that moves to the side",
     BODY "young: 2e4, poisson: 0.4}}\neffects:\n"
     "  - prescribed_motion: {box: [[-1, -1, 0.099], [2, 2, 2]], motion: [{time: 0}, {time: 1, translation: [0, 0, -0.009]}, {time: 8, "
     "translation: [0, 0, -0.009]}]}\n"
     "  - contact: {plane: {point: [0, 0, -0.008]}, motion: [{time: 0}, {time: 8, translation: [0.04, 0, 0]}], friction: 0.3,\n"
     "      thickness: 0.01, stiffness: 1e5}\n" TIME("1", "4"),
     {{"effects.prescribed_motion.motion[2].translation[2]", -0.009, 1e-5, 1e-5}, {"effects.contact.friction", 0.3, 1e-5, 1e-3}}, 0},
    {"equilibria under pressure",
     BODY "young: 1e4, poisson: 0.4}}\neffects:\n"
     "  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0}, {time: 1, translation: [0, 0.01, 0]}, {time: 4, "
     "translation: [0, 0.01, 0]}]}\n"
     "  - pressure: {box: [[-1, -1, 0.099], [5, 2, 2]], pressure: 400, amplitude: [{time: 0, value: 1}, {time: 4, value: 1}]}\n"
     TIME("1", "4"),
     {{"effects.pressure.amplitude[1].value", 1, 1e-3, 1e-3}, {"effects.prescribed_motion.motion[2].translation[0]", 0, 1e-5, 1e-5},
      {"body.material.young", 1e4, 20, 10}, {"effects.pressure.pressure", 400, 1, 1}}, 0},
};

static const motion_case others[] = {
    {"impact with friction",
     BODY "young: 2e4, poisson: 0.4}}\nstart: {velocity: [0.5, 0, -1]}\n"
     "effects:\n  - inertia: {}\n  - gravity: {}\n"
     "  - contact: {plane: {point: [0, 0, -0.012]}, friction: 0.3, thickness: 0.01, stiffness: 1e5}\n" TIME("1/240", "0.1"),
     {{"body.material.young", 2e4, 0.5, 10}, {"effects.contact.friction", 0.3, 1e-5, 1e-3},
      {"effects.contact.thickness", 0.01, 5e-8, 5e-8}, {"body.density", 1000, 0.05, 1}}, 0},
    {"dragged over the ground",
     BODY "young: 2e4, poisson: 0.4}}\nstart: {velocity: [0.2, 0, -0.5]}\neffects:\n  - inertia: {}\n"
     "  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0}, {time: 1, translation: [0.3, 0.2, -0.2]}]}\n"
     "  - contact: {plane: {point: [0, 0, -0.009]}, friction: 0.3, thickness: 0.01, stiffness: 1e5}\n" TIME("1/240", "0.04"),
     {{"effects.prescribed_motion.motion[1].translation[2]", -0.2, 1e-5, 1e-5},
      {"effects.prescribed_motion.motion[1].translation[0]", 0.3, 1e-5, 1e-4}, {"effects.contact.friction", 0.3, 1e-5, 1e-3}}, 0},
    {"follower pressure",
     BODY "young: 1e4, poisson: 0.4}}\neffects:\n  - inertia: {}\n" CLAMP
     "  - pressure: {box: [[-1, -1, 0.099], [5, 2, 2]], pressure: 400}\n" TIME("0.01", "0.06"),
     {{"body.material.young", 1e4, 20, 10}, {"effects.pressure.pressure", 400, 1, 1}}, 0},
    {"muscle and viscosity",
     BODY "young: 1e4, poisson: 0.4}}\neffects:\n  - inertia: {}\n" CLAMP "  - viscosity: {shear: 20, bulk: 30}\n"
     "  - muscle: {fibres: {direction: [1, 0.3, 0]}, peak_stress: 3e3, activation: [{time: 0, value: 0.5}]}\n"
     TIME("0.01", "0.04"),
     {{"effects.muscle.peak_stress", 3e3, 6, 10}, {"effects.viscosity.shear", 20, 0.04, 0.1},
      {"body.material.young", 1e4, 20, 10}}, 1}, /* equal to the tension at the optimal stretch */
    {"viscous body whose clamp turns within",
     BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0, 0.3, 0.1]}\neffects:\n  - inertia: {}\n  - viscosity: {shear: 20}\n"
     "  - prescribed_motion: {box: [[-1, -1, -1], [1e-9, 2, 2]], motion: [{time: 0}, {time: 0.015, translation: [0, 0.01, 0]}, "
     "{time: 0.1}]}\n" TIME("0.01", "0.03"),
     {{"effects.prescribed_motion.motion[1].translation[1]", 0.01, 1e-4, 1e-5}, {"effects.viscosity.shear", 20, 0.04, 0.1}}, 0},
    {"muscle at speed in a fluid",
     BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0, 0.3, 0.1]}\neffects:\n  - inertia: {}\n" CLAMP
     "  - muscle: {fibres: {direction: [1, 0.3, 0]}, peak_stress: 3e3, optimal_stretch: 1.1, max_shortening_velocity: 8}\n"
     "  - viscosity: {shear: 20}\n  - pressure: {box: [[-1, -1, -1], [1, 1, 1]], pressure: 300}\n" TIME("0.01", "0.03"),
     {{"effects.muscle.max_shortening_velocity", 8, 1e-3, 1e-5}, {"effects.pressure.pressure", 300, 0.1, 1}}, 2},
    {"damping by the current stiffness",
     BODY "young: 1e4, poisson: 0.4}}\nstart: {velocity: [0, 0.3, 0.1]}\neffects:\n  - inertia: {}\n" CLAMP
     "  - damping: {stiffness: 0.002, stiffness_at: current}\n" TIME("0.01", "0.03"),
     {{"effects.damping.stiffness", 0.002, 4e-7, 2e-9}, {"body.density", 1000, 0.02, 1e-3}}, 2},
    {"weld",
     BODY "young: 1e4, poisson: 0.4}}\nbodies:\n  - {name: upper, mesh: ../meshes/cube_3x3x3.mesh, density: 500, "
     "translation: [0, 0, 0.1],\n     material: {energy: S, constants: matched, young: 2e4, poisson: 0.4}}\n"
     "effects:\n  - inertia: {}\n" CLAMP "  - gravity: {acceleration: [0, 2, -9.81]}\n"
     "  - weld: {bodies: [bar, upper], stiffness: 1e6}\n" TIME("0.01", "0.06"),
     {{"effects.weld.stiffness", 1e6, 2e3, 1e3}, {"body.material.young", 1e4, 20, 10}, {"bodies[0].density", 500, 1, 1}}, 0},
};

/* A run of a scene to its end; `shift` moves the free dofs of the start along `direction` [2*n], x and v. */
typedef struct moved {
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_trajectory *trajectory;
  int n, steps;
  double integral; /* integral of `linear` over time, by the trapezoidal rule */
  flesh_state state;
} moved;

/* A linear function of the state, with derivatives `by` [2*n]. */
static double linear(const moved *m, double *by)
{
  double sum = 0;
  for (int d = 0; d < 2 * m->n; d++) {
    const double w = cos(0.3 + d) / m->n;
    sum += w * m->state.x[d]; /* and v, after x */
    if (by) by[d] = w;
  }
  return sum;
}

static moved begin(const char *text, const char *key, double value, flesh_method method)
{
  moved m = {.scene = gradient_scene(text, key, value)};
  const flesh_system *system = flesh_scene_system(m.scene);
  m.n = flesh_system_unknowns(system);
  m.state.x = calloc(2 * (size_t)m.n, sizeof(double));
  m.state.v = m.state.x + m.n;
  flesh_scene_start(m.scene, &m.state);
  for (int d = 0; d < m.n; d++) /* different weights everywhere */
    m.state.v[d] *= 1 + 3 * flesh_mesh_positions(flesh_scene_mesh(m.scene))[d / 3 * 3];
  CHECK_OK(flesh_integrator_create(system, method, flesh_scene_solver(m.scene), &m.integrator));
  CHECK_OK(flesh_integrator_set_max_energy_gain(m.integrator, INFINITY)); /* steps of the same length in all runs */
  return m;
}

static void run(moved *m)
{
  const flesh_scene_time *time = flesh_scene_times(m->scene);
  const int steps = (int)(time->end / time->step + 0.5);
  for (int k = 0; k < steps; k++) {
    flesh_solve_stats stats = {0};
    m->integral += time->step / 2 * linear(m, NULL);
    CHECK_OK(flesh_integrator_step(m->integrator, &m->state, time->step, &stats));
    m->integral += time->step / 2 * linear(m, NULL);
    m->steps += stats.steps;
  }
}

static void end(moved *m)
{
  flesh_trajectory_destroy(&m->trajectory);
  flesh_integrator_destroy(&m->integrator);
  flesh_scene_destroy(&m->scene);
  free(m->state.x);
}

/* The quantity: a nonlinear function of all positions and velocities; adds its derivatives unless `by` is NULL. */
static double quantity(const moved *m, double *by)
{
  double sum = 0;
  for (int d = 0; d < 2 * m->n; d++) {
    const double w = sin(0.7 + d) / m->n * (d < m->n ? 1 : 0.03), y = m->state.x[d];
    sum += w * y + 0.1 * w * y * y;
    if (by) by[d] = w + 0.2 * w * y;
  }
  return sum;
}

static void compare(const char *name, const char *key, double found, const double values[4], double step, double Q)
{
  double expected = 0;
  for (int k = 0; k < 4; k++) expected += gradient_weights[k] * values[k] / step;
  const double noise = 1e-13 * fabs(Q) / step; /* round-off of runs */
  printf("# %s, %s: %.10g, off by %.1e of it, of which %.1e may be round-off\n", name, key, found,
         fabs(found / expected - 1), noise / fabs(expected));
  CHECK_BELOW(fabs(found - expected), 1e-6 * fabs(expected) + noise);
}

/* Sums of a tangent: its product with `by` [2*n] at the last state, and its integral over time. */
typedef struct added {
  int n, states;
  const double *by;
  double last, t, integral;
} added;

static int add_up(void *data, int k, double t, const double *dx, const double *dv)
{
  added *a = (added *)data + k;
  double now = 0;
  for (int d = 0; d < a->n; d++) now += a->by[d] * dx[d] + a->by[a->n + d] * dv[d];
  if (a->states++) a->integral += (t - a->t) * (a->last + now) / 2;
  a->last = now;
  a->t = t;
  return FLESH_OK;
}

static void try_case(const motion_case *c, flesh_method method)
{
  char name[128];
  moved m = begin(c->text, NULL, 0, method);
  const int n = m.n;
  double *by = calloc(5 * (size_t)n, sizeof *by), *start = by + 2 * n, gradient[7], integral[7], values[4], integrals[4];
  gradient_parameter parameters[7];
  flesh_parameter all[7];
  int count = 0;
  snprintf(name, sizeof name, "%s, %s", c->name, flesh_method_name(method));
  for (; c->keys[count].key; count++) {
    parameters[count] = gradient_parameter_of(c->text, c->keys[count]);
    all[count] = parameters[count].parameter;
  }
  CHECK_OK(flesh_trajectory_create(m.integrator, 1e-12, 1000, &m.trajectory));
  run(&m);
  const double Q = quantity(&m, by);
  flesh_integrator_destroy(&m.integrator); /* the steps are known */
  const flesh_motion_quantity at_end = {.by_x = by, .by_v = by + n};
  const flesh_motion_quantity over_time = {.by_x = by, .by_v = by + n, .over = FLESH_INTEGRAL};
  CHECK_OK(flesh_trajectory_gradient(m.trajectory, &at_end, count, all, gradient, start));
  for (int i = 0; i < count; i++) {
    double *dx = calloc(2 * (size_t)n, sizeof *dx), by_tangent = 0;
    CHECK_OK(flesh_trajectory_tangent(m.trajectory, &all[i], dx, dx + n));
    for (int d = 0; d < 2 * n; d++) by_tangent += by[d] * dx[d];
    CHECK_NEAR(by_tangent, gradient[i], 1e-7 * fabs(gradient[i]) + 1e-13 * fabs(Q / c->keys[i].step));
    double by_start = 0, size = fabs(gradient[i]); /* with derivatives of the start of the same magnitude */
    added all_of_it = {.n = n, .by = by};
    for (int d = 0; d < 2 * n; d++) size += fabs(start[d]) / n;
    for (int d = 0; d < 2 * n; d++) dx[d] = size * sin(d + 1) / n, by_start += start[d] * dx[d];
    CHECK_OK(flesh_trajectory_tangents(m.trajectory, 1, &all[i], dx, add_up, &all_of_it));
    CHECK_NEAR(all_of_it.last, gradient[i] + by_start, 1e-7 * (fabs(gradient[i]) + fabs(by_start)) + 1e-13 * fabs(Q / c->keys[i].step));
    const flesh_scene_time *time = flesh_scene_times(m.scene);
    CHECK(all_of_it.states == 1 + (int)(time->end / time->step + 0.5));
    free(dx);
  }
  linear(&m, by);
  CHECK_OK(flesh_trajectory_gradient(m.trajectory, &over_time, count, all, integral, NULL));
  added together[7];
  for (int i = 0; i < count; i++) together[i] = (added){.n = n, .by = by};
  CHECK_OK(flesh_trajectory_tangents(m.trajectory, count, all, NULL, add_up, together));
  for (int i = 0; i < count; i++) {
    CHECK_NEAR(together[i].integral, integral[i], 1e-7 * fabs(integral[i]) + 1e-13 * fabs(m.state.t / c->keys[i].step));
    for (int k = 0; k < 4 && i < TEST_FEWER(count, 1); k++) {
      moved other = begin(c->text, c->keys[i].key, c->keys[i].value + gradient_at[k] * c->keys[i].step, method);
      run(&other);
      CHECK(other.steps == m.steps);
      values[k] = quantity(&other, NULL);
      integrals[k] = other.integral;
      end(&other);
    }
    if (i < TEST_FEWER(count, 1)) {
      compare(name, c->keys[i].key, gradient[i], values, c->keys[i].step, Q);
      compare("its integral", c->keys[i].key, integral[i], integrals, c->keys[i].step, 0.5 * m.state.t); /* of terms of 0.5 */
    }
    gradient_parameter_clear(&parameters[i]);
  }
  double along = 0; /* the start's velocities and positions */
  const double step = c == &incompressible ? 1e-4 : 1e-5; /* which is solved less accurately */
  const int compared = c->kinked < TEST_FEWER(2, 0);
  for (int k = 0; k < 4 && compared; k++) {
    moved other = begin(c->text, NULL, 0, method);
    for (int d = 0; d < n; d++) {
      const double X = flesh_mesh_positions(flesh_scene_mesh(m.scene))[d / 3 * 3], move = X > 1e-9 ? cos(d) : 0;
      /* Shear preserves the volumes of tets: if constraints do not hold, motions start in another way. */
      const double shift = c->kinked ? 0 : c == &incompressible ? (d % 3 == 1) * 0.1 * X : 0.01 * move;
      other.state.v[d] += gradient_at[k] * step * move;
      other.state.x[d] += gradient_at[k] * step * shift;
      if (k == 0) along += move * start[n + d] + shift * start[d];
    }
    run(&other);
    values[k] = quantity(&other, NULL);
    end(&other);
  }
  if (compared) compare(name, "the start", along, values, step, Q);
  free(by);
  end(&m);
}

static int is_fixed_step(flesh_method method) { return method != FLESH_METHOD_STATIC && method != FLESH_METHOD_IDA; }

static void gradients_by_every_method(void)
{
  for (int k = 0; flesh_method_name((flesh_method)k); k++)
    if (is_fixed_step((flesh_method)k)) try_case(&swing, (flesh_method)k), try_case(&driven, (flesh_method)k);
}

static void gradients_of_every_kind(void)
{
  for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
    try_case(&others[k], FLESH_METHOD_RUNGE_KUTTA); /* whose stages lag behind each other */
    const flesh_method fixed[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_MIDPOINT, FLESH_METHOD_NEWMARK};
    for (int m = 0; m < TEST_FEWER(3, 1); m++) try_case(&others[k], fixed[m]);
  }
}

/* A body slightly wider than at rest, whose stiffness has eigenvalues clamped at zero. */
static void no_difference_crosses_a_kink(void)
{
  static const char text[] = "body: {mesh: ../meshes/cube_of_six_tets.mesh, density: 1000, material: {energy: E, young: 1e4, poisson: 0.4}}\n"
                             "start: {velocity: [0, 0.3, 0.1]}\neffects:\n  - inertia: {}\n"
                             "  - damping: {stiffness: 0.01, stiffness_at: current}\n" TIME("0.01", "0.01");
  const double wider = 3e-9, step = wider / 16;
  double along = 0, expected = 0;
  for (int k = -1; k < 4; k++) {
    moved m = begin(text, NULL, 0, FLESH_METHOD_BACKWARD_EULER);
    double *by = calloc(4 * (size_t)m.n, sizeof *by), *start = by + 2 * m.n;
    for (int d = 0; d < m.n; d++) m.state.x[d] *= 1 + wider * (1 + (k < 0 ? 0 : gradient_at[k] / 16 * cos(d)));
    if (k < 0) CHECK_OK(flesh_trajectory_create(m.integrator, 1e-12, 1000, &m.trajectory));
    run(&m);
    const double Q = quantity(&m, by);
    if (k >= 0) expected += gradient_weights[k] * Q / step;
    else CHECK_OK(flesh_trajectory_gradient(m.trajectory, &(flesh_motion_quantity){.by_x = by, .by_v = by + m.n}, 0,
                                            (flesh_parameter[1]){{.difference = 0}}, by, start));
    for (int d = 0; d < m.n && k < 0; d++) along += start[d] * cos(d) * flesh_mesh_positions(flesh_scene_mesh(m.scene))[d];
    free(by);
    end(&m);
  }
  printf("# beside a kink: %.10g, off by %.1e\n", along, fabs(along / expected - 1));
  CHECK_NEAR(along, expected, 1e-6 * fabs(expected));
}

static void incompressible_bodies_have_gradients(void)
{
  for (int k = 0; flesh_method_name((flesh_method)k); k++)
    if (is_fixed_step((flesh_method)k)) try_case(&incompressible, (flesh_method)k);
}

static void sequences_of_equilibria_have_gradients(void)
{
  for (size_t k = 0; k < sizeof equilibria / sizeof *equilibria; k++) try_case(&equilibria[k], FLESH_METHOD_STATIC);
}

static void what_has_no_gradient_is_refused(void)
{
  moved m = begin(swing.text, NULL, 0, FLESH_METHOD_IDA);
  CHECK(flesh_trajectory_create(m.integrator, 1e-10, 1000, &m.trajectory) == FLESH_ERR_ARGUMENT && !m.trajectory);
  CHECK_TEXT(flesh_error_text(), "ida has no sensitivities");
  end(&m);
  m = begin(swing.text, NULL, 0, FLESH_METHOD_BDF2);
  gradient_parameter young = gradient_parameter_of(swing.text, swing.keys[0]);
  double *dx = calloc(2 * (size_t)m.n, sizeof *dx), gradient = 0;
  const flesh_motion_quantity quantity = {.by_x = dx};
  CHECK_OK(flesh_trajectory_create(m.integrator, 1e-10, 1000, &m.trajectory));
  CHECK(flesh_trajectory_tangent(m.trajectory, &young.parameter, dx, dx + m.n) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_trajectory_gradient(m.trajectory, &quantity, 1, &young.parameter, &gradient, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "recorded no step");
  run(&m);
  CHECK(flesh_trajectory_gradient(m.trajectory, &quantity, -1, &young.parameter, &gradient, NULL) == FLESH_ERR_ARGUMENT);
  const flesh_motion_quantity odd = {.by_x = dx, .over = (flesh_over)3};
  CHECK(flesh_trajectory_gradient(m.trajectory, &odd, 1, &young.parameter, &gradient, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "quantity->over is number 3");
  for (int k = 0; k < 3; k++) { /* without any system, and without one on either side */
    flesh_parameter lacking = young.parameter;
    for (int j = 0; j < 4; j++) lacking.systems[j] = k && j == 3 - k ? young.parameter.systems[j] : NULL;
    CHECK(flesh_trajectory_gradient(m.trajectory, &quantity, 1, &lacking, &gradient, NULL) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "a parameter lacks systems");
  }
  gradient_parameter_clear(&young);
  free(dx);
  end(&m);
}

/* Returns the status of a tangent by a time at which methods of order 2 cut their steps. */
static int by_a_time(const char *text, gradient_key key, flesh_method method)
{
  moved m = begin(text, NULL, 0, method);
  gradient_parameter turn = gradient_parameter_of(text, key);
  double *dx = calloc(2 * (size_t)m.n, sizeof *dx);
  CHECK_OK(flesh_trajectory_create(m.integrator, 1e-10, 1000, &m.trajectory));
  run(&m);
  const int status = flesh_trajectory_tangent(m.trajectory, &turn.parameter, dx, dx + m.n);
  gradient_parameter_clear(&turn);
  free(dx);
  end(&m);
  return status;
}

static void times_at_which_something_turns_are_refused(void)
{
  static const char loaded[] = BODY "young: 1e4, poisson: 0.4}}\neffects:\n  - inertia: {}\n" CLAMP
                               "  - force: {nodes: [63], force: [0, 0.09, 0], amplitude: [{time: 0, value: 0}, "
                               "{time: 0.055, value: 1}, {time: 0.13, value: 2}]}\n" TIME("0.01", "0.1");
  const gradient_key motion = {"effects.prescribed_motion.motion[1].time", 0.035, 1e-4, 1e-5},
                     within = {"effects.force.amplitude[1].time", 0.055, 1e-4, 1e-5},
                     after_the_end = {"effects.force.amplitude[2].time", 0.13, 1e-4, 1e-5};
  CHECK_OK(by_a_time(loaded, within, FLESH_METHOD_BACKWARD_EULER));
  const flesh_method cut[] = {FLESH_METHOD_NEWMARK, FLESH_METHOD_BDF2, FLESH_METHOD_MIDPOINT, FLESH_METHOD_RUNGE_KUTTA};
  for (int k = 0; k < 4; k++) {
    CHECK(by_a_time(driven.text, motion, cut[k]) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "changes the time 0.035 s");
    CHECK(by_a_time(loaded, within, cut[k]) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "changes the time 0.055 s");
    CHECK_OK(by_a_time(loaded, after_the_end, cut[k]));
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(gradients_by_every_method), TEST(gradients_of_every_kind), TEST(no_difference_crosses_a_kink),
                   TEST(incompressible_bodies_have_gradients), TEST(sequences_of_equilibria_have_gradients), TEST(what_has_no_gradient_is_refused),
                   TEST(times_at_which_something_turns_are_refused));
}
