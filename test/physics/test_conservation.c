// TEST name=test_conservation_quick quick excerpt args: no_method_makes_energy midpoint_keeps_both_momenta
// TEST+ every_method_keeps_momenta_by_its_order methods_converge_to_another_codes_motion small_systems_agree_with_gsl
// TEST full seconds=120
/* test_conservation.c: conservation of energy and momenta by each method, and agreement with exact motions: another
 * code's trajectories and GSL's of small systems. */
#include <gsl/gsl_eigen.h>

#include "methods.h"
#include "motion_reference.h"

static double energy_of(const test_body *b, const flesh_state *state)
{
  double *zeros = calloc((size_t)b->n, sizeof *zeros), energies[8], sum = 0;
  const flesh_point point = flesh_point_at(state->t, state->x, state->v, zeros);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  for (int e = 0; e < flesh_system_effect_count(b->system); e++) sum += energies[e];
  free(zeros);
  return sum;
}

/* Returns the angular frequency of the lowest mode of the clamped rest shape, and its shape in `mode` [n] with largest
 * entry 1. */
static double lowest_mode(const test_body *b, double *mode)
{
  int n = b->n, free_count = 0;
  uint8_t *fixed = malloc((size_t)n);
  int *dofs = malloc((size_t)n * sizeof *dofs);
  double *mass = malloc((size_t)n * sizeof *mass), *zeros = calloc((size_t)n, sizeof *zeros);
  flesh_block_matrix *K = NULL;
  flesh_system_fixed(b->system, 0, fixed);
  for (int d = 0; d < n; d++)
    if (!fixed[d]) dofs[free_count++] = d;
  flesh_mesh_lumped_mass(b->mesh, b->density, mass);
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  const flesh_point rest = flesh_point_at(0, flesh_mesh_positions(b->mesh), zeros, zeros);
  CHECK_OK(flesh_system_jacobian(b->system, &rest, &(flesh_shift){.x = 1}, K));
  double *H = test_dense(K);
  gsl_matrix *A = gsl_matrix_alloc((size_t)free_count, (size_t)free_count),
             *vectors = gsl_matrix_alloc((size_t)free_count, (size_t)free_count);
  gsl_vector *values = gsl_vector_alloc((size_t)free_count);
  gsl_eigen_symmv_workspace *work = gsl_eigen_symmv_alloc((size_t)free_count);
  for (int i = 0; i < free_count; i++)
    for (int j = 0; j < free_count; j++)
      gsl_matrix_set(A, (size_t)i, (size_t)j, H[dofs[i] * n + dofs[j]] / sqrt(mass[dofs[i] / 3] * mass[dofs[j] / 3]));
  gsl_eigen_symmv(A, values, vectors, work);
  gsl_eigen_symmv_sort(values, vectors, GSL_EIGEN_SORT_VAL_ASC);
  double largest = 0, w = sqrt(gsl_vector_get(values, 0));
  memset(mode, 0, (size_t)n * sizeof *mode);
  for (int i = 0; i < free_count; i++) {
    mode[dofs[i]] = gsl_matrix_get(vectors, (size_t)i, 0) / sqrt(mass[dofs[i] / 3]);
    largest = fmax(largest, fabs(mode[dofs[i]]));
  }
  for (int d = 0; d < n; d++) mode[d] /= largest;
  printf("# modes from %.4g to %.4g rad/s\n", w, sqrt(gsl_vector_get(values, (size_t)free_count - 1)));
  gsl_eigen_symmv_free(work);
  gsl_matrix_free(A);
  gsl_matrix_free(vectors);
  gsl_vector_free(values);
  flesh_block_matrix_destroy(&K);
  free(H);
  free(fixed);
  free(dofs);
  free(mass);
  free(zeros);
  return w;
}

typedef struct energy_record {
  double last, lowest, highest, trend; /* of E/E(0) - 1; trend: rise of the fitted line over the run */
} energy_record;

