// TEST quick seconds=60
/* test_energy.c: external work against closed forms, for every method; spurious energy is reported and ends a step;
 * bodies that are merely moved, pushed, rubbed, inflated or at rest show none. */
#include <stdlib.h>

#include "body.h"
#include "methods.h"
#include "test.h"
#include "time/method.h"

/* Every fixed-step method, and adaptive last: filled in by main. */
enum { METHODS_LIMIT = 64 };
static flesh_method methods[METHODS_LIMIT];
static int method_count;

static void find_methods(void)
{
  for_every_method(method, TEST_FIXED_STEPS) methods[method_count++] = method;
  methods[method_count++] = FLESH_METHOD_IDA;
}

static flesh_integrator *integrator_of(const test_body *b, flesh_method method)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.max_step = 0.02; /* a prescribed motion causes no error that would limit the step */
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  return integrator;
}

static void add(test_body *b, flesh_effect *effect) { CHECK_OK(flesh_system_add_effect(b->system, &effect)); }

static void add_contact(test_body *b, flesh_obstacle *obstacle, double thickness, double friction)
{
  flesh_contact_options options;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&options);
  options.thickness = thickness;
  options.friction = friction;
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, &options, &obstacle, &effect));
  add(b, effect);
}

static flesh_obstacle *floor_at(double z, const flesh_motion *motion)
{
  flesh_obstacle *o = NULL;
  CHECK_OK(flesh_obstacle_plane((double[]){0, 0, z}, (double[]){0, 0, 1}, &o));
  if (motion) CHECK_OK(flesh_obstacle_move(o, motion));
  return o;
}

static void cube(int cells, double size, double young, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.45, &material));
  CHECK_OK(test_body_create(test_box(cells, cells, cells, size, size, size), material, 1000, FLESH_MASS_LUMPED, 1, b));
}

/* A body with all nodes following x(t) = X + (3 s^2 - 2 s^3) e_x, s = t/1 s: the reactions' work is its kinetic energy,
 * M (6 s - 6 s^2)^2 / 2, and all of it is returned; also if backward Euler replaces steps that seem to gain energy. */
static void reactions_work_as_much_as_the_body_moves(void)
{
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {1, {1, 0, 0}, {0}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys, .smooth = 1};
  for (int m = 0; m < method_count; m++) {
    double worst[3] = {0, 0, 0};
    int damped = 0;
    for (int run = 0; run < 3; run++) {
      flesh_solve_stats stats = {0};
      test_body b;
      cube(2, 1, 1e5, &b);
      int nodes[27];
      for (int i = 0; i < 27; i++) nodes[i] = i;
      CHECK_OK(flesh_system_add_prescribed_motion(b.system, 27, nodes, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
      CHECK_OK(flesh_system_finalize(b.system));
      flesh_integrator *integrator = integrator_of(&b, methods[m]);
      CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, run < 2 ? INFINITY : 1e-3));
      const int steps = run == 1 ? 80 : 40;
      for (int k = 1; k <= steps; k++) {
        CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / steps, &stats));
        const double s = b.state.t, v = 6 * s - 6 * s * s;
        worst[run] = fmax(worst[run], fabs(flesh_integrator_energy_balance(integrator)->supplied - 500 * v * v));
      }
      CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 1e-2);
      CHECK(flesh_integrator_warning(integrator) == NULL);
      damped = stats.damped_steps;
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
    printf("# %s: work of reactions off by %.3g and %.3g of 1125 J, by %.3g where %d steps are damped\n",
           flesh_method_name(methods[m]), worst[0], worst[1], worst[2], damped);
    for (int run = 0; run < 3; run += 2)
      CHECK_BELOW(worst[run], flesh_method_order(methods[m]) == 1 ? 160 : methods[m] == FLESH_METHOD_IDA ? 1e-9 : 6);
    CHECK(methods[m] != FLESH_METHOD_NEWMARK || damped > 0);
    if (methods[m] != FLESH_METHOD_IDA) CHECK_BELOW(worst[1], flesh_method_order(methods[m]) == 1 ? 0.6 * worst[0] : 0.3 * worst[0]);
  }
}

/* Returns the sum of the effects' energies. */
static double energy_of(const test_body *b)
{
  double *zeros = calloc((size_t)b->n, sizeof *zeros), energies[8], sum = 0;
  const flesh_point point = flesh_point_at(b->state.t, b->state.x, b->state.v, zeros);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  for (int e = 0; e < flesh_system_effect_count(b->system); e++) sum += energies[e];
  free(zeros);
  return sum;
}

