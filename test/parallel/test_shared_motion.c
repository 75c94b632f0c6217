// TEST full memory needs=ranks ranks=2,3
// TEST full needs=ranks ranks=5 args: all
/* test_shared_motion.c: motions of bodies shared by ranks: adaptive methods and orders against another code's exact
 * motion, conservation laws of free bodies, failing and stopped steps. With the argument `all` also long tests. */
#include "shared_body.h"

#include "motion_reference.h"

/* Copies the whole's start to the part's state, or back. */
static void take(const bodies *b, const flesh_state *whole, flesh_state *own)
{
  const int *nodes = flesh_rank_part_nodes(b->part);
  own->t = whole->t;
  for (int d = 0; d < b->own.n; d++) {
    own->x[d] = whole->x[3 * nodes[d / 3] + d % 3];
    own->v[d] = whole->v[3 * nodes[d / 3] + d % 3];
  }
}

static void gather(const bodies *b, const flesh_state *own, flesh_state *whole)
{
  CHECK_OK(flesh_rank_part_gather(b->part, own->x, whole->x));
  CHECK_OK(flesh_rank_part_gather(b->part, own->v, whole->v));
  whole->t = own->t;
}

static int says(void) { return flesh_communicator_rank(ranks) == 0; }

/* The bar of the reference files grav_*. */
static void open_oracle_bar(flesh_mass mass, bodies *b)
{
  flesh_mesh *mesh = NULL;
  flesh_material material;
  CHECK_OK(flesh_mesh_read("reference/oracle/bar_8x2x2.mesh", &mesh));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
  open_body(b, mesh, material, mass, 9.8, 1);
}

/* Names of the files for the body's kind of mass. */
static const char *const oracle_states[] = {"grav_lumped_ref_states.txt", "grav_consistent_ref_states.txt"};

static flesh_integrator *adaptive(const test_body *b, flesh_method method, double tolerance, int max_steps)
{
  flesh_adaptive_options options;
  flesh_integrator *integrator = motion_integrator(b, method, 1e-8);
  flesh_adaptive_options_default(&options);
  options.tolerance = tolerance;
  if (max_steps) options.max_steps = max_steps;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
  return integrator;
}

/* On ranks, too, the error is a few times the tolerance, and falls with it. */
static void errors_follow_the_tolerance(void)
{
  enum { RUNS = 3 };
  for (int mass = 0; mass < 2; mass++) {
    bodies b;
    double tolerance[RUNS], error[RUNS];
    open_oracle_bar((flesh_mass)mass, &b);
    flesh_state exact = state_copy(b.whole.n, &b.whole.state), reached = state_copy(b.whole.n, &b.whole.state);
    for (int k = 0; k < RUNS; k++) {
      flesh_solve_stats stats = {0};
      tolerance[k] = pow(10, -2 - k);
      error[k] = 0;
      flesh_integrator *integrator = adaptive(&b.own, FLESH_METHOD_IDA, tolerance[k], 0);
      take(&b, &b.whole.state, &b.own.state);
      for (int at = 1; at <= 3; at++) {
        CHECK_OK(flesh_integrator_step(integrator, &b.own.state, 0.1 * at - b.own.state.t, &stats));
        gather(&b, &b.own.state, &reached);
        motion_read_states(oracle_states[mass], 0.1 * at, b.whole.n / 3, &exact);
        for (int i = 0; i < b.whole.n; i += 3)
          error[k] = fmax(error[k], sqrt(pow(reached.x[i] - exact.x[i], 2) + pow(reached.x[i + 1] - exact.x[i + 1], 2) +
                                         pow(reached.x[i + 2] - exact.x[i + 2], 2)));
      }
      if (says())
        printf("# %s mass, tolerance %g: %d steps, %d rejected, error %.3g m\n", mass ? "consistent" : "lumped", tolerance[k],
               stats.steps, stats.rejected, error[k]);
      CHECK_BELOW(error[k], 5 * tolerance[k] * 4); /* the bar is 4 m long */
      if (k > 0) CHECK(error[k] < error[k - 1]);
      flesh_integrator_destroy(&integrator);
    }
    state_free(&exact);
    state_free(&reached);
    close_body(&b);
  }
}

