// TEST full seconds=120
/* test_incompressible_motion.c: incompressible bodies in motion: volumes, momenta and energy are conserved, methods
 * have their orders, states can be resumed. */
#include "temporary.h"

#include <stdlib.h>

#include "flesh/observer.h"
#include "incompressible.h"
#include "methods.h"
#include "time/method.h"

static double energy_of(const test_body *b)
{
  double energies[4], sum = 0;
  flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  point.multipliers = b->state.multipliers;
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  for (int e = 0; e < flesh_system_effect_count(b->system); e++) sum += energies[e];
  return sum;
}

/* Volumes are conserved at every step's end by all methods, momenta by all (angular ones exactly by the midpoint rule),
 * and the energy up to the order by those without damping. */
static void motion_keeps_what_it_must(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    test_body b;
    double first[6], last[6], gap = 0, turn = 0, drift = 0;
    flesh_solve_stats stats = {0};
    throw_block(&b);
    flesh_integrator *integrator = integrator_of(&b, method, 1e-10, 1);
    test_momenta(&b, first);
    const double E0 = energy_of(&b);
    double rest;
    for (int k = 0; k < 30; k++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 120, &stats));
      gap = fmax(gap, largest_gap(&b));
    }
    test_momenta(&b, last);
    for (int c = 0; c < 3; c++) {
      drift = fmax(drift, fabs(last[c] - first[c]));
      turn = fmax(turn, fabs(last[3 + c] - first[3 + c]));
    }
    rest = energy_of(&b) - E0;
    const double kinetic = 250. * 9 / 2;
    printf("# %s: volumes to %.1g, momentum to %.1g N s, angular momentum to %.2g N m s of %.3g, energy %+.3g J of about "
           "%.3g J; %.3g updates a step\n",
           flesh_method_name(method), gap, drift, turn, test_norm(3, first + 3), rest, kinetic,
           stats.multiplier_updates / 30.);
    CHECK_BELOW(gap, 1e-10);
    CHECK_BELOW(drift, 1e-8 * 250);
    if (method == FLESH_METHOD_MIDPOINT) {
      CHECK_BELOW(turn, 1e-6 * test_norm(3, first + 3));
      CHECK_BELOW(fabs(rest), 1e-3 * kinetic);
    }
    if (method == FLESH_METHOD_NEWMARK) CHECK_BELOW(fabs(rest), 1e-2 * kinetic);
    CHECK_BELOW(rest, 1e-2 * kinetic);
    CHECK(flesh_integrator_energy_balance(integrator)->gain < 0.05);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* A free body, solved no more tightly than by default, keeps its velocity to round-off from its first step on. */
static void flight_is_free(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    test_body b;
    double off = 0;
    throw_block(&b);
    for (int d = 0; d < b.n; d++) b.state.v[d] = d % 3 - 2;
    flesh_integrator *integrator = integrator_of(&b, method, 1e-4, 1);
    for (int k = 0; k < 3; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    for (int d = 0; d < b.n; d++) off = fmax(off, fabs(b.state.v[d] - d % 3 + 2));
    printf("# %s: %.2g m/s\n", flesh_method_name(method), off);
    CHECK_BELOW(off, 1e-10);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* Computes the positions x [n] at 1/4 s of a clamped bar that begins to swing. */
static void swing(flesh_method method, int steps, double *x)
{
  test_body b;
  make(test_box(4, 1, 1, 2, 0.5, 0.5), test_material(FLESH_ENERGY_S, 0.5), 1, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -4));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, method, 1e-9, 1);
  for (int k = 0; k < steps; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.25 / steps, NULL));
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

/* Halved steps have a quarter of the error with methods of order 2, a half with backward Euler. Runge-Kutta's order is
 * 2.83 here, and 2.94 with half of these steps. */
static void methods_have_their_orders(void)
{
  static double exact[6000], x[2][6000];
  flesh_mesh *raised = NULL, *box = test_box(4, 1, 1, 2, 0.5, 0.5);
  CHECK_OK(flesh_mesh_raise_order(box, &raised));
  const int n = 3 * flesh_mesh_node_count(raised);
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&raised);
  CHECK(n <= 6000);
  swing(FLESH_METHOD_RUNGE_KUTTA, 160, exact);
  for_every_method(method, TEST_FIXED_STEPS) {
    const int order = flesh_method_order(method);
    swing(method, 20, x[0]);
    swing(method, 40, x[1]);
    const double coarse = test_distance(n, x[0], exact), fine = test_distance(n, x[1], exact);
    printf("# %s: %.3g m, %.3g m: order %.2f\n", flesh_method_name(method), coarse, fine, log2(coarse / fine));
    CHECK_NEAR(log2(coarse / fine), order, order == 2 ? 0.35 : 0.2);
  }
}

