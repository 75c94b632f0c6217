// TEST quick seconds=60
/* test_runge_kutta.c: the method runge-kutta against order conditions, ARKODE's coefficients, GSL's integration and its
 * own stability function; how its steps follow a tolerance, are refused, and are resumed from a checkpoint. */
#include <stdio.h>
#include <stdlib.h>
#ifdef HAVE_ARKODE
#include <arkode/arkode_butcher_dirk.h>
#endif

#include "busy_bar.h"
#include "motion_reference.h"
#include "oscillator.h"
#include "time/butcher_table.h"
#include "time/method.h"

#include <complex.h> /* last: it uses the name I */

static flesh_integrator *controlled(const test_body *b, flesh_method method, flesh_table table, double tolerance)
{
  flesh_integrator *integrator = motion_integrator(b, method, 1e-11);
  flesh_method_options options;
  flesh_method_options_default(&options);
  options.table = table;
  CHECK_OK(flesh_integrator_set_method_options(integrator, &options));
  if (tolerance > 0) test_control(integrator, tolerance);
  return integrator;
}

static flesh_integrator *integrator_of(const test_body *b, flesh_table table, double tolerance)
{
  return controlled(b, FLESH_METHOD_RUNGE_KUTTA, table, tolerance);
}

/* Checks the order conditions up to 3 (Hairer, Norsett & Wanner 1993, II.2) and 2 for the embedded method; that stages
 * have equal diagonal entries; and that infinitely fast motions are completely damped (L-stability): the last row is
 * the step. */
static void tables_have_their_orders(void)
{
  for (int k = 1; flesh_table_names[k]; k++) {
    const flesh_butcher_table *t = flesh_butcher_table_of((flesh_table)k);
    const int last = t->stages - 1;
    double sums[2][4] = {{0}};
    for (int i = 0; i <= last; i++) {
      double row = 0, row_c = 0;
      for (int j = 0; j <= i; j++) row += t->a[i][j], row_c += t->a[i][j] * t->c[j];
      CHECK_NEAR(row, t->c[i], 4e-15);
      if (i > 0) CHECK(t->a[i][i] == t->a[1][1]);
      if (i > 0) CHECK_NEAR(row_c, t->c[i] * t->c[i] / 2, 4e-15); /* stages of order 2 */
      for (int e = 0; e < 2; e++) {
        const double b = e ? t->embedded[i] : t->a[last][i];
        sums[e][0] += b, sums[e][1] += b * t->c[i], sums[e][2] += b * t->c[i] * t->c[i], sums[e][3] += b * row_c;
      }
    }
    CHECK(t->c[last] == 1 && t->a[0][0] == 0);
    for (int e = 0; e < 2; e++) {
      CHECK_NEAR(sums[e][0], 1, 4e-15);
      CHECK_NEAR(sums[e][1], 0.5, 4e-15);
      const int third = e == 0 ? t->order == 3 : t->order == 2; /* one of both is of order 3, otherwise there is no estimate */
      CHECK((fabs(sums[e][2] - 1. / 3) < 4e-15) == third);
      CHECK((fabs(sums[e][3] - 1. / 6) < 4e-15) == third);
    }
#ifdef HAVE_ARKODE
    const ARKODE_DIRKTableID ids[] = {ARKODE_DIRK_NONE, ARKODE_ESDIRK325L2SA_5_2_3, ARKODE_ESDIRK324L2SA_4_2_3,
                                      ARKODE_TRBDF2_3_3_2};
    ARKodeButcherTable other = ARKodeButcherTable_LoadDIRK(ids[k]);
    CHECK(other && other->stages == t->stages && other->q == t->order);
    for (int i = 0; i <= last; i++) {
      CHECK_NEAR(t->c[i], other->c[i], 1e-15);
      CHECK_NEAR(t->embedded[i], other->d[i], 1e-15);
      for (int j = 0; j <= i; j++) CHECK_NEAR(t->a[i][j], other->A[i][j], 1e-15);
    }
    ARKodeButcherTable_Free(other);
#endif
  }
}

/* Stages of a motion with constant acceleration are exact, so that the safer guess at a later one is its solution,
 * whatever was known of the acceleration. */
