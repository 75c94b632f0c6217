// TEST quick seconds=60
/* test_contact_pair.c: the barrier between two features: derivatives against finite differences, forces and moments
 * that balance, filtered eigenvalues, and configurations of every kind without NaN. */
#include "geometry/barrier.h"
#include "geometry/contact_pair.h"
#include "math/eig_small.h"
#include "test_matrix.h"

enum { KINDS = 4 };

/* Makes a pair of random features about `distance` apart, with feet in or near them. */
static flesh_contact_pair random_pair(int kind, double distance, double x[12])
{
  flesh_contact_pair pair = {{0, 1, 2, 3}, (flesh_contact_kind)kind, 0, 0, 1 + uniform() / 2, 0.2, 0, 0};
  double R[9], base[12];
  random_rotation(R);
  for (int k = 0; k < 12; k++) base[k] = uniform();
  for (int a = 0; a < 4; a++) base[3 * a + 2] *= 0.02;
  const int first = kind == FLESH_CONTACT_EDGE_EDGE ? 2 : 1; /* nodes of the first feature */
  for (int c = 0; c < 2; c++) {
    double shift = 0.5 * uniform();
    for (int a = 0; a < 4; a++) {
      if (kind == FLESH_CONTACT_POINT_POINT && a == 1) base[3 * a + c] = base[c] + 0.05 * uniform();
      else if (a < first) base[3 * a + c] += shift;
    }
  }
  for (int a = 0; a < first; a++) base[3 * a + 2] += distance;
  for (int a = 0; a < 4; a++) flesh_mat3_times(R, base + 3 * a, x + 3 * a);
  for (int k = flesh_contact_kind_nodes(pair.kind); k < 4; k++) pair.nodes[k] = -1;
  return pair;
}

static int gradient_of(const flesh_contact_pair *pair, const double *x, double *value, double *gradient)
{
  flesh_contact_closest at;
  flesh_contact_find_closest(pair->kind, pair->within, pair->nodes, x, &at);
  return flesh_contact_pair_gradient(pair, &at, x, value, gradient);
}

static int hessian_of(const flesh_contact_pair *pair, const double *x, flesh_eigenvalue_filter filter, double *H)
{
  flesh_contact_closest at;
  flesh_contact_find_closest(pair->kind, pair->within, pair->nodes, x, &at);
  return flesh_contact_pair_hessian(pair, &at, x, filter, H);
}

static int same_feature(const flesh_contact_pair *pair, const double *x, const double *y)
{
  flesh_contact_closest a, b;
  flesh_contact_find_closest(pair->kind, 0, pair->nodes, x, &a);
  flesh_contact_find_closest(pair->kind, 0, pair->nodes, y, &b);
  if (a.count != b.count) return 0;
  return !memcmp(a.corner, b.corner, sizeof a.corner);
}

/* Returns the derivative of f by h at 0 from six values, with an error of order h^6. */
static double derivative(const double f[6], double h)
{
  return (f[5] - f[0] + 9 * (f[1] - f[4]) + 45 * (f[3] - f[2])) / (60 * h);
}

static const int stencil[6] = {-3, -2, -1, 1, 2, 3};

/* Returns the largest errors of gradient and Hessian over their magnitudes; -1: another feature is nearest within the
 * stencil. */
static int compare(const flesh_contact_pair *pair, const double *x, double step, double *of_gradient, double *of_hessian)
{
  double value, g[12], H[144], gradients[6][12], values[6], y[12], size = 0, bend = 0;
  *of_gradient = *of_hessian = 0;
  if (gradient_of(pair, x, &value, g) || value == 0) return -1;
  CHECK_OK(hessian_of(pair, x, FLESH_FILTER_NONE, H));
  for (int k = 0; k < 12; k++) size = fmax(size, fabs(g[k]));
  for (int k = 0; k < 144; k++) bend = fmax(bend, fabs(H[k]));
  for (int k = 0; k < 3 * flesh_contact_kind_nodes(pair->kind); k++) {
    for (int s = 0; s < 6; s++) {
      memcpy(y, x, sizeof y);
      y[k] += stencil[s] * step;
      if (!same_feature(pair, x, y) || gradient_of(pair, y, &values[s], gradients[s]) || values[s] == 0)
        return -1;
    }
    *of_gradient = fmax(*of_gradient, fabs(derivative(values, step) - g[k]) / size);
    for (int j = 0; j < 12; j++) {
      double f[6];
      for (int s = 0; s < 6; s++) f[s] = gradients[s][j];
      *of_hessian = fmax(*of_hessian, fabs(derivative(f, step) - H[12 * k + j]) / bend);
    }
  }
  return 0;
}