/* Makes a viscous clamped bar whose velocity changes its volume, as motions may start, and its integrator: with
 * adaptive steps if there is a tolerance. */
static flesh_integrator *expanding(flesh_method method, double tolerance, test_body *b)
{
  flesh_effect *viscosity = NULL;
  make(test_box(4, 1, 1, 2, 0.5, 0.5), test_material(FLESH_ENERGY_S, 0.5), 1, b);
  CHECK_OK(flesh_effect_viscosity(&b->body, 100, 100, &viscosity));
  CHECK_OK(flesh_system_add_effect(b->system, &viscosity));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int d = 0; d < b->n; d += 3) b->state.v[d] = b->state.x[d] / 2;
  flesh_integrator *integrator = integrator_of(b, method, tolerance > 0 ? 1e-4 : 1e-9, 1);
  if (tolerance > 0) test_control(integrator, tolerance);
  return integrator;
}

/* Computes its positions after 1/20 s, x [n]. */
static void expand(flesh_method method, double tolerance, double *x, flesh_solve_stats *stats)
{
  test_body b;
  flesh_integrator *integrator = expanding(method, tolerance, &b);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, stats));
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

/* The divergence of a velocity vanishes at once, whatever the method and the tolerance: errors that it left would not
 * fall with the step, nor do those of a start longer than the tolerance allows. Viscous forces by the divergence must
 * not hinder the solve of a start: with them it takes 300 iterations. */
static void velocities_lose_their_divergence(void)
{
  static double exact[6000], x[6000];
  expand(FLESH_METHOD_RUNGE_KUTTA, 1e-7, exact, NULL);
  for_every_method(method, TEST_FIXED_STEPS) {
    if (!flesh_method_controlled(method)) continue;
    for (int is_fine = 0; is_fine <= (flesh_method_order(method) > 1); is_fine++) {
      flesh_solve_stats stats = {0};
      expand(method, is_fine ? 1e-5 : 1e-2, x, &stats);
      const double error = test_distance(405, x, exact);
      printf("# %s: %d steps, %d Newton iterations, %.2g m off\n", flesh_method_name(method), stats.steps, stats.newton, error);
      CHECK_BELOW(stats.newton, is_fine ? 1200 : 120);
      CHECK_BELOW(error, !is_fine ? 2e-3 : method == FLESH_METHOD_RUNGE_KUTTA ? 2e-6 : 2e-7);
    }
  }
}

