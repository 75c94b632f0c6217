// TEST quick
/* test_mesh.c: creating and measuring meshes, against closed forms and an independent list of tets. */
#include "test.h"

#include <stdlib.h>

#include "flesh/mesh.h"
#include "mesh/mesh.h"

static const double unit_tet[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};

/* A box grid with nodes moved by a fixed random field, small enough to keep every tet's orientation. */
static flesh_mesh *jittered_box(int nx, int ny, int nz, double amount)
{
  int cells[3] = {nx, ny, nz};
  double size[3] = {nx, ny, nz}, origin[3] = {-1, 2, 0.5};
  flesh_mesh *grid, *mesh;
  CHECK_OK(flesh_mesh_box(cells, size, origin, &grid));
  int nodes = flesh_mesh_node_count(grid);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  unsigned long long seed = 7;
  for (int i = 0; i < 3 * nodes; i++)
    x[i] = flesh_mesh_positions(grid)[i] + amount * (2 * test_uniform(&seed) - 1);
  CHECK_OK(
      flesh_mesh_create(nodes, x, flesh_mesh_tet_count(grid), flesh_mesh_tets(grid), NULL, &mesh));
  flesh_mesh_destroy(&grid);
  free(x);
  return mesh;
}

static void box_is_the_oracles_bar(void)
{
  static const struct {
    const char *path;
    int cells[3];
  } bars[] = {{"reference/meshes/bar_8x2x2.mesh", {8, 2, 2}},
              {"reference/meshes/bar_16x4x4.mesh", {16, 4, 4}}};
  for (int b = 0; b < 2; b++) {
    flesh_mesh *bar, *box;
    CHECK_OK(flesh_mesh_read(bars[b].path, &bar));
    CHECK_OK(flesh_mesh_box(bars[b].cells, (double[]){4, 1, 1}, (double[]){0, 0, 0}, &box));
    CHECK(flesh_mesh_node_count(bar) == flesh_mesh_node_count(box));
    CHECK(flesh_mesh_tet_count(bar) == flesh_mesh_tet_count(box));
    CHECK(!memcmp(flesh_mesh_positions(bar), flesh_mesh_positions(box),
                  3 * (size_t)flesh_mesh_node_count(box) * sizeof(double)));
    CHECK(!memcmp(flesh_mesh_tets(bar), flesh_mesh_tets(box),
                  4 * (size_t)flesh_mesh_tet_count(box) * sizeof(int)));
    flesh_mesh_destroy(&bar);
    flesh_mesh_destroy(&box);
  }
}

static void box_fills_its_size(void)
{
  flesh_mesh *box;
  flesh_mesh_info info;
  CHECK_OK(flesh_mesh_box((int[]){3, 4, 5}, (double[]){0.3, 2, 7}, (double[]){1, -2, 3}, &box));
  flesh_mesh_inspect(box, &info);
  CHECK(info.nodes == 4 * 5 * 6 && info.tets == 6 * 60);
  CHECK(info.triangles == 4 * (3 * 4 + 4 * 5 + 3 * 5));
  CHECK(info.flipped == 0 && info.unused_nodes == 0 && info.regions == 1);
  CHECK_NEAR(info.volume, 0.3 * 2 * 7, 1e-14);
  CHECK_NEAR(info.edge_min, 0.1, 1e-15);
  CHECK_NEAR(info.edge_max, sqrt(0.01 + 0.25 + 1.96), 1e-15);
  for (int d = 0; d < 3; d++) {
    CHECK_NEAR(info.low[d], ((double[]){1, -2, 3})[d], 0);
    CHECK_NEAR(info.high[d], ((double[]){1.3, 0, 10})[d], 0);
  }
  flesh_mesh_destroy(&box);
  CHECK(flesh_mesh_box((int[]){0, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &box) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "cells along x is 0");
  CHECK(flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, -1, 1}, (double[]){0, 0, 0}, &box) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "size along y is -1");
  CHECK(flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, 1, 1}, (double[]){0, 0, NAN}, &box) ==
        FLESH_ERR_ARGUMENT);
  CHECK(flesh_mesh_box((int[]){2000, 2000, 2000}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &box) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "at most");
}