/* A bar 3 x 1 x 1 m swings from its lowest mode, bent by `amplitude` m, for `periods` of that mode with h = T/50. */
static energy_record swing(flesh_energy energy, flesh_method method, double amplitude, int periods)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(energy, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  double *mode = malloc((size_t)b.n * sizeof *mode), rest = energy_of(&b, &b.state);
  double period = 2 * M_PI / lowest_mode(&b, mode), h = period / 50;
  for (int d = 0; d < b.n; d++) b.state.x[d] += amplitude * mode[d];
  double start = energy_of(&b, &b.state) - rest;
  int samples = 10 * periods;
  double *t = malloc((size_t)samples * sizeof *t), *e = malloc((size_t)samples * sizeof *e);
  flesh_integrator *integrator = motion_integrator(&b, method, 1e-10);
  energy_record record = {0};
  double tip = 0;
  for (int k = 0; k < samples; k++) {
    for (int step = 0; step < 5; step++) CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    t[k] = (k + 1.) / samples;
    e[k] = (energy_of(&b, &b.state) - rest) / start - 1;
    record.lowest = fmin(record.lowest, e[k]);
    record.highest = fmax(record.highest, e[k]);
    if (k >= samples - 10) tip = fmax(tip, test_distance(b.n, b.state.x, flesh_mesh_positions(b.mesh)));
  }
  record.last = e[samples - 1];
  double c0, c00, c01, c11, sum;
  gsl_fit_linear(t, 1, e, 1, (size_t)samples, &c0, &record.trend, &c00, &c01, &c11, &sum);
  printf("# %s, %s, %d periods of %.3g s, %.3g J: energy off by %.3g to %.3g, %.3g at the end, trend %.3g; swings %.3g "
         "m at the end\n",
         flesh_energy_name(energy), flesh_method_name(method), periods, period, start, record.lowest, record.highest,
         record.last, record.trend, tip);
  flesh_integrator_destroy(&integrator);
  free(mode);
  free(t);
  free(e);
  test_body_destroy(&b);
  return record;
}

/* The energy of the discrete motion oscillates within fixed bounds: the larger the amplitude, the wider they are. */
static void midpoint_keeps_the_energy_for_1000_periods(void)
{
  energy_record far = swing(FLESH_ENERGY_S, FLESH_METHOD_MIDPOINT, 0.3, 1000),
                near = swing(FLESH_ENERGY_NEO, FLESH_METHOD_MIDPOINT, 0.1, 1000);
  CHECK(far.lowest > -0.01 && far.highest < 0.01);
  CHECK(near.lowest > -0.001 && near.highest < 0.001);
  CHECK_BELOW(fabs(far.trend), 2e-4);
  CHECK_BELOW(fabs(near.trend), 2e-5);
  energy_record lost = swing(FLESH_ENERGY_S, FLESH_METHOD_BACKWARD_EULER, 0.3, 10);
  CHECK(lost.last < -0.5);
}

/* No method creates energy; those of order 1 lose much, and those without damping keep it. */
static void no_method_makes_energy(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    const energy_record e = swing(FLESH_ENERGY_S, method, 0.1, 10);
    const int keeps = method == FLESH_METHOD_MIDPOINT || method == FLESH_METHOD_NEWMARK;
    CHECK_BELOW(e.highest, 2e-3);
    CHECK(flesh_method_order(method) == 1 ? e.last < -0.5 : keeps ? e.lowest > -2e-3 : e.last < 0 && e.lowest > -0.2);
  }
}

/* The bar of the next test, thrown so that it tumbles, strongly deformed. */
static void throw_wildly(test_body *b)
{
  for (int i = 0; i < b->n / 3; i++) {
    const double *X = b->state.x + 3 * i;
    double *v = b->state.v + 3 * i;
    v[0] = 3 - 6 * (X[1] - 0.5) + 4 * X[0];
    v[1] = -1 + 6 * (X[0] - 1) - 3 * X[2];
    v[2] = 2 + 3 * X[1] * X[0];
  }
}

/* Linear momentum is conserved up to the residuals of solves, and angular momentum up to the order of the method: with
 * half the step its error is a half or a quarter. */