/* Adaptive steps are those of one rank: equally many except for two plus one in four hundred, because errors are
 * filtered by a rough solve, with equally many rejected ones. The bar is released bent, so that some are rejected. */
static void controlled_steps_are_those_of_one_rank(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER,    FLESH_METHOD_BDF2,       FLESH_METHOD_NEWMARK,
                                         FLESH_METHOD_HHT,               FLESH_METHOD_RUNGE_KUTTA,
                                         FLESH_METHOD_GENERALIZED_ALPHA};
  bodies b;
  open_oracle_bar(FLESH_MASS_LUMPED, &b);
  for (int d = 2; d < b.whole.n; d += 3) b.whole.state.v[d] = b.whole.state.x[d - 2] * b.whole.state.x[d - 2];
  flesh_state exact = state_copy(b.whole.n, &b.whole.state), reached = state_copy(b.whole.n, &b.whole.state);
  for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
    flesh_solve_stats stats[2] = {{0}};
    flesh_state *const states[] = {&exact, &b.own.state};
    take(&b, &b.whole.state, &b.own.state);
    memcpy(exact.x, b.whole.state.x, (size_t)b.whole.n * sizeof *exact.x);
    memcpy(exact.v, b.whole.state.v, (size_t)b.whole.n * sizeof *exact.v);
    exact.t = b.whole.state.t;
    for (int shared = 0; shared < 2; shared++) {
      flesh_integrator *integrator = motion_controlled(shared ? &b.own : &b.whole, methods[k], 1e-8, 3e-3);
      for (int at = 1; at <= 3; at++)
        CHECK_OK(flesh_integrator_step(integrator, states[shared], 0.1 * at - states[shared]->t, &stats[shared]));
      flesh_integrator_destroy(&integrator);
    }
    gather(&b, &b.own.state, &reached);
    const double off = motion_distance(b.whole.n, reached.x, exact.x);
    if (says())
      printf("# %s: %d steps, %d rejected, %d Newton; of ranks %d, %d, %d; off by %.2g m\n", flesh_method_name(methods[k]),
             stats[0].steps, stats[0].rejected, stats[0].newton, stats[1].steps, stats[1].rejected, stats[1].newton, off);
    CHECK(abs(stats[0].steps - stats[1].steps) <= 2 + stats[0].steps / 400 && stats[0].rejected == stats[1].rejected &&
          stats[0].convergence_failures == stats[1].convergence_failures);
    CHECK(stats[0].rejected > 0 || methods[k] == FLESH_METHOD_RUNGE_KUTTA);
    CHECK_BELOW(off, 0.1 * 3e-3 * 4);
  }
  state_free(&exact);
  state_free(&reached);
  close_body(&b);
}

/* Every method of fixed steps converges to the exact motion with its order, with the steps and within the bounds of one
 * rank. */
static void orders_are_those_of_one_rank(void)
{
  enum { RUNS = 3 };
  bodies b;
  open_oracle_bar(FLESH_MASS_LUMPED, &b);
  flesh_state exact = state_copy(b.whole.n, &b.whole.state), reached = state_copy(b.whole.n, &b.whole.state);
  motion_read_states(oracle_states[FLESH_MASS_LUMPED], 0.1, b.whole.n / 3, &exact);
  for (flesh_method method = 0; flesh_method_name(method); method++) {
    double h[RUNS], error[RUNS];
    if (flesh_method_order(method) < 1) continue;
    for (int k = 0; k < RUNS; k++) {
      const int steps = (method == FLESH_METHOD_BDF2 ? 200 : 100) << k;
      h[k] = 0.1 / steps;
      take(&b, &b.whole.state, &b.own.state);
      motion_run(&b.own, method, 1e-9, steps, 0.1, &b.own.state);
      gather(&b, &b.own.state, &reached);
      error[k] = motion_distance(b.whole.n, reached.x, exact.x);
    }
    const double order = fitted_order(RUNS, h, error);
    if (says()) printf("# %s: order %.3f, errors %.3g to %.3g m\n", flesh_method_name(method), order, error[0], error[RUNS - 1]);
    /* The first three steps of runge-kutta have a larger error, which falls faster. */
    if (method == FLESH_METHOD_RUNGE_KUTTA) CHECK(order > 2.9);
    else CHECK_NEAR(order, flesh_method_order(method), 0.1);
  }
  state_free(&exact);
  state_free(&reached);
  close_body(&b);
}