static void volume_and_jacobians_follow_an_affine_map(void)
{
  static const double A[3][3] = {{1.2, 0.3, -0.1}, {0.05, 0.8, 0.2}, {-0.3, 0.1, 1.5}};
  double det = A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) -
               A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0]) +
               A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0]);
  flesh_mesh *mesh = jittered_box(4, 3, 2, 0.1);
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh), worst, inverted;
  const double *X = flesh_mesh_positions(mesh);
  double *x = malloc(3 * (size_t)nodes * sizeof *x), *J = malloc((size_t)tets * sizeof *J);
  double rest = flesh_mesh_volume(mesh, X), sum = 0;
  for (int t = 0; t < tets; t++) sum += flesh_mesh_tet_volumes(mesh)[t];
  CHECK_NEAR(rest, sum, 1e-13);
  CHECK(flesh_mesh_jacobians(mesh, X, J, &worst, &inverted) == 1 && inverted == 0);
  for (int t = 0; t < tets; t++) CHECK(J[t] == 1);
  for (int mirror = 0; mirror < 2; mirror++) {
    double sign = mirror ? -1 : 1;
    for (int n = 0; n < nodes; n++)
      for (int d = 0; d < 3; d++)
        x[3 * n + d] = (d == 0 ? sign : 1) *
                       (5 + A[d][0] * X[3 * n] + A[d][1] * X[3 * n + 1] + A[d][2] * X[3 * n + 2]);
    CHECK_NEAR(flesh_mesh_volume(mesh, x), sign * det * rest, 1e-12);
    CHECK_NEAR(flesh_mesh_jacobians(mesh, x, J, NULL, &inverted), sign * det, 1e-12);
    CHECK(inverted == (mirror ? tets : 0));
    for (int t = 0; t < tets; t++) CHECK_NEAR(J[t], sign * det, 1e-12);
  }
  /* Moving one node through the opposite face of the last tet only inverts tets of that node. */
  memcpy(x, X, 3 * (size_t)nodes * sizeof *x);
  int far = nodes - 1;
  for (int d = 0; d < 3; d++) x[3 * far + d] -= 3;
  double smallest = flesh_mesh_jacobians(mesh, x, J, &worst, &inverted);
  int below = 0;
  for (int t = 0; t < tets; t++) {
    int touches = 0;
    for (int i = 0; i < 4; i++) touches |= flesh_mesh_tets(mesh)[4 * t + i] == far;
    CHECK(touches ? J[t] < 0 : J[t] == 1);
    below += touches;
    CHECK(J[t] >= smallest);
  }
  CHECK(inverted == below && below > 0 && J[worst] == smallest);
  x[3 * far] = NAN;
  CHECK(isnan(flesh_mesh_jacobians(mesh, x, NULL, &worst, &inverted)) && inverted == below);
  free(x);
  free(J);
  flesh_mesh_destroy(&mesh);
}

/* Computes the area vector of the surface and the volume it encloses, 1/3 of the flux of x. */
static double enclosed_volume(const flesh_mesh *mesh, double area[3])
{
  const double *x = flesh_mesh_positions(mesh);
  int count;
  const int *s = flesh_mesh_surface(mesh, &count);
  double flux = 0;
  for (int d = 0; d < 3; d++) area[d] = 0;
  for (int f = 0; f < count; f++) {
    const double *a = x + 3 * s[3 * f], *b = x + 3 * s[3 * f + 1], *c = x + 3 * s[3 * f + 2];
    for (int d = 0; d < 3; d++) {
      int e = (d + 1) % 3, g = (d + 2) % 3;
      double normal = ((b[e] - a[e]) * (c[g] - a[g]) - (b[g] - a[g]) * (c[e] - a[e])) / 2;
      area[d] += normal;
      flux += normal * (a[d] + b[d] + c[d]) / 3;
    }
  }
  return flux / 3;
}