static void stages_begin_at_the_cubic_between_those_before(void)
{
  const flesh_method_row *row = flesh_method_find(FLESH_METHOD_RUNGE_KUTTA);
  const double h = 0.3, a = -5;
  for (int t = 0; flesh_table_names[t]; t++) {
    if (t == FLESH_TABLE_AUTO) continue;
    double numbers[FLESH_METHOD_VECTORS] = {7}, x = 1, v = 2, v0, a0, u;
    const double *c = flesh_butcher_table_of((flesh_table)t)->c;
    const flesh_state state = {.x = &x, .v = &v};
    flesh_method_memory memory = {.n = 1, .method = FLESH_METHOD_RUNGE_KUTTA, .options.table = (flesh_table)t, .v0 = &v0, .a0 = &a0};
    for (int k = 0; k < FLESH_METHOD_VECTORS; k++) memory.vectors[k] = &numbers[k];
    for (; memory.at < row->stages(&memory); memory.at++) {
      const double time = c[memory.at + 1] * h, exact = v * time + a / 2 * time * time;
      flesh_stage stage;
      row->stage(&memory, &state, h, h, &stage);
      CHECK(row->guess(&memory, &stage, h, 1, &u));
      if (memory.at > 0) CHECK_NEAR(u, exact, 1e-13);
      row->keep(&memory, &stage, &exact);
    }
  }
}

static double order_of(const test_body *b, flesh_table table, double end, const flesh_state *exact, int coarsest)
{
  enum { RUNS = 4 };
  double h[RUNS], error[RUNS];
  for (int k = 0; k < RUNS; k++) {
    const int steps = coarsest << k;
    flesh_state state = state_copy(b->n, &b->state);
    flesh_integrator *integrator = integrator_of(b, table, 0);
    h[k] = end / steps;
    for (int step = 1; step <= steps; step++) {
      CHECK_OK(flesh_integrator_step(integrator, &state, h[k], NULL));
      state.t = step * h[k];
    }
    error[k] = motion_distance(b->n, state.x, exact->x);
    flesh_integrator_destroy(&integrator);
    state_free(&state);
  }
  const double order = fitted_order(RUNS, h, error);
  printf("# %s: order %.3f, errors %.3g ... %.3g m\n", flesh_table_names[table], order, error[0], error[RUNS - 1]);
  return order;
}

static void orders_are_as_promised(void)
{
  const flesh_energy energies[] = {FLESH_ENERGY_S, FLESH_ENERGY_NEO};
  for (int e = 0; e < 2; e++) {
    test_body b;
    make_bar(energies[e], FLESH_MASS_LUMPED, &b);
    flesh_state exact = state_copy(b.n, &b.state);
    motion_reference_run(&b, 0.5, 1e-13, &exact);
    for (int k = 1; flesh_table_names[k]; k++)
      CHECK_NEAR(order_of(&b, (flesh_table)k, 0.5, &exact, 40), k == FLESH_TABLE_TRBDF2 ? 2 : 3, 0.1);
    /* The first three steps use the table with the larger errors, and each of those falls with h^4. */
    CHECK(order_of(&b, FLESH_TABLE_AUTO, 0.5, &exact, 40) > 2.9);
    state_free(&exact);
    test_body_destroy(&b);
  }
}

/* Prescribed motions that turn, and constraints and springs that are switched within steps. */
static void orders_survive_events_and_moving_constraints(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  flesh_state exact = motion_exact(&b, FLESH_MASS_LUMPED, 0, 0.5);
  for (int k = 1; flesh_table_names[k]; k++)
    CHECK_NEAR(order_of(&b, (flesh_table)k, 0.5, &exact, 100), k == FLESH_TABLE_TRBDF2 ? 2 : 3, 0.1);
  state_free(&exact);
  test_body_destroy(&b);
}

/* Returns R(z) of a table (Hairer & Wanner 1996, IV.3): one step of y' = z y from 1. */
static double complex stability_function(const flesh_butcher_table *t, double complex z)
{
  double complex k[FLESH_TABLE_STAGES], y = 1;
  for (int i = 0; i < t->stages; i++) {
    y = 1;
    for (int j = 0; j < i; j++) y += t->a[i][j] * k[j];
    k[i] = z * y / (1 - z * t->a[i][i]);
    y += t->a[i][i] * k[i];
  }
  return y;
}

