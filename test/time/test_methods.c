// TEST quick seconds=120 builds=plain
/* test_methods.c: the fixed-step methods against GSL's integrators, closed forms and another code: orders, moving
 * constraints, events, restarts, damping. */
#include <gsl/gsl_math.h>

#include "busy_bar.h"
#include "motion_reference.h"
#include "oscillator.h"

/* All methods of order 2. */
enum { METHODS_LIMIT = 32 };
static flesh_method second_order[METHODS_LIMIT];
static int second_order_count;

static void find_second_order(void)
{
  for (int m = 0; flesh_method_name((flesh_method)m); m++)
    if (flesh_method_order((flesh_method)m) == 2 && second_order_count < METHODS_LIMIT)
      second_order[second_order_count++] = (flesh_method)m;
}

static double order_of(const test_body *b, flesh_method method, double end, const flesh_state *exact, int coarsest)
{
  enum { RUNS = 4 };
  double h[RUNS], error[RUNS];
  for (int k = 0; k < RUNS; k++) {
    flesh_state state = state_copy(b->n, &b->state);
    h[k] = end / (coarsest << k);
    motion_run(b, method, 1e-11, coarsest << k, end, &state);
    error[k] = motion_distance(b->n, state.x, exact->x);
    state_free(&state);
  }
  double order = fitted_order(RUNS, h, error);
  printf("# %s: order %.3f, errors %.3g ... %.3g m\n", flesh_method_name(method), order, error[0], error[RUNS - 1]);
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
    CHECK_NEAR(order_of(&b, FLESH_METHOD_BACKWARD_EULER, 0.5, &exact, 200), 1, 0.1);
    for (int k = 0; k < second_order_count; k++) {
      CHECK_NEAR(order_of(&b, second_order[k], 0.5, &exact, 50), 2, 0.1);
      CHECK(flesh_method_order(second_order[k]) == 2);
    }
    state_free(&exact);
    test_body_destroy(&b);
  }
}


/* Makes steps whose neighbours differ by random factors up to `ratio`, or by exactly that, alternating. */
static void check_variable_steps(double ratio, int in_turn)
{
  enum { RUNS = 5 };
  test_body b;
  double h[RUNS], error[RUNS];
  make_bar(FLESH_ENERGY_S, FLESH_MASS_LUMPED, &b);
  flesh_state exact = state_copy(b.n, &b.state);
  motion_reference_run(&b, 0.5, 1e-13, &exact);
  for (int k = 0; k < RUNS; k++) {
    int steps = 100 << k;
    unsigned long long random = 7;
    double *part = malloc((size_t)steps * sizeof *part), sum = 0;
    for (int j = 0; j < steps; j++) sum += part[j] = pow(ratio, in_turn ? j % 2 : test_uniform(&random));
    flesh_state state = state_copy(b.n, &b.state);
    flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_BDF2, 1e-11);
    for (int j = 0; j < steps; j++)
      CHECK_OK(flesh_integrator_step(integrator, &state, 0.5 * part[j] / sum, NULL));
    h[k] = 0.5 / steps;
    CHECK_NEAR(state.t, 0.5, 1e-12);
    error[k] = motion_distance(b.n, state.x, exact.x);
    flesh_integrator_destroy(&integrator);
    state_free(&state);
    free(part);
  }
  double order = fitted_order(RUNS, h, error);
  printf("# bdf2, steps differ by up to %g: order %.3f, errors %.3g ... %.3g m\n", ratio, order, error[0],
         error[RUNS - 1]);
  CHECK_NEAR(order, 2, 0.1);
  state_free(&exact);
  test_body_destroy(&b);
}

static void bdf2_keeps_its_order_with_variable_steps(void)
{
  check_variable_steps(2, 0);
  check_variable_steps(2, 1);
  check_variable_steps(100, 1);
}

