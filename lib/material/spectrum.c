/* spectrum.c: the nine eigenpairs of the Hessian in closed form, and its nearest positive
 * semi-definite matrix. */
#include "material/spectrum.h"

#include <math.h>
#include <string.h>

#include "material/psi.h"
#include "math/eig3.h"
#include "math/mat3.h"
#include "math/svd3.h"

int flesh_spectrum_make(const flesh_psi *psi, const double sigma[3], flesh_spectrum *spectrum)
{
  /* c = dJ/dsigma */
  double c[3] = {sigma[1] * sigma[2], sigma[2] * sigma[0], sigma[0] * sigma[1]};
  flesh_spectrum s;
  double check = 0;
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    s.twist[i] = 2 * psi->I + psi->J * sigma[i];
    s.flip[i] = 2 * psi->I - psi->J * sigma[i];
    s.A[4 * i] = 2 * psi->I + 4 * psi->II * sigma[i] * sigma[i] +
                 (4 * psi->IJ * sigma[i] + psi->JJ * c[i]) * c[i];
    s.A[3 * i + j] = s.A[3 * j + i] = psi->J * sigma[k] + 4 * psi->II * sigma[i] * sigma[j] +
                                      2 * psi->IJ * (sigma[i] * c[j] + sigma[j] * c[i]) +
                                      psi->JJ * c[i] * c[j];
    check += 0 * s.twist[i] + 0 * s.flip[i] + 0 * s.A[4 * i] + 0 * s.A[3 * i + j];
  }
  if (check != 0) return FLESH_NONFINITE;
  *spectrum = s;
  return FLESH_OK;
}

/* Pivots of the elimination without exchange: all positive for positive definite A only. */
static int positive_definite(const double A[9])
{
  if (!(A[0] > 0)) return 0;
  double l1 = A[1] / A[0], l2 = A[2] / A[0];
  double p1 = A[4] - l1 * A[1], r = A[5] - l1 * A[2];
  return p1 > 0 && A[8] - l2 * A[2] - r * r / p1 > 0;
}

static inline double filtered(double value, flesh_filter filter)
{
  return filter == FLESH_FILTER_ABSOLUTE ? fabs(value) : fmax(value, 0);
}

int flesh_spectrum_filter(flesh_spectrum *spectrum, flesh_filter filter)
{
  int changed = 0;
  for (int k = 0; k < 3; k++) {
    changed |= spectrum->twist[k] < 0 || spectrum->flip[k] < 0;
    spectrum->twist[k] = filtered(spectrum->twist[k], filter);
    spectrum->flip[k] = filtered(spectrum->flip[k], filter);
  }
  double *A = spectrum->A;
  if (positive_definite(A)) return changed;
  double w[3], Q[9], QW[9];
  flesh_eigh3(A, w, Q);
  if (w[0] >= 0) return changed;
  for (int k = 0; k < 9; k++) QW[k] = Q[k] * filtered(w[k % 3], filter);
  flesh_mat3_multiply_transposed(QW, Q, A);
  A[3] = A[1], A[6] = A[2], A[7] = A[5];
  return 1;
}

double flesh_spectrum_smallest(const flesh_spectrum *spectrum)
{
  double w[3], Q[9];
  flesh_eigh3(spectrum->A, w, Q);
  double smallest = w[0];
  for (int k = 0; k < 3; k++)
    smallest = fmin(smallest, fmin(spectrum->twist[k], spectrum->flip[k]));
  return smallest;
}

int flesh_material_eigen(const flesh_material *material, const double F[9], double values[9],
                         double vectors[81])
{
  flesh_psi psi;
  flesh_spectrum s;
  double U[9], sigma[3], V[9], w[3], Q[9];
  int status = flesh_psi_at(material, F, &psi, NULL);
  if (status) return status;
  flesh_svd3(F, U, sigma, V);
  status = flesh_spectrum_make(&psi, sigma, &s);
  if (status) return status;
  flesh_eigh3(s.A, w, Q);
  for (int m = 0; m < 3; m++) {
    /* Scaling: U diag(q) V^T. */
    double UD[9];
    for (int k = 0; k < 9; k++) UD[k] = U[k] * Q[3 * (k % 3) + m];
    values[m] = w[m];
    flesh_mat3_multiply_transposed(UD, V, vectors + 9 * m);
    /* Twist and flip: (u_j v_i^T -+ u_i v_j^T) / sqrt 2. */
    int i = (m + 1) % 3, j = (m + 2) % 3;
    double *twist = vectors + 9 * (3 + m), *flip = vectors + 9 * (6 + m);
    values[3 + m] = s.twist[m];
    values[6 + m] = s.flip[m];
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        double ji = U[3 * a + j] * V[3 * b + i], ij = U[3 * a + i] * V[3 * b + j];
        twist[3 * a + b] = M_SQRT1_2 * (ji - ij);
        flip[3 * a + b] = M_SQRT1_2 * (ji + ij);
      }
  }
  return FLESH_OK;
}

int flesh_material_hessian_projected(const flesh_material *material, const double F[9],
                                     double H[81])
{
  double values[9], vectors[81];
  int status = flesh_material_eigen(material, F, values, vectors);
  if (status) return status;
  memset(H, 0, 81 * sizeof *H);
  for (int m = 0; m < 9; m++) {
    if (!(values[m] > 0)) continue;
    const double *q = vectors + 9 * m;
    for (int p = 0; p < 9; p++)
      for (int r = p; r < 9; r++) H[9 * p + r] += values[m] * q[p] * q[r];
  }
  for (int p = 0; p < 9; p++)
    for (int r = 0; r < p; r++) H[9 * p + r] = H[9 * r + p];
  return FLESH_OK;
}