/* v + i w x of an oscillator is multiplied by R(i w h) in every step. */
static void oscillators_follow_the_stability_function(void)
{
  const double h = 0.1, angles[] = {0.1, 1, 3, 30, 1e3};
  for (int table = 1; flesh_table_names[table]; table++)
    for (size_t k = 0; k < sizeof angles / sizeof angles[0]; k++) {
      const double w = angles[k] / h;
      test_body b;
      make_oscillator(w, &b);
      for (int d = 0; d < 12; d++) b.state.x[d] += 1, b.state.v[d] = 0.5 / h;
      const double complex R = stability_function(flesh_butcher_table_of((flesh_table)table), I * angles[k]);
      double complex y = 0.5 / h + I * w;
      flesh_integrator *integrator = integrator_of(&b, (flesh_table)table, 0);
      for (int step = 0; step < 20; step++) {
        y *= R;
        CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
        double x = 0, v = 0;
        for (int i = 0; i < 4; i++) x += b.state.x[3 * i] / 4, v += b.state.v[3 * i] / 4;
        CHECK_BELOW(cabs(v + I * w * (x - 0.25) - y), 1e-9 * (1 / h + w));
      }
      CHECK(angles[k] > 3 ? cabs(R) < 0.7 : cabs(R) < 1.0000001);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* Returns the largest error of a motion at ten times, m, and its cost. */
static double error_at(flesh_method method, flesh_table table, double tolerance, flesh_solve_stats *stats)
{
  enum { TIMES = 10 };
  static flesh_state exact[TIMES];
  test_body b;
  double worst = 0;
  make_bar(FLESH_ENERGY_S, FLESH_MASS_LUMPED, &b);
  for (int k = 0; k < TIMES; k++) {
    if (exact[k].x) continue;
    exact[k] = state_copy(b.n, k ? &exact[k - 1] : &b.state);
    motion_reference_run(&b, 0.2 * (k + 1), 1e-12, &exact[k]);
  }
  flesh_integrator *integrator = controlled(&b, method, table, tolerance);
  *stats = (flesh_solve_stats){0};
  for (int k = 0; k < TIMES; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2 * (k + 1) - b.state.t, stats));
    worst = fmax(worst, motion_distance(b.n, b.state.x, exact[k].x));
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return worst;
}

/* Over four decades from 1e-2 on (two from 1e-1 on for backward Euler) the error is proportional to the tolerance; for
 * esdirk324 only once the motion is resolved. */
static void check_errors(flesh_method method, flesh_table table)
{
  enum { MOST = 5 };
  const int runs = flesh_method_order(method) == 1 ? 3 : MOST;
  double ratio[MOST], mean = 0;
  const char *name = method == FLESH_METHOD_RUNGE_KUTTA ? flesh_table_names[table] : flesh_method_name(method);
  for (int k = 0; k < runs; k++) {
    flesh_solve_stats stats;
    const double tolerance = pow(10, (runs == MOST ? -2 : -1) - k), error = error_at(method, table, tolerance, &stats);
    ratio[k] = error / (tolerance * 3);
    mean += log(ratio[k]) / runs;
    printf("# %s, tolerance %g: %d steps, %d rejected, %d Newton, error %.3g m = %.3g tolerances\n", name, tolerance,
           stats.steps, stats.rejected, stats.newton, error, ratio[k]);
    /* A solve examines two guesses, each once, and the end of each iteration. */
    CHECK(method != FLESH_METHOD_RUNGE_KUTTA || stats.potentials - stats.newton < 2.8 * stats.solves);
  }
  for (int k = 0; k < runs; k++) {
    CHECK(ratio[k] > 0.1 && ratio[k] < 3);
    if (table != FLESH_TABLE_ESDIRK324) CHECK(fabs(log(ratio[k]) - mean) < log(3));
  }
}

static void errors_follow_the_tolerance(void)
{
  for (int table = 0; flesh_table_names[table]; table++) check_errors(FLESH_METHOD_RUNGE_KUTTA, (flesh_table)table);
  check_errors(FLESH_METHOD_NEWMARK, FLESH_TABLE_AUTO);
  check_errors(FLESH_METHOD_HHT, FLESH_TABLE_AUTO);
  check_errors(FLESH_METHOD_GENERALIZED_ALPHA, FLESH_TABLE_AUTO);
  check_errors(FLESH_METHOD_BDF2, FLESH_TABLE_AUTO);
  check_errors(FLESH_METHOD_BACKWARD_EULER, FLESH_TABLE_AUTO);
}

/* An effect with a wrong energy: it pushes nodes along their velocities, v' = rate v, and claims that its energy is
 * 0. */
static const double rate = 4; /* 1/s, for 1 kg */

static int push(const flesh_effect *effect, const flesh_point *point, double *r)
{
  for (int d = 0; d < 3 * effect->nodes; d++) r[d] -= rate / 4 * point->v[d];
  return FLESH_OK;
}

static int push_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  (void)point, (void)slots;
  for (int i = 0; i < effect->nodes; i++)
    for (int c = 0; c < 3; c++) K->values[9 * (size_t)K->row_start[i] + 4 * (size_t)c] -= rate / 4 * shift->v;
  return FLESH_OK;
}

