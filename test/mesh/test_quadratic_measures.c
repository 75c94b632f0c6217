// TEST quick
/* test_quadratic_measures.c: volumes, J, masses and quality of ten-node tets, straight and curved. */
#include "quadratic.h"

/* A quadratic map of the rest shape, which every ten-node tet reproduces exactly. */
typedef struct map {
  double linear[3][3], square[3][3][3];
} map;

static map random_map(double amount, unsigned long long *seed)
{
  map m;
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < 3; i++) {
      m.linear[d][i] = (d == i) + amount * (2 * test_uniform(seed) - 1);
      for (int j = 0; j < 3; j++) m.square[d][i][j] = amount * (2 * test_uniform(seed) - 1);
    }
  return m;
}

static void apply_map(const map *m, const double X[3], double x[3])
{
  for (int d = 0; d < 3; d++) {
    x[d] = 0;
    for (int i = 0; i < 3; i++) {
      x[d] += m->linear[d][i] * X[i];
      for (int j = 0; j < 3; j++) x[d] += m->square[d][i][j] * X[i] * X[j];
    }
  }
}

static double map_jacobian(const map *m, const double X[3])
{
  double F[3][3];
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < 3; i++) {
      F[d][i] = m->linear[d][i];
      for (int j = 0; j < 3; j++) F[d][i] += (m->square[d][i][j] + m->square[d][j][i]) * X[j];
    }
  return F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
         F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
}

/* Computes the extreme values of the map's J over a straight tet, sampled on a lattice of step 1/n, and its mean over
 * the tet by the rule that is exact for cubics (Keast 1986, the five-point rule). */
static void sample_jacobian(const map *m, const double *X, const int *n, int steps, double *least, double *most,
                            double *mean)
{
  static const double rule[5][5] = {{0.25, 0.25, 0.25, 0.25, -0.8},
                                    {0.5, 1. / 6, 1. / 6, 1. / 6, 0.45},
                                    {1. / 6, 0.5, 1. / 6, 1. / 6, 0.45},
                                    {1. / 6, 1. / 6, 0.5, 1. / 6, 0.45},
                                    {1. / 6, 1. / 6, 1. / 6, 0.5, 0.45}};
  double p[3];
  *least = INFINITY, *most = -INFINITY, *mean = 0;
  for (int i = 0; i <= steps; i++)
    for (int j = 0; i + j <= steps; j++)
      for (int k = 0; i + j + k <= steps; k++) {
        const double L[4] = {i, j, k, steps - i - j - k};
        for (int d = 0; d < 3; d++) {
          p[d] = 0;
          for (int c = 0; c < 4; c++) p[d] += L[c] / steps * X[3 * n[c] + d];
        }
        double J = map_jacobian(m, p);
        *least = fmin(*least, J), *most = fmax(*most, fabs(J));
      }
  for (int q = 0; q < 5; q++) {
    for (int d = 0; d < 3; d++) {
      p[d] = 0;
      for (int c = 0; c < 4; c++) p[d] += rule[q][c] * X[3 * n[c] + d];
    }
    *mean += rule[q][4] * map_jacobian(m, p);
  }
}

/* Computes J of the map at the tet's four quadrature points: the least and the mean. */
static void points_of(const map *m, const double *X, const int n[4], double *least, double *mean)
{
  const double near = (5 + 3 * sqrt(5)) / 20, far = (5 - sqrt(5)) / 20;
  *least = INFINITY, *mean = 0;
  for (int q = 0; q < 4; q++) {
    double p[3] = {0};
    for (int c = 0; c < 4; c++)
      for (int d = 0; d < 3; d++) p[d] += (c == q ? near : far) * X[3 * n[c] + d];
    const double J = map_jacobian(m, p);
    *least = fmin(*least, J), *mean += J / 4;
  }
}

/* Computes the positions of the mesh under the map. */
static double *mapped(const flesh_mesh *mesh, const map *m)
{
  int nodes = flesh_mesh_node_count(mesh);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  for (int n = 0; n < nodes; n++) apply_map(m, flesh_mesh_positions(mesh) + 3 * n, x + 3 * n);
  return x;
}