static double energy_of(const bodies *b)
{
  double *zeros = calloc((size_t)b->own.n, sizeof *zeros), energies[8] = {0}, sum = 0;
  const flesh_point point = flesh_point_at(b->own.state.t, b->own.state.x, b->own.state.v, zeros);
  CHECK_OK(flesh_system_energies(b->own.system, &point, energies));
  for (int e = 0; e < flesh_system_effect_count(b->own.system); e++) sum += energies[e];
  free(zeros);
  return sum;
}

/* A free body that tumbles, strongly deformed. */
static void open_tumbling(flesh_mass mass, bodies *b)
{
  open_body(b, test_box(3, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4), mass, 0, 0);
  for (int i = 0; i < b->whole.n / 3; i++) {
    const double *X = b->whole.state.x + 3 * i;
    double *v = b->whole.state.v + 3 * i;
    v[0] = 3 - 6 * (X[1] - 0.5) + 4 * X[0];
    v[1] = -1 + 6 * (X[0] - 1) - 3 * X[2];
    v[2] = 2 + 3 * X[1] * X[0];
  }
  take(b, &b->whole.state, &b->own.state);
}

/* The midpoint rule conserves both momenta except for the residual r that the solves leave at the middle: at most h
 * sqrt(nodes) |r| per step, times the arm, as on one rank. */
static void midpoint_keeps_both_momenta(void)
{
  for (int mass = 0; mass < 2; mass++) {
    bodies b;
    const double h = 1. / 60, nodes = 36;
    double before[6], after[6], first[6];
    open_tumbling((flesh_mass)mass, &b);
    flesh_integrator *integrator = motion_integrator(&b.own, FLESH_METHOD_MIDPOINT, 1e-10);
    test_momenta(&b.whole, first);
    memcpy(before, first, sizeof before);
    for (int step = 0; step < 15; step++) {
      flesh_solve_stats stats = {0};
      double arm = 0;
      for (int d = 0; d < b.whole.n; d++) arm = fmax(arm, fabs(b.whole.state.x[d]) + h * fabs(b.whole.state.v[d]));
      CHECK_OK(flesh_integrator_step(integrator, &b.own.state, h, &stats));
      gather(&b, &b.own.state, &b.whole.state);
      const double size = test_momenta(&b.whole, after), bound = h * sqrt(nodes) * stats.residual_last;
      CHECK(stats.solves == 1 && stats.residual_last <= stats.residual_target);
      for (int c = 0; c < 3; c++) {
        CHECK_NEAR(after[c], before[c], bound + 1e-13 * size);
        CHECK_NEAR(after[3 + c], before[3 + c], 3 * arm * bound + 1e-12 * size * arm);
      }
      memcpy(before, after, sizeof before);
    }
    for (int c = 0; c < 6; c++) CHECK_NEAR(after[c], first[c], 1e-7 * test_norm(3, first + c / 3 * 3));
    flesh_integrator_destroy(&integrator);
    close_body(&b);
  }
}

/* The error test of IDA allows these losses of momenta and energy: velocities off by some tolerances of their scale, at
 * most as many as positions in `errors_follow_the_tolerance`, and four times that for the energy, because the body is
 * two body sizes away from its start. */