static void surface_is_closed_and_looks_outwards(void)
{
  flesh_mesh *mesh = jittered_box(4, 3, 2, 0.1);
  int count, open = 0;
  const int *s = flesh_mesh_surface(mesh, &count);
  double area[3], volume = enclosed_volume(mesh, area);
  CHECK(count == 4 * (4 * 3 + 3 * 2 + 4 * 2));
  CHECK_NEAR(volume, flesh_mesh_volume(mesh, flesh_mesh_positions(mesh)), 1e-12);
  for (int d = 0; d < 3; d++) CHECK_NEAR(area[d], 0, 1e-13);
  /* Each directed edge has exactly one partner in the opposite direction. */
  for (int e = 0; e < 3 * count; e++) {
    int from = s[e], to = s[e - e % 3 + (e + 1) % 3], back = 0;
    for (int o = 0; o < 3 * count; o++) back += s[o] == to && s[o - o % 3 + (o + 1) % 3] == from;
    open += back != 1;
  }
  CHECK(open == 0);
  for (int k = 0; k < 3 * count; k++) { /* every corner belongs to the tet behind the triangle */
    const int *tet = flesh_mesh_tets(mesh) + 4 * flesh_mesh_surface_tets(mesh)[k / 3];
    CHECK(s[k] == tet[0] || s[k] == tet[1] || s[k] == tet[2] || s[k] == tet[3]);
  }
  flesh_mesh_destroy(&mesh);

  /* Two tets that share only a node, and two separate ones: every face is on the surface. */
  double x[24];
  for (int i = 0; i < 24; i++)
    x[i] = i < 12 ? unit_tet[i] : -unit_tet[i - 12] - (i % 3 == 0 ? 2 : 0);
  CHECK_OK(flesh_mesh_create(8, x, 2, (int[]){0, 1, 2, 3, 4, 5, 6, 7}, NULL, &mesh));
  flesh_mesh_surface(mesh, &count);
  CHECK(count == 8);
  CHECK_NEAR(enclosed_volume(mesh, area), 1. / 3, 1e-15);
  flesh_mesh_destroy(&mesh);

  /* Two tets on the same side of a face overlap: all eight faces count. */
  double folded[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2};
  CHECK_OK(flesh_mesh_create(5, folded, 2, (int[]){0, 1, 2, 3, 0, 1, 2, 4}, NULL, &mesh));
  flesh_mesh_surface(mesh, &count);
  CHECK(count == 8);
  CHECK_NEAR(enclosed_volume(mesh, area), 0.5, 1e-15);
  flesh_mesh_destroy(&mesh);
}

static void masses_match_closed_forms(void)
{
  flesh_mesh *mesh = jittered_box(4, 3, 2, 0.1);
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *density = malloc((size_t)tets * sizeof *density),
         *mass = malloc((size_t)nodes * sizeof *mass);
  double *x = malloc(3 * (size_t)nodes * sizeof *x), *y = malloc(3 * (size_t)nodes * sizeof *y);
  double total = 0, sum = 0, moment[3] = {0}, closed[3] = {0};
  for (int t = 0; t < tets; t++) {
    density[t] = 900 + 10 * (t % 7);
    total += density[t] * flesh_mesh_tet_volumes(mesh)[t];
  }
  flesh_mesh_lumped_mass(mesh, density, mass);
  for (int n = 0; n < nodes; n++) sum += mass[n];
  CHECK_NEAR(sum, total, 1e-12 * total);
  /* M applied to a uniform field gives the lumped masses. */
  for (int i = 0; i < 3 * nodes; i++) x[i] = i % 3 + 1;
  flesh_mesh_consistent_mass_times(mesh, density, x, y);
  for (int i = 0; i < 3 * nodes; i++) CHECK_NEAR(y[i], mass[i / 3] * (i % 3 + 1), 1e-12 * total);
  /* 1.(M X) is the integral of rho X: rho V times each tet's centre. */
  flesh_mesh_consistent_mass_times(mesh, density, X, y);
  for (int i = 0; i < 3 * nodes; i++) moment[i % 3] += y[i];
  for (int t = 0; t < tets; t++)
    for (int i = 0; i < 4; i++)
      for (int d = 0; d < 3; d++)
        closed[d] += density[t] * flesh_mesh_tet_volumes(mesh)[t] *
                     X[3 * flesh_mesh_tets(mesh)[4 * t + i] + d] / 4;
  for (int d = 0; d < 3; d++) CHECK_NEAR(moment[d], closed[d], 1e-11 * total);
  flesh_mesh_destroy(&mesh);

  /* x.(M x) of a linear field over a box with faces along the axes: rho * the integral of x^2. */
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 4}, (double[]){2, 3, 0.5}, (double[]){1, -1, 0}, &mesh));
  nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  for (int t = 0; t < tets; t++) density[t] = 7;
  X = flesh_mesh_positions(mesh);
  flesh_mesh_consistent_mass_times(mesh, density, X, y);
  double square[3] = {0},
         expected[3] = {7 * 1.5 * (27 - 1) / 3., 7 * 1. * (8 + 1) / 3., 7 * 6 * 0.125 / 3};
  for (int i = 0; i < 3 * nodes; i++) square[i % 3] += X[i] * y[i];
  for (int d = 0; d < 3; d++) CHECK_NEAR(square[d], expected[d], 1e-12 * expected[d]);
  free(density);
  free(mass);
  free(x);
  free(y);
  flesh_mesh_destroy(&mesh);
}

