// TEST quick
/* test_curved_pressure.c: the pressure on the faces of ten-node tets, checked by integrals with another rule, volumes,
 * sums over closed surfaces, and derivatives. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

/* A cube of side 2 around the origin, of ten-node tets. */
static void make(int cells, test_body *b)
{
  flesh_mesh *box = NULL, *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){cells, cells, cells}, (double[]){2, 2, 2}, (double[]){-1, -1, -1}, &box));
  CHECK_OK(flesh_mesh_raise_order(box, &mesh));
  flesh_mesh_destroy(&box);
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0, b));
}

/* Maps every cube around the origin to a sphere. */
static void inflate_to_ball(test_body *b)
{
  for (int i = 0; i < b->n / 3; i++) {
    double *x = b->state.x + 3 * i, largest = fmax(fabs(x[0]), fmax(fabs(x[1]), fabs(x[2])));
    double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int c = 0; c < 3 && length > 0; c++) x[c] *= largest / length;
  }
}

static flesh_point point_of(const test_body *b)
{
  return flesh_point_at(0, b->state.x, b->state.v, b->state.v);
}

static void closed_surfaces_have_no_net_force(void)
{
  for (int cells = 1; cells <= 3; cells++) {
    test_body b;
    int count;
    const double p = 700;
    double sums[6], energy;
    make(cells, &b);
    const int *triangles = flesh_mesh_surface(b.mesh, &count);
    flesh_effect *effect = NULL;
    CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, p, NULL, &effect));
    inflate_to_ball(&b);
    test_jitter(b.n, 0.02, 3, b.state.x);
    double *r = calloc((size_t)b.n, sizeof *r);
    const flesh_point point = point_of(&b);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    CHECK_OK(effect->operations->energy(effect, &point, &energy));
    const double size = test_sums(&b, r, sums);
    for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-13 * size);
    const double rest = flesh_mesh_volume(b.mesh, flesh_mesh_positions(b.mesh));
    const double work = p * (flesh_mesh_volume(b.mesh, b.state.x) - rest);
    printf("# %d cells: energy %.15g J, pressure times change of volume %.15g J\n", cells, energy, work);
    CHECK_NEAR(energy, work, 1e-12 * p * 8);
    free(r);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* On a flat face the corners have no share, and each mid-edge node has a third of the area. */
static void flat_faces_pull_at_their_edges(void)
{
  test_body b;
  int count, corners = 0, middles = 0;
  make(2, &b);
  const int *triangles = flesh_mesh_surface(b.mesh, &count);
  const double *X = flesh_mesh_positions(b.mesh);
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 6, NULL, &effect));
  double *r = calloc((size_t)b.n, sizeof *r);
  const flesh_point point = point_of(&b);
  CHECK_OK(effect->operations->residual(effect, &point, r));
  for (int i = 0; i < b.n / 3; i++) {
    if (X[3 * i] != 1 || fabs(X[3 * i + 1]) == 1 || fabs(X[3 * i + 2]) == 1) continue;
    const int corner = i < 27; /* mid-edge nodes come after the corners */
    corners += corner, middles += !corner;
    /* Two faces of area 1/2 each, at 6 Pa. */
    CHECK_NEAR(r[3 * i], corner ? 0 : 2, 1e-13);
    CHECK_NEAR(r[3 * i + 1], 0, 1e-13);
    CHECK_NEAR(r[3 * i + 2], 0, 1e-13);
  }
  CHECK(corners == 1 && middles == 8);
  free(r);
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

/* Computes the integral of N_k over the deformed normals of triangle `quarter` of a six-node face, by Gauss points of
 * degree 9 on a square collapsed to a triangle. */
static void integrate(const double *x, const int node[6], int quarter, double *f)
{
  static const double at[5] = {.046910077030668, .230765344947158, .5, .769234655052841, .953089922969332};
  static const double weight[5] = {.118463442528095, .239314335249683, .284444444444444, .239314335249683,
                                   .118463442528095};
  static const double quarters[4][3][2] = {{{0, 0}, {.5, 0}, {0, .5}},
                                           {{.5, 0}, {1, 0}, {.5, .5}},
                                           {{0, .5}, {.5, .5}, {0, 1}},
                                           {{.5, 0}, {.5, .5}, {0, .5}}};
  for (int g = 0; g < 25; g++) {
    const double u = at[g / 5], v = at[g % 5] * (1 - u), w = weight[g / 5] * weight[g % 5] * (1 - u) / 4;
    double s[2], along[2][3] = {{0}};
    for (int i = 0; i < 2; i++)
      s[i] = quarters[quarter][0][i] + u * (quarters[quarter][1][i] - quarters[quarter][0][i]) +
             v * (quarters[quarter][2][i] - quarters[quarter][0][i]);
    const double a = 1 - s[0] - s[1], b = s[0], c = s[1];
    const double N[6] = {a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a};
    const double D[2][6] = {{1 - 4 * a, 4 * b - 1, 0, 4 * (a - b), 4 * c, -4 * c},
                            {1 - 4 * a, 0, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)}};
    for (int k = 0; k < 6; k++)
      for (int d = 0; d < 6; d++) along[d / 3][d % 3] += D[d / 3][k] * x[3 * node[k] + d % 3];
    for (int k = 0; k < 6; k++)
      for (int d = 0; d < 3; d++) {
        const int i = (d + 1) % 3, j = (d + 2) % 3;
        f[3 * node[k] + d] += w * N[k] * (along[0][i] * along[1][j] - along[0][j] * along[1][i]);
      }
  }
}