static void adaptive_steps_keep_momenta_and_energy(void)
{
  bodies b;
  const double tolerance = 1e-5, several = 5;
  double first[6], after[6];
  open_tumbling(FLESH_MASS_LUMPED, &b);
  flesh_integrator *integrator = adaptive(&b.own, FLESH_METHOD_IDA, tolerance, 0);
  const double size = test_momenta(&b.whole, first), energy = energy_of(&b);
  for (int step = 0; step < 4; step++) CHECK_OK(flesh_integrator_step(integrator, &b.own.state, 1. / 60, NULL));
  gather(&b, &b.own.state, &b.whole.state);
  test_momenta(&b.whole, after);
  const double gain = energy_of(&b) / energy - 1;
  double worst[2] = {0};
  for (int c = 0; c < 6; c++) worst[c / 3] = fmax(worst[c / 3], fabs(after[c] - first[c]) / size);
  if (says()) printf("# momenta off by %.2g and %.2g of %.3g N s, energy by %.2g of %.3g J\n", worst[0], worst[1], size, gain, energy);
  CHECK_BELOW(worst[0], several * tolerance);
  CHECK_BELOW(worst[1], 2 * several * tolerance); /* m, of arms */
  CHECK_NEAR(gain, 0, 4 * several * tolerance);
  flesh_integrator_destroy(&integrator);
  close_body(&b);
}

/* Requests an end on the last rank only. */
static int stop_at_third(void *data)
{
  const int last = flesh_communicator_rank(ranks) == flesh_communicator_size(ranks) - 1;
  return ++*(int *)data == 3 && last ? FLESH_ERR_INTERRUPTED : FLESH_OK;
}

/* A step that cannot succeed fails on all ranks, with one message and the numbers of the whole. */
static void failures_and_stops_are_everyones(void)
{
  bodies b;
  open_oracle_bar(FLESH_MASS_LUMPED, &b);
  flesh_integrator *integrator = adaptive(&b.own, FLESH_METHOD_IDA, 1e-6, 5);
  CHECK(flesh_integrator_step(integrator, &b.own.state, 0.1, NULL) == FLESH_ERR_INTEGRATOR);
  CHECK_TEXT(flesh_error_text(), "max_steps = 5");
  const flesh_failure *f = flesh_integrator_failure(integrator);
  double numbers[] = {f->worst_node, f->worst_tet, f->worst_J, f->t, f->h, b.own.state.t}, others[6];
  memcpy(others, numbers, sizeof others);
  flesh_communicator_largest(ranks, 6, others);
  CHECK(!memcmp(numbers, others, sizeof numbers)); /* the same on all */
  CHECK(f->worst_node >= 0 && f->worst_node < b.whole.n / 3 && f->worst_tet >= 0 &&
        f->worst_tet < flesh_mesh_tet_count(b.mesh));
  CHECK(b.own.state.t == f->t && f->t > 0 && f->t < 0.1);
  const flesh_adaptive_options more = {.tolerance = 1e-6, .max_order = 2, .max_steps = 100000, .max_step = INFINITY};
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &more));
  int asked = 0;
  const double t = b.own.state.t;
  flesh_integrator_set_stop(integrator, stop_at_third, &asked);
  CHECK(flesh_integrator_step(integrator, &b.own.state, 0.1, NULL) == FLESH_ERR_INTERRUPTED);
  CHECK(asked == 3 && b.own.state.t > t);
  flesh_integrator_destroy(&integrator);
  close_body(&b);
}

int main(int argc, char **argv)
{
  if (argc > 1)
    return RUN_TESTS_ON_RANKS(argc, argv, TEST(errors_follow_the_tolerance), TEST(orders_are_those_of_one_rank),
                              TEST(controlled_steps_are_those_of_one_rank), TEST(midpoint_keeps_both_momenta),
                              TEST(adaptive_steps_keep_momenta_and_energy),
                              TEST(failures_and_stops_are_everyones));
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(controlled_steps_are_those_of_one_rank), TEST(midpoint_keeps_both_momenta),
                            TEST(adaptive_steps_keep_momenta_and_energy),
                            TEST(failures_and_stops_are_everyones));
}