/* The formula is not zero-stable if steps grow by more than 1 + sqrt 2: such a step is treated as a first one. */
static void bdf2_starts_anew_where_steps_grow_fast(void)
{
  for (int fast = 0; fast < 2; fast++) {
    test_body b;
    make_bar(FLESH_ENERGY_S, FLESH_MASS_LUMPED, &b);
    flesh_integrator *grown = motion_integrator(&b, FLESH_METHOD_BDF2, 1e-10),
                     *first = motion_integrator(&b, FLESH_METHOD_BDF2, 1e-10);
    CHECK_OK(flesh_integrator_step(grown, &b.state, 0.01, NULL));
    flesh_state state = state_copy(b.n, &b.state);
    CHECK_OK(flesh_integrator_step(grown, &b.state, fast ? 0.0201 : 0.02, NULL));
    CHECK_OK(flesh_integrator_step(first, &state, fast ? 0.0201 : 0.02, NULL));
    int same = !memcmp(b.state.x, state.x, (size_t)b.n * sizeof *state.x);
    CHECK(same == fast);
    flesh_integrator_destroy(&grown);
    flesh_integrator_destroy(&first);
    state_free(&state);
    test_body_destroy(&b);
  }
}

static void orders_survive_events_and_moving_constraints(void)
{
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    make_busy_bar((flesh_mass)mass, &b);
    flesh_state exact = motion_exact(&b, (flesh_mass)mass, 20000, 0.5);
    /* Backward Euler is not affected by events and constraints. */
    CHECK_NEAR(order_of(&b, FLESH_METHOD_BACKWARD_EULER, 0.5, &exact, 400), 1, 0.15);
    for (int k = 0; k < second_order_count; k++) CHECK_NEAR(order_of(&b, second_order[k], 0.5, &exact, 200), 2, 0.1);
    state_free(&exact);
    test_body_destroy(&b);
  }
}

/* Constrained dofs are at their positions at the ends of steps, with the motion's own velocity. */
static void constrained_dofs_follow_their_motion(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_CONSISTENT, &b);
  for (int k = 0; k < second_order_count; k++) {
    flesh_state state = state_copy(b.n, &b.state);
    double *x = malloc((size_t)b.n * sizeof *x), *later = malloc((size_t)b.n * sizeof *later), slowest = 1;
    uint8_t *fixed = malloc((size_t)b.n);
    flesh_integrator *integrator = motion_integrator(&b, second_order[k], 1e-10);
    for (int step = 1; step <= 20; step++) {
      CHECK_OK(flesh_integrator_step(integrator, &state, 0.023, NULL));
      memcpy(x, state.x, (size_t)b.n * sizeof *x);
      memcpy(later, state.x, (size_t)b.n * sizeof *x);
      flesh_system_prescribe(b.system, state.t, x);
      flesh_system_prescribe(b.system, state.t - 1e-6, later);
      flesh_system_fixed(b.system, state.t, fixed);
      double position = 0, velocity = 0, size = 0;
      for (int d = 0; d < b.n; d++) {
        if (!fixed[d]) continue;
        position = fmax(position, fabs(state.x[d] - x[d]));
        velocity = fmax(velocity, fabs(state.v[d] - (x[d] - later[d]) / 1e-6));
        size = fmax(size, fabs(state.v[d]));
      }
      CHECK_BELOW(position, 1e-15);
      CHECK_BELOW(velocity, 2e-5);
      if (state.t < 0.4) slowest = fmin(slowest, size);
    }
    CHECK(slowest > 0.1); /* they moved */
    flesh_integrator_destroy(&integrator);
    state_free(&state);
    free(x);
    free(later);
    free(fixed);
  }
  test_body_destroy(&b);
}

/* A run that is stopped and continued with a new integrator. */
static double restart_difference(const test_body *b, flesh_method method, int steps)
{
  flesh_state whole = state_copy(b->n, &b->state), parted = state_copy(b->n, &b->state);
  motion_run(b, method, 1e-11, steps, 0.4, &whole);
  motion_run(b, method, 1e-11, steps / 2, 0.2, &parted);
  motion_run(b, method, 1e-11, steps / 2, 0.4, &parted);
  double difference = motion_distance(b->n, whole.x, parted.x);
  state_free(&whole);
  state_free(&parted);
  return difference;
}

