/* test_matrix.h: random 3x3 matrices and rotations for tests. */
#ifndef FLESH_TEST_MATRIX_H
#define FLESH_TEST_MATRIX_H

#include "test.h"

#include "math/mat3.h"

static unsigned long long matrix_seed = 20240607;

/* In [-1, 1). */
static inline double uniform(void) { return 2 * test_uniform(&matrix_seed) - 1; }

static inline void random_matrix(double A[9])
{
  for (int k = 0; k < 9; k++) A[k] = uniform();
}

/* Makes a rotation from a random unit quaternion. */
static inline void random_rotation(double R[9])
{
  double q[4], n = 0;
  for (int k = 0; k < 4; k++) q[k] = uniform() + 1e-3, n += q[k] * q[k];
  for (int k = 0; k < 4; k++) q[k] /= sqrt(n);
  double w = q[0], x = q[1], y = q[2], z = q[3];
  double rows[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                    2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                    2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  memcpy(R, rows, sizeof rows);
}

/* Computes F = R1 diag(s) R2^T. */
static inline void compose(const double s[3], double F[9])
{
  double R1[9], R2[9];
  random_rotation(R1);
  random_rotation(R2);
  for (int k = 0; k < 9; k++) R1[k] *= s[k % 3];
  flesh_mat3_multiply_transposed(R1, R2, F);
}

#endif