static void every_method_keeps_momenta_by_its_order(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    double off[2];
    for (int fine = 0; fine < 2; fine++) {
      test_body b;
      double first[6], last[6];
      CHECK_OK(test_body_create(test_box(3, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED,
                                1, &b));
      CHECK_OK(flesh_system_finalize(b.system));
      throw_wildly(&b);
      test_momenta(&b, first);
      flesh_integrator *integrator = motion_integrator(&b, method, 1e-11);
      for (int step = 0; step < 60 << fine; step++)
        CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / (600 << fine), NULL));
      test_momenta(&b, last);
      for (int c = 0; c < 3; c++) CHECK_NEAR(last[c], first[c], 1e-9 * test_norm(3, first));
      for (int c = 0; c < 3; c++) last[3 + c] -= first[3 + c];
      off[fine] = test_norm(3, last + 3) / test_norm(3, first + 3);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
    printf("# %s: angular momentum off by %.3g, with half the step by %.3g\n", flesh_method_name(method), off[0], off[1]);
    if (method == FLESH_METHOD_MIDPOINT) CHECK_BELOW(off[0], 1e-9);
    else CHECK(log2(off[0] / off[1]) > flesh_method_order(method) - 0.3);
  }
}

/* A free body that tumbles, strongly deformed. p and L change in a step by h sum r and h sum x_mid cross r, where r is
 * the residual that the solve leaves at the middle: at most sqrt(nodes) |r|, times the arm. */