static void derivatives_are_those_of_differences(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    double worst[2] = {0, 0};
    int done = 0, full = 0;
    for (int trial = 0; trial < 800; trial++) {
      double x[12], errors[2];
      flesh_contact_closest at;
      const flesh_contact_pair pair = random_pair(kind, 0.1, x);
      if (compare(&pair, x, 3e-4, &errors[0], &errors[1])) continue;
      flesh_contact_find_closest(pair.kind, 0, pair.nodes, x, &at);
      full += at.count == flesh_contact_kind_nodes(pair.kind);
      for (int e = 0; e < 2; e++) worst[e] = fmax(worst[e], errors[e]);
      done++;
    }
    printf("# kind %d: gradient %.2g, Hessian %.2g in %d, %d of them within the features\n", kind, worst[0], worst[1],
           done, full);
    CHECK(done > 60 && full > 20);
    CHECK_BELOW(worst[0], 1e-8);
    CHECK_BELOW(worst[1], 1e-6);
  }
}

/* Nearly parallel edges side by side. */
static flesh_contact_pair parallel_pair(double angle, double x[12])
{
  flesh_contact_pair pair = {{0, 1, 2, 3}, FLESH_CONTACT_EDGE_EDGE, 0, -1, 1.3, 0.2, 0, 0};
  double R[9], base[12] = {0, 0, 0.1, 1, angle, 0.1 + angle * uniform(), 0.3 * uniform(), 0, 0, 1.2, 0, 0};
  random_rotation(R);
  for (int a = 0; a < 4; a++) flesh_mat3_times(R, base + 3 * a, x + 3 * a);
  pair.parallel = flesh_contact_parallel(1, 1);
  return pair;
}

static void mollified_edges_too(void)
{
  double worst[2] = {0, 0};
  int done = 0;
  for (int trial = 0; trial < 300; trial++) {
    double x[12], errors[2];
    const flesh_contact_pair pair = parallel_pair(0.003 + 0.018 * trial / 300., x); /* the mollifier ends at 0.0316 */
    if (compare(&pair, x, 3e-5, &errors[0], &errors[1])) continue;
    for (int e = 0; e < 2; e++) worst[e] = fmax(worst[e], errors[e]);
    done++;
  }
  printf("# gradient %.2g, Hessian %.2g in %d\n", worst[0], worst[1], done);
  CHECK(done > 100);
  CHECK_BELOW(worst[0], 1e-8);
  CHECK_BELOW(worst[1], 1e-6);
}

static void forces_and_moments_balance(void)
{
  double worst[2] = {0, 0};
  for (int trial = 0; trial < 4000; trial++) {
    double x[12], value, g[12], size = 0, sums[6] = {0};
    const flesh_contact_pair pair =
        trial % 5 == 4 ? parallel_pair(0.02, x) : random_pair(trial % 5, 0.1 + 0.09 * uniform(), x);
    if (gradient_of(&pair, x, &value, g) || value == 0) continue;
    for (int a = 0; a < flesh_contact_kind_nodes(pair.kind); a++) {
      double moment[3];
      flesh_vec3_cross(x + 3 * a, g + 3 * a, moment);
      for (int c = 0; c < 3; c++) {
        sums[c] += g[3 * a + c], sums[3 + c] += moment[c];
        size = fmax(size, fabs(g[3 * a + c]));
      }
    }
    for (int c = 0; c < 6; c++) worst[c / 3] = fmax(worst[c / 3], fabs(sums[c]) / size);
  }
  printf("# sum of forces %.2g, of moments %.2g m\n", worst[0], worst[1]);
  CHECK_BELOW(worst[0], 1e-14);
  CHECK_BELOW(worst[1], 3e-14);
}

