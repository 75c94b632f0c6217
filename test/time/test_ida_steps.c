// TEST quick seconds=120
/* test_ida_steps.c: the adaptive methods against another code's exact motions and GSL's: errors and tolerances, events,
 * restarts, failures, energy. */
#include <float.h>

#include "busy_bar.h"
#include "motion_reference.h"

static flesh_integrator *adaptive(const test_body *b, flesh_method method, double tolerance, int max_order)
{
  flesh_solver_options solver;
  flesh_adaptive_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&solver);
  flesh_adaptive_options_default(&options);
  options.tolerance = tolerance;
  options.max_order = max_order;
  CHECK_OK(flesh_integrator_create(b->system, method, &solver, &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
  return integrator;
}

/* The bar of the reference files grav_*. */
static void make_oracle_bar(flesh_mass mass, test_body *b)
{
  flesh_mesh *mesh = NULL;
  flesh_material material;
  CHECK_OK(flesh_mesh_read("reference/oracle/bar_8x2x2.mesh", &mesh));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, mass, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.8));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Finds the largest distance of a node [m] and largest difference of a velocity [m/s] from the reference over t = 0.1
 * ... 1. */
static void oracle_errors(flesh_mass mass, double tolerance, int max_order, double error[2], flesh_solve_stats *stats)
{
  test_body b;
  char line[256];
  make_oracle_bar(mass, &b);
  flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, tolerance, max_order);
  FILE *file = fopen(
      mass ? "reference/oracle/grav_consistent_ref_states.txt" : "reference/oracle/grav_lumped_ref_states.txt", "r");
  CHECK(file != NULL);
  *stats = (flesh_solve_stats){0};
  error[0] = error[1] = 0;
  int blocks = 0;
  while (file && fgets(line, sizeof line, file)) {
    double t, row[6];
    if (sscanf(line, "t %lf", &t) != 1) continue;
    if (t > 0) CHECK_OK(flesh_integrator_step(integrator, &b.state, t - b.state.t, stats));
    for (int i = 0; i < b.n / 3; i++) {
      double distance = 0;
      for (int c = 0; c < 6; c++) CHECK(fscanf(file, "%lf", &row[c]) == 1);
      for (int c = 0; c < 3; c++) {
        distance += (row[c] - b.state.x[3 * i + c]) * (row[c] - b.state.x[3 * i + c]);
        error[1] = fmax(error[1], fabs(row[3 + c] - b.state.v[3 * i + c]));
      }
      error[0] = fmax(error[0], sqrt(distance));
    }
    blocks++;
  }
  CHECK(blocks == 11);
  if (file) fclose(file);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* At every tolerance the error is at most a hundred times as large, and it falls with the tolerance; the tightest reach
 * the reference to a micrometre. */
static void errors_follow_the_tolerance(void)
{
  enum { RUNS = 5 };
  for (int max_order = 2; max_order <= 5; max_order += 3)
    for (int mass = 0; mass < 2; mass++) {
      double tolerance[RUNS], error[RUNS], both[2];
      for (int k = 0; k < RUNS; k++) {
        flesh_solve_stats stats;
        tolerance[k] = pow(10, -2 - k);
        oracle_errors((flesh_mass)mass, tolerance[k], max_order, both, &stats);
        error[k] = both[0];
        double length = 4, ratio = error[k] / (tolerance[k] * length);
        printf("# %s mass, order <= %d, tolerance %g: %d steps, %d rejected, error %.3g m = %.3g tolerances\n",
               mass ? "consistent" : "lumped", max_order, tolerance[k], stats.steps, stats.rejected, error[k], ratio);
        CHECK_BELOW(ratio, max_order == 2 ? 5 : 20);
        if (k > 0) CHECK(error[k] < error[k - 1]);
      }
      double slope = fitted_order(RUNS, tolerance, error);
      printf("# slope %.3f\n", slope);
      CHECK(slope > 0.8 && slope < 1.4);
    }
}

static void tight_tolerances_reach_another_codes_motion(void)
{
  for (int mass = 0; mass < 2; mass++) {
    flesh_solve_stats stats;
    double error[2];
    oracle_errors((flesh_mass)mass, 1e-9, 5, error, &stats);
    printf("# %s mass: %d steps, off by %.3g m, %.3g m/s\n", mass ? "consistent" : "lumped", stats.steps, error[0],
           error[1]);
    CHECK_BELOW(error[0], 3e-8);
    CHECK_BELOW(error[1], 1e-5);
  }
}

