// TEST full memory seconds=10
/* test_ahead.c: states between the ends of adaptive steps: how few steps they take, their errors, and when there are
 * none. */
#include "busy_bar.h"
#include "motion_reference.h"
#include "system/one_effect.h"
#include "time/integrator.h"

enum { OUTPUTS = 60 };
static const double end = 0.5, length = 3, spin = 6;

static flesh_integrator *controlled(const test_body *b, flesh_method method, double tolerance)
{
  flesh_integrator *integrator = motion_controlled(b, method, 1e-11, tolerance);
  integrator->ahead.limit = INFINITY;
  return integrator;
}

/* Advances to output k of OUTPUTS. */
static void go_to(flesh_integrator *integrator, int k, flesh_state *state, flesh_solve_stats *stats)
{
  const double t = k * end / OUTPUTS;
  CHECK_OK(flesh_integrator_step(integrator, state, t - state->t, stats));
  CHECK_NEAR(state->t, t, 1e-12);
  state->t = t;
}

/* Returns the root mean square difference of the free nodes' velocities. */
static double difference(const test_body *b, const flesh_state *state, const flesh_state *exact)
{
  uint8_t *fixed = malloc((size_t)b->n);
  double sum = 0;
  flesh_system_fixed(b->system, state->t, fixed);
  for (int d = 0; d < b->n; d++)
    if (!fixed[d]) sum += pow(state->v[d] - exact->v[d], 2);
  free(fixed);
  return sqrt(3 * sum / b->n);
}

/* A bar with events and moving constraints, against integration by GSL. Positions are as accurate as steps, velocities
 * to that error over a hundredth of a second; constrained nodes are where they should be. */
static void check_states(flesh_method method, double tolerance)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  flesh_state exact = state_copy(b.n, &b.state), whole = state_copy(b.n, &b.state);
  double *held = malloc((size_t)b.n * sizeof *held), off = 0, off_v = 0;
  flesh_integrator *integrator = controlled(&b, method, tolerance);
  flesh_solve_stats stats = {0}, once = {0};
  int between = 0, unsolved = 0;
  for (int k = 1; k <= OUTPUTS; k++) {
    const int solves = stats.solves;
    stats.residual_target = 0;
    go_to(integrator, k, &b.state, &stats);
    CHECK(stats.residual_target > 0); /* target of the last solve, however long ago */
    unsolved += stats.solves == solves;
    motion_reference_run(&b, b.state.t, 1e-12, &exact);
    between += integrator->ahead.shown;
    CHECK(!integrator->ahead.shown || flesh_integrator_stage(integrator, &b.state) == &b.state);
    off = fmax(off, motion_distance(b.n, b.state.x, exact.x));
    off_v = fmax(off_v, difference(&b, &b.state, &exact));
    memcpy(held, b.state.x, (size_t)b.n * sizeof *held);
    flesh_system_prescribe(b.system, b.state.t, held);
    CHECK_BELOW(motion_distance(b.n, held, b.state.x), 1e-14);
  }
  flesh_integrator_destroy(&integrator);
  integrator = controlled(&b, method, tolerance);
  CHECK_OK(flesh_integrator_step(integrator, &whole, end, &once));
  printf("# %s, tolerance %g: %d outputs between the ends of %d steps (%d without outputs); off by %.3g m, %.3g m/s\n",
         flesh_method_name(method), tolerance, between, stats.steps, once.steps, off, off_v);
  CHECK(stats.steps <= once.steps + 4); /* the step beyond the end, and those where it begins anew */
  CHECK(between > OUTPUTS / 3 && (unsolved > 0 || stats.steps > OUTPUTS));
  CHECK_BELOW(off, 2 * tolerance * length);
  CHECK_BELOW(off_v, 2 * tolerance * length / 0.01);
  flesh_integrator_destroy(&integrator);
  state_free(&exact);
  state_free(&whole);
  free(held);
  test_body_destroy(&b);
}

