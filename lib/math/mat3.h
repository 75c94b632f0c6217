/* mat3.h: row-major 3x3 matrices A[3*i+j] = A_ij and 3-vectors of flesh_real (lanes.h), inlined. Outputs come last and
 * must not overlap the inputs. */
#ifndef FLESH_MATH_MAT3_H
#define FLESH_MATH_MAT3_H

#include <math.h>

#include "math/lanes.h"

static inline flesh_real flesh_vec3_dot(const flesh_real a[3], const flesh_real b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void flesh_vec3_cross(const flesh_real a[3], const flesh_real b[3], flesh_real c[3])
{
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

/* Sets w to a unit vector orthogonal to the unit vector u. */
static inline void flesh_vec3_perpendicular(const flesh_real u[3], flesh_real w[3])
{
  flesh_real x = flesh_abs(u[0]), y = flesh_abs(u[1]), z = flesh_abs(u[2]);
  flesh_mask first = (x <= y) & (x <= z), second = (y < x) & (y <= z);
  flesh_real zero = flesh_all(0), one = flesh_all(1);
  flesh_real axis[3] = {flesh_select(first, one, zero), flesh_select(second, one, zero),
                        flesh_select(first | second, zero, one)};
  flesh_vec3_cross(u, axis, w);
  flesh_real n = 1 / flesh_sqrt(flesh_vec3_dot(w, w));
  for (int i = 0; i < 3; i++) w[i] *= n;
}

static inline void flesh_mat3_identity(flesh_real A[9])
{
  for (int k = 0; k < 9; k++) A[k] = flesh_all(k % 4 == 0);
}

/* C = A B. */
static inline void flesh_mat3_multiply(const flesh_real A[9], const flesh_real B[9],
                                       flesh_real C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

/* C = A B^T. */
static inline void flesh_mat3_multiply_transposed(const flesh_real A[9], const flesh_real B[9],
                                                  flesh_real C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) C[3 * i + j] = flesh_vec3_dot(A + 3 * i, B + 3 * j);
}

/* C = A^T B. */
static inline void flesh_mat3_transposed_multiply(const flesh_real A[9], const flesh_real B[9],
                                                  flesh_real C[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      C[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
}

/* y = A x. */
static inline void flesh_mat3_times(const flesh_real A[9], const flesh_real x[3], flesh_real y[3])
{
  for (int i = 0; i < 3; i++) y[i] = flesh_vec3_dot(A + 3 * i, x);
}

/* y = A^T x. */
static inline void flesh_mat3_transposed_times(const flesh_real A[9], const flesh_real x[3],
                                               flesh_real y[3])
{
  for (int i = 0; i < 3; i++) y[i] = A[i] * x[0] + A[3 + i] * x[1] + A[6 + i] * x[2];
}

static inline flesh_real flesh_mat3_trace(const flesh_real A[9]) { return A[0] + A[4] + A[8]; }

/* A : B. */
static inline flesh_real flesh_mat3_inner(const flesh_real A[9], const flesh_real B[9])
{
  return flesh_vec3_dot(A, B) + flesh_vec3_dot(A + 3, B + 3) + flesh_vec3_dot(A + 6, B + 6);
}

/* Returns tr(A^T A), the squared Frobenius norm. */
static inline flesh_real flesh_mat3_norm2(const flesh_real A[9]) { return flesh_mat3_inner(A, A); }

/* C = cof A = dJ/dA: its rows are the cross products of A's rows; A^T C = det(A) I. */
static inline void flesh_mat3_cofactor(const flesh_real A[9], flesh_real C[9])
{
  flesh_vec3_cross(A + 3, A + 6, C);
  flesh_vec3_cross(A + 6, A, C + 3);
  flesh_vec3_cross(A, A + 3, C + 6);
}

static inline flesh_real flesh_mat3_determinant(const flesh_real A[9])
{
  flesh_real c[3];
  flesh_vec3_cross(A + 3, A + 6, c);
  return flesh_vec3_dot(A, c);
}

/* B = A^-1; returns det A. B is not finite if det A is 0. */
static inline flesh_real flesh_mat3_inverse(const flesh_real A[9], flesh_real B[9])
{
  flesh_real C[9];
  flesh_mat3_cofactor(A, C);
  flesh_real det = flesh_vec3_dot(A, C), scale = 1 / det;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) B[3 * i + j] = C[3 * j + i] * scale;
  return det;
}

/* Returns whether all nine numbers are finite. */
static inline flesh_mask flesh_mat3_finite(const flesh_real A[9])
{
  flesh_real sum = A[0] * 0;
  for (int k = 1; k < 9; k++) sum += A[k] * 0;
  return sum == 0;
}

#endif
