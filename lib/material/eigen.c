/* eigen.c: the nine eigenpairs of the Hessian in closed form, and its nearest positive
 * semi-definite matrix, from spectrum.h. */
#include "material/spectrum.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "material/stretch.h"
#include "math/eig3.h"
#include "math/mat3.h"

int flesh_material_eigen(const flesh_material *material, const double F[9], double values[9],
                         double vectors[81])
{
  FLESH_NEED({material, "material"}, {F, "F"}, {values, "values"}, {vectors, "vectors"});
  flesh_spectrum s;
  double U[9], V[9], w[3], Q[9];
  int status = flesh_spectrum_at(material, F, &s, U, V);
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

/* Composes the matrix with these eigenpairs, leaving out those with values up to `least`. */
static void compose(const double values[9], const double vectors[81], double least, double H[81])
{
  memset(H, 0, 81 * sizeof *H);
  for (int m = 0; m < 9; m++) {
    if (!(values[m] > least)) continue;
    const double *q = vectors + 9 * m;
    for (int p = 0; p < 9; p++)
      for (int r = p; r < 9; r++) H[9 * p + r] += values[m] * q[p] * q[r];
  }
  for (int p = 0; p < 9; p++)
    for (int r = 0; r < p; r++) H[9 * p + r] = H[9 * r + p];
}

int flesh_material_hessian_projected(const flesh_material *material, const double F[9],
                                     double H[81])
{
  FLESH_NEED({material, "material"}, {F, "F"}, {H, "H"});
  double values[9], vectors[81];
  int status = flesh_material_eigen(material, F, values, vectors);
  if (!status) compose(values, vectors, 0, H);
  return status;
}

int flesh_stretch_hessian(const flesh_material *material, const double F[9], double H[81])
{
  double values[9], vectors[81];
  int status = flesh_material_eigen(material, F, values, vectors);
  if (!status) compose(values, vectors, -INFINITY, H);
  return status;
}