static void one_tet_is_measured(void)
{
  flesh_mesh *mesh;
  flesh_mesh_info info;
  /* The corner of a cube: inradius 1/(3+sqrt 3), circumradius sqrt(3)/2. */
  CHECK_OK(flesh_mesh_create(4, unit_tet, 1, (int[]){0, 1, 2, 3}, (int[]){-5}, &mesh));
  flesh_mesh_inspect(mesh, &info);
  CHECK_NEAR(info.volume, 1. / 6, 1e-16);
  CHECK_NEAR(info.radius_ratio_min, 3 / (3 + sqrt(3)) / (sqrt(3) / 2), 1e-14);
  CHECK(info.triangles == 4 && info.worst_tet == 0 && flesh_mesh_regions(mesh)[0] == -5);
  flesh_mesh_destroy(&mesh);
  double regular[12] = {1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1};
  CHECK_OK(flesh_mesh_create(4, regular, 1, (int[]){0, 1, 2, 3}, NULL, &mesh));
  flesh_mesh_inspect(mesh, &info);
  CHECK_NEAR(info.radius_ratio_min, 1, 1e-14);
  CHECK_NEAR(info.edge_mean, sqrt(8), 1e-14);
  flesh_mesh_destroy(&mesh);
  CHECK(mesh == NULL);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(NULL);
}

static void inverted_tets_are_flipped_and_counted(void)
{
  flesh_mesh *mesh;
  flesh_mesh_info info;
  double x[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 9, 9, 9};
  CHECK_OK(flesh_mesh_create(6, x, 2, (int[]){0, 2, 1, 3, 0, 2, 1, 4}, (int[]){3, 4}, &mesh));
  flesh_mesh_inspect(mesh, &info);
  CHECK(info.flipped == 1 && info.unused_nodes == 1 && info.regions == 2 && info.triangles == 6);
  CHECK_NEAR(info.volume, 1. / 3, 1e-15);
  CHECK_NEAR(info.high[0], 1, 0); /* the unused node is not part of the body */
  for (int t = 0; t < 2; t++) CHECK_NEAR(flesh_mesh_tet_volumes(mesh)[t], 1. / 6, 1e-16);
  for (int n = 0; n < 6; n++) CHECK(flesh_mesh_node_used(mesh)[n] == (n < 5));
  flesh_mesh_destroy(&mesh);
}

static void bad_arrays_are_refused(void)
{
  static const struct {
    int nodes, tets, list[8];
    double moved; /* height of node 3 */
    const char *text;
  } cases[] = {
      {0, 1, {0, 1, 2, 3}, 1, "the mesh is empty"},
      {4, 0, {0, 1, 2, 3}, 1, "at least one tet"},
      {4, 1, {0, 1, 2, 4}, 1, "tet 0 uses node 4; the nodes are 0 to 3"},
      {4, 1, {0, 1, -1, 3}, 1, "tet 0 uses node -1"},
      {4, 1, {0, 1, 1, 3}, 1, "tet 0 uses node 1 twice"},
      {4, 1, {0, 1, 2, 3}, 0, "tet 0 (nodes 0 1 2 3) is flat"},
      {4, 1, {0, 1, 2, 3}, 1e-14, "flat"},
      {4, 1, {0, 1, 2, 3}, NAN, "node 3: z is nan"},
      {4, 1, {0, 1, 2, 3}, -INFINITY, "node 3: z is -inf"},
      {4, 1, {0, 1, 2, 3}, 1e200, "too large"},
      {4, 2, {0, 1, 2, 3, 1, 3, 2, 0}, 1, "tet 1 has the same nodes as tet 0"},
  };
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    flesh_mesh *mesh;
    double x[12];
    memcpy(x, unit_tet, sizeof x);
    x[11] = cases[c].moved;
    CHECK(flesh_mesh_create(cases[c].nodes, x, cases[c].tets, cases[c].list, NULL, &mesh) ==
          FLESH_ERR_ARGUMENT);
    CHECK(mesh == NULL);
    CHECK_TEXT(flesh_error_text(), cases[c].text);
  }
  /* Three tets on one face. */
  flesh_mesh *mesh;
  double fan[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 2};
  CHECK(flesh_mesh_create(6, fan, 3, (int[]){0, 1, 2, 3, 0, 1, 2, 4, 0, 1, 2, 5}, NULL, &mesh) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "nodes 0 1 2 belongs to tets 0, 1 and 2");
}