/* Fixed steps do so as well: no tet's volume keeps a rate of change, such as half of one per second at the start. */
static void fixed_steps_lose_it(void)
{
  const double brief = 1e-6; /* s */
  for_every_method(method, TEST_FIXED_STEPS) {
    test_body b;
    flesh_integrator *integrator = expanding(method, 0, &b);
    for (int k = 0; k < 12; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.0025, NULL));
    for (int d = 0; d < b.n; d++) b.state.x[d] += brief * b.state.v[d];
    const double rate = largest_gap(&b) / brief;
    printf("# %s: %.2g of a volume in a second\n", flesh_method_name(method), rate);
    CHECK_BELOW(rate, 1e-3);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* Gaps of constraints at the start close within the first step, not at once: otherwise nodes would be thrown. */
static void gaps_at_the_start_throw_nothing(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    test_body b;
    double fastest = 0;
    flesh_integrator *integrator = expanding(method, 0, &b);
    for (int d = 0; d < b.n; d++) b.state.v[d] = 0;
    for (int d = 0; d < b.n; d += 3) b.state.x[d] *= 1.05; /* by a tenth of 2 m */
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    for (int d = 0; d < b.n; d++) fastest = fmax(fastest, fabs(b.state.v[d]));
    printf("# %s: %.2g m/s, gaps %.2g\n", flesh_method_name(method), fastest, largest_gap(&b));
    CHECK_BELOW(fastest, 3);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* Multipliers are part of the state: a file keeps them, and a run from it has the same bits as the one that wrote it,
 * for any number of threads; without them the first step must find them again. */
static void states_go_on(void)
{
  char folder[200], path[220];
  CHECK(!test_folder_make(folder, sizeof folder));
  snprintf(path, sizeof path, "%s/state.txt", folder);
  test_body b;
  flesh_solve_stats stats[3] = {{0}};
  throw_block(&b);
  const int tets = b.state.multiplier_count;
  const size_t bytes = (size_t)b.n * sizeof(double), p_bytes = (size_t)tets * sizeof(double);
  flesh_integrator *first = integrator_of(&b, FLESH_METHOD_NEWMARK, 1e-8, 1);
  for (int k = 0; k < 6; k++) CHECK_OK(flesh_integrator_step(first, &b.state, 1. / 120, NULL));
  flesh_integrator_destroy(&first);
  CHECK_OK(flesh_state_write(path, b.n / 3, &b.state));
  flesh_state states[3];
  for (int s = 0; s < 3; s++) {
    states[s] = (flesh_state){.x = malloc(bytes), .v = malloc(bytes), .multipliers = malloc(p_bytes),
                              .multiplier_count = tets};
    CHECK_OK(flesh_state_read(path, b.n / 3, &states[s]));
    CHECK(!memcmp(states[s].multipliers, b.state.multipliers, p_bytes) && states[s].t == b.state.t);
  }
  memcpy(states[1].x, b.state.x, bytes);
  memcpy(states[1].v, b.state.v, bytes);
  memset(states[2].multipliers, 0, p_bytes);
  for (int s = 0; s < 3; s++) {
    flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_NEWMARK, 1e-8, s == 1 ? 3 : 1);
    for (int k = 0; k < 3; k++) CHECK_OK(flesh_integrator_step(integrator, &states[s], 1. / 120, &stats[s]));
    flesh_integrator_destroy(&integrator);
  }
  CHECK(!memcmp(states[0].x, states[1].x, bytes) && !memcmp(states[0].v, states[1].v, bytes) &&
        !memcmp(states[0].multipliers, states[1].multipliers, p_bytes));
  /* The first step finds its pressures itself: those of the state are its initial guess. */
  printf("# without its multipliers a state is off by %.2g m after three steps, with %d updates for %d\n",
         test_distance(b.n, states[0].x, states[2].x), stats[2].multiplier_updates, stats[0].multiplier_updates);
  CHECK_BELOW(test_distance(b.n, states[0].x, states[2].x), 1e-8);
  CHECK(stats[2].multiplier_updates >= stats[0].multiplier_updates);
  flesh_state bare = {.x = states[2].x, .v = states[2].v};
  CHECK_OK(flesh_state_read(path, b.n / 3, &bare));
  states[0].multiplier_count--;
  CHECK(flesh_state_read(path, b.n / 3, &states[0]) == FLESH_ERR_FILE);
  CHECK_TEXT(flesh_error_text(), "one for each of the mesh's");
  for (int s = 0; s < 3; s++) free(states[s].x), free(states[s].v), free(states[s].multipliers);
  test_folder_remove(folder);
  destroy(&b);
}

static int see_energies(void *data, const flesh_step_record *record)
{
  *(double *)data = record->energies[0];
  CHECK(record->state->multiplier_count == flesh_mesh_tet_count(flesh_system_mesh(record->system)));
  CHECK(!record->step || record->state->multipliers[0] != 0);
  return FLESH_OK;
}

/* The energies of states that leave the pressures to the integrator are known, also in runs, whose observers see both. */
static void states_need_no_pressures(void)
{
  test_body b;
  double energy = NAN;
  throw_block(&b);
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_NEWMARK, 1e-6, 1);
  flesh_state state = {.x = b.state.x, .v = b.state.v};
  const flesh_observer observer = {see_energies, &energy};
  const flesh_run_options options = {.h = 0.01, .end = 0.03, .observer_count = 1, .observers = &observer};
  CHECK_OK(flesh_integrator_step(integrator, &state, 0.01, NULL));
  const double *known = flesh_integrator_energies(integrator, &state);
  CHECK(known && known[0] > 0);
  CHECK(!flesh_integrator_energies(integrator, &(flesh_state){state.t, state.x, state.v, state.x, 1, NULL, 0}));
  CHECK_OK(flesh_run(b.system, integrator, &options, &state, NULL));
  CHECK(energy > 0 && state.t == 0.03);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

/* Equilibria along a prescribed motion: a run that is stopped and resumed from its file has the bits of an
 * uninterrupted one. */
static void equilibria_go_on_with_the_same_bits(void)
{
  const flesh_keyframe frames[2] = {{0}, {.t = 1, .translation = {0.3, 0, 0.2}}};
  char folder[200], path[220];
  CHECK(!test_folder_make(folder, sizeof folder));
  snprintf(path, sizeof path, "%s/state.txt", folder);
  test_body b;
  make(test_box(4, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.5), 0, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(test_body_hold(&b, 0, 2, FLESH_AXES_ALL, &(flesh_motion){.count = 2, .keyframes = frames}, -INFINITY,
                          INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  const size_t bytes = (size_t)b.n * sizeof(double), p_bytes = (size_t)b.state.multiplier_count * sizeof(double);
  flesh_state again = {.x = malloc(bytes), .v = malloc(bytes), .multipliers = malloc(p_bytes),
                       .multiplier_count = b.state.multiplier_count};
  flesh_integrator *whole = integrator_of(&b, FLESH_METHOD_STATIC, 1e-8, 1), *rest;
  for (int k = 0; k < 4; k++) {
    CHECK_OK(flesh_integrator_step(whole, &b.state, 0.25, NULL));
    if (k == 1) CHECK_OK(flesh_state_write(path, b.n / 3, &b.state));
  }
  CHECK_OK(flesh_state_read(path, b.n / 3, &again));
  rest = integrator_of(&b, FLESH_METHOD_STATIC, 1e-8, 1);
  for (int k = 0; k < 2; k++) CHECK_OK(flesh_integrator_step(rest, &again, 0.25, NULL));
  CHECK(!memcmp(again.x, b.state.x, bytes) && !memcmp(again.multipliers, b.state.multipliers, p_bytes));
  flesh_integrator_destroy(&whole);
  flesh_integrator_destroy(&rest);
  free(again.x), free(again.v), free(again.multipliers);
  test_folder_remove(folder);
  destroy(&b);
}

/* Computes the positions, x [n], of a clamped bar whose end load is removed at `until`, s, and its Newton
 * iterations. */
static int let_go(flesh_method method, int controlled, double until, double *x)
{
  test_body b;
  flesh_effect *force = NULL;
  flesh_solve_stats stats = {0};
  make(test_box(4, 1, 1, 2, 0.5, 0.5), test_material(FLESH_ENERGY_S, 0.5), 1, &b);
  const int tip = b.n / 3 - 1;
  const flesh_amplitude amplitude = {.from = -INFINITY, .until = until};
  CHECK_OK(flesh_effect_force(&b.body, 1, &tip, (double[]){0, 20, -40}, &amplitude, &force));
  CHECK_OK(flesh_system_add_effect(b.system, &force));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, method, 1e-4, 1);
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = controlled;
  adaptive.tolerance = 1e-3;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  for (int k = 0; k < 20; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 90, &stats));
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
  return stats.newton;
}

/* An event whose time is rounded leaves no tiny part before or after a step's end, in which bodies would burst. */
static void rounded_events_throw_nothing(void)
{
  static const double rounded[] = {0.1111111, 0.1111112, 0.11111};
  static double exact[6000], x[6000];
  for (int controlled = 0; controlled < 2; controlled++)
    for_every_method(method, TEST_FIXED_STEPS) {
      /* One has no error estimate, the other steps across events. */
      if (method == (controlled ? FLESH_METHOD_MIDPOINT : FLESH_METHOD_BACKWARD_EULER)) continue;
      const int newton = let_go(method, controlled, 10. / 90, exact);
      for (int k = 0; k < 3; k++) {
        const int taken = let_go(method, controlled, rounded[k], x);
        const double off = test_distance(6000, x, exact);
        printf("# %s%s, until %.7g s: off by %.2g m, %d Newton iterations for %d\n", flesh_method_name(method),
               controlled ? ", steps by errors" : "", rounded[k], off, taken, newton);
        CHECK_BELOW(off, 1e-5);
        CHECK(taken <= 1.1 * newton);
      }
    }
}

/* A bar whose end is moved abruptly is resolved by adaptive steps with tight tolerances: rounding in the pressures
 * gains no energy that would keep steps short. */
static void sudden_motions_are_followed(void)
{
  static const flesh_keyframe pull[] = {{0, {0}, {0}}, {0.02, {-0.012, 0, 0.015}, {-0.1, 0, 0}}};
  static const double tolerances[] = {1e-5, 3e-6, 2e-6, 1e-6, 5e-7};
  for (int k = 0; k < 5; k++) {
    test_body b;
    flesh_solve_stats stats = {0};
    make(test_box(1, 1, 2, 0.1, 0.1, 0.2), test_material(FLESH_ENERGY_S, 0.5), 1, &b);
    CHECK_OK(test_body_hold(&b, 0, 0.1, FLESH_AXES_ALL, &(flesh_motion){2, pull, {0.1, 0.05, 0.1}, 0}, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-4, 1);
    flesh_adaptive_options adaptive;
    flesh_adaptive_options_default(&adaptive);
    adaptive.control = 1;
    adaptive.tolerance = tolerances[k];
    adaptive.max_steps = 2000;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, &stats));
    printf("# tolerance %g: %d steps, %d by backward Euler\n", tolerances[k], stats.steps, stats.damped_steps);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(motion_keeps_what_it_must), TEST(flight_is_free), TEST(methods_have_their_orders),
                   TEST(velocities_lose_their_divergence), TEST(fixed_steps_lose_it), TEST(gaps_at_the_start_throw_nothing),
                   TEST(rounded_events_throw_nothing), TEST(sudden_motions_are_followed), TEST(states_need_no_pressures),
                   TEST_OF_THREADS(states_go_on), TEST(equilibria_go_on_with_the_same_bits));
}