/* Filters all twelve eigenvalues of the Hessian. */
static void filter_by_twelve(double *H, flesh_eigenvalue_filter filter)
{
  double w[12], Q[144], copy[144];
  memcpy(copy, H, sizeof copy);
  flesh_eigh_small(12, copy, w, Q);
  for (int k = 0; k < 144; k++) {
    H[k] = 0;
    for (int e = 0; e < 12; e++)
      H[k] += (w[e] >= 0 ? w[e] : filter == FLESH_FILTER_ABSOLUTE ? -w[e] : 0) * Q[12 * (k / 12) + e] *
              Q[12 * (k % 12) + e];
  }
}

static void filters_are_those_of_the_whole(void)
{
  double worst = 0, least = 0;
  int done = 0;
  for (int trial = 0; trial < 3000; trial++) {
    double x[12], H[144], whole[144], w[12], Q[144], size = 0;
    const flesh_eigenvalue_filter filter = trial % 2 ? FLESH_FILTER_CLAMP : FLESH_FILTER_ABSOLUTE;
    flesh_contact_pair pair =
        trial % 5 == 4 ? parallel_pair(0.02, x) : random_pair(trial % 5, 0.1 + 0.09 * uniform(), x);
    if (trial % 3 == 0) pair.weight = -pair.weight;
    CHECK_OK(hessian_of(&pair, x, FLESH_FILTER_NONE, whole));
    CHECK_OK(hessian_of(&pair, x, filter, H));
    filter_by_twelve(whole, filter);
    for (int k = 0; k < 144; k++) size = fmax(size, fabs(whole[k]));
    if (size == 0) continue;
    for (int k = 0; k < 144; k++) worst = fmax(worst, fabs(H[k] - whole[k]) / size);
    flesh_eigh_small(12, H, w, Q);
    for (int k = 0; k < 12; k++) least = fmin(least, w[k] / size);
    done++;
  }
  printf("# filters differ by %.2g, least eigenvalue %.2g, in %d\n", worst, least, done);
  CHECK(done > 1500);
  CHECK_BELOW(worst, 1e-13);
  CHECK_BELOW(-least, 1e-14);
}

/* Distances from 1e-12 of the thickness, slivers, parallel and collinear edges, edges without length, large
 * coordinates. */
static void stress_one(int trial, int *felt, int *bad)
{
  double x[12], value, g[12], H[144];
  const double distance = 0.2 * pow(10, -12 * test_uniform(&matrix_seed));
  flesh_contact_pair pair = random_pair(trial % KINDS, distance, x);
  if (trial % 4 == FLESH_CONTACT_EDGE_EDGE) pair.parallel = trial % 8 < 4 ? flesh_contact_parallel(1, 1) : 0;
  const int way = trial / 4 % 8, first = pair.kind == FLESH_CONTACT_EDGE_EDGE ? 2 : 1;
  for (int c = 0; c < 3; c++) {
    const double thin = way == 1 ? 1e-9 : way == 2 ? 1e-14 : 0;
    if (way == 1 || way == 2 || way == 3) /* a sliver, parallel edges, an edge without length */
      x[9 + c] = x[6 + c] + thin * x[c] +
                 (way == 3 ? 0 : first == 2 ? x[3 + c] - x[c] : 0.3 * (x[6 + c] - x[3 + c]));
    if (way == 4) x[3 + c] = x[c];                                  /* points coincide, or an edge has no length */
    if (way == 5) x[c] = 0.3 * x[3 + c] + 0.7 * x[6 + c];           /* on the edge, up to rounding */
    if (way == 6) for (int a = 0; a < 4; a++) x[3 * a + c] += 1e6;
    if (way == 7) for (int a = 0; a < 4; a++) x[3 * a + c] = x[c] + 1e-8 * x[3 * a + c];
  }
  const int status = gradient_of(&pair, x, &value, g);
  double sum = value;
  for (int k = 0; k < 12; k++) sum += g[k] * 0 + (status ? fabs(g[k]) : 0);
  *bad += !isfinite(sum) || (status && sum != 0);
  *felt += status == FLESH_OK && value > 0;
  if (trial / 32 % 8) return;
  *bad += hessian_of(&pair, x, (flesh_eigenvalue_filter)(trial / 256 % 3), H) != status;
  sum = 0;
  for (int k = 0; k < 144; k++) sum += H[k] * 0;
  *bad += sum != 0;
}