/* Returns the largest difference of work and energy, as a fraction of the largest energy, of a cube with all nodes
 * prescribed for 2 s, shown in this many steps: thrown and turned as a whole or, if `pressed`, one side moved against
 * the other. */
static double prescribe_all(flesh_method method, int control, int pressed, int steps, double *gain)
{
  const flesh_keyframe thrown[] = {{0, {0}, {0}}, {0.7, {1, 0.5, 0}, {0.3, 2, 0.5}}, {2, {0.5, 2, 1}, {0, 1, -1}}};
  const flesh_keyframe turned[] = {{0, {0}, {0}}, {0.7, {-0.3, 0, 0}, {0.4, 0, 0}}, {2, {0.2, 0.1, 0}, {-0.8, 0, 0}}};
  const flesh_motion whole = {.count = 3, .keyframes = thrown, .smooth = 1};
  const flesh_motion side = {.count = 3, .keyframes = turned, .smooth = 1};
  flesh_adaptive_options adaptive;
  double worst = 0, most = 0;
  test_body b;
  cube(1, 1, 1e5, &b);
  if (pressed) {
    CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
    CHECK_OK(test_body_hold(&b, 0, 1, FLESH_AXES_ALL, &side, -INFINITY, INFINITY));
  } else {
    CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, &whole, -INFINITY, INFINITY));
    CHECK_OK(test_body_hold(&b, 0, 1, FLESH_AXES_ALL, &whole, -INFINITY, INFINITY));
  }
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, method);
  flesh_adaptive_options_default(&adaptive);
  adaptive.tolerance = 1e-2;
  adaptive.control = control;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  const double begin = energy_of(&b);
  for (int k = 1; k <= steps; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 2. / steps, NULL));
    const double energy = energy_of(&b) - begin;
    worst = fmax(worst, fabs(flesh_integrator_energy_balance(integrator)->supplied - energy));
    most = fmax(most, energy);
  }
  *gain = flesh_integrator_energy_balance(integrator)->gain;
  CHECK(flesh_integrator_warning(integrator) == NULL);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return worst / most;
}

/* The energy of a body with a completely prescribed motion is known, and the work is its change. The adaptive methods,
 * which have no error to limit their steps then, are asked for few states and for many. */
static void work_is_the_energy_of_what_is_prescribed(void)
{
  for (int m = 0; m < method_count; m++)
    for (int pressed = 0; pressed < 2; pressed++) {
      const int is_adaptive = !flesh_method_order(methods[m]), first = flesh_method_order(methods[m]) == 1;
      double gain[2];
      const double coarse = prescribe_all(methods[m], 0, pressed, is_adaptive ? 3 : 200, &gain[0]),
                   fine = prescribe_all(methods[m], 0, pressed, is_adaptive ? 50 : 400, &gain[1]);
      printf("# %s, %s: work off by %.2g and %.2g of the energy, gain %.2g and %.2g\n", flesh_method_name(methods[m]),
             pressed ? "pressed" : "thrown", coarse, fine, gain[0], gain[1]);
      CHECK_BELOW(fmax(gain[0], gain[1]), 5e-3);
      CHECK_BELOW(fine, first ? 0.2 : 5e-3);
      if (is_adaptive) CHECK_BELOW(coarse, 5e-3);
      else CHECK_BELOW(fine, (first ? 0.7 : 0.4) * coarse);
    }
}

/* Adaptive steps of other methods do so as well, to half a percent at a tolerance of 1e-2, however few states are asked
 * for. */
static void work_is_known_where_errors_choose_steps(void)
{
  for (int m = 0; m < method_count; m++)
    for (int pressed = 0; pressed < 2; pressed++) {
      const flesh_method method = methods[m];
      double gain[2];
      if (!flesh_method_controlled(method)) continue;
      const double few = prescribe_all(method, 1, pressed, 3, &gain[0]), many = prescribe_all(method, 1, pressed, 50, &gain[1]);
      printf("# %s, %s: work off by %.2g and %.2g of the energy, gain %.2g and %.2g\n", flesh_method_name(method),
             pressed ? "pressed" : "thrown", few, many, gain[0], gain[1]);
      CHECK_BELOW(fmax(few, many), 5e-3);
      CHECK_BELOW(fmax(gain[0], gain[1]), 2e-3);
    }
}

/* A viscous bar whose ends are pressed together and drawn apart again: the work is what viscosity dissipates, and
 * nothing is gained. All of its nodes are prescribed, so that all methods have the same motion. */