static void distance_from_rest_ignores_rigid_motion(void)
{
  /* Rotation by 120 degrees about (1,1,1) and by 100 degrees about z, and a shift. */
  double c = cos(100 * acos(-1) / 180), s = sin(100 * acos(-1) / 180);
  double R[3][3] = {{0, c, -s}, {0, s, c}, {1, 0, 0}}, shift[3] = {10, -20, 5};
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_box((int[]){4, 2, 2}, (double[]){4, 1, 2}, (double[]){-1, 3, 0}, &mesh));
  int nodes = flesh_mesh_node_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  CHECK_NEAR(flesh_mesh_distance_from_rest(mesh, X), 0, 1e-15);
  /* Stretched by 1+e along x about the centre and then moved rigidly, the fit is that motion: the ends are off by e/2
   * of the length. e = 0 is rigid; a mirror image is no rigid motion. */
  for (int trial = 0; trial < 3; trial++) {
    double stretch = (double[]){1, 1.1, 0.75}[trial];
    for (int n = 0; n < nodes; n++) {
      double y[3] = {1 + (X[3 * n] - 1) * stretch, X[3 * n + 1], X[3 * n + 2]};
      for (int d = 0; d < 3; d++)
        x[3 * n + d] = R[d][0] * y[0] + R[d][1] * y[1] + R[d][2] * y[2] + shift[d];
    }
    CHECK_NEAR(flesh_mesh_distance_from_rest(mesh, x), fabs(stretch - 1) / 2, 1e-14);
  }
  /* Mirrored along its thinnest side y, the best rotation leaves that side mirrored: 1 of length 4. */
  for (int n = 0; n < nodes; n++)
    for (int d = 0; d < 3; d++) x[3 * n + d] = d == 1 ? 7 - X[3 * n + d] : X[3 * n + d];
  CHECK_NEAR(flesh_mesh_distance_from_rest(mesh, x), 0.25, 1e-14);
  x[7] = NAN;
  CHECK(!(flesh_mesh_distance_from_rest(mesh, x) < 1e300));
  free(x);
  flesh_mesh_destroy(&mesh);
}

/* A tet with a radius ratio near 1e-4, which must be accepted. */
static void check_bad_but_not_flat(const double x[12])
{
  flesh_mesh *mesh;
  flesh_mesh_info info;
  CHECK_OK(flesh_mesh_create(4, x, 1, (int[]){0, 1, 2, 3}, NULL, &mesh));
  if (!mesh) return;
  flesh_mesh_inspect(mesh, &info);
  CHECK(info.radius_ratio_min > 0.5e-4 && info.radius_ratio_min < 3e-4);
  flesh_mesh_destroy(&mesh);
}

static void slivers_are_accepted(void)
{
  for (int place = 0; place < 3; place++) {
    double size = (double[]){1, 1e-6, 1e6}[place], h = 1e-4 * size;
    /* A square whose fourth corner is lifted by h, and a needle: the ratio is proportional to h, the volume to h and to
     * h^2. */
    check_bad_but_not_flat((double[]){0, 0, 0, size, 0, 0, size, size, 0, 0, size, h});
    check_bad_but_not_flat((double[]){0, 0, 0, h, 0, 0, 0, h, 0, 0, 0, size});
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(box_is_the_oracles_bar), TEST(box_fills_its_size),
                   TEST(volume_and_jacobians_follow_an_affine_map),
                   TEST(surface_is_closed_and_looks_outwards), TEST(masses_match_closed_forms),
                   TEST(one_tet_is_measured), TEST(inverted_tets_are_flipped_and_counted),
                   TEST(bad_arrays_are_refused), TEST(distance_from_rest_ignores_rigid_motion),
                   TEST(slivers_are_accepted));
}