static void states_between_steps_are_those_of_the_motion(void)
{
  for (double tolerance = 1e-3; tolerance > 1e-6; tolerance /= 10) check_states(FLESH_METHOD_RUNGE_KUTTA, tolerance);
  check_states(FLESH_METHOD_NEWMARK, 1e-4);
  check_states(FLESH_METHOD_HHT, 1e-4);
  check_states(FLESH_METHOD_GENERALIZED_ALPHA, 1e-4);
  check_states(FLESH_METHOD_BDF2, 1e-3);
  check_states(FLESH_METHOD_BACKWARD_EULER, 1e-2);
}

/* Advances another integrator from the state to the next output. */
static void check_begins(const test_body *b, const flesh_integrator *first, const flesh_state *from, double h,
                         const flesh_state *state)
{
  flesh_state other = state_copy(b->n, from);
  flesh_integrator *integrator = controlled(b, FLESH_METHOD_RUNGE_KUTTA, 1e-6);
  CHECK(!first->ahead.shown || state->t == from->t + h);
  CHECK_OK(flesh_integrator_step(integrator, &other, h, NULL));
  CHECK_BELOW(motion_distance(b->n, other.x, state->x), 1e-5);
  CHECK_BELOW(motion_distance(b->n, other.v, state->v), 1e-3);
  flesh_integrator_destroy(&integrator);
  state_free(&other);
}

/* The motion continues from a state that the caller changes between steps, or with new options of the integrator. */
static void changes_between_steps_count(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  flesh_integrator *integrator = controlled(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-4);
  int k = 0, changes = 0;
  for (; changes < 4 && k < OUTPUTS - 2; ) {
    go_to(integrator, ++k, &b.state, NULL);
    if (!integrator->ahead.shown) continue;
    if (changes++ % 2)
      for (int d = 0; d < b.n; d++) b.state.v[d] *= 0.5;
    else {
      flesh_adaptive_options options;
      flesh_adaptive_options_default(&options);
      options.control = 1;
      options.tolerance = 1e-5;
      CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
      integrator->ahead.limit = INFINITY;
    }
    flesh_state from = state_copy(b.n, &b.state);
    go_to(integrator, ++k, &b.state, NULL);
    check_begins(&b, integrator, &from, b.state.t - from.t, &b.state);
    state_free(&from);
  }
  CHECK(changes == 4);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static double latest;
static int between;

static int see_state(void *data, const flesh_step_record *record)
{
  const flesh_integrator *integrator = data;
  between += record->step > 0 && integrator->ahead.shown;
  return FLESH_OK;
}

static int see_step(void *data, const flesh_internal_step *step)
{
  (void)data;
  latest = fmax(latest, step->t);
  return FLESH_OK;
}

/* Far below. */
static void add_floor(test_body *b)
{
  flesh_obstacle *floor = NULL;
  flesh_effect *contact = NULL;
  flesh_contact_options options;
  flesh_contact_options_default(&options);
  CHECK_OK(flesh_obstacle_plane((double[]){0, 0, -9}, (double[]){0, 0, 1}, &floor));
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, &options, &floor, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
}

/* A run takes no step beyond its end, nor do single steps beyond theirs. With an obstacle, every step ends where a
 * state is shown. */
static void runs_and_obstacles_end_steps(void)
{
  for (int obstacle = 0; obstacle < 2; obstacle++) {
    test_body b;
    int steps;
    CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -2));
    if (obstacle) add_floor(&b);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = controlled(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-3);
    flesh_adaptive_options options = integrator->control.options;
    options.observe = see_step;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
    flesh_observer observer = {.observe = see_state, .data = integrator};
    const flesh_run_options run = {.h = end / OUTPUTS, .end = end, .observers = &observer, .observer_count = 1};
    latest = 0;
    between = 0;
    CHECK_OK(flesh_run(b.system, integrator, &run, &b.state, &steps));
    CHECK(latest == end && b.state.t == end && steps == OUTPUTS);
    CHECK(obstacle ? between == 0 : between > OUTPUTS / 2);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, end / OUTPUTS, NULL));
    CHECK(!integrator->ahead.shown);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* The elastic energy, above that at rest, J, at each output of a bar that spins and is stretched by that. */
