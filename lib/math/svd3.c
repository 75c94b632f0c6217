/* svd3.c: scales the matrix to ordinary size and calls svd3_core.h. */
#include "math/svd3.h"

#include "math/svd3_core.h"

void flesh_svd3(const double F[9], double U[9], double sigma[3], double V[9])
{
  double largest = 0, scaled[9];
  for (int k = 0; k < 9; k++) largest = fmax(largest, fabs(F[k]));
  if (!(largest > 0) || !flesh_mat3_finite(F)) {
    double value = flesh_mat3_finite(F) ? 0 : NAN;
    sigma[0] = sigma[1] = sigma[2] = value;
    flesh_mat3_identity(U);
    flesh_mat3_identity(V);
    return;
  }
  if (largest >= FLESH_SVD3_SMALLEST && largest <= FLESH_SVD3_LARGEST) {
    flesh_svd3_core(F, U, sigma, V);
    return;
  }
  int exponent = ilogb(largest); /* a power of two, so that scaling is exact */
  for (int k = 0; k < 9; k++) scaled[k] = ldexp(F[k], -exponent);
  flesh_svd3_core(scaled, U, sigma, V);
  for (int p = 0; p < 3; p++) sigma[p] = ldexp(sigma[p], exponent);
}
