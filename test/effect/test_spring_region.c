// TEST quick seconds=60
/* test_spring_region.c: a spring that pulls within a radius: its weights against integrals in closed form, its sums and
 * derivatives, and the convergence of the pulled displacement under refinement, in contrast to a spring at a point. */
#include <stdlib.h>

#include "body.h"
#include "effect/effect.h"
#include "effect/spring_weights.h"
#include "test.h"

/* Makes a system of only the spring on the box of `cells` per metre. */
static void make(const int cells[3], const double size[3], int order, test_body *b)
{
  flesh_mesh *mesh = test_box(cells[0], cells[1], cells[2], size[0], size[1], size[2]), *raised;
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 0, b));
}

static double *weights_of(const test_body *b, const double p[3], double radius)
{
  double *w = calloc((size_t)b->n / 3, sizeof *w), sum = 0;
  int tet = 0;
  /* Any tet that holds p will do: take the one whose centre is nearest of those that touch it. */
  const double *X = flesh_mesh_positions(b->mesh);
  double best = INFINITY;
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++) {
    double middle[3] = {0};
    for (int k = 0; k < 12; k++) middle[k % 3] += X[3 * flesh_mesh_tets(b->mesh)[4 * e + k / 3] + k % 3] / 4;
    if (test_distance(3, middle, p) < best) best = test_distance(3, middle, p), tet = e;
  }
  CHECK_OK(flesh_spring_weights(b->mesh, tet, p, radius, w));
  for (int i = 0; i < b->n / 3; i++) {
    CHECK(w[i] >= 0);
    sum += w[i];
  }
  CHECK_NEAR(sum, 1, 1e-13);
  return w;
}

/* Over a ball the integral of k is 4 pi r^3 (1/3 - 2/5 + 1/7), and of k s^2 it is 4 pi r^3 (1/5 - 2/7 + 1/9): the
 * weights' mean of |X - p|^2 is r^2 / 3. Over half of it the mean distance from the cut is r (1/4 - 1/3 + 1/8) / 2 over
 * (1/3 - 2/5 + 1/7). */
static void weights_are_integrals(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    make((int[]){24, 24, 24}, (double[]){1, 1, 1}, order, &b);
    const double *X = flesh_mesh_positions(b.mesh), radius = 0.4, p[2][3] = {{0.5, 0.5, 0.5}, {0.5, 0.5, 1}};
    const double k0 = 1. / 3 - 2. / 5 + 1. / 7, k1 = 1. / 4 - 1. / 3 + 1. / 8;
    double *w = weights_of(&b, p[0], radius), square = 0, middle[3] = {0}, below = 0;
    for (int i = 0; i < b.n / 3; i++) {
      for (int c = 0; c < 3; c++) {
        square += w[i] * pow(X[3 * i + c] - p[0][c], 2);
        middle[c] += w[i] * X[3 * i + c];
      }
    }
    free(w);
    printf("# order %d: mean square %.5f of %.5f\n", order, square, radius * radius / 3);
    CHECK_NEAR(square, radius * radius / 3, 0.02 * radius * radius / 3);
    for (int c = 0; c < 3; c++) CHECK_NEAR(middle[c], 0.5, 1e-3 * radius);
    w = weights_of(&b, p[1], radius);
    for (int i = 0; i < b.n / 3; i++) below += w[i] * (1 - X[3 * i + 2]);
    free(w);
    printf("# order %d: mean depth %.5f of %.5f\n", order, below, radius * k1 / 2 / k0);
    CHECK_NEAR(below, radius * k1 / 2 / k0, 0.01 * radius * k1 / 2 / k0);
    test_body_destroy(&b);
  }
}

/* A radius far below an element's size: the nodes' shares are near the point's own weights. */
static void small_radii_are_points(void)
{
  test_body b;
  make((int[]){2, 2, 2}, (double[]){1, 1, 1}, 1, &b);
  const double p[3] = {0.37, 0.21, 0.83}, *X = flesh_mesh_positions(b.mesh);
  double *w = weights_of(&b, p, 1e-3), middle[3] = {0};
  for (int i = 0; i < b.n / 3; i++)
    for (int c = 0; c < 3; c++) middle[c] += w[i] * X[3 * i + c];
  CHECK_BELOW(test_distance(3, middle, p), 1e-5);
  free(w);
  test_body_destroy(&b);
}