static void spin_stiffly(flesh_method method, double ratio, double tolerance, double limit, double energies[OUTPUTS],
                          flesh_solve_stats *stats, int *shown, int *solved)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(6, 2, 2, 3, 1, 1), test_material(FLESH_ENERGY_S, ratio), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  const double *X = flesh_mesh_positions(b.mesh);
  for (int d = 0; d < b.n; d += 3) {
    b.state.v[d] = -spin * (X[d + 2] - 0.5);
    b.state.v[d + 2] = spin * (X[d] - 1.5);
  }
  flesh_integrator *integrator = controlled(&b, method, tolerance);
  integrator->ahead.limit = limit;
  for (int k = 0; k < OUTPUTS; k++) {
    double all[8] = {0};
    if (k) go_to(integrator, k, &b.state, stats);
    *shown += integrator->ahead.shown;
    *solved += integrator->ahead.shown && integrator->ahead.balances;
    const flesh_point point = flesh_point_at(b.state.t, b.state.x, b.state.v, b.state.v);
    CHECK_OK(flesh_system_energies(b.system, &point, all));
    energies[k] = flesh_system_role_energy(b.system, FLESH_ROLE_ELASTICITY, all) - (k ? energies[0] : 0);
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* However stiff its volumes are, a body's energy between the ends of steps is that of the motion. */
static void states_between_steps_balance(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_RUNGE_KUTTA, FLESH_METHOD_HHT, FLESH_METHOD_BDF2};
  for (int k = 0; k < 6; k++) {
    const double ratio = k % 2 ? 0.49 : 0.4999;
    double exact[OUTPUTS], energies[OUTPUTS], most = 0, off = 0;
    flesh_solve_stats stats = {0}, ignored = {0};
    int between = 0, solved = 0, none = 0;
    spin_stiffly(methods[k / 2], ratio, 1e-5, -INFINITY, exact, &ignored, &none, &none);
    spin_stiffly(methods[k / 2], ratio, 1e-2, INFINITY, energies, &stats, &between, &solved);
    for (int i = 1; i < OUTPUTS; i++) {
      most = fmax(most, exact[i]);
      off = fmax(off, fabs(energies[i] - exact[i]));
    }
    printf("# %s, Poisson's ratio %g: %d of %d states between ends of steps, %d of them solved for, energies off by %.2g of the "
           "largest, %d Newton\n",
           flesh_method_name(methods[k / 2]), ratio, between, OUTPUTS - 1, solved, off / most, stats.newton);
    CHECK(!none && between > OUTPUTS / 2);
    CHECK_BELOW(off, 0.06 * most);
    /* The stiffer volumes are, the more they reveal of pressures; one state in a brief step passes as it is. */
    CHECK(ratio > 0.499 ? solved >= between - 1 : solved < between);
  }
}

