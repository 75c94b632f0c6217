/* svd3_core.h: the decomposition of svd3.h for one matrix or several side by side (lanes.h), of ordinary size: finite,
 * the largest entry between SMALLEST and LARGEST.
 *
 * V comes from the eigenvectors of F^T F and is improved by one-sided Jacobi (Hestenes 1958; de Rijk 1989): pairs of
 * columns of B = F V are rotated until they are orthogonal, usually in one sweep. Working on B, and not only on F^T F,
 * keeps the small singular values accurate. */
#ifndef FLESH_MATH_SVD3_CORE_H
#define FLESH_MATH_SVD3_CORE_H

#include <float.h>

#include "math/eig3_core.h"

#define FLESH_SVD3_SMALLEST 1e-30
#define FLESH_SVD3_LARGEST  1e30
/* Columns count as orthogonal when the cosine between them is below this. */
#define FLESH_SVD3_ORTHOGONAL (2 * DBL_EPSILON)
/* Jacobi converges quadratically: if all cosines and angles of a sweep were below this, the remaining error is at
 * rounding. */
#define FLESH_SVD3_LAST_SWEEP 1e-8
/* Products of columns below this fraction of |F|^2 are invisible in F at rounding. */
#define FLESH_SVD3_NEGLIGIBLE 1e-40
#define FLESH_SVD3_MAX_SWEEPS 20

/* Matrices are kept by columns here: b[p] is column p of B, v[p] of V. */

/* Swaps a and b in the lanes of `swap`; a sign changes, so that the swap is a rotation. */
static inline void flesh_svd3_swap(flesh_mask swap, flesh_real a[3], flesh_real b[3])
{
  for (int i = 0; i < 3; i++) {
    flesh_real t = a[i];
    a[i] = flesh_select(swap, b[i], t);
    b[i] = flesh_select(swap, -t, b[i]);
  }
}

/* Makes columns p, q of B orthogonal; returns the lanes that need another sweep. */
static inline flesh_mask flesh_svd3_rotate(flesh_real b[3][3], flesh_real v[3][3], int p, int q,
                                           flesh_real floor)
{
  flesh_real pp = flesh_vec3_dot(b[p], b[p]), qq = flesh_vec3_dot(b[q], b[q]);
  flesh_real pq = flesh_vec3_dot(b[p], b[q]), product = pp * qq, pq2 = pq * pq;
  flesh_mask turn =
      (pq2 > FLESH_SVD3_ORTHOGONAL * FLESH_SVD3_ORTHOGONAL * product) & (flesh_abs(pq) > floor);
  if (!flesh_any(turn)) return turn;
  /* The rotation by the smallest angle: tan = 2pq/(|d| + hypot(d, 2pq)), with the sign of qq - pp. */
  flesh_real d = qq - pp, o = 2 * pq;
  flesh_real r = flesh_abs(d) + flesh_sqrt(d * d + o * o);
  o = flesh_select(d < 0, -o, o);
  flesh_real n = 1 / flesh_sqrt(r * r + o * o);
  flesh_real c = flesh_select(turn, r * n, flesh_all(1));
  flesh_real s = flesh_select(turn, o * n, flesh_all(0));
  for (int i = 0; i < 3; i++) {
    flesh_real x = b[p][i], y = b[q][i], vx = v[p][i], vy = v[q][i];
    b[p][i] = c * x - s * y;
    b[q][i] = s * x + c * y;
    v[p][i] = c * vx - s * vy;
    v[q][i] = s * vx + c * vy;
  }
  return turn & ((pq2 > FLESH_SVD3_LAST_SWEEP * FLESH_SVD3_LAST_SWEEP * product) |
                 (flesh_abs(s) > FLESH_SVD3_LAST_SWEEP));
}

static inline void flesh_svd3_core(const flesh_real F[9], flesh_real U[9], flesh_real sigma[3],
                                   flesh_real V[9])
{
  flesh_real b[3][3], v[3][3], floor = flesh_mat3_norm2(F) * FLESH_SVD3_NEGLIGIBLE;
  flesh_real squares[9], FV[9];
  flesh_mat3_transposed_multiply(F, F, squares);
  flesh_eig3_core(squares, sigma, V);
  flesh_mat3_multiply(F, V, FV);
  for (int p = 0; p < 3; p++)
    for (int i = 0; i < 3; i++) b[p][i] = FV[3 * i + p], v[p][i] = V[3 * i + p];
  flesh_mask again;
  int sweep = 0;
  do {
    again = flesh_svd3_rotate(b, v, 0, 1, floor);
    again |= flesh_svd3_rotate(b, v, 0, 2, floor);
    again |= flesh_svd3_rotate(b, v, 1, 2, floor);
  } while (flesh_any(again) && ++sweep < FLESH_SVD3_MAX_SWEEPS);

  flesh_real n[3];
  for (int p = 0; p < 3; p++) n[p] = flesh_vec3_dot(b[p], b[p]);
  static const int pairs[3][2] = {{0, 1}, {1, 2}, {0, 1}};
  for (int k = 0; k < 3; k++) {
    int p = pairs[k][0], q = pairs[k][1];
    flesh_mask swap = n[p] < n[q];
    flesh_real t = n[p];
    n[p] = flesh_select(swap, n[q], t), n[q] = flesh_select(swap, t, n[q]);
    flesh_svd3_swap(swap, b[p], b[q]);
    flesh_svd3_swap(swap, v[p], v[q]);
  }

  /* The columns of U are those of B, normalised; for a rank-deficient F they are completed to a rotation. */
  flesh_real u[3][3], s0 = flesh_sqrt(n[0]), s1 = flesh_sqrt(n[1]), inverse = 1 / s0;
  for (int i = 0; i < 3; i++) u[0][i] = b[0][i] * inverse;
  flesh_real along = flesh_vec3_dot(u[0], b[1]), rest[3];
  for (int i = 0; i < 3; i++) rest[i] = b[1][i] - along * u[0][i];
  flesh_real n1 = flesh_sqrt(flesh_vec3_dot(rest, rest));
  inverse = 1 / n1;
  for (int i = 0; i < 3; i++) u[1][i] = rest[i] * inverse;
  /* Lanes in which the second column is large enough that its squares are not denormal. */
  flesh_mask full = (s1 > FLESH_SVD3_NEGLIGIBLE * s0) & (n1 > 0.5 * s1);
  if (flesh_any(full == 0)) {
    flesh_real w[3];
    flesh_vec3_perpendicular(u[0], w);
    for (int i = 0; i < 3; i++) u[1][i] = flesh_select(full, u[1][i], w[i]);
  }
  flesh_vec3_cross(u[0], u[1], u[2]);
  flesh_real s2 = flesh_vec3_dot(u[2], b[2]);

  sigma[0] = s0, sigma[1] = s1;
  /* |sigma[2]| may exceed sigma[1] only by rounding, and is cut then. */
  sigma[2] = flesh_select(s2 > s1, s1, flesh_select(s2 < -s1, -s1, s2));
  for (int p = 0; p < 3; p++)
    for (int i = 0; i < 3; i++) U[3 * i + p] = u[p][i], V[3 * i + p] = v[p][i];
}

#endif