static void restarts_go_on_as_if_nothing_had_been(void)
{
  test_body b;
  make_bar(FLESH_ENERGY_S, FLESH_MASS_CONSISTENT, &b);
  CHECK_BELOW(restart_difference(&b, FLESH_METHOD_BACKWARD_EULER, 80), 1e-12);
  CHECK_BELOW(restart_difference(&b, FLESH_METHOD_MIDPOINT, 80), 1e-12);
  CHECK_BELOW(restart_difference(&b, FLESH_METHOD_NEWMARK, 80), 1e-10);
  const flesh_method parted[] = {FLESH_METHOD_BDF2, FLESH_METHOD_HHT};
  for (int k = 0; k < 2; k++) {
    double coarse = restart_difference(&b, parted[k], 80), fine = restart_difference(&b, parted[k], 320);
    printf("# %s: a restart moves the end by %.3g m, with h/4 by %.3g m\n", flesh_method_name(parted[k]), coarse, fine);
    CHECK(coarse > 1e-9 && log(coarse / fine) / log(4) > 1.9);
  }
  test_body_destroy(&b);
}

/* The memory of one motion must not affect another. */
static void another_state_starts_anew(void)
{
  for (int k = 0; k < second_order_count; k++) {
    test_body b;
    make_bar(FLESH_ENERGY_S, FLESH_MASS_CONSISTENT, &b);
    flesh_state used = state_copy(b.n, &b.state), fresh = state_copy(b.n, &b.state);
    flesh_integrator *integrator = motion_integrator(&b, second_order[k], 1e-10);
    for (int step = 0; step < 5; step++) CHECK_OK(flesh_integrator_step(integrator, &used, 0.01, NULL));
    test_jitter(b.n, 0.1, 3, b.state.x);
    for (int field = 0; field < 3; field++) { /* another x, v, or t */
      for (int d = 0; d < b.n; d++) {
        if (field == 0) used.x[d] = b.state.x[d];
        if (field == 1) used.v[d] *= 0.5;
      }
      if (field == 2) used.t -= 0.02;
      memcpy(fresh.x, used.x, (size_t)b.n * sizeof *fresh.x);
      memcpy(fresh.v, used.v, (size_t)b.n * sizeof *fresh.v);
      fresh.t = used.t;
      flesh_integrator *other = motion_integrator(&b, second_order[k], 1e-10);
      for (int step = 0; step < 3; step++) {
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
  }
}

/* Steps that fail for lack of Newton iterations are retried in halves and stay as accurate. */
static void halved_steps_stay_accurate(void)
{
  test_body b;
  make_bar(FLESH_ENERGY_S, FLESH_MASS_LUMPED, &b);
  flesh_state exact = state_copy(b.n, &b.state);
  motion_reference_run(&b, 0.6, 1e-12, &exact);
  for (int k = 0; k < second_order_count; k++) {
    double error[2];
    for (int halved = 0; halved < 2; halved++) {
      flesh_state state = state_copy(b.n, &b.state);
      flesh_solver_options options;
      flesh_integrator *integrator = NULL;
      flesh_solve_stats stats = {0};
      flesh_solver_options_default(&options);
      options.newton_tolerance = 1e-7;
      options.linear_tolerance = 1e-8;
      if (halved) options.max_newton = 2;
      CHECK_OK(flesh_integrator_create(b.system, second_order[k], &options, &integrator));
      for (int step = 0; step < 12; step++) CHECK_OK(flesh_integrator_step(integrator, &state, 0.05, &stats));
      CHECK(halved ? stats.solves > 16 : stats.solves == 12);
      CHECK_NEAR(state.t, 0.6, 1e-14);
      error[halved] = motion_distance(b.n, state.x, exact.x);
      printf("# %s: %d solves for 12 steps, error %.3g m\n", flesh_method_name(second_order[k]), stats.solves,
             error[halved]);
      flesh_integrator_destroy(&integrator);
      state_free(&state);
    }
    CHECK_BELOW(error[1], 0.9 * error[0]);
  }
  state_free(&exact);
  test_body_destroy(&b);
}

/* With an energy that is undefined inside out no method may end a step there, even if its stage is valid. */
static void ends_of_steps_have_an_energy(void)
{
  for (int k = 0; k < second_order_count; k++) {
    test_body b;
    CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_NEO, 0.4), 4e4, FLESH_MASS_LUMPED,
                              1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 0; d < b.n; d++) b.state.v[d] = -35 * (b.state.x[d] - 0.5);
    flesh_integrator *integrator = motion_integrator(&b, second_order[k], 1e-8);
    flesh_solve_stats stats = {0};
    for (int step = 0; step < 10; step++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.05, &stats));
      CHECK(flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, NULL) > 0);
    }
    const int within = second_order[k] == FLESH_METHOD_MIDPOINT || second_order[k] == FLESH_METHOD_HHT ||
                       second_order[k] == FLESH_METHOD_GENERALIZED_ALPHA || second_order[k] == FLESH_METHOD_BDF2;
    if (within) CHECK(stats.solves > 10); /* steps of this kind occurred */
    printf("# %s: %d solves for 10 steps\n", flesh_method_name(second_order[k]), stats.solves);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Returns the long-term amplification of the amplitude by a step with w h = `angle`; each step is compared with the
 * recursion as written by Chung and Hulbert, which is that of Hilber, Hughes and Taylor without m. */