/* The cost of showing this many states of a stiff sagging bar. */
static flesh_solve_stats show(int states)
{
  test_body b;
  flesh_solve_stats stats = {0};
  CHECK_OK(test_body_create(test_box(6, 2, 2, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.499), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = controlled(&b, FLESH_METHOD_RUNGE_KUTTA, 1e-2);
  for (int k = 1; k <= states; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, k * end / states - b.state.t, &stats));
  printf("# %d states within %d steps: %d Newton, %d linear, %d matrices\n", states, stats.steps, stats.newton, stats.linear,
         stats.assemblies);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return stats;
}

/* Solved states within a step start from the previous ones' errors, with their matrix. */
static void states_of_a_step_tell_each_other(void)
{
  const flesh_solve_stats few = show(60), many = show(480);
  CHECK(many.newton < 2 * few.newton && many.assemblies < few.newton);
}

static double least;

static int see_length(void *data, const flesh_internal_step *step)
{
  (void)data;
  least = fmin(least, step->h);
  return FLESH_OK;
}

/* Rounding leaves no short step before a shown state if steps end with it. */
static void no_step_is_what_rounding_leaves(void)
{
  for (double tolerance = 1e-2; tolerance > 1e-4; tolerance /= 1.3) {
    test_body b;
    make_busy_bar(FLESH_MASS_LUMPED, &b);
    flesh_integrator *integrator = controlled(&b, FLESH_METHOD_BDF2, tolerance);
    flesh_adaptive_options options = integrator->control.options;
    options.observe = see_length;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
    least = end;
    integrator->ahead.limit = -INFINITY;
    for (int k = 1; k <= OUTPUTS; k++) go_to(integrator, k, &b.state, NULL);
    printf("# tolerance %.3g: the shortest step is %.3g s\n", tolerance, least);
    CHECK(least > 1e-6 * end / OUTPUTS);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A step that was hard to solve, so that the next one must not go on beyond a shown state. */
static int see_hard_step(void *data, const flesh_internal_step *step)
{
  ((flesh_integrator *)data)->memory.easy = 0;
  return see_length(data, step);
}

/* Nor if a step that may go on ends there but for rounding, as one of twice the length of the step before. */
static void no_step_of_rounding_follows_a_step_that_may_go_on(void)
{
  int ends = 0;
  test_body b;
  CHECK_OK(test_body_create(test_box(2, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = controlled(&b, FLESH_METHOD_RUNGE_KUTTA, 0.1);
  flesh_adaptive_options options = integrator->control.options;
  options.observe = see_hard_step;
  options.observe_data = integrator;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
  integrator->ahead.limit = INFINITY;
  least = end;
  for (int k = 1; k < OUTPUTS; k++) {
    go_to(integrator, k, &b.state, NULL);
    if (integrator->ahead.shown) continue;
    integrator->memory.easy = 1;
    integrator->control.h = (k + 1) * end / OUTPUTS - b.state.t - 2e-16;
    ends++;
  }
  printf("# %d such steps; the shortest one is of %.3g s\n", ends, least);
  CHECK(ends > 10 && least > 1e-6 * end / OUTPUTS);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Returns the number of steps of a bar whose end turns at a different rate from the time `kink` on. */
static int steps_through(flesh_method method, double kink)
{
  const flesh_keyframe turn[] = {{0, {0}, {0}}, {kink, {0, 0, 0.02}, {0}}, {end, {0, 0.05, 0}, {0}}};
  flesh_solve_stats stats = {0};
  test_body b;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -2));
  CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, &(flesh_motion){3, turn, {0, 0.5, 0.5}, 0}, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = controlled(&b, method, 1e-4);
  for (int k = 1; k <= OUTPUTS; k++) go_to(integrator, k, &b.state, &stats);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return stats.steps;
}

/* A prescribed motion starts with its true acceleration, not with that of its rounding in the time left until a state
 * is shown. */
static void kinks_just_before_states_cost_nothing(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_RUNGE_KUTTA, FLESH_METHOD_NEWMARK, FLESH_METHOD_HHT};
  for (int k = 0; k < 3; k++) {
    const double shown = 12 * end / OUTPUTS;
    const int there = steps_through(methods[k], shown);
    for (double before = 1e-9; before < 1e-4; before *= 100) {
      const int steps = steps_through(methods[k], shown - before);
      printf("# %s: %d steps with a kink %g s before a state, %d with one there\n", flesh_method_name(methods[k]), steps, before,
             there);
      CHECK(steps <= there + 2);
    }
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(states_between_steps_are_those_of_the_motion), TEST_LONG(states_between_steps_balance),
                   TEST(states_of_a_step_tell_each_other), TEST(changes_between_steps_count),
                   TEST(runs_and_obstacles_end_steps), TEST(no_step_is_what_rounding_leaves), TEST(no_step_of_rounding_follows_a_step_that_may_go_on),
                   TEST(kinks_just_before_states_cost_nothing));
}
