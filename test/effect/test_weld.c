// TEST quick seconds=60
/* test_weld.c: welds of non-matching meshes: constant stress, momenta, bending compared with one mesh, iterations. */
#include <stdlib.h>

#include "body.h"
#include "effect/effect.h"
#include "methods.h"
#include "test.h"
#include "welded.h"

/* The plane between two blocks, z = 1 before, is inclined; nodes in it are scattered. */
static void incline(double *x) { x[2] += (0.3 * x[0] + 0.2 * x[1]) * (1 - fabs(x[2] - 1)); }
static int inclined(const double *X) { return fabs(X[2] - 1 - 0.3 * X[0] - 0.2 * X[1]) < 1e-9; }
static void scatter(double *x)
{
  const double inner = x[0] * (1 - x[0]) * x[1] * (1 - x[1]), by = 0.8 * inner * sin(9 * x[0] + 7 * x[1]);
  x[0] += by;
  x[1] -= by / 2;
}

static void pin(test_body *b, double x, double y, unsigned axes)
{
  for (int i = 0; i < b->n / 3; i++) {
    const double *X = flesh_mesh_positions(b->mesh) + 3 * i;
    if (X[0] == x && X[1] == y && X[2] == 0)
      CHECK_OK(flesh_system_add_pin(b->system, 1, &i, axes, -INFINITY, INFINITY));
  }
}