static double amplification(flesh_method method, const flesh_method_options *options, double angle)
{
  enum { STEPS = 400 };
  test_body b;
  const double h = 0.1, w2 = angle * angle / (h * h);
  make_oscillator(sqrt(w2), &b);
  for (int d = 0; d < 12; d++) b.state.x[d] += 1, b.state.v[d] = 0.5 / h;
  flesh_integrator *integrator = motion_integrator(&b, method, 1e-13);
  CHECK_OK(flesh_integrator_set_method_options(integrator, options));
  CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, INFINITY)); /* no step is replaced by another method's */
  const double rho = options->spectral_radius, own = method == FLESH_METHOD_GENERALIZED_ALPHA;
  const double f = own ? rho / (rho + 1) : method == FLESH_METHOD_HHT ? -options->alpha : 0;
  const double m = own ? (2 * rho - 1) / (rho + 1) : 0;
  const double beta = method == FLESH_METHOD_NEWMARK ? options->beta : (1 - m + f) * (1 - m + f) / 4;
  const double gamma = method == FLESH_METHOD_NEWMARK ? options->gamma : 0.5 - m + f;
  double x = 1, v = 0.5 / h, a = -w2 * x, energy[STEPS + 1];
  int last = 0;
  for (int step = 1; step <= STEPS; step++) {
    double predicted = x + h * v + h * h * (0.5 - beta) * a;
    double next = -(m * a + w2 * ((1 - f) * predicted + f * x)) / (1 - m + (1 - f) * w2 * beta * h * h);
    v += h * ((1 - gamma) * a + gamma * next);
    x = predicted + beta * h * h * next;
    a = next;
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    double scale = fabs(x) + fabs(v) * h;
    for (int c = 0; c < 3; c++) { /* of the centroid; the nodes' other motions have no force */
      double X = -0.25, V = 0;
      for (int i = 0; i < 4; i++) X += b.state.x[3 * i + c] / 4, V += b.state.v[3 * i + c] / 4;
      CHECK_NEAR(X, x, 1e-11 * step * scale + 1e-12);
      CHECK_NEAR(V * h, v * h, 1e-11 * step * scale + 1e-12 * (1 + angle));
    }
    energy[step] = x * x * w2 + v * v;
    last = step;
    if (energy[step] < 1e-16 * energy[1]) break; /* the rest would be rounding */
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  int half = last / 2;
  return pow(energy[last] / energy[half], 0.5 / (last - half));
}