/* Two bodies side by side: the spring pulls the one it is attached to. */
static void other_bodies_are_left_alone(void)
{
  flesh_mesh *mesh = NULL;
  double X[24], w[8] = {0};
  const double tet[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int k = 0; k < 24; k++) X[k] = tet[k % 12] + (k >= 12 && k % 3 == 0 ? 1.05 : 0);
  CHECK_OK(flesh_mesh_create(8, X, 2, (int[]){0, 1, 2, 3, 4, 5, 6, 7}, NULL, &mesh));
  CHECK_OK(flesh_spring_weights(mesh, 1, X + 12, 0.5, w));
  CHECK(w[0] == 0 && w[1] == 0 && w[2] == 0 && w[3] == 0);
  CHECK(w[4] > 0.5 && w[5] > 0 && w[6] > 0 && w[7] > 0);
  const flesh_body_part parts[2] = {{"one", 0, 1}, {"two", 1, 1}};
  const flesh_body body = {.mesh = mesh, .part_count = 2, .parts = parts}, whole = {.mesh = mesh};
  CHECK_NEAR(flesh_spring_radius(&body, 1), 0.05, 1e-15);
  CHECK_NEAR(flesh_spring_radius(&whole, 1), 0.05 * 2.05, 1e-15);
  flesh_mesh_destroy(&mesh);
}

static void carry_affinely(double x[3])
{
  const double A[9] = {0.2, -1.1, 0.3, 0.9, 0.1, -0.4, 0.5, 0.2, 1.3}, X[3] = {x[0], x[1], x[2]};
  for (int c = 0; c < 3; c++) x[c] = A[3 * c] * X[0] + A[3 * c + 1] * X[1] + A[3 * c + 2] * X[2] + 0.1 * (c - 1);
}

/* However a body moves and deforms, the forces are one force at p = sum of w x, without a torque about it; p follows
 * affine motions. Forces are the potential's gradient everywhere. */
static void sums_and_derivatives(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    flesh_effect *effect = NULL;
    const double p[3] = {2, 0.7, 0.3}, target_at[3] = {3, 1, 0.5};
    const flesh_keyframe key = {.translation = {3, 1, 0.5}};
    const flesh_motion target = {.count = 1, .keyframes = &key};
    double energy, at[3];
    make((int[]){4, 2, 2}, (double[]){2, 1, 1}, order, &b);
    CHECK_OK(flesh_effect_spring_within(&b.body, p, NAN, 50, &target, 0, 1, &effect));
    CHECK_NEAR(flesh_effect_spring_radius(effect, at), 0.1, 1e-15);
    CHECK_BELOW(test_distance(3, at, p), 1e-15);
    double *all = calloc((size_t)b.n, sizeof *all);
    flesh_point point = flesh_point_at(0.5, b.state.x, b.state.v, b.state.v);
    for (int deformed = 0; deformed < 2; deformed++) {
      double sums[6], expected = 0, off[3], moved[3];
      for (int i = 0; i < b.n; i += 3) carry_affinely(b.state.x + i);
      if (deformed) test_jitter(b.n, 0.1, 11, b.state.x);
      memset(all, 0, (size_t)b.n * sizeof *all);
      CHECK_OK(effect->operations->residual(effect, &point, all));
      CHECK_OK(effect->operations->energy(effect, &point, &energy));
      test_sums(&b, all, sums);
      for (int c = 0; c < 3; c++) off[c] = sums[c] / 50, moved[c] = off[c] + target_at[c];
      for (int c = 0; c < 3; c++) {
        CHECK_NEAR(sums[3 + c], moved[(c + 1) % 3] * sums[(c + 2) % 3] - moved[(c + 2) % 3] * sums[(c + 1) % 3], 1e-11);
        expected += 25 * off[c] * off[c];
      }
      CHECK_NEAR(energy, expected, 1e-11);
      memcpy(at, p, sizeof at);
      carry_affinely(at);
      if (!deformed) CHECK_BELOW(test_distance(3, at, moved), 1e-11);
      memcpy(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof *b.state.x);
    }
    point.t = point.lagged.t = 1;
    memset(all, 0, (size_t)b.n * sizeof *all);
    CHECK_OK(effect->operations->residual(effect, &point, all));
    for (int d = 0; d < b.n; d++) CHECK(all[d] == 0);
    flesh_derivative_report report;
    test_jitter(b.n, 0.02, 3, b.state.x);
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0.5, b.state.x, 7, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
    free(all);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

typedef struct pull {
  double force, displacement, least;
} pull;

/* Pulls a block, held below, upwards at the middle of its top. */
static pull pull_block(int cells, int order, double radius)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-8);
  const double p[3] = {1, 0.5, 0.5}, stiffness = 1e5, lift = 0.1;
  const flesh_keyframe key = {.translation = {1 + lift, 0.5, 0.5}};
  const flesh_motion target = {.count = 1, .keyframes = &key};
  make((int[]){cells, cells, cells}, (double[]){1, 1, 1}, order, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_effect_spring_within(&b.body, p, radius, stiffness, &target, -INFINITY, INFINITY, &effect));
  const flesh_effect *spring = effect;
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, NULL));
  double *r = calloc((size_t)b.n, sizeof *r);
  const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  CHECK_OK(spring->operations->residual(spring, &point, r));
  pull result = {0, 0, flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, NULL)};
  for (int d = 0; d < b.n; d += 3) result.force -= r[d];
  /* mean displacement of the region that the spring pulls */
  result.displacement = lift - result.force / stiffness;
  printf("# %2d cells of order %d, radius %g: force %.1f N, displacement %.4f m, least J %.3f\n", cells, order, radius,
         result.force, result.displacement, result.least);
  free(r);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return result;
}

