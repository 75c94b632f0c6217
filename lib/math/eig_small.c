/* eig_small.c: eigenvalues and eigenvectors of small symmetric matrices, by Jacobi's cyclic rotations. */
#include "math/eig_small.h"

#include <float.h>
#include <math.h>

enum { SWEEPS = 30 };

/* Zeroes A_pq by a rotation in the plane of p and q. */
static void rotate(int n, double *A, double *Q, int p, int q)
{
  const double apq = A[n * p + q], theta = (A[n * q + q] - A[n * p + p]) / (2 * apq);
  const double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
  A[n * p + p] -= t * apq;
  A[n * q + q] += t * apq;
  A[n * p + q] = A[n * q + p] = 0;
  for (int k = 0; k < n; k++) {
    const double vp = Q[n * k + p], vq = Q[n * k + q];
    Q[n * k + p] = c * vp - s * vq;
    Q[n * k + q] = s * vp + c * vq;
    if (k == p || k == q) continue;
    const double kp = A[n * k + p], kq = A[n * k + q];
    A[n * k + p] = A[n * p + k] = c * kp - s * kq;
    A[n * k + q] = A[n * q + k] = s * kp + c * kq;
  }
}

void flesh_eigh_small(int n, double *A, double *w, double *Q)
{
  for (int k = 0; k < n * n; k++) Q[k] = k / n == k % n;
  for (int sweep = 0, turned = 1; turned && sweep < SWEEPS; sweep++) {
    turned = 0;
    for (int p = 0; p < n - 1; p++)
      for (int q = p + 1; q < n; q++) {
        /* An entry below the rounding of both diagonal entries changes neither. */
        const double least = DBL_EPSILON / 4 * fmin(fabs(A[n * p + p]), fabs(A[n * q + q]));
        if (fabs(A[n * p + q]) <= least || A[n * p + q] == 0) continue;
        rotate(n, A, Q, p, q);
        turned = 1;
      }
  }
  for (int k = 0; k < n; k++) w[k] = A[n * k + k];
}