static void volume_and_jacobians_follow_a_quadratic_map(void)
{
  unsigned long long seed = 3;
  flesh_mesh *mesh = raised_box(3, 0.15);
  int tets = flesh_mesh_tet_count(mesh), seen_inverted = 0, seen_partly = 0;
  const double *X = flesh_mesh_positions(mesh), *volumes = flesh_mesh_tet_volumes(mesh);
  double *J = malloc((size_t)tets * sizeof *J), *J_mean = malloc((size_t)tets * sizeof *J),
         *J_min = malloc((size_t)tets * sizeof *J);
  int seen_unseen = 0; /* a bound below 0 for a tet with J > 0 at all points */
  for (int trial = 0; trial < 20; trial++) {
    map m = random_map(0.02 * trial, &seed);
    double *x = mapped(mesh, &m), volume = 0, smallest = INFINITY;
    int worst, inverted, none = 0;
    double answer = flesh_mesh_jacobian_bounds(mesh, x, J, &worst, &inverted), smallest_at_points = INFINITY;
    int worst_at_points, inverted_at_points, none_at_points = 0;
    const double answer_at_points = flesh_mesh_jacobians(mesh, x, J_min, &worst_at_points, &inverted_at_points);
    flesh_mesh_mean_jacobians(mesh, x, J_mean);
    for (int t = 0; t < tets; t++) {
      double least, most, mean;
      sample_jacobian(&m, X, flesh_mesh_tets(mesh) + 4 * t, 12, &least, &most, &mean);
      volume += volumes[t] * mean;
      /* The lattice is coarse: it misses the least value slightly, and only from above. */
      CHECK(J[t] <= least + 1e-12 * most);
      CHECK_BELOW(least - J[t], 0.0101 * most + 0.01 * most);
      CHECK(J[t] <= 0 || least > 0);
      smallest = fmin(smallest, J[t]);
      none += J[t] <= 0;
      seen_inverted += J[t] <= 0, seen_partly += J[t] <= 0 && mean > 0;
      double least_at_points, mean_at_points;
      points_of(&m, X, flesh_mesh_tets(mesh) + 4 * t, &least_at_points, &mean_at_points);
      CHECK_NEAR(J_min[t], least_at_points, 1e-11 * most);
      CHECK_NEAR(J_mean[t], mean_at_points, 1e-11 * most);
      smallest_at_points = fmin(smallest_at_points, J_min[t]);
      none_at_points += J_min[t] <= 0;
      seen_unseen += J[t] <= 0 && J_min[t] > 0;
    }
    CHECK(answer_at_points == smallest_at_points && J_min[worst_at_points] == smallest_at_points);
    CHECK(inverted_at_points == none_at_points);
    CHECK(answer == smallest && J[worst] == smallest && inverted == none);
    CHECK_NEAR(flesh_mesh_volume(mesh, x), volume, 1e-11 * (1 + fabs(volume)));
    free(x);
  }
  CHECK(seen_inverted > 100 && seen_partly > 10 && seen_unseen > 10);
  free(J), free(J_mean), free(J_min);
  flesh_mesh_destroy(&mesh);
}

/* A curved rest shape: volumes are the curved ones, and J is relative to the rest shape, so 1 at rest to the last
 * bit. */
static void curved_rest_shapes_are_measured(void)
{
  unsigned long long seed = 5;
  flesh_mesh *straight = raised_box(3, 0.1), *mesh;
  map m = random_map(0.06, &seed), n = random_map(0.06, &seed);
  double *X = mapped(straight, &m);
  int nodes = flesh_mesh_node_count(straight), tets = flesh_mesh_tet_count(straight), worst, inverted, bent = 0;
  int *ten = malloc(10 * (size_t)tets * sizeof *ten);
  for (int t = 0; t < tets; t++) ten_nodes(straight, t, ten + 10 * t);
  CHECK_OK(flesh_mesh_create_quadratic(nodes, X, tets, ten, NULL, &mesh));
  double *J = malloc((size_t)tets * sizeof *J), sum = 0;
  CHECK(flesh_mesh_jacobian_bounds(mesh, X, J, &worst, &inverted) == 1 && !inverted);
  CHECK(flesh_mesh_jacobians(mesh, X, NULL, &worst, &inverted) == 1 && !inverted);
  for (int t = 0; t < tets; t++) {
    double least, most, mean;
    sample_jacobian(&m, flesh_mesh_positions(straight), ten + 10 * t, 4, &least, &most, &mean);
    CHECK(J[t] == 1);
    CHECK_NEAR(flesh_mesh_tet_volumes(mesh)[t], mean * flesh_mesh_tet_volumes(straight)[t], 1e-14);
    sum += flesh_mesh_tet_volumes(mesh)[t];
    bent += flesh_mesh_tet_curved(mesh)[t];
  }
  CHECK(bent == tets);
  CHECK_NEAR(flesh_mesh_volume(mesh, X), sum, 1e-13);
  /* From the curved shape to another image of the same straight one: J is the quotient of both. */
  double *x = mapped(straight, &n);
  flesh_mesh_jacobian_bounds(mesh, x, J, NULL, NULL);
  for (int t = 0; t < tets; t++) {
    double least = INFINITY, most = 0;
    for (int i = 0; i <= 12; i++)
      for (int j = 0; i + j <= 12; j++)
        for (int k = 0; i + j + k <= 12; k++) {
          double p[3] = {0};
          for (int c = 0; c < 4; c++)
            for (int d = 0; d < 3; d++)
              p[d] += (const int[]){i, j, k, 12 - i - j - k}[c] / 12. * flesh_mesh_positions(straight)[3 * ten[10 * t + c] + d];
          double ratio = map_jacobian(&n, p) / map_jacobian(&m, p);
          least = fmin(least, ratio), most = fmax(most, ratio);
        }
    CHECK(J[t] <= least + 1e-12);
    CHECK_BELOW(least - J[t], 0.02 * most);
  }
  for (int i = 0; i < 3 * nodes; i++) x[i] = 2 * X[i];
  for (int d = 0; d < nodes; d++) x[3 * d] *= -1;
  CHECK_NEAR(flesh_mesh_jacobian_bounds(mesh, x, J, NULL, &inverted), -8, 1e-9);
  CHECK(inverted == tets);
  x[3 * ten[9]] = NAN;
  CHECK(isnan(flesh_mesh_jacobian_bounds(mesh, x, J, &worst, NULL)) && isnan(J[worst]));
  free(X), free(x), free(ten), free(J);
  flesh_mesh_destroy(&straight);
  flesh_mesh_destroy(&mesh);
}