/* The last digits of positions 1 m from the origin are worth more than the energy of motions of 1e-8 m. That is no
 * reason to cut steps to nothing, or to split them. */
static void motion_that_has_almost_died_out_is_solved_as_easily(void)
{
  flesh_method_options options;
  flesh_method_options_default(&options);
  int newton_most = 0;
  for (int trial = 0; trial < 16; trial++) {
    test_body b;
    make_oscillator(20 + 0.01 * trial, &b);
    for (int d = 0; d < 12; d++) b.state.v[d] = 5;
    options.alpha = -0.2;
    flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_HHT, 1e-13);
    CHECK_OK(flesh_integrator_set_method_options(integrator, &options));
    for (int step = 0; step < 400; step++) {
      flesh_solve_stats stats = {0};
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, &stats));
      CHECK(stats.solves == 1);
      if (stats.newton > newton_most) newton_most = stats.newton;
    }
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  printf("# at most %d Newton iterations a step\n", newton_most);
  CHECK(newton_most <= 8);
}

static void hht_damps_fast_oscillations_most(void)
{
  flesh_method_options options;
  flesh_method_options_default(&options);
  CHECK(options.alpha == -0.1 && options.beta == 0.25 && options.gamma == 0.5);
  CHECK_NEAR(amplification(FLESH_METHOD_NEWMARK, &options, 0.1), 1, 1e-4);
  CHECK_NEAR(amplification(FLESH_METHOD_NEWMARK, &options, 30), 1, 1e-4);
  options.beta = 0.3025, options.gamma = 0.6;
  CHECK_BELOW(amplification(FLESH_METHOD_NEWMARK, &options, 30), 0.95);
  for (int k = 1; k <= 3; k++) {
    options.alpha = -k / 9.;
    double slow = amplification(FLESH_METHOD_HHT, &options, 0.1), middle = amplification(FLESH_METHOD_HHT, &options, 2),
           fast = amplification(FLESH_METHOD_HHT, &options, 1e3), limit = (1 + options.alpha) / (1 - options.alpha);
    printf("# hht(%.3f) keeps %.6f of the amplitude at wh = 0.1, %.4f at 2, %.4f at 1000; %.4f at infinity\n",
           options.alpha, slow, middle, fast, limit);
    CHECK(slow > 0.999 && slow < 1 && middle < slow && fast < middle);
    CHECK_NEAR(fast, limit, 0.04);
  }
  options.alpha = 0;
  CHECK_NEAR(amplification(FLESH_METHOD_HHT, &options, 1), 1, 1e-4);
}

/* A step leaves the spectral radius of infinitely fast oscillations. Resolved oscillations are damped less than by HHT
 * with the same radius, (1 + alpha)/(1 - alpha), except for 1/2, where both are the same method; with 1 they are
 * undamped. */
static void generalized_alpha_has_its_spectral_radius(void)
{
  flesh_method_options options;
  flesh_method_options_default(&options);
  CHECK(options.spectral_radius == 0.8);
  for (int k = 0; k <= 2; k++) {
    const double rho = options.spectral_radius = 0.5 + k / 4.;
    options.alpha = (rho - 1) / (rho + 1);
    const double slow = amplification(FLESH_METHOD_GENERALIZED_ALPHA, &options, 0.3),
                 hht = amplification(FLESH_METHOD_HHT, &options, 0.3),
                 fast = rho < 1 ? amplification(FLESH_METHOD_GENERALIZED_ALPHA, &options, 1e3) : 1;
    printf("# generalized-alpha(%g) loses %.2e of the amplitude at wh = 0.3, hht %.2e; it keeps %.4f at 1000\n", rho,
           1 - slow, 1 - hht, fast);
    CHECK_NEAR(fast, rho, 0.04);
    if (rho == 0.5) CHECK_NEAR(slow, hht, 1e-10);
    else if (rho == 1) CHECK_NEAR(slow, 1, 1e-6);
    else CHECK(slow < 1 && 1 - slow < 0.2 * (1 - hht));
  }
}

