/* orient.c: signs of determinants by exact sums (Shewchuk 1997).
 *
 * A number is represented by a sum of non-overlapping doubles, the largest last; its sign is that of the last. The
 * build compiles this file without fused products and without reordering of sums, both of which would invalidate the
 * error terms. */
#include "geometry/orient.h"

#include <float.h>
#include <math.h>

#if FLT_EVAL_METHOD != 0
#error "orient.c needs double sums that are rounded to double: on x86 with 32 bits, -msse2 -mfpmath=sse"
#endif
#ifdef __FAST_MATH__
#error "orient.c must be compiled without -ffast-math"
#endif

/* Largest numbers of terms: of a difference; of a 2 x 2 determinant of differences; of a 3 x 3 one, the sum of three
 * products of a minor and a difference. */
enum { DIFFERENCE = 2, MINOR = 16, TERMS = 192 };

/* Computes value + error = a + b exactly (Knuth, The Art of Computer Programming 2, section 4.2.2). */
static double two_sum(double a, double b, double *error)
{
  const double value = a + b, of_b = value - a, of_a = value - of_b;
  *error = (a - of_a) + (b - of_b);
  return value;
}

/* Returns the upper half of the digits (Veltkamp 1968). */
static double upper_half(double a)
{
  const double c = 134217729.0 * a; /* 2^27 + 1 */
  return c - (c - a);
}

/* Computes value + error = a b exactly (Dekker 1971). */
static double two_product(double a, double b, double *error)
{
  const double value = a * b, ah = upper_half(a), al = a - ah, bh = upper_half(b), bl = b - bh;
  *error = al * bl - (((value - ah * bh) - al * bh) - ah * bl);
  return value;
}

/* Adds b to a sum of `count` terms. Returns the new number of terms. */
static int add(int count, double *terms, double b)
{
  int kept = 0;
  for (int k = 0; k < count; k++) {
    double error;
    b = two_sum(b, terms[k], &error);
    if (error != 0) terms[kept++] = error;
  }
  if (b != 0) terms[kept++] = b;
  return kept;
}

typedef struct difference {
  int count;
  double terms[DIFFERENCE];
} difference;

static difference subtract(double a, double b)
{
  difference d;
  double error, value = two_sum(a, -b, &error);
  d.count = add(0, d.terms, error);
  d.count = add(d.count, d.terms, value);
  return d;
}

/* Adds sign a b to `to`. Returns the new number of terms. */
static int add_product(int count, double *to, double sign, int a_count, const double *a, const difference *b)
{
  for (int i = 0; i < a_count; i++)
    for (int j = 0; j < b->count; j++) {
      double error, value = two_product(sign * a[i], b->terms[j], &error);
      count = add(count, to, error);
      count = add(count, to, value);
    }
  return count;
}

/* Computes a d - b c. Returns the number of terms. */
static int cross(const difference *a, const difference *b, const difference *c, const difference *d, double *to)
{
  const int count = add_product(0, to, 1, a->count, a->terms, d);
  return add_product(count, to, -1, b->count, b->terms, c);
}

static int sign_of(int count, const double *terms)
{
  if (count == 0) return 0;
  return terms[count - 1] > 0 ? 1 : -1;
}

/* Copies the points, all multiplied by one power of two if products might overflow or underflow. Returns 0 if one is
 * not finite. */
static int scale(int count, const double *const points[], double scaled[][3])
{
  double largest = 0, sound = 0;
  int exponent = 0;
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3; c++) {
      const double p = points[k][c];
      largest = fabs(p) > largest ? fabs(p) : largest;
      sound += 0 * p;
      scaled[k][c] = p;
    }
  if (sound != 0 || largest > DBL_MAX) return 0; /* true also for NaN, which differs from 0 */
  if (largest >= 1 && largest < 0x1p60) return 1;
  frexp(largest, &exponent);
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3; c++) scaled[k][c] = ldexp(points[k][c], -exponent);
  return 1;
}

static int exact_orient3d(const double *const points[4])
{
  double p[4][3];
  if (!scale(4, points, p)) return 0;
  difference d[3][3];
  double minor[MINOR], det[TERMS];
  int count = 0;
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) d[k][c] = subtract(p[k + 1][c], p[0][c]);
  for (int c = 0; c < 3; c++) {
    const int u = (c + 1) % 3, v = (c + 2) % 3;
    if (d[2][c].count == 0) continue;
    const int minors = cross(&d[0][u], &d[0][v], &d[1][u], &d[1][v], minor);
    count = add_product(count, det, 1, minors, minor, &d[2][c]);
  }
  return sign_of(count, det);
}

/* The computed determinant errs by less than 8 units of rounding times the sum of its products' magnitudes (Shewchuk
 * 1997, section 4.3). If products underflow, the exact sum decides. */
