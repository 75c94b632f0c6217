// TEST quick seconds=60
/* test_rounding.c: matrices are rounded to single precision only if inertia is large compared with the change by
 * rounding. */
#include <gsl/gsl_eigen.h>
#include <stdlib.h>

#include "matrices.h"
#include "mesh/rigid_fit.h"
#include "newton/newton.h"
#include "test.h"

/* Returns the largest change of x.K x by rounding K, over x.M x times shift.a, over all x that are 0 at the fixed
 * dofs. */
static double worst_change(const flesh_newton *newton)
{
  const flesh_equations *equations = &newton->equations;
  const flesh_block_matrix *K = equations->K;
  const float *inertia = newton->policy.inertia;
  const size_t n = (size_t)equations->n;
  const int numbers = 9 * K->row_start[K->rows];
  flesh_block_matrix change = *K;
  change.values = malloc((size_t)numbers * sizeof *change.values);
  for (int e = 0; e < numbers; e++) change.values[e] = K->values[e] - (double)(float)K->values[e];
  double *dense = test_dense(&change);
  gsl_matrix *E = gsl_matrix_calloc(n, n);
  gsl_vector *values = gsl_vector_alloc(n);
  gsl_eigen_symm_workspace *room = gsl_eigen_symm_alloc(n);
  for (size_t d = 0; d < n; d++)
    for (size_t e = 0; e < n; e++)
      if (!equations->constrained.is[d] && !equations->constrained.is[e])
        gsl_matrix_set(E, d, e, dense[d * n + e] / (equations->stage.shift.a * sqrt((double)inertia[d]) *
                                                    sqrt((double)inertia[e])));
  gsl_eigen_symm(E, values, room);
  const double worst = fmax(gsl_vector_max(values), -gsl_vector_min(values));
  gsl_eigen_symm_free(room);
  gsl_vector_free(values);
  gsl_matrix_free(E);
  free(dense);
  free(change.values);
  return worst;
}

/* From steps of a hundredth of a second to minutes, for bodies of soft and nearly incompressible rubber. */
static void inertia_covers_what_rounding_changes(void)
{
  static const double ratios[] = {0.3, 0.49, 0.4999};
  double largest = 0, smallest_refused = INFINITY;
  for (int k = 0; k < 3; k++) {
    test_body b;
    flesh_solver_options options;
    flesh_newton newton;
    int before = 1;
    const flesh_material material = test_material(FLESH_ENERGY_S, ratios[k]);
    /* Flat tets. */
    CHECK_OK(test_body_create(test_box(4, 2, 2, 1, 0.2, 0.02), material, 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options_default(&options);
    options.eigenvalue_filter = FLESH_FILTER_TRUST_REGION_ALWAYS;
    CHECK_OK(flesh_newton_init(b.system, &options, (flesh_stage_solver){0}, &newton));
    test_jitter(b.n, 0.002, 5, b.state.x);
    for (double h = 0.001; h < 1000; h *= 3) {
      const flesh_stage stage = {
          .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .a = 1 / (h * h)}, .x0 = b.state.x};
      flesh_newton_set_stage(&newton, &stage);
      CHECK_OK(flesh_newton_matrix(&newton, b.state.x, NULL));
      CHECK_OK(flesh_matrix_policy_refresh(&newton.policy));
      const double change = worst_change(&newton);
      if (newton.direction.single) largest = fmax(largest, change);
      else smallest_refused = fmin(smallest_refused, change);
      CHECK(before || !newton.direction.single); /* longer steps have less inertia */
      before = newton.direction.single;
    }
    CHECK(!before);
    const flesh_stage statics = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = b.state.x};
    flesh_newton_set_stage(&newton, &statics);
    CHECK_OK(flesh_newton_matrix(&newton, b.state.x, NULL));
    CHECK_OK(flesh_matrix_policy_refresh(&newton.policy));
    CHECK(!newton.direction.single);
    flesh_newton_clear(&newton);
    test_body_destroy(&b);
  }
  printf("# rounding changes at most %.2g where it is done, and at least %.2g where it is not\n", largest,
         smallest_refused);
  CHECK(largest > 1e-4);
  CHECK_BELOW(largest, 0.01);
  CHECK(smallest_refused > 1e-3);
}

/* Steps of a swinging bar are solved in single precision, its equilibrium is not; and they end where direct solves
 * end. */
