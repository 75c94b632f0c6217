/* svd3.c: one-sided Jacobi (Hestenes 1958; de Rijk 1989): rotate pairs of columns of B = F V until
 * they are orthogonal. Working on B and not on F^T F keeps the small singular values accurate. */
#include "math/svd3.h"

#include <float.h>

#include "math/mat3.h"

/* Columns count as orthogonal when the cosine between them is below this. */
#define ORTHOGONAL (2 * DBL_EPSILON)
/* Jacobi converges quadratically: after a sweep whose cosines and angles were all below this,
 * what remains is at rounding. */
#define LAST_SWEEP 1e-8
/* Products of columns below this fraction of |F|^2 cannot be seen in F at rounding. */
#define NEGLIGIBLE 1e-40
#define MAX_SWEEPS 20

/* Here matrices are kept by columns: b[p] is column p of B, v[p] of V. */

static inline void swap_columns(double a[3], double b[3])
{
  /* With one sign changed the swap is a rotation. */
  for (int i = 0; i < 3; i++) {
    double t = a[i];
    a[i] = b[i];
    b[i] = -t;
  }
}

/* Makes columns p, q of B orthogonal; returns 1 when another sweep is needed. */
static inline int rotate_columns(double b[3][3], double v[3][3], int p, int q, double floor)
{
  double pp = flesh_vec3_dot(b[p], b[p]), qq = flesh_vec3_dot(b[q], b[q]);
  double pq = flesh_vec3_dot(b[p], b[q]), product = pp * qq, pq2 = pq * pq;
  if (pq2 <= ORTHOGONAL * ORTHOGONAL * product || fabs(pq) <= floor) return 0;
  /* The rotation of smallest angle: tan = 2pq/(|d| + hypot(d, 2pq)) with the sign of d = qq - pp.
   */
  double d = qq - pp, o = 2 * pq;
  double r = fabs(d) + sqrt(d * d + o * o);
  if (d < 0) o = -o;
  double n = 1 / sqrt(r * r + o * o), c = r * n, s = o * n;
  for (int i = 0; i < 3; i++) {
    double x = b[p][i], y = b[q][i], vx = v[p][i], vy = v[q][i];
    b[p][i] = c * x - s * y;
    b[q][i] = s * x + c * y;
    v[p][i] = c * vx - s * vy;
    v[q][i] = s * vx + c * vy;
  }
  return pq2 > LAST_SWEEP * LAST_SWEEP * product || fabs(s) > LAST_SWEEP;
}

static void perpendicular(const double u[3], double w[3])
{
  int k = fabs(u[0]) <= fabs(u[1]) ? (fabs(u[0]) <= fabs(u[2]) ? 0 : 2)
                                   : (fabs(u[1]) <= fabs(u[2]) ? 1 : 2);
  double axis[3] = {k == 0, k == 1, k == 2};
  flesh_vec3_cross(u, axis, w);
  double n = 1 / sqrt(flesh_vec3_dot(w, w));
  for (int i = 0; i < 3; i++) w[i] *= n;
}

void flesh_svd3(const double F[9], double U[9], double sigma[3], double V[9])
{
  double largest = 0;
  for (int k = 0; k < 9; k++) largest = fmax(largest, fabs(F[k]));
  if (!(largest > 0) || !flesh_mat3_finite(F)) {
    double value = flesh_mat3_finite(F) ? 0 : NAN;
    sigma[0] = sigma[1] = sigma[2] = value;
    flesh_mat3_identity(U);
    flesh_mat3_identity(V);
    return;
  }

  double b[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  int exponent = 0;
  for (int p = 0; p < 3; p++)
    for (int i = 0; i < 3; i++) b[p][i] = F[3 * i + p];
  if (largest < 1e-30 || largest > 1e30) { /* a power of two, so that scaling is exact */
    exponent = ilogb(largest);
    for (int p = 0; p < 3; p++)
      for (int i = 0; i < 3; i++) b[p][i] = ldexp(b[p][i], -exponent);
  }

  double floor = 0;
  for (int p = 0; p < 3; p++) floor += NEGLIGIBLE * flesh_vec3_dot(b[p], b[p]);
  for (int sweep = 0, again = 1; again && sweep < MAX_SWEEPS; sweep++) {
    again = rotate_columns(b, v, 0, 1, floor);
    again |= rotate_columns(b, v, 0, 2, floor);
    again |= rotate_columns(b, v, 1, 2, floor);
  }

  double n[3];
  for (int p = 0; p < 3; p++) n[p] = flesh_vec3_dot(b[p], b[p]);
  static const int pairs[3][2] = {{0, 1}, {1, 2}, {0, 1}};
  for (int k = 0; k < 3; k++) {
    int p = pairs[k][0], q = pairs[k][1];
    if (n[p] >= n[q]) continue;
    double t = n[p];
    n[p] = n[q], n[q] = t;
    swap_columns(b[p], b[q]);
    swap_columns(v[p], v[q]);
  }

  /* U's columns are B's, normalised; what rank deficiency leaves open is completed to a rotation.
   */
  double u[3][3];
  double s0 = sqrt(n[0]), s1 = sqrt(n[1]);
  for (int i = 0; i < 3; i++) u[0][i] = b[0][i] / s0;
  double along = flesh_vec3_dot(u[0], b[1]), rest[3];
  for (int i = 0; i < 3; i++) rest[i] = b[1][i] - along * u[0][i];
  double n1 = sqrt(flesh_vec3_dot(rest, rest));
  if (s1 > NEGLIGIBLE * s0 && n1 > 0.5 * s1) /* its squares are then no denormal numbers */
    for (int i = 0; i < 3; i++) u[1][i] = rest[i] / n1;
  else perpendicular(u[0], u[1]);
  flesh_vec3_cross(u[0], u[1], u[2]);
  double s2 = flesh_vec3_dot(u[2], b[2]);

  sigma[0] = s0, sigma[1] = s1, sigma[2] = s2;
  if (fabs(s2) > s1) sigma[2] = copysign(s1, s2); /* equal but for rounding */
  if (exponent)
    for (int p = 0; p < 3; p++) sigma[p] = ldexp(sigma[p], exponent);
  for (int p = 0; p < 3; p++)
    for (int i = 0; i < 3; i++) U[3 * i + p] = u[p][i], V[3 * i + p] = v[p][i];
}