/* One tet whose edge 01 is bent by moving its node along x by s: J is 1 + 4 s at corner 0, 1 - 4 s at corner 1, and
 * linear. A rest shape must have J > 0. */
static void rest_shapes_turned_inside_out_are_refused(void)
{
  const int n[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  double x[30] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  flesh_mesh *mesh;
  for (int k = 0; k < 6; k++)
    for (int d = 0; d < 3; d++) x[3 * (4 + k) + d] = (x[3 * ends[k][0] + d] + x[3 * ends[k][1] + d]) / 2;
  for (int i = 0; i < 7; i++) {
    double s = (const double[]){-0.26, -0.25, -0.2499, 0.1, 0.2499, 0.25, 0.26}[i];
    x[12] = 0.5 + s;
    int status = flesh_mesh_create_quadratic(10, x, 1, n, NULL, &mesh);
    CHECK(status == (fabs(s) < 0.25 ? FLESH_OK : FLESH_ERR_ARGUMENT));
    if (!status) {
      /* J is linear here: its smallest over its largest value. */
      flesh_mesh_info info;
      flesh_mesh_inspect(mesh, &info);
      CHECK(info.order == 2 && info.curved == 1 && info.most_bent_tet == 0);
      CHECK_NEAR(info.scaled_jacobian_min, (1 - 4 * fabs(s)) / (1 + 4 * fabs(s)), 1e-12);
    }
    if (status) CHECK_TEXT(flesh_error_text(), "tet 0 (corners 0 1 2 3) is turned inside out");
    flesh_mesh_destroy(&mesh);
  }
}

/* Returns det F of ten nodes x against the unit tet at barycentric L, from the shape functions' derivatives: L_i (2 L_i
 * - 1) at the corners, 4 L_i L_j on the edges. */
static double shape_jacobian(const double *x, const double L[4])
{
  double F[3][3];
  for (int a = 0; a < 3; a++)
    for (int d = 0; d < 3; d++) {
      F[d][a] = (4 * L[a + 1] - 1) * x[3 * (a + 1) + d] - (4 * L[0] - 1) * x[d];
      for (int k = 0; k < 6; k++) {
        const int i = ends[k][0], j = ends[k][1];
        F[d][a] += 4 * x[3 * (4 + k) + d] *
                   ((i == a + 1) * L[j] + (j == a + 1) * L[i] - (i == 0) * L[j] - (j == 0) * L[i]);
      }
    }
  return F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
         F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
}

/* States of one tet with random nodes, including ones inverted inside with J > 0 at all corners. */
static void inversion_inside_is_found(void)
{
  const int n[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, steps = 24;
  double X[30] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, x[30];
  flesh_mesh *mesh;
  unsigned long long seed = 9;
  int hidden = 0, fine = 0, bare = 0;
  for (int k = 0; k < 6; k++)
    for (int d = 0; d < 3; d++) X[3 * (4 + k) + d] = (X[3 * ends[k][0] + d] + X[3 * ends[k][1] + d]) / 2;
  CHECK_OK(flesh_mesh_create_quadratic(10, X, 1, n, NULL, &mesh));
  for (int trial = 0; trial < 3000; trial++) {
    double amount = 0.3 * trial / 3000, least = INFINITY, most = 0, corners = INFINITY;
    for (int i = 0; i < 30; i++) x[i] = X[i] + amount * (2 * test_uniform(&seed) - 1);
    for (int i = 0; i <= steps; i++)
      for (int j = 0; i + j <= steps; j++)
        for (int k = 0; i + j + k <= steps; k++) {
          const double L[4] = {(double)i / steps, (double)j / steps, (double)k / steps,
                               (double)(steps - i - j - k) / steps};
          double J = shape_jacobian(x, L);
          least = fmin(least, J), most = fmax(most, fabs(J));
          if (i == steps || j == steps || k == steps || i + j + k == 0) corners = fmin(corners, J);
        }
    double J = flesh_mesh_jacobian_bounds(mesh, x, NULL, NULL, NULL);
    CHECK(J <= least + 1e-12);
    CHECK_BELOW(least - J, 0.03 * (most + 1));
    hidden += corners > 0 && J <= 0;
    bare += corners <= 0;
    fine += J > 0;
    CHECK(J > 0 || least < 0.01);
  }
  CHECK(hidden > 20 && bare > 100 && fine > 500);
  flesh_mesh_destroy(&mesh);
}

/* Returns the volume of a quarter of a thick pipe, with the nodes of a grid in polar coordinates; order 1: without
 * mid-edge nodes. */
static double pipe_volume(int cells, int order)
{
  flesh_mesh *box, *grid, *mesh, *lowered;
  CHECK_OK(flesh_mesh_box((int[]){cells, 2 * cells, cells}, (double[]){1, acos(0), 0.5}, (double[]){1, 0, 0}, &box));
  CHECK_OK(flesh_mesh_raise_order(box, &grid));
  int nodes = flesh_mesh_node_count(grid), tets = flesh_mesh_tet_count(grid);
  double *x = malloc(3 * (size_t)nodes * sizeof *x), volume;
  int *ten = malloc(10 * (size_t)tets * sizeof *ten);
  for (int n = 0; n < nodes; n++) {
    const double *X = flesh_mesh_positions(grid) + 3 * n;
    x[3 * n] = X[0] * cos(X[1]), x[3 * n + 1] = X[0] * sin(X[1]), x[3 * n + 2] = X[2];
  }
  for (int t = 0; t < tets; t++) ten_nodes(grid, t, ten + 10 * t);
  CHECK_OK(flesh_mesh_create_quadratic(nodes, x, tets, ten, NULL, &mesh));
  CHECK_OK(flesh_mesh_lower_order(mesh, &lowered));
  volume = order == 2 ? flesh_mesh_volume(mesh, x) : flesh_mesh_volume(lowered, flesh_mesh_positions(lowered));
  free(x), free(ten);
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&grid);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&lowered);
  return volume;
}

