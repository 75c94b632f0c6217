/* eig3.c: cyclic Jacobi for symmetric 3x3 matrices (Golub & Van Loan, Matrix Computations, 8.5). */
#include "math/eig3.h"

#include <float.h>

#include "math/mat3.h"

#define MAX_SWEEPS 20

/* Zeroes a[p][q]; r is the third index. a is kept full and symmetric. */
static inline void rotate(double a[3][3], double q_columns[3][3], int p, int q, int r)
{
  double o = 2 * a[p][q], d = a[q][q] - a[p][p];
  if (o == 0) return;
  double h = fabs(d) + sqrt(d * d + o * o);
  if (!(h > 0)) return;
  double t = (d < 0 ? -o : o) / h; /* tan of the rotation, |t| <= 1 */
  double c = 1 / sqrt(1 + t * t), s = t * c, shift = t * a[p][q];
  a[p][p] -= shift;
  a[q][q] += shift;
  a[p][q] = a[q][p] = 0;
  double x = a[p][r], y = a[q][r];
  a[p][r] = a[r][p] = c * x - s * y;
  a[q][r] = a[r][q] = s * x + c * y;
  for (int i = 0; i < 3; i++) {
    double vx = q_columns[p][i], vy = q_columns[q][i];
    q_columns[p][i] = c * vx - s * vy;
    q_columns[q][i] = s * vx + c * vy;
  }
}

void flesh_eigh3(const double A[9], double w[3], double Q[9])
{
  double largest = 0;
  for (int k = 0; k < 9; k++) largest = fmax(largest, fabs(A[k]));
  if (!(largest > 0) || !flesh_mat3_finite(A)) {
    w[0] = w[1] = w[2] = flesh_mat3_finite(A) ? 0 : NAN;
    flesh_mat3_identity(Q);
    return;
  }

  int exponent = largest < 1e-100 || largest > 1e100 ? ilogb(largest) : 0;
  double a[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++)
      a[i][j] = a[j][i] = exponent ? ldexp(A[3 * i + j], -exponent) : A[3 * i + j];
  /* Below this fraction of |A| an off-diagonal entry cannot be seen. */
  double norm2 = 0;
  for (int i = 0; i < 3; i++) norm2 += flesh_vec3_dot(a[i], a[i]);
  double floor = norm2 * (0.0625 * DBL_EPSILON * DBL_EPSILON);
  for (int sweep = 0; sweep < MAX_SWEEPS; sweep++) {
    double off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
    if (off <= floor) break;
    rotate(a, v, 0, 1, 2);
    rotate(a, v, 0, 2, 1);
    rotate(a, v, 1, 2, 0);
  }

  static const int pairs[3][2] = {{0, 1}, {1, 2}, {0, 1}};
  for (int k = 0; k < 3; k++) w[k] = a[k][k];
  for (int k = 0; k < 3; k++) {
    int p = pairs[k][0], q = pairs[k][1];
    if (w[p] <= w[q]) continue;
    double t = w[p];
    w[p] = w[q], w[q] = t;
    for (int i = 0; i < 3; i++) { /* one sign changed: the swap stays a rotation */
      t = v[p][i];
      v[p][i] = v[q][i], v[q][i] = -t;
    }
  }
  for (int p = 0; p < 3; p++) {
    if (exponent) w[p] = ldexp(w[p], exponent);
    for (int i = 0; i < 3; i++) Q[3 * i + p] = v[p][i];
  }
}