static int push_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  for (int d = 0; d < 3 * effect->nodes; d++) {
    const double part = rate / 8 * point->v[d] * point->v[d] / shift->v;
    *phi -= part;
    *magnitude += part;
  }
  return FLESH_OK;
}

static int no_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  (void)effect, (void)point;
  *energy = 0;
  return FLESH_OK;
}

typedef struct account {
  double last, most; /* J; of the speed, and the largest rise in a step */
  int steps, rejected;
} account;

static int see_energy(void *data, const flesh_internal_step *step)
{
  account *a = data;
  double energy = 0;
  for (int d = 0; d < 12; d++) energy += step->state->v[d] * step->state->v[d] / 8;
  a->most = fmax(a->most, energy / a->last - 1);
  a->last = energy;
  a->steps++;
  a->rejected += step->rejected;
  return FLESH_OK;
}

/* The error of uniform acceleration is small, so that only the energy refuses steps; where halving does not help,
 * backward Euler is used. */
static void gains_of_energy_shorten_steps(void)
{
  static const flesh_effect_operations operations = {.name = "push", .role = FLESH_ROLE_DAMPING, .residual = push,
                                                     .jacobian = push_jacobian, .potential = push_potential,
                                                     .energy = no_energy};
  account seen[2] = {{0}};
  for (int lies = 0; lies < 2; lies++) {
    const double X[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, density = 6;
    flesh_mesh *mesh = NULL;
    flesh_system *system = NULL;
    flesh_effect *effect = NULL;
    flesh_integrator *integrator = NULL;
    CHECK_OK(flesh_mesh_create(4, X, 1, (const int[]){0, 1, 2, 3}, NULL, &mesh));
    const flesh_body body = {.mesh = mesh, .density = &density};
    CHECK_OK(flesh_system_create(mesh, &system));
    CHECK_OK(flesh_effect_inertia(&body, &effect));
    CHECK_OK(flesh_system_add_effect(system, &effect));
    if (lies) {
      CHECK_OK(flesh_effect_create(&operations, mesh, NULL, &effect));
      CHECK_OK(flesh_system_add_effect(system, &effect));
    }
    CHECK_OK(flesh_system_finalize(system));
    double x[12], v[12];
    for (int d = 0; d < 12; d++) x[d] = X[d], v[d] = d % 3 == 0;
    flesh_state state = {.x = x, .v = v};
    flesh_solver_options options;
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_integrator_create(system, FLESH_METHOD_RUNGE_KUTTA, &options, &integrator));
    CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY));
    flesh_adaptive_options adaptive;
    flesh_adaptive_options_default(&adaptive);
    adaptive.control = 1;
    adaptive.tolerance = 0.02;
    adaptive.observe = see_energy;
    adaptive.observe_data = &seen[lies];
    seen[lies].last = 0.5;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    CHECK_OK(flesh_integrator_step(integrator, &state, 0.2, NULL));
    printf("# %s: %d steps, %d rejected, at most %.2g of the energy more in a step\n", lies ? "lies" : "honest",
           seen[lies].steps, seen[lies].rejected, seen[lies].most);
    if (lies) CHECK_NEAR(x[0], (exp(0.2 * rate) - 1) / rate, adaptive.tolerance);
    flesh_integrator_destroy(&integrator);
    flesh_system_destroy(&system);
    flesh_mesh_destroy(&mesh);
  }
  CHECK(seen[0].rejected == 0 && seen[0].steps < 10);
  CHECK(seen[1].rejected > 5 && seen[1].steps > 10 * seen[0].steps);
  CHECK_BELOW(seen[1].most, 0.012);
}

/* The table of three solves a step is used while a body that its motion crumples is inverted, however easy its steps
 * are to solve, unless they resolve the motion with one iteration per stage; the steps are adaptive nevertheless. */