int flesh_orient3d(const double a[3], const double b[3], const double c[3], const double d[3])
{
  double det = 0, size = 0;
  for (int k = 0; k < 3; k++) {
    if (a[k] == b[k] && a[k] == c[k] && a[k] == d[k]) return 0; /* common case: a plane normal to an axis */
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    const double first = (b[u] - a[u]) * (c[v] - a[v]), second = (b[v] - a[v]) * (c[u] - a[u]), e = d[k] - a[k];
    det += (first - second) * e;
    size += (fabs(first) + fabs(second)) * fabs(e);
  }
  const double bound = 8 * DBL_EPSILON * size + 1e-290;
  if (det > bound && det <= DBL_MAX) return 1;
  if (det < -bound && det >= -DBL_MAX) return -1;
  return exact_orient3d((const double *const[]){a, b, c, d});
}

static int exact_orient2d(int u, int v, const double *const points[3])
{
  double p[3][3];
  if (!scale(3, points, p)) return 0;
  const difference bu = subtract(p[1][u], p[0][u]), bv = subtract(p[1][v], p[0][v]);
  const difference cu = subtract(p[2][u], p[0][u]), cv = subtract(p[2][v], p[0][v]);
  double det[MINOR];
  return sign_of(cross(&bu, &bv, &cu, &cv, det), det);
}

int flesh_orient2d(int axis, const double a[3], const double b[3], const double c[3])
{
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double bu = b[u] - a[u], bv = b[v] - a[v], cu = c[u] - a[u], cv = c[v] - a[v];
  if ((bu == 0 || cv == 0) && (bv == 0 || cu == 0)) return 0; /* common case: a plane seen edge-on */
  const double first = bu * cv, second = bv * cu, det = first - second;
  const double bound = 4 * DBL_EPSILON * (fabs(first) + fabs(second)) + 1e-290;
  if (det > bound && det <= DBL_MAX) return 1;
  if (det < -bound && det >= -DBL_MAX) return -1;
  return exact_orient2d(u, v, (const double *const[]){a, b, c});
}

static int intervals_meet(double a, double b, double c, double d)
{
  return (a < b ? a : b) <= (c > d ? c : d) && (c < d ? c : d) <= (a > b ? a : b);
}

/* Whether the projections of the segments along an axis meet. */
static int shadows_meet(int axis, const double p[3], const double q[3], const double a[3], const double b[3])
{
  const int of_a = flesh_orient2d(axis, p, q, a), of_b = flesh_orient2d(axis, p, q, b);
  const int of_p = flesh_orient2d(axis, a, b, p), of_q = flesh_orient2d(axis, a, b, q);
  if (of_a * of_b > 0 || of_p * of_q > 0) return 0;
  if (of_a || of_b || of_p || of_q) return 1;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3; /* all four points are collinear */
  return intervals_meet(p[u], q[u], a[u], b[u]) && intervals_meet(p[v], q[v], a[v], b[v]);
}

/* Segments in one plane meet if their projections do along an axis that is not in the plane; there is at least one such
 * axis. If the segments meet, all projections do. So they meet exactly if all three projections do. */
int flesh_segment_meets_segment(const double p[3], const double q[3], const double a[3], const double b[3])
{
  for (int axis = 0; axis < 3; axis++)
    if (!shadows_meet(axis, p, q, a, b)) return 0;
  return flesh_orient3d(p, q, a, b) == 0;
}

static int agree(int first, int second, int third)
{
  return (first >= 0 && second >= 0 && third >= 0) || (first <= 0 && second <= 0 && third <= 0);
}

/* Whether p, in the plane of the triangle, lies within it; decided by projections as above. */
static int is_inside(const double p[3], const double a[3], const double b[3], const double c[3])
{
  for (int axis = 0; axis < 3; axis++)
    if (!agree(flesh_orient2d(axis, a, b, p), flesh_orient2d(axis, b, c, p), flesh_orient2d(axis, c, a, p))) return 0;
  return 1;
}

int flesh_segment_meets_triangle(const double p[3], const double q[3], const double a[3], const double b[3],
                                 const double c[3])
{
  const int of_p = flesh_orient3d(a, b, c, p), of_q = flesh_orient3d(a, b, c, q);
  if (of_p * of_q > 0) return 0;
  if (of_p || of_q)
    return agree(flesh_orient3d(p, q, a, b), flesh_orient3d(p, q, b, c), flesh_orient3d(p, q, c, a));
  if (flesh_segment_meets_segment(p, q, a, b) || flesh_segment_meets_segment(p, q, b, c) ||
      flesh_segment_meets_segment(p, q, c, a))
    return 1;
  const int has_area = flesh_orient2d(0, a, b, c) || flesh_orient2d(1, a, b, c) || flesh_orient2d(2, a, b, c);
  return has_area && is_inside(p, a, b, c);
}