/* Checks an open surface, with some faces lacking quarters; `chosen` selects by a triangle's number. */
static void check_open(int (*chosen)(int k))
{
  test_body b;
  int all, count = 0;
  make(2, &b);
  const int *surface = flesh_mesh_surface(b.mesh, &all);
  int *triangles = malloc(3 * (size_t)all * sizeof *triangles);
  double *r = calloc(2 * (size_t)b.n, sizeof *r), *expected = r + b.n;
  inflate_to_ball(&b);
  test_jitter(b.n, 0.05, 5, b.state.x);
  for (int k = 0; k < all; k++) {
    if (!chosen(k)) continue;
    /* Rotates the corners, as users may. */
    for (int a = 0; a < 3; a++) triangles[3 * count + a] = surface[3 * k + (a + k) % 3];
    count++;
    const int *face = surface + 12 * (size_t)(k / 4);
    integrate(b.state.x, (int[]){face[0], face[4], face[8], face[1], face[5], face[2]}, k % 4, expected);
  }
  flesh_effect *effect = NULL;
  flesh_derivative_report report;
  const flesh_point point = point_of(&b);
  CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 1, NULL, &effect));
  CHECK_OK(effect->operations->residual(effect, &point, r));
  CHECK_BELOW(test_distance(b.n, r, expected), 1e-13);
  CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 7, &report));
  printf("# %d of %d triangles: potential %.1g, Jacobian %.1g, with products by the lagged state %.1g\n", count, all,
         report.potential[0], report.jacobian[0], report.jacobian[1]);
  CHECK(flesh_derivative_report_passes(&report, 1e-6));
  flesh_effect_destroy(&effect);
  free(triangles);
  free(r);
  test_body_destroy(&b);
}

/* Returns d.(r with the rim lagged - r) at a displacement of `size` d from the lagged state. */
static double rim_error(const flesh_effect *effect, const test_body *b, const double *d, double size)
{
  double *x = malloc(3 * (size_t)b->n * sizeof *x), *lagged = x + b->n, *now = x + 2 * b->n, error = 0;
  flesh_point point = point_of(b);
  for (int k = 0; k < b->n; k++) x[k] = b->state.x[k] + size * d[k], lagged[k] = now[k] = 0;
  point.x = x;
  CHECK_OK(effect->operations->residual(effect, &point, lagged));
  point.lagged.x = x;
  CHECK_OK(effect->operations->residual(effect, &point, now));
  for (int k = 0; k < b->n; k++) error += size * d[k] * (lagged[k] - now[k]);
  free(x);
  return fabs(error);
}

static int every(int k) { return k >= 0; }
static int half(int k) { return k / 4 % 2; }
static int some_quarters(int k) { return k % 3 == 0 || k % 7 == 0; }
static int one(int k) { return k == 11; }

static void forces_are_exact_integrals(void)
{
  check_open(every);
  check_open(half);
  check_open(some_quarters);
  check_open(one);
}

/* The term of the rim is expanded with the symmetric part of its derivative, so its work is exact. */
static void lagged_rims_have_the_symmetric_derivative(void)
{
  test_body b;
  int all, count = 0, *triangles;
  flesh_effect *effect = NULL;
  make(2, &b);
  const int *surface = flesh_mesh_surface(b.mesh, &all);
  triangles = malloc(3 * (size_t)all * sizeof *triangles);
  for (int k = 0; k < all; k++)
    if (some_quarters(k)) memcpy(triangles + 3 * count++, surface + 3 * k, 3 * sizeof *triangles);
  CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 1, NULL, &effect));
  double *d = calloc((size_t)b.n, sizeof *d);
  inflate_to_ball(&b);
  test_jitter(b.n, 1, 9, d);
  const double error = rim_error(effect, &b, d, 1e-3);
  printf("# work off by %.3g J\n", error);
  CHECK_BELOW(error, 1e-16);
  free(d);
  free(triangles);
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

static void other_triangles_are_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  make(1, &b);
  CHECK(flesh_effect_pressure(&b.body, 1, (int[]){0, 1, 7}, 1, NULL, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "is not one of the mesh's surface");
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(closed_surfaces_have_no_net_force), TEST(flat_faces_pull_at_their_edges),
                   TEST(forces_are_exact_integrals), TEST(lagged_rims_have_the_symmetric_derivative),
                   TEST(other_triangles_are_refused));
}
