/* eig3_core.h: cyclic Jacobi for symmetric 3x3 matrices, one or several side by side (lanes.h), of
 * ordinary size (finite, the largest entry within SMALLEST and LARGEST).
 * Source: Golub & Van Loan, Matrix Computations, 8.5. */
#ifndef FLESH_MATH_EIG3_CORE_H
#define FLESH_MATH_EIG3_CORE_H

#include <float.h>

#include "math/mat3.h"

#define FLESH_EIG3_SMALLEST   1e-100
#define FLESH_EIG3_LARGEST    1e100
#define FLESH_EIG3_MAX_SWEEPS 20

/* Zeroes a[p][q] where `turn`; r is the third index. a is kept full and symmetric; v is Q by
 * columns. */
static inline void flesh_eig3_rotate(flesh_mask turn, flesh_real a[3][3], flesh_real v[3][3], int p,
                                     int q, int r)
{
  flesh_real o = 2 * a[p][q], d = a[q][q] - a[p][p];
  flesh_real h = flesh_abs(d) + flesh_sqrt(d * d + o * o);
  turn &= h > 0; /* else o is 0, or its square is */
  /* tan of the rotation, at most 1 */
  flesh_real t = flesh_select(turn, flesh_select(d < 0, -o, o) / h, flesh_all(0));
  flesh_real c = 1 / flesh_sqrt(1 + t * t), s = t * c, shift = t * a[p][q];
  a[p][p] -= shift;
  a[q][q] += shift;
  a[p][q] = a[q][p] = flesh_select(turn, flesh_all(0), a[p][q]);
  flesh_real x = a[p][r], y = a[q][r];
  a[p][r] = a[r][p] = c * x - s * y;
  a[q][r] = a[r][q] = s * x + c * y;
  for (int i = 0; i < 3; i++) {
    flesh_real vx = v[p][i], vy = v[q][i];
    v[p][i] = c * vx - s * vy;
    v[q][i] = s * vx + c * vy;
  }
}

/* A = Q diag(w) Q^T, w in no order; Q a rotation. */
static inline void flesh_eig3_core(const flesh_real A[9], flesh_real w[3], flesh_real Q[9])
{
  flesh_real a[3][3], v[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      a[i][j] = a[j][i] = A[3 * i + j];
      v[i][j] = v[j][i] = flesh_all(i == j);
    }
  /* Below this fraction of |A| an off-diagonal entry cannot be seen. */
  flesh_real norm2 =
      flesh_vec3_dot(a[0], a[0]) + flesh_vec3_dot(a[1], a[1]) + flesh_vec3_dot(a[2], a[2]);
  flesh_real floor = norm2 * (0.0625 * DBL_EPSILON * DBL_EPSILON);
  for (int sweep = 0; sweep < FLESH_EIG3_MAX_SWEEPS; sweep++) {
    flesh_real off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
    flesh_mask turn = off > floor;
    if (!flesh_any(turn)) break;
    flesh_eig3_rotate(turn, a, v, 0, 1, 2);
    flesh_eig3_rotate(turn, a, v, 0, 2, 1);
    flesh_eig3_rotate(turn, a, v, 1, 2, 0);
  }
  for (int p = 0; p < 3; p++) {
    w[p] = a[p][p];
    for (int i = 0; i < 3; i++) Q[3 * i + p] = v[p][i];
  }
}

#endif
