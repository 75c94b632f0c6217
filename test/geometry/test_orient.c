// TEST quick seconds=60
/* test_orient.c: signs of determinants and intersections against integers of 1536 bits. */
#include <float.h>

#include "geometry/orient.h"
#include "test.h"
#include "wide.h"

static unsigned long long state = 7;
static double between(double a, double b) { return a + (b - a) * test_uniform(&state); }
static int chance(int of) { return (int)(of * test_uniform(&state)); }

static void nudge(double *x, int ulps)
{
  for (; ulps > 0; ulps--) *x = nextafter(*x, INFINITY);
  for (; ulps < 0; ulps++) *x = nextafter(*x, -INFINITY);
}

/* Makes points near the plane of three others, to the last bits; on a grid, where many are coplanar; or of very
 * different magnitudes. */
static void hard_points(int kind, double x[5][3])
{
  const double offset = kind % 2 ? 1e6 : 0;
  for (int k = 0; k < 5; k++)
    for (int c = 0; c < 3; c++)
      switch (kind % 5) {
      case 0: x[k][c] = offset + between(-1, 1); break;
      case 1: x[k][c] = offset + 0.1 * chance(4); break;
      case 2: x[k][c] = between(-1, 1) * pow(10, between(-50, 20)); break;
      case 3: x[k][c] = k < 3 ? offset + between(-1, 1) : 0; break;
      default: x[k][c] = 0.5 + chance(6) * DBL_EPSILON * (c + 1) * (k < 2 ? 1 : 1e14); break;
      }
  if (kind % 5 != 3) return;
  for (int k = 3; k < 5; k++) {
    const double s = between(-1, 2), t = between(-1, 2);
    for (int c = 0; c < 3; c++) {
      x[k][c] = x[0][c] + s * (x[1][c] - x[0][c]) + t * (x[2][c] - x[0][c]);
      nudge(&x[k][c], chance(5) - 2);
    }
  }
}

static void orient3d_is_exact(void)
{
  int zeros = 0, wrong = 0, naive = 0;
  for (int k = 0; k < 20000; k++) {
    double x[5][3];
    hard_points(k % 10, x);
    const int sign = flesh_orient3d(x[0], x[1], x[2], x[3]), exact = wide_orient3d(x[0], x[1], x[2], x[3]);
    double e[3], f[3], d[3];
    for (int c = 0; c < 3; c++) e[c] = x[1][c] - x[0][c], f[c] = x[2][c] - x[0][c], d[c] = x[3][c] - x[0][c];
    const double det = (e[1] * f[2] - e[2] * f[1]) * d[0] + (e[2] * f[0] - e[0] * f[2]) * d[1] +
                       (e[0] * f[1] - e[1] * f[0]) * d[2];
    zeros += exact == 0;
    wrong += sign != exact;
    naive += ((det > 0) - (det < 0)) != exact;
    CHECK(flesh_orient3d(x[1], x[0], x[2], x[3]) == -sign && flesh_orient3d(x[3], x[2], x[1], x[0]) == sign);
  }
  printf("# %d of 20000 in a plane; the sign of the rounded determinant is wrong for %d\n", zeros, naive);
  CHECK(wrong == 0);
  CHECK(zeros > 500 && naive > 400); /* the points are hard cases */
}

static void orient2d_is_exact(void)
{
  for (int k = 0; k < 20000; k++) {
    double x[5][3];
    hard_points(k % 10, x);
    for (int axis = 0; axis < 3; axis++) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const wide_vector e = wide_between(x[0], x[1]), f = wide_between(x[0], x[3]);
      const wide det = wide_minus(wide_times(e.c[u], f.c[v]), wide_times(e.c[v], f.c[u]));
      CHECK(flesh_orient2d(axis, x[0], x[1], x[3]) == wide_sign(det));
    }
  }
}