static void inverted_bodies_keep_the_table_that_damps(void)
{
  static const double tolerances[] = {0.1, 1e-3}, ends[] = {0.04, 0.02};
  for (int resolved = 0; resolved < 2; resolved++) {
    test_body b;
    CHECK_OK(test_body_create(test_box(4, 2, 2, 4, 2, 2), test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    test_jitter(b.n, 100, 5, b.state.v);
    flesh_solve_stats stats = {0};
    flesh_integrator *integrator = integrator_of(&b, FLESH_TABLE_AUTO, tolerances[resolved]);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, ends[resolved], &stats));
    const flesh_solve_stats before = stats;
    CHECK_OK(flesh_integrator_step(integrator, &b.state, ends[resolved], &stats));
    int inverted;
    flesh_mesh_jacobian_bounds(b.mesh, b.state.x, NULL, NULL, &inverted);
    const int tried = stats.steps + stats.rejected - before.steps - before.rejected, solves = stats.solves - before.solves;
    printf("# %d tries, %d solves, %d Newton iterations, %d damped; %d tets inverted\n", tried, solves,
           stats.newton - before.newton, stats.damped_steps, inverted);
    CHECK(inverted > 4 && tried > 10 && solves == (resolved ? 4 : 3) * tried && stats.damped_steps == 0);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Bodies that start with random nodes are recovered by few steps of backward Euler, and continue with their own
 * method. */
static void bodies_that_begin_tangled_are_led_out(void)
{
  static const double ratios[] = {0.3, 0.45, 0.49, 0.499};
  const flesh_energy energies[] = {FLESH_ENERGY_S, FLESH_ENERGY_E};
  for (int k = 0; k < 8; k++) {
    test_body b;
    flesh_mesh *mesh = test_box(4, 2, 2, 0.2, 0.1, 0.1);
    if (k == 5) {
      flesh_mesh *corners = mesh;
      CHECK_OK(flesh_mesh_raise_order(corners, &mesh));
      flesh_mesh_destroy(&corners);
    }
    CHECK_OK(test_body_create(mesh, test_material(energies[k % 2], ratios[k / 2]), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 0; d < b.n; d++) b.state.x[d] = d % 3 ? 0.05 : 0.1;
    for (int c = 0; c < 3; c++) {
      double *along = calloc((size_t)b.n, sizeof *along);
      test_jitter(b.n, c ? 0.05 : 0.1, 7 + (unsigned)k, along);
      for (int d = c; d < b.n; d += 3) b.state.x[d] += along[d];
      free(along);
    }
    flesh_solve_stats stats = {0};
    flesh_integrator *integrator = integrator_of(&b, FLESH_TABLE_AUTO, 1e-2);
    flesh_adaptive_options few;
    flesh_adaptive_options_default(&few);
    few.control = 1;
    few.tolerance = 1e-2;
    few.max_steps = 30;
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &few));
    for (int step = 0; step < 30 && stats.newton <= 450; step++)
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
    int inverted;
    flesh_mesh_jacobian_bounds(b.mesh, b.state.x, NULL, NULL, &inverted);
    printf("# %g: %d steps, %d damped, %d Newton iterations, %d tets inverted\n", ratios[k / 2], stats.steps, stats.damped_steps,
           stats.newton, inverted);
    CHECK(inverted == 0 && stats.steps <= 40 && stats.newton <= 450);
    CHECK(stats.damped_steps >= 3 && stats.damped_steps <= 20);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Sums of what internal steps report. */
typedef struct steps_seen {
  double t;
  int steps, rejected, gaps, off_grid;
} steps_seen;

static int see_step(void *data, const flesh_internal_step *step)
{
  steps_seen *s = data;
  s->gaps += fabs(s->t + step->h - step->t) > 1e-12;
  s->t = step->t;
  s->steps++;
  s->rejected += step->rejected;
  return FLESH_OK;
}

/* An impact that no event announces: a force along z for a sixth of a second. */
static int blow(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const int now = point->t > 0.53 && point->t < 0.7;
  for (int i = 0; i < effect->nodes && now; i++) r[3 * i + 2] -= 1e4;
  return FLESH_OK;
}

static int blow_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  (void)effect, (void)point, (void)shift, (void)K, (void)slots;
  return FLESH_OK;
}

static int blow_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const int now = point->t > 0.53 && point->t < 0.7;
  for (int i = 0; i < effect->nodes && now; i++) {
    const double part = -1e4 * point->x[3 * i + 2] / shift->x;
    *phi += part;
    *magnitude += fabs(part);
  }
  return FLESH_OK;
}

/* Steps are rejected where a bar is hit; internal steps join, and outputs are ends of steps. */
static void errors_reject_steps(void)
{
  static const flesh_effect_operations operations = {.name = "blow", .role = FLESH_ROLE_LOAD, .residual = blow,
                                                     .jacobian = blow_jacobian, .potential = blow_potential};
  test_body b;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_effect_create(&operations, b.mesh, NULL, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 2; d < b.n; d += 3) b.state.v[d] = 0.1 * b.state.x[d - 2] * b.state.x[d - 2];
  flesh_integrator *integrator = integrator_of(&b, FLESH_TABLE_AUTO, 1e-3);
  steps_seen seen = {0};
  flesh_solve_stats stats = {0};
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = 1;
  adaptive.tolerance = 1e-3;
  adaptive.observe = see_step;
  adaptive.observe_data = &seen;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  for (int k = 1; k <= 10; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1 * k - b.state.t, &stats));
    seen.off_grid += fabs(seen.t - 0.1 * k) > 1e-12;
  }
  printf("# %d steps, %d rejected\n", seen.steps, seen.rejected);
  CHECK(seen.rejected > 0 && seen.rejected == stats.rejected + stats.convergence_failures);
  CHECK(seen.steps == stats.steps && seen.gaps == 0 && seen.off_grid == 0);
  adaptive.max_steps = 3;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  CHECK(flesh_integrator_step(integrator, &b.state, 1, NULL) == FLESH_ERR_INTEGRATOR);
  CHECK_TEXT(flesh_error_text(), "max_steps = 3");
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Forces at ends of steps balance as accurately as requested. */
static int see_balance(void *data, const flesh_internal_step *step)
{
  const flesh_solve_stats *stats = data;
  printf("# t = %g s: a residual of %.3g of that wanted\n", step->t, stats->residual_last / stats->residual_target);
  CHECK_BELOW(stats->residual_last, 1.0001 * stats->residual_target);
  return FLESH_OK;
}