static void midpoint_keeps_both_momenta(void)
{
  for (int mass = 0; mass < 2; mass++)
    for (int loose = 0; loose < 2; loose++) {
      test_body b;
      const double h = 1. / 60, nodes = 36;
      CHECK_OK(test_body_create(test_box(3, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, (flesh_mass)mass,
                                1, &b));
      CHECK_OK(flesh_system_finalize(b.system));
      throw_wildly(&b);
      CHECK(b.n == 3 * nodes);
      flesh_integrator *integrator = motion_integrator(&b, FLESH_METHOD_MIDPOINT, loose ? 1e-5 : 1e-10);
      double before[6], after[6], first[6], turned = 0, sum = 0;
      test_momenta(&b, first);
      memcpy(before, first, sizeof before);
      for (int step = 0; step < 60; step++) {
        flesh_solve_stats stats = {0};
        double arm = 0, middle = b.state.x[0];
        for (int d = 0; d < b.n; d++) arm = fmax(arm, fabs(b.state.x[d]) + h * fabs(b.state.v[d]));
        CHECK_OK(flesh_integrator_step(integrator, &b.state, h, &stats));
        const double size = test_momenta(&b, after);
        double bound = h * sqrt(nodes) * stats.residual_last;
        CHECK(stats.solves == 1 && stats.residual_last <= stats.residual_target);
        for (int c = 0; c < 3; c++) {
          CHECK_NEAR(after[c], before[c], bound + 1e-13 * size);
          CHECK_NEAR(after[3 + c], before[3 + c], 3 * arm * bound + 1e-12 * size * arm);
        }
        sum += 3 * arm * bound + 1e-12 * size * arm;
        turned = fmax(turned, fabs(b.state.x[0] - middle));
        memcpy(before, after, sizeof before);
      }
      for (int c = 0; c < 6; c++) CHECK_NEAR(after[c], first[c], sum);
      printf("# %s, tolerance %g: L was %.8g, %.8g, %.8g and is %.8g, %.8g, %.8g kg m^2/s\n",
             mass ? "consistent" : "lumped", loose ? 1e-5 : 1e-10, first[3], first[4], first[5], after[3], after[4],
             after[5]);
      if (!loose)
        for (int c = 0; c < 6; c++) CHECK_NEAR(after[c], first[c], 1e-7 * test_norm(3, first + c / 3 * 3));
      CHECK(turned > 0.05);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* Every method converges to the exact motion of another code with its order; the extrapolated midpoint rule reaches
 * it. */
static void methods_converge_to_another_codes_motion(void)
{
  const char *const names[] = {"grav_lumped_ref_states.txt", "grav_consistent_ref_states.txt"};
  const double end = 0.1;
  for (int mass = 0; mass < 2; mass++) {
    test_body b;
    flesh_mesh *mesh = NULL;
    flesh_material material;
    CHECK_OK(flesh_mesh_read("reference/oracle/bar_8x2x2.mesh", &mesh));
    CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
    CHECK_OK(test_body_create(mesh, material, 1000, (flesh_mass)mass, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.8));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_state exact = state_copy(b.n, &b.state), best = state_copy(b.n, &b.state);
    motion_read_states(names[mass], end, b.n / 3, &exact);
    for_every_method(method, TEST_FIXED_STEPS) {
      enum { RUNS = 3 };
      double h[RUNS], error[RUNS];
      for (int k = 0; k < RUNS; k++) {
        flesh_state state = state_copy(b.n, &b.state);
        int steps = (method == FLESH_METHOD_BDF2 ? 200 : 100) << k;
        h[k] = end / steps;
        motion_run(&b, method, 1e-9, steps, end, &state);
        error[k] = motion_distance(b.n, state.x, exact.x);
        if (method == FLESH_METHOD_MIDPOINT && k > 0) /* Richardson extrapolation removes the error's h^2 from the last two */
          for (int d = 0; d < b.n; d++) best.x[d] = k == 1 ? state.x[d] : (4 * state.x[d] - best.x[d]) / 3;
        state_free(&state);
      }
      double order = fitted_order(RUNS, h, error);
      printf("# %s, %s: order %.3f, errors %.3g to %.3g m\n", names[mass], flesh_method_name(method), order, error[0],
             error[RUNS - 1]);
      /* The first three steps of runge-kutta have a larger error, which falls faster. */
      if (method == FLESH_METHOD_RUNGE_KUTTA) CHECK(order > 2.9);
      else CHECK_NEAR(order, flesh_method_order(method), 0.1);
    }
    double off = motion_distance(b.n, best.x, exact.x);
    printf("# %s: extrapolated midpoint off by %.3g m\n", names[mass], off);
    CHECK_BELOW(off, 1e-8);
    state_free(&exact);
    state_free(&best);
    test_body_destroy(&b);
  }
}

/* Free bodies that oscillate by a fifth of their length; midpoint with h, h/2, h/4, h/8, with the errors' h^2, h^4 and
 * h^6 removed (Richardson; a symmetric method has only even powers), against GSL. */
static void check_small(flesh_mesh *mesh, const char *name)
{
  enum { LEVELS = 4 };
  test_body b;
  const double end = 1;
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < b.n / 3; i++) {
    double *x = b.state.x + 3 * i;
    x[2] *= 1.2;
    x[0] += 0.1 * x[1];
    b.state.v[3 * i + 1] = 0.3 * x[0];
  }
  flesh_state exact = state_copy(b.n, &b.state), level[LEVELS];
  motion_reference_run(&b, end, 1e-13, &exact);
  double moved = motion_distance(b.n, exact.x, b.state.x);
  for (int k = 0; k < LEVELS; k++) {
    level[k] = state_copy(b.n, &b.state);
    motion_run(&b, FLESH_METHOD_MIDPOINT, 1e-13, 500 << k, end, &level[k]);
  }
  double plain = motion_distance(b.n, level[LEVELS - 1].x, exact.x);
  for (int power = 1; power < LEVELS; power++)
    for (int k = LEVELS - 1; k >= power; k--)
      for (int d = 0; d < b.n; d++) {
        double q = pow(4, power);
        level[k].x[d] = (q * level[k].x[d] - level[k - 1].x[d]) / (q - 1);
        level[k].v[d] = (q * level[k].v[d] - level[k - 1].v[d]) / (q - 1);
      }
  double off = motion_distance(b.n, level[LEVELS - 1].x, exact.x),
         speed = motion_distance(b.n, level[LEVELS - 1].v, exact.v);
  printf("# %s: midpoint off by %.3g m, extrapolated by %.3g m and %.3g m/s; moved %.3g m\n", name, plain, off, speed,
         moved);
  CHECK_BELOW(off, 1e-9);
  CHECK_BELOW(speed, 2e-8);
  CHECK(plain > 1e-7 && moved > 0.05);
  for (int k = 0; k < LEVELS; k++) state_free(&level[k]);
  state_free(&exact);
  test_body_destroy(&b);
}

static void small_systems_agree_with_gsl(void)
{
  flesh_mesh *tet = NULL;
  const double X[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  CHECK_OK(flesh_mesh_create(4, X, 1, (const int[]){0, 1, 2, 3}, NULL, &tet));
  check_small(tet, "one tet");
  check_small(test_box(1, 1, 1, 1, 1, 1), "a cube of six tets");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(midpoint_keeps_the_energy_for_1000_periods), TEST(no_method_makes_energy),
                   TEST(midpoint_keeps_both_momenta), TEST(every_method_keeps_momenta_by_its_order),
                   TEST(methods_converge_to_another_codes_motion), TEST(small_systems_agree_with_gsl));
}