static void sizes_at_the_ends(void)
{
  for (int power = -900; power <= 900; power += 100) {
    const double s = ldexp(1, power), t = nextafter(s, 0);
    const double a[3] = {0, 0, 0}, b[3] = {s, 0, 0}, c[3] = {0, s, 0}, above[3] = {s, s, s * 0x1p-52}, in[3] = {t, s, 0};
    CHECK(flesh_orient3d(a, b, c, above) == 1);
    CHECK(flesh_orient3d(a, c, b, above) == -1);
    CHECK(flesh_orient3d(a, b, c, in) == 0);
    CHECK(flesh_orient2d(2, a, b, c) == 1);
    CHECK(flesh_orient2d(2, a, (const double[]){s, s, 0}, in) == 1);
  }
  const double p[3] = {0, 0, 0}, q[3] = {1, 0, 0}, r[3] = {0, 1, 0}, bad[3] = {0, NAN, 1}, far[3] = {0, 0, INFINITY};
  CHECK(flesh_orient3d(p, q, r, bad) == 0 && flesh_orient3d(bad, p, q, r) == 0 && flesh_orient3d(p, q, r, far) == 0);
  CHECK(flesh_orient2d(0, p, bad, q) == 0);
}

static void intersections_are_exact(void)
{
  int meeting = 0, flat = 0, trials = 0;
  for (int k = 0; k < 20000; k++) {
    double x[5][3];
    hard_points(k % 10, x);
    if (k % 3 == 0) /* all in one plane normal to an axis */
      for (int j = 0; j < 5; j++) x[j][k % 9 / 3] = 0.7;
    const double *p = x[3], *q = x[4];
    if (k % 7 == 0) memcpy(x[4], x[chance(3)], sizeof x[4]); /* an end at a corner */
    if (k % 11 == 0) memcpy(x[4], x[3], sizeof x[4]);        /* a point */
    const int exact = wide_segment_meets_triangle(p, q, x[0], x[1], x[2]);
    if (exact < 0) continue;
    trials++;
    meeting += exact;
    flat += wide_orient3d(x[0], x[1], x[2], p) == 0 && wide_orient3d(x[0], x[1], x[2], q) == 0;
    for (int turn = 0; turn < 3; turn++) {
      const int i = turn, j = (turn + 1) % 3, l = (turn + 2) % 3;
      CHECK(flesh_segment_meets_triangle(p, q, x[i], x[j], x[l]) == exact);
      CHECK(flesh_segment_meets_triangle(q, p, x[j], x[i], x[l]) == exact);
    }
  }
  printf("# %d of %d meet, %d lie in one plane\n", meeting, trials, flat);
  CHECK(meeting > 4000 && trials - meeting > 4000 && flat > 4000);
}

/* Triangles that are shrunk to a segment or a point. */
static void triangles_without_area(void)
{
  const double o[3] = {0, 0, 0}, a[3] = {1, 2, 3}, b[3] = {2, 4, 6}, m[3] = {0.5, 1, 1.5}, off[3] = {0.5, 1, 1.25};
  const double down[3] = {0.5, 1, -9}, up[3] = {0.5, 1, 9}, beyond[3] = {3, 6, 9};
  CHECK(flesh_segment_meets_triangle(down, up, o, a, b));
  CHECK(flesh_segment_meets_triangle(m, off, o, b, a));
  CHECK(!flesh_segment_meets_triangle(down, off, o, a, b));
  CHECK(flesh_segment_meets_triangle(beyond, a, o, b, b));
  CHECK(!flesh_segment_meets_triangle(beyond, b, o, a, a));
  CHECK(flesh_segment_meets_triangle(m, m, o, a, b) && !flesh_segment_meets_triangle(off, off, o, a, b));
  CHECK(flesh_segment_meets_triangle(o, a, m, m, m) && !flesh_segment_meets_triangle(o, a, off, off, off));
  CHECK(flesh_segment_meets_triangle(a, a, a, a, a) && !flesh_segment_meets_triangle(a, a, b, b, b));
  CHECK(!flesh_segment_meets_segment(down, off, o, a) && flesh_segment_meets_segment(down, up, o, a));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(orient3d_is_exact), TEST(orient2d_is_exact), TEST(sizes_at_the_ends),
                   TEST(intersections_are_exact), TEST(triangles_without_area));
}