static void pressing_a_viscous_bar_gains_nothing(void)
{
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {0.2, {-0.8, 0, 0}, {0}}, {0.6, {-0.8, 0, 0}, {0}}, {0.8, {0}, {0}}};
  const flesh_motion motion = {.count = 4, .keyframes = keys, .smooth = 1};
  double work[METHODS_LIMIT];
  for (int m = 0; m < method_count; m++) {
    test_body b;
    flesh_material material;
    flesh_effect *effect = NULL;
    flesh_adaptive_options adaptive;
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
    CHECK_OK(test_body_create(test_box(1, 1, 1, 4, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_effect_viscosity(&b.body, 500, 500, &effect));
    add(&b, effect);
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(test_body_hold(&b, 0, 4, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    flesh_adaptive_options_default(&adaptive);
    adaptive.tolerance = 1e-2;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    const int steps = flesh_method_order(methods[m]) ? 320 : 40;
    for (int k = 0; k < steps; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.8 / steps, NULL));
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    work[m] = balance->supplied;
    printf("# %s: the ends work %.1f J, gain %.2g\n", flesh_method_name(methods[m]), work[m], balance->gain);
    CHECK_BELOW(balance->gain, 5e-3);
    CHECK(flesh_integrator_warning(integrator) == NULL);
    if (m > 1) CHECK_NEAR(work[m], work[1], 5e-3 * work[1]);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* 1 kg on a spring of k = w^2 whose end is pulled away at c: x = c t - c/w sin(w t), and the work of the pull is m c^2
 * (1 - cos(w t)). A tet without elasticity, suspended at its centroid. */
static void a_moving_spring_works_as_an_oscillator_says(void)
{
  const double X[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, w = 10, c = 2, h = 0.01;
  const flesh_keyframe keys[] = {{0, {0.25, 0.25, 0.25}, {0}}, {2, {0.25 + 2 * 2, 0.25, 0.25}, {0}}};
  for (int m = 0; m < method_count; m++) {
    test_body b = {.n = 12};
    double worst = 0;
    CHECK_OK(flesh_mesh_create(4, X, 1, (const int[]){0, 1, 2, 3}, NULL, &b.mesh));
    b.density = malloc(sizeof *b.density);
    b.density[0] = 6;
    b.body = (flesh_body){.mesh = b.mesh, .density = b.density};
    b.state.x = malloc(sizeof X);
    b.state.v = calloc(12, sizeof *b.state.v);
    memcpy(b.state.x, X, sizeof X);
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_system_create(b.mesh, &b.system));
    CHECK_OK(flesh_effect_inertia(&b.body, &effect));
    add(&b, effect);
    CHECK_OK(flesh_effect_spring(&b.body, keys[0].translation, w * w, &(flesh_motion){.count = 2, .keyframes = keys},
                               -INFINITY, INFINITY, &effect));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    for (int k = 1; k <= 150; k++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
      const double work = flesh_integrator_energy_balance(integrator)->supplied;
      worst = fmax(worst, fabs(work - c * c * (1 - cos(w * b.state.t))));
    }
    printf("# %s: work of the spring off by %.3g of 8 J\n", flesh_method_name(methods[m]), worst);
    /* Backward Euler's oscillation decays; the others' only lose their phase. */
    if (m > 0) CHECK_BELOW(worst, methods[m] == FLESH_METHOD_RUNGE_KUTTA ? 3e-4 : 0.45);
    CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 1e-2);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A block of mass m on a belt that starts at c: friction accelerates it with mu g until both are equally fast. The belt
 * moves twice as far as the block meanwhile: its work is m c^2, half of which is dissipated by friction. */
static void a_belt_works_twice_what_the_block_gets(void)
{
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {10, {10 * 0.5, 0, 0}, {0}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  for (int m = 0; m < method_count - 1; m++) {
    test_body b;
    cube(2, 0.1, 1e5, &b);
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    add_contact(&b, floor_at(-0.0021, &motion), 0.002, 0.3);
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_effect_viscosity(&b.body, 30, 30, &effect));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    for (int k = 0; k < 200; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 400, NULL));
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    printf("# %s: the belt works %.4g J, m c^2 = 0.25 J; gain %.2g\n", flesh_method_name(methods[m]), balance->supplied,
           balance->gain);
    CHECK_NEAR(balance->supplied, 0.25, 0.025);
    CHECK_BELOW(balance->gain, 0.05);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A pressure p on one face A of a free block is a follower load without an energy: its work is p A s, with s the
 * block's displacement, which is its kinetic energy, because the block is stiff. */
static void a_follower_load_works_along_its_way(void)
{
  for (int m = 0; m < method_count; m++) {
    test_body b;
    cube(2, 1, 1e7, &b);
    int triangles, count = 0, chosen[24];
    const int *surface = flesh_mesh_surface(b.mesh, &triangles);
    const double *X = flesh_mesh_positions(b.mesh);
    for (int k = 0; k < triangles; k++)
      if (X[3 * surface[3 * k]] + X[3 * surface[3 * k + 1]] + X[3 * surface[3 * k + 2]] < 1e-9)
        memcpy(chosen + 3 * count++, surface + 3 * k, 3 * sizeof *chosen);
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_effect_pressure(&b.body, count, chosen, 2000, NULL, &effect));
    CHECK(effect->operations->energy == NULL);
    add(&b, effect);
    CHECK_OK(flesh_effect_viscosity(&b.body, 1e4, 1e4, &effect));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    for (int k = 0; k < 50; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    /* a = p A / M = 2 m/s^2; s = a t^2/2 = 0.25 m. */
    printf("# %s: the pressure works %.5g J of 500 J; gain %.2g\n", flesh_method_name(methods[m]), balance->supplied,
           balance->gain);
    CHECK_NEAR(balance->supplied, 500, flesh_method_order(methods[m]) == 1 ? 15 : 1);
    CHECK_BELOW(balance->gain, 1e-2);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A force that ends, with a step or within one, removes its potential: its work is then the body's energy. */
static void a_load_that_ends_has_worked_what_is_left(void)
{
  for (int m = 0; m < method_count; m++)
    for (int within = 0; within < 2; within++) {
      const flesh_amplitude amplitude = {.from = -INFINITY, .until = within ? 0.0837 : 0.08};
      test_body b;
      cube(2, 1, 1e5, &b);
      CHECK_OK(test_body_clamp(&b, 1e-9));
      flesh_effect *effect = NULL;
      CHECK_OK(flesh_effect_force(&b.body, 1, (int[]){b.n / 3 - 1}, (double[]){0, 300, -500}, &amplitude, &effect));
      add(&b, effect);
      CHECK_OK(flesh_system_finalize(b.system));
      flesh_integrator *integrator = integrator_of(&b, methods[m]);
      const double begin = energy_of(&b);
      for (int k = 0; k < 40; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.004, NULL));
      const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
      const double energy = energy_of(&b) - begin;
      CHECK(energy > 1);
      CHECK_NEAR(balance->supplied, energy, (flesh_method_order(methods[m]) == 1 ? 0.5 : 0.03) * energy);
      CHECK_BELOW(balance->gain, 1e-2);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* A cube of 1000 kg at rest, all of which moves at 2 m/s from the first step on: its kinetic energy is work. The
 * reactions of backward Euler do twice that. */
static void a_start_with_a_jerk_is_work(void)
{
  const flesh_motion motion = {.count = 2, .keyframes = (flesh_keyframe[]){{0, {0}, {0}}, {1, {2, 0, 0}, {0}}}};
  for (int m = 0; m < method_count; m++) {
    test_body b;
    cube(1, 1, 1e5, &b);
    for (int k = 0; k < 2; k++) CHECK_OK(test_body_hold(&b, 0, k, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    for (int k = 0; k < 5; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    CHECK_NEAR(flesh_integrator_energy_balance(integrator)->supplied,
               flesh_method_order(methods[m]) == 1 ? 4000 : 2000, 1);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A plate that rises under a block, and one that moves away from it: no method reports anything. */
static void what_is_pushed_is_not_told(void)
{
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {0.2, {0, 0, 0.05}, {0}}, {0.4, {0}, {0}}};
  const flesh_motion motion = {.count = 3, .keyframes = keys, .smooth = 1};
  for (int m = 0; m < method_count - 1; m++) {
    test_body b;
    cube(2, 0.1, 1e5, &b);
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    add_contact(&b, floor_at(-0.004, &motion), 0.004, 0);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    for (int k = 0; k < 300; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 1000, NULL));
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    printf("# %s: the plate works %.4g J, gain %.2g\n", flesh_method_name(methods[m]), balance->supplied,
           balance->gain);
    CHECK(balance->supplied > 0.1);
    CHECK_BELOW(balance->gain, 0.05);
    CHECK(flesh_integrator_warning(integrator) == NULL);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A hanging bar that has come to rest stays so for long: no last digits are reported. */
static void rest_is_not_told(void)
{
  for (int m = 0; m < method_count; m++) {
    test_body b;
    cube(2, 1, 1e5, &b);
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(test_body_gravity(&b, 0, 0, -1));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *settling = integrator_of(&b, FLESH_METHOD_STATIC), *integrator = integrator_of(&b, methods[m]);
    CHECK_OK(flesh_integrator_step(settling, &b.state, 0, NULL));
    CHECK(!flesh_integrator_energy_balance(settling)->begun);
    for (int k = 0; k < 200; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.02, NULL));
    CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 0.05);
    flesh_integrator_destroy(&settling);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A block within a barrier's reach, which HHT's first step blows up, and one that midpoint drops on the floor. If gains
 * are limited, steps are cut, or backward Euler replaces them, and there are none. */
static void energy_from_nowhere_cuts_steps(void)
{
  for (int drop = 0; drop < 2; drop++)
    for (int limited = 0; limited < 2; limited++) {
      test_body b;
      flesh_solve_stats stats = {0};
      cube(4, 0.1, 1e5, &b);
      CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
      add_contact(&b, floor_at(drop ? -0.02 : -0.0005, NULL), NAN, 0);
      CHECK_OK(flesh_system_finalize(b.system));
      flesh_integrator *integrator = integrator_of(&b, drop ? FLESH_METHOD_MIDPOINT : FLESH_METHOD_HHT);
      CHECK(flesh_integrator_set_max_energy_gain(integrator, 0) == FLESH_ERR_ARGUMENT);
      CHECK_TEXT(flesh_error_text(), "must be positive");
      if (!limited) CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY));
      int status = FLESH_OK, steps = 0;
      for (; !status && steps < (drop ? 1000 : 10); steps++)
        status = flesh_integrator_step(integrator, &b.state, drop ? 0.001 : 0.01, &stats);
      const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
      const char *warning = flesh_integrator_warning(integrator);
      printf("# %s: %s after %d steps: %s\n", drop ? "drop" : "block", flesh_status_name(status), steps,
             warning ? warning : "no warning");
      CHECK(status == FLESH_OK && balance->supplied == 0);
      if (limited) {
        CHECK(balance->gain < 0.2 && stats.rejected > 0 && stats.convergence_failures == 0);
        CHECK(drop || stats.damped_steps > 0);
      } else {
        CHECK(balance->gain > 0.5 && balance->largest > 0.5 * balance->scale);
        CHECK(stats.rejected == 0 && stats.damped_steps == 0);
        CHECK_TEXT(warning ? warning : "", "although nothing put it in");
        CHECK(balance->worst_tet >= 0 && balance->fastest_node >= 0 && balance->t_largest > balance->t_least);
      }
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* A cube hits a plane so slowly that its strain is hardly a tolerance: adaptive steps gain no more than they may, and
 * report their gain. */
static void slow_impacts_gain_little_and_tell_it(void)
{
  for (int m = 0; m < method_count; m++) {
    flesh_adaptive_options adaptive;
    test_body b;
    if (!flesh_method_controlled(methods[m]) || flesh_method_order(methods[m]) == 1) continue;
    cube(2, 0.1, 1e5, &b);
    add_contact(&b, floor_at(-0.002, NULL), 0.0005, 0);
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 2; d < b.n; d += 3) b.state.v[d] = -0.05;
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    flesh_adaptive_options_default(&adaptive);
    adaptive.tolerance = 1e-2;
    adaptive.control = 1;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    double least = energy_of(&b);
    for (int k = 0; k < 12; k++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.02, NULL));
      least = fmin(least, energy_of(&b));
    }
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    const double gained = (energy_of(&b) - least) / balance->scale;
    printf("# %s: gains %.3g, tells %.3g\n", flesh_method_name(methods[m]), gained, balance->gain);
    CHECK_BELOW(gained, 0.011);
    CHECK_BELOW(0.95 * gained, balance->gain + 1e-6);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A bar in strong wind, to which residuals at their tolerance would add energy: its stages are solved more accurately,
 * rather than all its steps halved. */
static void what_residuals_gain_is_solved_deeper(void)
{
  test_body b;
  flesh_material material;
  flesh_solve_stats stats = {0};
  flesh_adaptive_options adaptive;
  flesh_effect *drag = NULL;
  int count;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.3, &material));
  CHECK_OK(test_body_create(test_box(6, 2, 2, 0.3, 0.1, 0.1), material, 1000, FLESH_MASS_LUMPED, 1, &b));
  const int *triangles = flesh_mesh_surface(b.mesh, &count);
  CHECK_OK(flesh_effect_drag(&b.body, count, triangles, 50, (double[]){4, 3, 0}, 1, &drag));
  add(&b, drag);
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 2; d < b.n; d += 3) b.state.v[d] = flesh_mesh_positions(b.mesh)[d - 2] > 0 ? 2 : 0;
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_NEWMARK);
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = 1;
  adaptive.tolerance = 1e-2;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  for (int k = 0; k < 36; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
  const double gain = flesh_integrator_energy_balance(integrator)->gain;
  printf("# %d steps, %d rejected, %d Newton iterations; gain %.3g\n", stats.steps, stats.rejected, stats.newton, gain);
  CHECK(stats.rejected > 2 && stats.rejected < stats.steps / 10);
  CHECK_BELOW(gain, 0.011);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Drops a block on a floor this far below by IDA at a loose tolerance; returns what its last step reports. */
static int drop_by_ida(double depth, int order, test_body *b, flesh_integrator **integrator)
{
  cube(4, 0.1, 1e5, b);
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  add_contact(b, floor_at(-depth, NULL), NAN, 0);
  CHECK_OK(flesh_system_finalize(b->system));
  *integrator = integrator_of(b, FLESH_METHOD_IDA);
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.max_order = order;
  adaptive.tolerance = 0.1;
  CHECK_OK(flesh_integrator_set_adaptive(*integrator, &adaptive));
  int status = FLESH_OK, steps = 0;
  for (; !status && steps < 1000; steps++) status = flesh_integrator_step(*integrator, &b->state, 0.001, NULL);
  printf("# %s after %d steps: %s\n", flesh_status_name(status), steps, status ? flesh_error_text() : "");
  return status;
}

/* IDA's steps are not cut for a gain: if order 4 adds energy to a bouncing block, the run ends. */
static void energy_from_nowhere_ends_a_step(void)
{
  test_body b;
  flesh_integrator *integrator;
  const int status = drop_by_ida(0.1, 4, &b, &integrator);
  const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
  const flesh_failure *failure = flesh_integrator_failure(integrator);
  CHECK(status == FLESH_ERR_ENERGY && balance->gain > 0.5 && balance->t_largest > balance->t_least);
  CHECK(failure->status == FLESH_ERR_ENERGY && failure->t > 0 && failure->worst_tet >= 0);
  CHECK(test_all_finite(b.n, b.state.x));
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Its iterations resolve gaps of contact, however loose the tolerance: otherwise order 5 adds energy to the block
 * here. */
static void iterations_of_ida_resolve_gaps(void)
{
  test_body b;
  flesh_integrator *integrator;
  CHECK_OK(drop_by_ida(0.02, 5, &b, &integrator));
  CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 0.05);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Energies known for a run's state are not used for one in which two numbers are exchanged. */
static void energies_belong_to_one_state(void)
{
  for (int m = 0; m < method_count; m++) {
    test_body b;
    CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -2));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, methods[m]);
    b.state.v[0] = 1;
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    CHECK(flesh_integrator_energies(integrator, &b.state));
    for (int back = 0; back < 2; back++) {
      const double first = b.state.v[0];
      b.state.v[0] = b.state.v[8], b.state.v[8] = first;
      CHECK(!back == !flesh_integrator_energies(integrator, &b.state));
    }
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  find_methods();
  return RUN_TESTS(argc, argv, TEST(reactions_work_as_much_as_the_body_moves),
                   TEST(work_is_the_energy_of_what_is_prescribed), TEST(work_is_known_where_errors_choose_steps), TEST(pressing_a_viscous_bar_gains_nothing),
                   TEST(a_moving_spring_works_as_an_oscillator_says), TEST(a_belt_works_twice_what_the_block_gets),
                   TEST(a_follower_load_works_along_its_way), TEST(a_load_that_ends_has_worked_what_is_left),
                   TEST(a_start_with_a_jerk_is_work), TEST(what_is_pushed_is_not_told), TEST(rest_is_not_told),
                   TEST_LONG(energy_from_nowhere_cuts_steps), TEST(slow_impacts_gain_little_and_tell_it),
                   TEST(what_residuals_gain_is_solved_deeper),
                   TEST(energy_from_nowhere_ends_a_step),
                   TEST(iterations_of_ida_resolve_gaps), TEST(energies_belong_to_one_state));
}