/* A viscous bar that moves by long steps has the viscosity of the shape at a step's end, also if the last iteration
 * hardly moved it. */
static void viscosity_is_that_of_the_end(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(4, 1, 1, 4, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_effect_viscosity(&b.body, 3e3, 3e3, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 2; d < b.n; d += 3) b.state.v[d] = 2 * b.state.x[d - 2];
  flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_BDF2, 1e-8);
  flesh_solve_stats stats = {0};
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = 1;
  adaptive.tolerance = 1e-1;
  adaptive.observe = see_balance;
  adaptive.observe_data = &stats;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  for (int s = 0; s < 4; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, &stats));
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void what_has_no_estimate_is_refused(void)
{
  static const flesh_method methods[] = {FLESH_METHOD_STATIC, FLESH_METHOD_MIDPOINT};
  static const char *const sentences[] = {"the error of static is not estimated", "the error of midpoint is not estimated"};
  test_body b;
  make_bar(FLESH_ENERGY_S, FLESH_MASS_LUMPED, &b);
  flesh_integrator *integrator = NULL;
  for (int k = 0; k < 2; k++) {
    flesh_integrator_destroy(&integrator);
    integrator = motion_integrator(&b, methods[k], 1e-8);
    flesh_adaptive_options adaptive;
    flesh_adaptive_options_default(&adaptive);
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    adaptive.control = 1;
    CHECK(flesh_integrator_set_adaptive(integrator, &adaptive) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), sentences[k]);
  }
  flesh_method_options options;
  flesh_method_options_default(&options);
  options.table = (flesh_table)9;
  CHECK(flesh_integrator_set_method_options(integrator, &options) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "there is no table 9");
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(tables_have_their_orders),
                   TEST(stages_begin_at_the_cubic_between_those_before), TEST(orders_are_as_promised),
                   TEST(orders_survive_events_and_moving_constraints), TEST(oscillators_follow_the_stability_function),
                   TEST_LONG(errors_follow_the_tolerance), TEST(gains_of_energy_shorten_steps),
                   TEST(errors_reject_steps), TEST(inverted_bodies_keep_the_table_that_damps),
                   TEST(bodies_that_begin_tangled_are_led_out), TEST(viscosity_is_that_of_the_end),
                   TEST(what_has_no_estimate_is_refused));
}