/* Takes two steps of h of the oscillator from 1 m away from its rest; x of its first node after each. */
static void take_two(flesh_method method, double h, double limit, double x[2])
{
  test_body b;
  make_oscillator(100, &b);
  for (int d = 0; d < 12; d++) b.state.x[d] += 1;
  flesh_integrator *integrator = motion_integrator(&b, method, 1e-13);
  CHECK_OK(flesh_integrator_set_max_energy_gain(integrator, limit));
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    x[k] = b.state.x[0];
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Methods that continue from an acceleration start with backward Euler if the force at the start would carry the body
 * farther than its size within a step; not with a shorter step, nor if energy may grow without limit. */
static void violent_starts_are_damped(void)
{
  const flesh_method begun[] = {FLESH_METHOD_NEWMARK, FLESH_METHOD_HHT, FLESH_METHOD_GENERALIZED_ALPHA,
                                FLESH_METHOD_RUNGE_KUTTA};
  double euler[2], own[2];
  for (int k = 0; k < 4; k++) {
    take_two(FLESH_METHOD_BACKWARD_EULER, 0.1, 0.5, euler);
    take_two(begun[k], 0.1, 0.5, own);
    CHECK(own[0] == euler[0] && own[1] != euler[1]);
    take_two(begun[k], 0.1, INFINITY, own);
    CHECK(fabs(own[0] - euler[0]) > 0.01);
    take_two(FLESH_METHOD_BACKWARD_EULER, 0.01, 0.5, euler);
    take_two(begun[k], 0.01, 0.5, own);
    CHECK(fabs(own[0] - euler[0]) > 0.01);
  }
}

static void parameters_out_of_range_are_refused(void)
{
  test_body b;
  make_oscillator(1, &b);
  flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_HHT, 1e-8);
#define OPTIONS(a, b, c) {.alpha = a, .beta = b, .gamma = c}
  const flesh_method_options bad[] = {OPTIONS(-0.34, 0.25, 0.5),
                                      OPTIONS(0.1, 0.25, 0.5),
                                      OPTIONS(NAN, 0.25, 0.5),
                                      OPTIONS(-0.1, 0.2, 0.5),
                                      OPTIONS(-0.1, 0.25, 0.4),
                                      OPTIONS(-0.1, 0.25, 0.6),
                                      OPTIONS(-0.1, INFINITY, 0.5),
                                      OPTIONS(-0.1, 1, 1.1)};
#undef OPTIONS
  const char *const names[] = {"alpha", "alpha", "alpha", "beta", "gamma", "beta", "beta", "gamma"};
  for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
    CHECK(flesh_integrator_set_method_options(integrator, &bad[k]) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), names[k]);
    CHECK_TEXT(flesh_error_text(), "it must be in [");
  }
  flesh_method_options radius;
  flesh_method_options_default(&radius);
  radius.spectral_radius = 1.1;
  CHECK(flesh_integrator_set_method_options(integrator, &radius) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "spectral_radius is 1.1; it must be in [0, 1]");
  CHECK(flesh_method_name((flesh_method)99) == NULL && flesh_method_order((flesh_method)-1) == 0);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  find_second_order();
  return RUN_TESTS(argc, argv, TEST(orders_are_as_promised), TEST(bdf2_keeps_its_order_with_variable_steps),
                   TEST(bdf2_starts_anew_where_steps_grow_fast), TEST(orders_survive_events_and_moving_constraints),
                   TEST(constrained_dofs_follow_their_motion), TEST(restarts_go_on_as_if_nothing_had_been),
                   TEST(another_state_starts_anew), TEST(halved_steps_stay_accurate),
                   TEST(ends_of_steps_have_an_energy), TEST(motion_that_has_almost_died_out_is_solved_as_easily),
                   TEST(hht_damps_fast_oscillations_most),
                   TEST(generalized_alpha_has_its_spectral_radius),
                   TEST(violent_starts_are_damped), TEST(parameters_out_of_range_are_refused));
}