/* An independent reference for small free bodies that oscillate by a fifth of their length. */
static void small_bodies_agree_with_gsl(void)
{
  const double corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int k = 0; k < 2; k++) {
    test_body b;
    flesh_mesh *mesh = NULL;
    if (k == 0) CHECK_OK(flesh_mesh_create(4, corners, 1, (int[]){0, 1, 2, 3}, NULL, &mesh));
    else mesh = test_box(1, 1, 1, 1, 1, 1);
    CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int i = 0; i < b.n / 3; i++) {
      b.state.x[3 * i + 2] *= 1.2;
      b.state.v[3 * i] = 0.5 * b.state.x[3 * i + 1];
    }
    flesh_state exact = state_copy(b.n, &b.state), state = state_copy(b.n, &b.state);
    motion_reference_run(&b, 1, 1e-14, &exact);
    flesh_solver_options solver;
    flesh_solver_options_default(&solver);
    flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-11, 5);
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &state, 1, &stats));
    double off = motion_distance(b.n, state.x, exact.x), moved = motion_distance(b.n, state.x, b.state.x);
    printf("# %s: %d steps, off by %.3g m after moving %.3g m\n", k ? "cube" : "tet", stats.steps, off, moved);
    CHECK_BELOW(off, 1e-9);
    CHECK(moved > 0.01);
    flesh_integrator_destroy(&integrator);
    state_free(&exact);
    state_free(&state);
    test_body_destroy(&b);
  }
}

/* Prescribed motions that turn, a roller that is released, a spring that is switched, at times that are no outputs. The
 * lumped motion is GSL's; with the consistent mass, where prescribed nodes accelerate the free ones, that of a fine run
 * of the midpoint rule. */
static void events_and_moving_constraints(void)
{
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    make_busy_bar((flesh_mass)mass, &b);
    flesh_state exact = motion_exact(&b, (flesh_mass)mass, 10000, 0.5);
    for (int order = 2; order <= 5; order += 3)
      for (int pieces = 1; pieces <= 37; pieces += 36) {
        flesh_state state = state_copy(b.n, &b.state);
        flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-6, order);
        flesh_solve_stats stats = {0};
        for (int k = 1; k <= pieces; k++) {
          CHECK_OK(flesh_integrator_step(integrator, &state, 0.5 / pieces, &stats));
          state.t = 0.5 * k / pieces; /* as flesh_run does */
        }
        double off = motion_distance(b.n, state.x, exact.x);
        printf("# %s mass, order <= %d, %d calls: %d steps, off by %.3g m\n", mass ? "consistent" : "lumped", order,
               pieces, stats.steps, off);
        CHECK_BELOW(off, 3e-6);
        flesh_integrator_destroy(&integrator);
        state_free(&state);
      }
    state_free(&exact);
    test_body_destroy(&b);
  }
}

/* Constrained dofs are at their positions, with the motion's own velocity; events at outputs count once. */
static void constrained_dofs_follow_their_motion(void)
{
  test_body b;
  const flesh_keyframe keys[] = {{0, {0}, {0}}, {0.1, {0, 0.1, 0}, {0}}, {0.3, {0, 0.1, 0}, {0.4, 0, 0}}};
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_CONSISTENT,
                            1, &b));
  CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, &(flesh_motion){3, keys, {0, 0.5, 0.5}, 0}, -INFINITY, 0.4));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-4, 2);
  double *x = malloc((size_t)b.n * sizeof *x), *earlier = malloc((size_t)b.n * sizeof *x);
  uint8_t *fixed = malloc((size_t)b.n);
  for (int k = 1; k <= 8; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, NULL));
    b.state.t = 0.05 * k;
    double before = b.state.t - 1e-9;
    flesh_system_fixed(b.system, before, fixed);
    memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
    memcpy(earlier, b.state.x, (size_t)b.n * sizeof *x);
    flesh_system_prescribe(b.system, before, x);
    flesh_system_prescribe(b.system, before - 1e-6, earlier);
    for (int d = 0; d < b.n; d++)
      if (fixed[d]) {
        CHECK_NEAR(b.state.x[d], x[d], 1e-8);
        CHECK_NEAR(b.state.v[d], (x[d] - earlier[d]) / 1e-6, 1e-5);
      }
  }
  /* Released at 0.4: they move freely. */
  memcpy(x, b.state.x, (size_t)b.n * sizeof *x);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, NULL));
  double moved = 0;
  for (int d = 0; d < b.n; d++)
    if (fixed[d]) moved = fmax(moved, fabs(b.state.x[d] - x[d]));
  CHECK(moved > 1e-3);
  flesh_integrator_destroy(&integrator);
  free(x);
  free(earlier);
  free(fixed);
  test_body_destroy(&b);
}