static void steps_solve_in_single_precision(void)
{
  static const flesh_linear_solver solvers[] = {FLESH_LINEAR_PCG, FLESH_LINEAR_KLU};
  double *ends[2] = {NULL, NULL};
  size_t n = 0;
  for (int still = 0; still < 2; still++)
    for (int k = 0; k < 2 - still; k++) {
      test_body b;
      flesh_solver_options options = test_options(1e-10);
      flesh_integrator *integrator = NULL;
      flesh_solve_stats stats = {0};
      const flesh_material material = test_material(FLESH_ENERGY_S, 0.45);
      CHECK_OK(test_body_create(test_box(6, 2, 2, 2, 0.5, 0.5), material, 1000, FLESH_MASS_LUMPED, 1, &b));
      CHECK_OK(test_body_gravity(&b, 0, 0, still ? -0.5 : -9.81));
      CHECK_OK(test_body_clamp(&b, 1e-9));
      CHECK_OK(flesh_system_finalize(b.system));
      options.linear_solver = solvers[k];
      CHECK_OK(flesh_integrator_create(b.system, still ? FLESH_METHOD_STATIC : FLESH_METHOD_BACKWARD_EULER, &options,
                                       &integrator));
      for (int step = 0; step < (still ? 1 : 20); step++)
        CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
      printf("# %d of %d linear iterations in single precision\n", stats.linear_single, stats.linear);
      if (still || k) CHECK(stats.linear_single == 0);
      else CHECK(stats.linear_single > 0.9 * stats.linear);
      if (!still) {
        n = (size_t)b.n;
        ends[k] = malloc(n * sizeof *ends[k]);
        memcpy(ends[k], b.state.x, n * sizeof *ends[k]);
      }
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
  CHECK_BELOW(test_distance((int)n, ends[0], ends[1]), 1e-8); /* of 2 m */
  free(ends[0]);
  free(ends[1]);
}

/* The solve ends less than a thousandth of a millimetre from rest. Returns whether its residual was at round-off
 * then. */
static int relax_with_spring(double stiffness, double sheared)
{
  test_body b;
  flesh_solver_options options = test_options(1e-10);
  flesh_integrator *integrator = NULL;
  flesh_effect *spring = NULL;
  flesh_solve_stats stats = {0};
  const double inside[] = {0.93, 0.31, 0.37};
  const flesh_keyframe key = {.translation = {0.93, 0.31, 0.37}};
  const flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK_OK(test_body_create(test_box(6, 2, 2, 2, 0.7, 0.7), test_material(FLESH_ENERGY_S, 0.45), 1000, FLESH_MASS_LUMPED, 1,
                            &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_effect_spring(&b.body, inside, stiffness, &target, -INFINITY, INFINITY, &spring));
  CHECK_OK(flesh_system_add_effect(b.system, &spring));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 0; d < b.n; d += 3)
    if (b.state.x[d] > 1.01) b.state.x[d + 2] += sheared * (b.state.x[d] - 1);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  const double distance = test_distance(b.n, b.state.x, flesh_mesh_positions(b.mesh));
  printf("# %g N/m, %g: %d iterations, %d at rounding, %.3g m from rest, residual %.3g N\n", stiffness, sheared,
         stats.newton, stats.at_rounding, distance, stats.residual_last);
  CHECK_BELOW(distance, 1e-6);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return stats.at_rounding > 0;
}

/* A spring so stiff that round-off of its node's position causes a force like those of the whole body. Its residual
 * hides that the body is far from its equilibrium; the potential, which falls from step to step, does not. (If the node
 * ends on its target to the last bit, the spring has no force, and the residual meets its tolerance.) */
static void falling_potentials_are_no_round_off(void)
{
  static const double sheared[] = {1.7, 1.9, 2, 2.03, 2.2, 2.5};
  int at_rounding = 0;
  relax_with_spring(1e6, 2);
  for (int k = 0; k < 6; k++) at_rounding += relax_with_spring(1e18, sheared[k]);
  CHECK(at_rounding >= 4);
}

/* A free plate of nearly incompressible ten-node tets, 1000 km from the origin. */
static void make_far_plate(test_body *b)
{
  flesh_mesh *box = NULL, *mesh = NULL;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_mesh_box((int[]){5, 4, 1}, (double[]){0.2, 0.14, 0.01}, (double[]){1e6, 1e6, 1e6}, &box));
  CHECK_OK(flesh_mesh_raise_order(box, &mesh));
  flesh_mesh_destroy(&box);
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4999), 1000, FLESH_MASS_LUMPED, 1, b));
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(mesh, &b->system));
  b->body.element = FLESH_ELEMENT_TET10_MEAN;
  CHECK_OK(flesh_effect_inertia(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Positions are rounded to 1e-10 m there. Through the volumes' forces that would hide how far the plate still is from
 * rest. */
static void far_bodies_come_back_to_rest(void)
{
  for (unsigned long long seed = 1; seed <= 3; seed++) {
    test_body b;
    const flesh_solver_options options = test_options(1e-4);
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    flesh_rigid_fit fit;
    double worst = 0, y[3];
    make_far_plate(&b);
    const double *X = flesh_mesh_positions(b.mesh);
    test_jitter(b.n, 0.003, seed, b.state.x);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int step = 0; step < 90; step++)
      CHECK_OK(flesh_integrator_step(integrator, &b.state, step < 60 ? 1. / 60 : 0.5, &stats));
    uint8_t *all = malloc((size_t)b.n);
    memset(all, 1, (size_t)b.n);
    flesh_rigid_fit_find(b.n / 3, X, b.state.x, all, &fit);
    free(all);
    for (int i = 0; i < b.n; i += 3) {
      flesh_rigid_fit_apply(&fit, X + i, y);
      worst = fmax(worst, test_distance(3, y, b.state.x + i));
    }
    printf("# %d Newton iterations, %d solves at rounding, %.2g m from rest\n", stats.newton, stats.at_rounding, worst);
    CHECK_BELOW(worst, 1e-6 * 0.2);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(inertia_covers_what_rounding_changes), TEST(steps_solve_in_single_precision),
                   TEST(falling_potentials_are_no_round_off), TEST(far_bodies_come_back_to_rest));
}