static void a_million_pairs_give_no_nan(void)
{
  int felt = 0, bad = 0;
  for (int trial = 0; trial < 1000000; trial++) stress_one(trial, &felt, &bad);
  printf("# %d of them felt\n", felt);
  CHECK(felt > 100000);
  CHECK(bad == 0);
}

/* The distance agrees with dense sampling, and the force with the law. */
static void distances_are_the_least(void)
{
  enum { CUTS = 40 };
  for (int trial = 0; trial < 400; trial++) {
    double x[12], best = INFINITY;
    const flesh_contact_pair pair = random_pair(trial % KINDS, 0.15, x);
    flesh_contact_closest at;
    const double force = flesh_contact_pair_force(&pair, x, &at);
    for (int i = 0; i <= CUTS; i++)
      for (int j = 0; j <= (pair.kind == FLESH_CONTACT_EDGE_EDGE ? CUTS : CUTS - i); j++) {
        const double s = (double)i / CUTS, t = (double)j / CUTS;
        double c[4] = {1, -1, 0, 0}, d = 0;
        if (pair.kind == FLESH_CONTACT_POINT_EDGE) c[1] = s - 1, c[2] = -s;
        if (pair.kind == FLESH_CONTACT_POINT_TRIANGLE) c[1] = s + t - 1, c[2] = -s, c[3] = -t;
        if (pair.kind == FLESH_CONTACT_EDGE_EDGE) c[0] = 1 - s, c[1] = s, c[2] = t - 1, c[3] = -t;
        for (int k = 0; k < 3; k++) {
          const double e = c[0] * x[k] + c[1] * x[3 + k] + c[2] * x[6 + k] + c[3] * x[9 + k];
          d += e * e;
        }
        best = fmin(best, sqrt(d));
      }
    CHECK(at.distance <= best * (1 + 1e-14) && at.distance > best - 0.1);
    CHECK(at.distance > best - 0.004 / best); /* the grid has a spacing of 0.025 on edges of at most 3 m */
    double law, first, second;
    flesh_barrier_law(at.distance / pair.thickness, &law, &first, &second);
    CHECK_NEAR(force, at.distance < pair.thickness ? -pair.weight * first : 0, 1e-14 * fabs(force));
  }
}

/* Finds the largest jumps of value and forces of an edge that turns through parallel while it slides past the ends of
 * another. */
static void jumps_of(int steps, double jump[2])
{
  double x[12] = {-0.5, 0, 0, 0.5, 0, 0}, last[13] = {0};
  const flesh_contact_pair pair = {{0, 1, 2, 3}, FLESH_CONTACT_EDGE_EDGE, 0, -1, 1, 0.2,
                                   flesh_contact_parallel(1, 1), 0};
  jump[0] = jump[1] = 0;
  for (int k = 0; k <= steps; k++) {
    const double s = (double)k / steps, angle = 0.2 * (s - 0.4), tilt = 0.05 * (s - 0.4);
    double now[13];
    for (int end = 0; end < 2; end++) {
      const double along = end - 0.8 + 1.2 * s;
      const double place[3] = {along * cos(angle), along * sin(angle) + 0.01, 0.05 + tilt * along};
      memcpy(x + 6 + 3 * end, place, sizeof place);
    }
    CHECK_OK(gradient_of(&pair, x, now, now + 1));
    for (int c = 0; c < 13 && k; c++) jump[c > 0] = fmax(jump[c > 0], fabs(now[c] - last[c]));
    memcpy(last, now, sizeof last);
  }
}

static void nothing_jumps_where_edges_turn(void)
{
  double coarse[2], fine[2];
  jumps_of(20000, coarse);
  jumps_of(80000, fine);
  printf("# value %.3g J, force %.3g N in a step; %.3f and %.3f of it in a quarter\n", coarse[0], coarse[1],
         fine[0] / coarse[0], fine[1] / coarse[1]);
  CHECK_BELOW(fine[0], 0.27 * coarse[0]);
  CHECK_BELOW(fine[1], 0.27 * coarse[1]);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(derivatives_are_those_of_differences), TEST(mollified_edges_too),
                   TEST(forces_and_moments_balance), TEST(filters_are_those_of_the_whole),
                   TEST(a_million_pairs_give_no_nan), TEST(distances_are_the_least),
                   TEST(nothing_jumps_where_edges_turn));
}