/* The volume of a round body converges with the fourth power of the cell size, with flat faces with the second. */
static void curved_volumes_converge_with_order_four(void)
{
  const double exact = 0.5 * acos(0) / 2 * (4 - 1);
  for (int order = 1; order <= 2; order++) {
    double error[3];
    for (int k = 0; k < 3; k++) error[k] = fabs(pipe_volume(1 << k, order) - exact);
    for (int k = 0; k < 2; k++) CHECK_NEAR(log2(error[k] / error[k + 1]), 2 * order, 0.1);
    printf("# order %d: volume off by %.3g, %.3g, %.3g m^3\n", order, error[0], error[1], error[2]);
  }
}

/* HRZ lumping: 1/36 and 4/27 of a straight tet's mass, with the right total; the consistent mass is exact for products
 * of two quadratic fields. */
static void masses_match_closed_forms(void)
{
  flesh_mesh *mesh = raised_box(2, 0), *random = raised_box(2, 0.15);
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  double *density = malloc((size_t)tets * sizeof *density), *mass = malloc((size_t)nodes * sizeof *mass);
  double *expected = calloc((size_t)nodes, sizeof *expected);
  double *x = malloc(3 * (size_t)nodes * sizeof *x), *y = malloc(3 * (size_t)nodes * sizeof *y);
  for (int t = 0; t < tets; t++) density[t] = 900 + 10 * (t % 7);
  for (int t = 0; t < tets; t++) {
    int n[10];
    ten_nodes(random, t, n);
    for (int a = 0; a < 10; a++)
      expected[n[a]] += density[t] * flesh_mesh_tet_volumes(random)[t] * (a < 4 ? 1. / 36 : 4. / 27);
  }
  flesh_mesh_lumped_mass(random, density, mass);
  for (int n = 0; n < nodes; n++) CHECK_NEAR(mass[n], expected[n], 1e-12);
  /* x(M y) of 1, X, X^2 over the box from -0.3 to 0.7 along x, 1.5 m^2 across. */
  const double *X = flesh_mesh_positions(mesh);
  for (int t = 0; t < tets; t++) density[t] = 7;
  for (int i = 0; i < 3 * nodes; i++) x[i] = (double[]){1, X[i / 3 * 3], X[i / 3 * 3] * X[i / 3 * 3]}[i % 3];
  flesh_mesh_consistent_mass_times(mesh, density, x, y);
  for (int p = 0; p < 3; p++)
    for (int q = 0; q < 3; q++) {
      double sum = 0, power = p + q + 1;
      for (int n = 0; n < nodes; n++) sum += x[3 * n + p] * y[3 * n + q];
      CHECK_NEAR(sum, 7 * 1.5 * (pow(0.7, power) - pow(-0.3, power)) / power, 1e-13);
    }
  free(density), free(mass), free(expected), free(x), free(y);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&random);
}