/* Applies tractions P N on the whole outside except the weld. */
static void load_with(test_body *b, const double P[9])
{
  int all;
  const int *surface = flesh_mesh_surface(b->mesh, &all);
  const double *X = flesh_mesh_positions(b->mesh);
  for (int k = 0; k < all; k++) {
    const int *n = surface + 3 * (size_t)k;
    double d[2][3], N[3], t[3] = {0}, length;
    flesh_effect *effect = NULL;
    if (inclined(X + 3 * n[0]) && inclined(X + 3 * n[1]) && inclined(X + 3 * n[2])) continue;
    for (int i = 0; i < 6; i++) d[i / 3][i % 3] = X[3 * n[i / 3 + 1] + i % 3] - X[3 * n[0] + i % 3];
    for (int i = 0; i < 3; i++) N[i] = d[0][(i + 1) % 3] * d[1][(i + 2) % 3] - d[0][(i + 2) % 3] * d[1][(i + 1) % 3];
    length = sqrt(N[0] * N[0] + N[1] * N[1] + N[2] * N[2]);
    for (int i = 0; i < 9; i++) t[i / 3] += P[i] * N[i % 3] / length;
    CHECK_OK(flesh_effect_traction(&b->body, 1, n, t, NULL, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
}

/* Both bodies have the deformation gradient F of a uniform stress P; the upper one is displaced by P N/k. */
static void patch(int order)
{
  static const double F[9] = {1.1, 0.08, -0.05, 0, 1.05, 0.04, 0, 0, 1.15};
  test_body b;
  double P[9], worst = 0, jump[3], N[3] = {-0.3, -0.2, 1};
  flesh_mesh *lower = box((int[]){3, 3, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 0});
  flesh_mesh *upper = moved(box((int[]){2, 4, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 1}), scatter);
  CHECK_OK(test_body_create(of_order(order, moved(joined(lower, upper), incline)), test_material(FLESH_ENERGY_S, 0.35),
                            1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_material_stress(&b.material, F, P));
  load_with(&b, P);
  flesh_effect *effect = welded(&b, 1e-9, NAN, NAN);
  const double length = sqrt(1.13), k = force_per_metre(&b, effect) / length;
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  pin(&b, 0, 0, FLESH_AXES_ALL);
  pin(&b, 1, 0, 6);
  pin(&b, 0, 1, 4);
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options options = test_options(1e-13);
  options.linear_solver = FLESH_LINEAR_KLU;
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, NULL));
  for (int c = 0; c < 3; c++)
    jump[c] = (P[3 * c] * N[0] + P[3 * c + 1] * N[1] + P[3 * c + 2] * N[2]) / length / k;
  /* Nodes of either body: those of its tets. */
  for (int e = 0; e < flesh_mesh_tet_count(b.mesh); e++)
    for (int a = 0; a < (order == 2 ? 10 : 4); a++) {
      const int i = a < 4 ? flesh_mesh_tets(b.mesh)[4 * e + a] : flesh_mesh_tet_edges(b.mesh)[6 * e + a - 4];
      const double *X = flesh_mesh_positions(b.mesh) + 3 * (size_t)i, *x = b.state.x + 3 * (size_t)i;
      for (int c = 0; c < 3; c++) {
        const double wanted = F[3 * c] * X[0] + F[3 * c + 1] * X[1] + F[3 * c + 2] * X[2];
        worst = fmax(worst, fabs(x[c] - wanted - (flesh_mesh_regions(b.mesh)[e] ? jump[c] : 0)));
      }
    }
  printf("# order %d: k %.3g Pa/m, jump (%.2g, %.2g, %.2g) m; off by %.2g m\n", order, k, jump[0], jump[1], jump[2],
         worst);
  CHECK_BELOW(worst, 1e-10);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void constant_stress_passes(void)
{
  for (int order = 1; order <= 2; order++) patch(order);
}

/* At any state the forces have neither resultant nor torque; rigid and affine motions have no energy. */
static void forces_and_torques_balance(void)
{
  for (int run = 0; run < 6; run++) {
    const int order = 1 + run % 2;
    const double gap = run < 2 ? 0 : run < 4 ? 0.03 : -0.04; /* coincident, apart, overlapping */
    test_body b;
    double sums[6], far = 0, energy, turned;
    flesh_mesh *lower = box((int[]){2, 3, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0});
    flesh_mesh *upper = box((int[]){3, 2, 2}, (double[]){1, 1, 1}, (double[]){0.2, -0.1, 1 + gap});
    CHECK_OK(test_body_create(of_order(order, joined(lower, upper)), test_material(FLESH_ENERGY_S, 0.35), 1000,
                              FLESH_MASS_LUMPED, 0, &b));
    flesh_effect *effect = welded(&b, 0.05, 1e6, NAN);
    double *r = calloc((size_t)b.n, sizeof *r);
    flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
    for (int d = 0; d < b.n; d += 3) { /* an affine motion */
      const double *X = flesh_mesh_positions(b.mesh) + d;
      b.state.x[d] = 3 + 0.5 * X[0] - 0.9 * X[1], b.state.x[d + 1] = 1.2 * X[0] + 0.4 * X[2], b.state.x[d + 2] = X[1];
    }
    CHECK_OK(effect->operations->residual(effect, &point, r));
    CHECK_NEAR(force_per_metre(&b, effect), 1e6 * 0.8 * 0.9, 1e-12 * 1e6);
    CHECK_BELOW(test_norm(b.n, r), 1e-12 * 1e6);
    memset(r, 0, (size_t)b.n * sizeof *r);
    test_jitter(b.n, 0.5, 3, b.state.x);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    CHECK_OK(effect->operations->energy(effect, &point, &energy));
    for (int d = 0; d < b.n; d++) far = fmax(far, fabs(b.state.x[d]));
    const double size = test_sums(&b, r, sums);
    for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-13 * far * size);
    for (int i = 0; i < b.n; i += 3) { /* a rotation by 1.1 about y */
      const double x = b.state.x[i], z = b.state.x[i + 2];
      b.state.x[i] = cos(1.1) * x + sin(1.1) * z - 7, b.state.x[i + 2] = cos(1.1) * z - sin(1.1) * x;
    }
    CHECK_OK(effect->operations->energy(effect, &point, &turned));
    CHECK(energy > 0);
    CHECK_NEAR(turned, energy, 1e-11 * energy);
    free(r);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* A spinning pair of blocks that moves apart conserves its momentum, and its angular momentum with the midpoint
 * rule. */
static void check_momentum(flesh_method method)
{
  test_body b;
  double before[6], after[6];
  flesh_mesh *lower = box((int[]){2, 2, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 0});
  flesh_mesh *upper = box((int[]){3, 3, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 1});
  CHECK_OK(test_body_create(joined(lower, upper), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  flesh_effect *effect = welded(&b, 1e-9, NAN, NAN);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < b.n / 3; i++) { /* the upper block moves away, turning */
    const double *X = flesh_mesh_positions(b.mesh) + 3 * i;
    b.state.v[3 * i] = -3 * X[1] + 1, b.state.v[3 * i + 1] = 3 * X[0], b.state.v[3 * i + 2] = X[2] > 1 ? 1 : 0;
  }
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(1e-11);
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  for (int when = 0; when < 2; when++) {
    for (int s = 0; when && s < 60; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.005, NULL));
    test_momenta(&b, when ? after : before);
  }
  for (int c = 0; c < (method == FLESH_METHOD_MIDPOINT ? 6 : 3); c++) CHECK_NEAR(after[c], before[c], 1e-7 * 4000);
  CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 1e-2);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void welded_bodies_keep_their_momentum(void)
{
  for_every_method(method, TEST_FIXED_STEPS) check_momentum(method);
}

typedef struct bent {
  double tip;
  flesh_solve_stats stats;
} bent;

/* Returns the mean deflection of the end of a bar of 4 m that sags under its weight: welded in the middle with this
 * factor on the default stiffness, or one mesh if the factor is 0. */
static bent sag(int order, const int left[3], const int right[3], double factor)
{
  test_body b;
  bent result = {0};
  int count = 0;
  flesh_mesh *mesh;
  if (factor > 0)
    mesh = joined(box(left, (double[]){2, 1, 1}, (double[]){0, 0, 0}),
                  box(right, (double[]){2, 1, 1}, (double[]){2, 0, 0}));
  else mesh = box(left, (double[]){4, 1, 1}, (double[]){0, 0, 0});
  CHECK_OK(test_body_create(of_order(order, mesh), test_material(FLESH_ENERGY_S, 0.4), 200, FLESH_MASS_LUMPED, 0, &b));
  if (factor > 0) {
    flesh_effect *effect = welded(&b, 1e-9, NAN, NAN);
    const double k = force_per_metre(&b, effect); /* of 1 m^2 */
    flesh_effect_destroy(&effect);
    effect = welded(&b, 1e-9, factor * k, NAN);
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
  }
  CHECK_OK(test_body_gravity(&b, 0, 0, -1));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options options = test_options(1e-8);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, &result.stats));
  for (int i = 0; i < b.n / 3; i++)
    if (flesh_mesh_positions(b.mesh)[3 * i] == 4) {
      result.tip += b.state.x[3 * i + 2] - flesh_mesh_positions(b.mesh)[3 * i + 2];
      count++;
    }
  result.tip /= count;
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return result;
}

static double per_newton(const bent *b) { return (double)b->stats.linear / b->stats.newton; }

/* The sag of a welded bar lies between those of one mesh with the cells of either half, and takes at most twice the
 * iterations. */
static void a_welded_bar_bends_as_one_mesh(void)
{
  for (int order = 1; order <= 2; order++) {
    const bent coarse = sag(order, (int[]){8, 2, 2}, NULL, 0), fine = sag(order, (int[]){12, 3, 3}, NULL, 0);
    printf("# order %d: one mesh of 2 cells across: %.5f m in %.1f iterations a Newton step, of 3: %.5f m in %.1f\n", order,
           coarse.tip, per_newton(&coarse), fine.tip, per_newton(&fine));
    const double factors[] = {1. / 30, 1. / 3, 1, 10. / 3, 100. / 3};
    for (int k = 0; k < 5; k++) {
      const double factor = factors[k];
      const bent welded = sag(order, (int[]){4, 2, 2}, (int[]){6, 3, 3}, factor);
      printf("# stiffness %g times 3 mu/edge: %.5f m in %.1f\n", 30 * factor, welded.tip, per_newton(&welded));
      if (factor != 1) continue;
      CHECK(-welded.tip > -coarse.tip * (order == 1 ? 1 : 0.998) && -welded.tip < -fine.tip * 1.002);
      CHECK_BELOW(per_newton(&welded), 2 * per_newton(&fine));
    }
  }
}

static void nonsense_is_refused(void)
{
  test_body b;
  int count;
  flesh_effect *effect = NULL;
  flesh_mesh *lower = box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0});
  flesh_mesh *upper = box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 1.5});
  CHECK_OK(test_body_create(joined(lower, upper), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  const int *t = flesh_mesh_surface(b.mesh, &count);
#define REFUSED(text, n, some, m, others, ...)                                                                         \
  CHECK(flesh_effect_weld(&b.body, (flesh_triangles){n, some}, (flesh_triangles){m, others}, __VA_ARGS__, &effect) ==   \
            FLESH_ERR_ARGUMENT && !effect);                                                                            \
  CHECK_TEXT(flesh_error_text(), text)
  REFUSED("do not face each other", 12, t, 12, t + 36, 0.4, NAN, NAN);
  REFUSED("distance is -1", 12, t, 12, t + 36, -1, NAN, NAN);
  REFUSED("stiffness is 0", 12, t, 12, t + 36, 1, 0, NAN);
  REFUSED("there are 12 and 0", 12, t, 0, t + 36, 1, NAN, NAN);
  REFUSED("is not one of the mesh's surface", 1, ((int[]){0, 1, 15}), 12, t + 36, 1, NAN, NAN);
  REFUSED("breaks_at is -1 Pa", 12, t, 12, t + 36, 1, NAN, -1);
  REFUSED("breaks_at is 0 Pa", 12, t, 12, t + 36, 1, NAN, 0);
  b.body.materials = NULL;
  REFUSED("stiffness is missing", 12, t, 12, t + 36, 1, NAN, NAN);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(constant_stress_passes), TEST(forces_and_torques_balance),
                   TEST(welded_bodies_keep_their_momentum), TEST(a_welded_bar_bends_as_one_mesh),
                   TEST(nonsense_is_refused));
}
