/* rigid_fit.c: best rigid motion between two sets of points. */
#include "mesh/rigid_fit.h"

#include "math/mat3.h"
#include "math/svd3.h"

void flesh_rigid_fit_find(int count, const double *X, const double *x, const uint8_t *chosen,
                          flesh_rigid_fit *fit)
{
  double H[9] = {0}, U[9], sigma[3], V[9];
  int number = 0;
  for (int c = 0; c < 3; c++) fit->centre[c] = fit->moved[c] = 0;
  for (int i = 0; i < count; i++) {
    if (!chosen[i]) continue;
    number++;
    for (int c = 0; c < 3; c++) fit->centre[c] += X[3 * i + c], fit->moved[c] += x[3 * i + c];
  }
  for (int c = 0; c < 3; c++) fit->centre[c] /= number, fit->moved[c] /= number;
  for (int i = 0; i < count; i++) {
    if (!chosen[i]) continue;
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++)
        H[3 * r + c] += (X[3 * i + r] - fit->centre[r]) * (x[3 * i + c] - fit->moved[c]);
  }
  /* U and V are rotations and the last singular value carries the sign, so V U^T maximises tr(R H). */
  flesh_svd3(H, U, sigma, V);
  flesh_mat3_multiply_transposed(V, U, fit->R);
}

void flesh_rigid_fit_apply(const flesh_rigid_fit *fit, const double X[3], double y[3])
{
  double d[3] = {X[0] - fit->centre[0], X[1] - fit->centre[1], X[2] - fit->centre[2]};
  flesh_mat3_times(fit->R, d, y);
  for (int c = 0; c < 3; c++) y[c] += fit->moved[c];
}