/* A curved rest shape: integrals over it, mapped back to the straight one, against a product rule of Gauss-Legendre
 * points in the collapsed cube, which is exact for these degrees. */
static void curved_masses_are_exact(void)
{
  static const double point[8] = {0.0198550717512319, 0.1016667612931866, 0.2372337950418355, 0.4082826787521751,
                                  0.5917173212478249, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681};
  static const double weight[8] = {0.0506142681451881, 0.1111905172266872, 0.1568533229389436, 0.1813418916891810,
                                   0.1813418916891810, 0.1568533229389436, 0.1111905172266872, 0.0506142681451881};
  unsigned long long seed = 21;
  double X[30] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, M[10][10] = {{0}}, diagonal = 0, volume = 0, mass[10];
  const int n[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  for (int k = 0; k < 6; k++)
    for (int d = 0; d < 3; d++)
      X[3 * (4 + k) + d] = (X[3 * ends[k][0] + d] + X[3 * ends[k][1] + d]) / 2 + 0.08 * (test_uniform(&seed) - 0.5);
  for (int i = 0; i < 512; i++) {
    double r = point[i % 8], s = point[i / 8 % 8], t = point[i / 64], N[10];
    double L[4] = {0, r, (1 - r) * s, (1 - r) * (1 - s) * t};
    L[0] = 1 - L[1] - L[2] - L[3];
    double w = weight[i % 8] * weight[i / 8 % 8] * weight[i / 64] * (1 - r) * (1 - r) * (1 - s) * shape_jacobian(X, L);
    for (int a = 0; a < 10; a++) N[a] = a < 4 ? L[a] * (2 * L[a] - 1) : 4 * L[ends[a - 4][0]] * L[ends[a - 4][1]];
    for (int a = 0; a < 10; a++)
      for (int b = 0; b < 10; b++) M[a][b] += w * N[a] * N[b];
    volume += w;
  }
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_create_quadratic(10, X, 1, n, NULL, &mesh));
  const double density = 3;
  double x[30], y[30];
  CHECK_NEAR(flesh_mesh_tet_volumes(mesh)[0], volume, 1e-15);
  for (int b = 0; b < 10; b++) {
    for (int i = 0; i < 30; i++) x[i] = i == 3 * b + 1;
    flesh_mesh_consistent_mass_times(mesh, &density, x, y);
    for (int a = 0; a < 10; a++) CHECK_NEAR(y[3 * a + 1], density * M[a][b], 1e-15);
    diagonal += M[b][b];
  }
  flesh_mesh_lumped_mass(mesh, &density, mass);
  for (int a = 0; a < 10; a++) CHECK_NEAR(mass[a], density * volume * M[a][a] / diagonal, 1e-14);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(volume_and_jacobians_follow_a_quadratic_map),
                   TEST(curved_rest_shapes_are_measured), TEST(rest_shapes_turned_inside_out_are_refused),
                   TEST(inversion_inside_is_found), TEST(curved_volumes_converge_with_order_four),
                   TEST(masses_match_closed_forms), TEST(curved_masses_are_exact));
}
