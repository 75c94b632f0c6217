/* eig3.c: scales the matrix to ordinary size, calls eig3_core.h and sorts. */
#include "math/eig3.h"

#include "math/eig3_core.h"

void flesh_eigh3(const double A[9], double w[3], double Q[9])
{
  double largest = 0, scaled[9];
  for (int k = 0; k < 9; k++) largest = fmax(largest, fabs(A[k]));
  if (!(largest > 0) || !flesh_mat3_finite(A)) {
    w[0] = w[1] = w[2] = flesh_mat3_finite(A) ? 0 : NAN;
    flesh_mat3_identity(Q);
    return;
  }
  int ordinary = largest >= FLESH_EIG3_SMALLEST && largest <= FLESH_EIG3_LARGEST;
  int exponent = ordinary ? 0 : ilogb(largest);
  for (int k = 0; k < 9; k++) scaled[k] = exponent ? ldexp(A[k], -exponent) : A[k];
  flesh_eig3_core(scaled, w, Q);

  static const int pairs[3][2] = {{0, 1}, {1, 2}, {0, 1}};
  for (int k = 0; k < 3; k++) {
    int p = pairs[k][0], q = pairs[k][1];
    if (w[p] <= w[q]) continue;
    double t = w[p];
    w[p] = w[q], w[q] = t;
    for (int i = 0; i < 3; i++) { /* a sign changes, so that the swap is a rotation */
      t = Q[3 * i + p];
      Q[3 * i + p] = Q[3 * i + q], Q[3 * i + q] = -t;
    }
  }
  for (int p = 0; exponent && p < 3; p++) w[p] = ldexp(w[p], exponent);
}