static int count_internal(void *data, const flesh_internal_step *step)
{
  (void)step;
  ++*(int *)data;
  return FLESH_OK;
}

/* Another x, v or t than was returned restarts the method; the same state continues, and outputs cost no steps. */
static void another_state_starts_anew(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_CONSISTENT, &b);
  flesh_state used = state_copy(b.n, &b.state), fresh = state_copy(b.n, &b.state);
  flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-3, 2);
  for (int k = 0; k < 5; k++) CHECK_OK(flesh_integrator_step(integrator, &used, 0.01, NULL));
  for (int field = 0; field < 3; field++) {
    for (int d = 0; d < b.n; d++) {
      if (field == 0) used.x[d] += 1e-3 * sin(d);
      if (field == 1) used.v[d] *= 0.5;
    }
    if (field == 2) used.t -= 0.02;
    memcpy(fresh.x, used.x, (size_t)b.n * sizeof *fresh.x);
    memcpy(fresh.v, used.v, (size_t)b.n * sizeof *fresh.v);
    fresh.t = used.t;
    flesh_integrator *other = adaptive(&b, FLESH_METHOD_IDA, 1e-3, 2);
    for (int k = 0; k < 3; k++) {
      CHECK_OK(flesh_integrator_step(integrator, &used, 0.01, NULL));
      CHECK_OK(flesh_integrator_step(other, &fresh, 0.01, NULL));
    }
    CHECK(!memcmp(used.x, fresh.x, (size_t)b.n * sizeof *used.x));
    CHECK(!memcmp(used.v, fresh.v, (size_t)b.n * sizeof *used.v));
    flesh_integrator_destroy(&other);
  }
  flesh_integrator_destroy(&integrator);
  state_free(&used);
  state_free(&fresh);
  test_body_destroy(&b);

  int counts[2] = {0, 0};
  make_oracle_bar(FLESH_MASS_LUMPED, &b);
  flesh_state ends[2];
  for (int k = 0; k < 2; k++) {
    flesh_adaptive_options options;
    ends[k] = state_copy(b.n, &b.state);
    integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-3, 2);
    flesh_adaptive_options_default(&options);
    options.tolerance = 1e-3;
    options.observe = count_internal;
    options.observe_data = &counts[k];
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
    flesh_solve_stats stats = {0};
    for (int j = 0; j < (k ? 200 : 1); j++)
      CHECK_OK(flesh_integrator_step(integrator, &ends[k], k ? 0.005 : 1, &stats));
    CHECK(stats.steps == counts[k] && stats.order == 2 && stats.h_last > 0 && stats.residuals > stats.steps);
    flesh_integrator_destroy(&integrator);
  }
  double apart = motion_distance(b.n, ends[0].x, ends[1].x);
  printf("# %d steps in one call, %d in 200 calls, %.3g m apart\n", counts[0], counts[1], apart);
  CHECK(counts[1] == counts[0]);
  CHECK_BELOW(apart, 1e-12);
  state_free(&ends[0]);
  state_free(&ends[1]);
  test_body_destroy(&b);
}