/* Halving the elements changes the force by ever less, and both elements converge to the same force. At a point each
 * refinement nearly halves the force again, because the dent deepens. */
static void pulls_converge(void)
{
  pull within[3], at[3], quadratic[2];
  for (int k = 0; k < 3; k++) {
    within[k] = pull_block(4 << k, 1, 0.35);
    at[k] = pull_block(4 << k, 1, 0);
  }
  for (int k = 0; k < 2; k++) quadratic[k] = pull_block(4 << k, 2, 0.35);
  const double first = within[0].force - within[1].force, second = within[1].force - within[2].force;
  CHECK(first > 0 && second > 0 && second < 0.7 * first);
  CHECK_NEAR(quadratic[1].force, quadratic[0].force, 0.05 * quadratic[0].force);
  CHECK_NEAR(quadratic[1].force, within[2].force, 0.03 * quadratic[1].force);
  CHECK(within[2].least > 0.95 && quadratic[1].least > 0.9);
  CHECK(at[1].force < 0.6 * at[0].force && at[2].force < 0.6 * at[1].force);
  CHECK(at[2].least < at[1].least - 0.05);
}

/* A cube of 3375 nodes, and a tet 40 m away that makes the body long: a twentieth of its length contains the whole
 * cube. */
static flesh_mesh *cube_and_a_far_tet(void)
{
  flesh_mesh *cube = test_box(14, 14, 14, 1, 1, 1), *mesh = NULL;
  const int nodes = flesh_mesh_node_count(cube), tets = flesh_mesh_tet_count(cube);
  double *X = malloc(((size_t)nodes + 4) * 3 * sizeof *X);
  int *tet = malloc(((size_t)tets + 1) * 4 * sizeof *tet);
  const double far[12] = {40, 0, 0, 41, 0, 0, 40, 1, 0, 40, 0, 1};
  memcpy(X, flesh_mesh_positions(cube), (size_t)nodes * 3 * sizeof *X);
  memcpy(X + 3 * (size_t)nodes, far, sizeof far);
  memcpy(tet, flesh_mesh_tets(cube), (size_t)tets * 4 * sizeof *tet);
  for (int k = 0; k < 4; k++) tet[4 * tets + k] = nodes + k;
  CHECK_OK(flesh_mesh_create(nodes + 4, X, tets + 1, tet, NULL, &mesh));
  flesh_mesh_destroy(&cube);
  free(X);
  free(tet);
  return mesh;
}

/* Each node is coupled with every other: a radius with too many nodes is refused, the default one shrinks. */
static void nodes_are_limited(void)
{
  flesh_mesh *mesh = cube_and_a_far_tet();
  const flesh_body body = {.mesh = mesh};
  flesh_effect *effect = NULL;
  const double p[3] = {0.5, 0.5, 0.5}, radii[2] = {0.4, NAN};
  const flesh_keyframe key = {.translation = {1, 1, 1}};
  const flesh_motion target = {.count = 1, .keyframes = &key};
  CHECK(flesh_effect_spring_within(&body, p, 2.05, 1, &target, 0, 1, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "radius is 2.05 m, which holds 3375 nodes; it must hold at most 1200");
  CHECK(effect == NULL);
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_effect_spring_within(&body, p, radii[k], 1, &target, 0, 1, &effect));
    const int count = effect->operations->cells(effect)->nodes_per_cell;
    printf("# a radius of %g m holds %d nodes\n", flesh_effect_spring_radius(effect, NULL), count);
    CHECK(count > 700 && count <= FLESH_SPRING_NODES);
    flesh_effect_destroy(&effect);
  }
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(weights_are_integrals), TEST(small_radii_are_points),
                   TEST(other_bodies_are_left_alone), TEST(sums_and_derivatives), TEST(pulls_converge), TEST(nodes_are_limited));
}
