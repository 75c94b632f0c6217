/* eig3_core.h: eigenvalues and eigenvectors of symmetric 3x3 matrices, one or several side by side (lanes.h), of
 * ordinary size (finite, the largest entry between SMALLEST and LARGEST), without iteration: the eigenvalue farthest
 * from the others is the well-conditioned root of the characteristic polynomial, its vector is a cross product, and one
 * Jacobi rotation diagonalises the remaining plane. Errors are of the order of rounding in |A|. Sources: Smith,
 * Eigenvalues of a symmetric 3x3 matrix, 1961; Eberly, A robust eigensolver for 3x3 symmetric matrices, 2014; Golub &
 * Van Loan, Matrix Computations, 8.5. */
#ifndef FLESH_MATH_EIG3_CORE_H
#define FLESH_MATH_EIG3_CORE_H

#include "math/mat3.h"

#define FLESH_EIG3_SMALLEST 1e-100
#define FLESH_EIG3_LARGEST  1e100

/* Returns z = 2 cos(acos(c)/3), the largest root of z^3 - 3z = 2c, for 0 <= c <= 1: a cubic approximation within 1e-4,
 * improved by two Newton steps to rounding. */
static inline flesh_real flesh_eig3_root(flesh_real c)
{
  flesh_real z = 1.7321326590663835 +
                 c * (0.33066070044169166 + c * (-0.08138239484577889 + c * 0.018639367794966583));
  for (int k = 0; k < 2; k++) z -= ((z * z - 3) * z - 2 * c) / (3 * (z * z - 1));
  return z;
}

/* Computes the unit null vector of M, of rank 2: the longest cross product of its rows, normalised. */
static inline void flesh_eig3_null(const flesh_real M[9], flesh_real v[3])
{
  flesh_real other[2][3];
  flesh_vec3_cross(M, M + 3, v);
  flesh_vec3_cross(M + 3, M + 6, other[0]);
  flesh_vec3_cross(M + 6, M, other[1]);
  flesh_real longest = flesh_vec3_dot(v, v);
  for (int k = 0; k < 2; k++) {
    flesh_real length = flesh_vec3_dot(other[k], other[k]);
    flesh_mask better = length > longest;
    longest = flesh_select(better, length, longest);
    for (int i = 0; i < 3; i++) v[i] = flesh_select(better, other[k][i], v[i]);
  }
  longest = flesh_sqrt(longest); /* dividing by it keeps an axis exact */
  for (int i = 0; i < 3; i++) v[i] /= longest;
}

/* Computes A = Q diag(w) Q^T with w in no order; Q is a rotation. */
static inline void flesh_eig3_core(const flesh_real A[9], flesh_real w[3], flesh_real Q[9])
{
  /* K = (A - mean)/p has the eigenvalues 2 cos(angle + 2 pi k/3). The first is farthest from the others and at least
   * sqrt(3) in size. */
  flesh_real K[9], M[9], mean = (A[0] + A[4] + A[8]) / 3, a = A[0] - mean, b = A[4] - mean,
                         c = A[8] - mean, left = (a + b + c) / 3;
  a -= left, b -= left, c -= left; /* what rounding left of the trace would matter if A is nearly a multiple of I */
  flesh_real p =
      flesh_sqrt((a * a + b * b + c * c + 2 * (A[1] * A[1] + A[2] * A[2] + A[5] * A[5])) / 6);
  flesh_real scale = flesh_select(p > 1e-150, 1 / p, flesh_all(0));
  K[0] = a * scale, K[4] = b * scale, K[8] = c * scale;
  K[1] = K[3] = A[1] * scale, K[2] = K[6] = A[2] * scale, K[5] = K[7] = A[5] * scale;
  flesh_real half = 0.5 * flesh_mat3_determinant(K), cosine = flesh_abs(half);
  flesh_real far = flesh_eig3_root(flesh_select(cosine < 1, cosine, flesh_all(1)));
  far = flesh_select(half < 0, -far, far);
  for (int k = 0; k < 9; k++) M[k] = k % 4 == 0 ? K[k] - far : K[k];

  /* Its eigenvector v, and K in the remaining plane of u and n. */
  flesh_real v[3], u[3], n[3], Kv[3], Ku[3], Kn[3];
  flesh_eig3_null(M, v);
  flesh_vec3_perpendicular(v, u);
  flesh_vec3_cross(v, u, n);
  flesh_mat3_times(K, v, Kv);
  flesh_mat3_times(K, u, Ku);
  flesh_mat3_times(K, n, Kn);
  flesh_real uu = flesh_vec3_dot(u, Ku), nn = flesh_vec3_dot(n, Kn), o = 2 * flesh_vec3_dot(u, Kn);
  flesh_real d = nn - uu, h = flesh_abs(d) + flesh_sqrt(d * d + o * o);
  flesh_real t = flesh_select(h > 1e-150, flesh_select(d < 0, -o, o) / h, flesh_all(0));
  flesh_real cs = 1 / flesh_sqrt(1 + t * t), sn = t * cs;
  w[0] = flesh_vec3_dot(v, Kv) * p + mean;
  w[1] = (uu - 0.5 * t * o) * p + mean;
  w[2] = (nn + 0.5 * t * o) * p + mean;
  for (int i = 0; i < 3; i++) {
    Q[3 * i] = v[i];
    Q[3 * i + 1] = cs * u[i] - sn * n[i];
    Q[3 * i + 2] = sn * u[i] + cs * n[i];
  }
}

#endif