/* A body displaced into a random ball. */
static void make_scrambled(test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.49, &material));
  CHECK_OK(test_body_create(test_box(4, 1, 1, 1, 0.25, 0.25), material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
  test_jitter(b->n, 0.3, 4, b->state.x);
}

static int stop_at_third(void *data) { return ++*(int *)data == 3 ? FLESH_ERR_INTERRUPTED : FLESH_OK; }

/* A motion that cannot continue reports where and why; the state is the last one reached, and can be continued from. */
static void failures_are_reported(void)
{
  test_body b;
  flesh_adaptive_options options;
  make_scrambled(&b);
  flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-4, 2);
  flesh_adaptive_options_default(&options);
  options.max_steps = 50;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
  CHECK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL) == FLESH_ERR_INTEGRATOR);
  printf("# %s\n", flesh_error_text());
  CHECK_TEXT(flesh_error_text(), "max_steps = 50");
  CHECK_TEXT(flesh_error_text(), "order");
  CHECK_TEXT(flesh_error_text(), "node");
  CHECK_TEXT(flesh_error_text(), "tet");
  const flesh_failure *f = flesh_integrator_failure(integrator);
  CHECK(f->t > 0 && f->t < 1. / 60 && f->h > 0 && f->order >= 1 && f->order <= 2);
  CHECK(f->worst_node >= 0 && f->worst_node < b.n / 3 && f->worst_tet >= 0 && f->worst_J < 0);
  CHECK(b.state.t == f->t && test_all_finite(b.n, b.state.x));
  double t = b.state.t;
  CHECK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL) == FLESH_ERR_INTEGRATOR);
  CHECK(b.state.t > t);
  /* Interrupted between internal steps. */
  int asked = 0;
  t = b.state.t;
  flesh_integrator_set_stop(integrator, stop_at_third, &asked);
  CHECK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL) == FLESH_ERR_INTERRUPTED);
  CHECK(asked == 3 && b.state.t > t);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);

  /* An energy that is undefined where the body is going, even with the shortest steps. */
  make_oracle_bar(FLESH_MASS_LUMPED, &b);
  for (int i = 0; i < b.n / 3; i++) b.state.v[3 * i] = -1e9 * b.state.x[3 * i];
  integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-2, 2);
  int status = flesh_integrator_step(integrator, &b.state, 1, NULL);
  printf("# %s\n", flesh_error_text());
  CHECK(status == FLESH_ERR_INTEGRATOR);
  CHECK_TEXT(flesh_error_text(), "too short");
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void bad_options_are_refused(void)
{
  test_body b;
  flesh_integrator *integrator = NULL;
  flesh_solver_options solver;
  flesh_adaptive_options good, bad;
  make_oracle_bar(FLESH_MASS_LUMPED, &b);
  integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-3, 2);
  flesh_adaptive_options_default(&good);
#define REFUSED(member, value, part)                                              \
  bad = good;                                                                     \
  bad.member = value;                                                             \
  CHECK(flesh_integrator_set_adaptive(integrator, &bad) == FLESH_ERR_ARGUMENT);   \
  CHECK_TEXT(flesh_error_text(), part)
  REFUSED(tolerance, 0, "tolerance is 0");
  REFUSED(tolerance, NAN, "tolerance is nan");
  REFUSED(tolerance, 1, "below 1");
  REFUSED(max_order, 6, "1 to 5");
  REFUSED(max_order, 0, "1 to 5");
  REFUSED(max_step, 0, "positive");
  REFUSED(max_steps, 0, "positive");
#undef REFUSED
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  CHECK_OK(
      test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&solver);
  CHECK(flesh_integrator_create(b.system, FLESH_METHOD_IDA, &solver, &integrator) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "inertia");
  test_body_destroy(&b);
}

/* Order 5 at a loose tolerance adds energy to a nearly incompressible bar that is released twisted by 1 rad; order 2
 * does not (with tolerances of 3e-3 and less by a few percent: it depends on rounding). */
static void growing_energy_is_warned_about(void)
{
  for (int order = 2; order <= 5; order += 3) {
    test_body b;
    flesh_material material;
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.499, &material));
    CHECK_OK(test_body_create(test_box(8, 2, 2, 1, 0.25, 0.25), material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int i = 0; i < b.n / 3; i++) {
      double *x = b.state.x + 3 * i, y = x[1] - 0.125, z = x[2] - 0.125;
      x[1] = 0.125 + cos(x[0]) * y - sin(x[0]) * z;
      x[2] = 0.125 + sin(x[0]) * y + cos(x[0]) * z;
    }
    flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 4e-3, order);
    CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY)); /* run to its end */
    for (int k = 0; k < 120; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
    const char *warning = flesh_integrator_warning(integrator);
    double gain = flesh_integrator_energy_balance(integrator)->gain;
    printf("# order <= %d: gain %.3g; %s\n", order, gain, warning ? warning : "no warning");
    CHECK((order == 5) == (warning != NULL));
    CHECK((order == 5) == (gain > 0.05));
    if (warning) CHECK_TEXT(warning, "although nothing put it in");
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* A moving prescribed motion and a moving target add energy; that is no fault of the method. */
static void driven_bodies_are_not_warned_about(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  flesh_integrator *integrator = adaptive(&b, FLESH_METHOD_IDA, 1e-4, 2);
  for (int k = 0; k < 50; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
  CHECK(flesh_integrator_warning(integrator) == NULL);
  CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 1e-2);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(errors_follow_the_tolerance), TEST(tight_tolerances_reach_another_codes_motion),
                   TEST(small_bodies_agree_with_gsl), TEST(events_and_moving_constraints),
                   TEST(constrained_dofs_follow_their_motion), TEST(another_state_starts_anew),
                   TEST(failures_are_reported), TEST(bad_options_are_refused), TEST(growing_energy_is_warned_about),
                   TEST(driven_bodies_are_not_warned_about));
}
