/* spectrum.h: the Hessian of psi(I_C, J) in the frame of F's singular vectors, where it decouples into three numbers
 * for twists, three for flips and a 3x3 block for scalings.
 *
 * With F = U diag(sigma) V^T (svd3.h) and Y = U^T X V, the second derivative in direction X is, with t = twist[k], f =
 * flip[k] and k the index that is neither i nor j,
 *
 *   Y_ii -> sum_j A_ij Y_jj        Y_ij -> (t+f)/2 Y_ij + (f-t)/2 Y_ji.
 *
 * An element is assembled without any 9x9 matrix. Source: Smith, de Goes & Kim 2018, section 4. */
#ifndef FLESH_MATERIAL_SPECTRUM_H
#define FLESH_MATERIAL_SPECTRUM_H

#include "material/psi_forms.h"
#include "math/eig3_core.h"

typedef struct flesh_spectrum {
  flesh_real A[9];     /* scaling block, symmetric */
  flesh_real twist[3]; /* 2 psi_I + psi_J sigma_k */
  flesh_real flip[3];  /* 2 psi_I - psi_J sigma_k */
} flesh_spectrum;

/* Fills the spectrum; returns the lanes in which every entry is finite. */
static inline flesh_mask flesh_spectrum_make(const flesh_psi_real *psi, const flesh_real sigma[3],
                                             flesh_spectrum *spectrum)
{
  /* c = dJ/dsigma */
  flesh_real c[3] = {sigma[1] * sigma[2], sigma[2] * sigma[0], sigma[0] * sigma[1]};
  flesh_real check = flesh_all(0);
  flesh_spectrum *s = spectrum;
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    s->twist[i] = 2 * psi->I + psi->J * sigma[i];
    s->flip[i] = 2 * psi->I - psi->J * sigma[i];
    s->A[4 * i] = 2 * psi->I + 4 * psi->II * sigma[i] * sigma[i] +
                  (4 * psi->IJ * sigma[i] + psi->JJ * c[i]) * c[i];
    s->A[3 * i + j] = s->A[3 * j + i] = psi->J * sigma[k] + 4 * psi->II * sigma[i] * sigma[j] +
                                        2 * psi->IJ * (sigma[i] * c[j] + sigma[j] * c[i]) +
                                        psi->JJ * c[i] * c[j];
    check += 0 * s->twist[i] + 0 * s->flip[i] + 0 * s->A[4 * i] + 0 * s->A[3 * i + j];
  }
  return check == 0;
}

/* Returns whether A is positive definite: the pivots of elimination without exchange are all positive only then. */
static inline flesh_mask flesh_spectrum_definite(const flesh_real A[9])
{
  flesh_real inverse = 1 / A[0], l1 = A[1] * inverse, l2 = A[2] * inverse;
  flesh_real p1 = A[4] - l1 * A[1], r = A[5] - l1 * A[2];
  return (A[0] > 0) & (p1 > 0) & (A[8] - l2 * A[2] - r * r / p1 > 0);
}

static inline flesh_real flesh_spectrum_filtered(flesh_real value, flesh_eigenvalue_filter filter)
{
  return filter == FLESH_FILTER_ABSOLUTE ? flesh_abs(value) : flesh_max(value, flesh_all(0));
}

/* Filters the eigenvalues of the scaling block in lanes that have a negative one; returns those lanes. */
static inline flesh_mask flesh_spectrum_filter_scaling(flesh_real A[9], flesh_eigenvalue_filter filter)
{
  flesh_real largest = flesh_all(0), w[3], Q[9], QW[9], scaled[9];
  for (int k = 0; k < 9; k++) largest = flesh_max(largest, flesh_abs(A[k]));
  largest = flesh_select(largest > 1e-300, largest, flesh_all(1));
  flesh_real inverse = 1 / largest; /* finite */
  for (int k = 0; k < 9; k++) scaled[k] = A[k] * inverse;
  flesh_eig3_core(scaled, w, Q);
  flesh_mask negative = (w[0] < 0) | (w[1] < 0) | (w[2] < 0);
  for (int k = 0; k < 3; k++) w[k] = flesh_spectrum_filtered(w[k], filter) * largest;
  for (int k = 0; k < 9; k++) QW[k] = Q[k] * w[k % 3];
  flesh_mat3_multiply_transposed(QW, Q, scaled);
  scaled[3] = scaled[1], scaled[6] = scaled[2], scaled[7] = scaled[5];
  for (int k = 0; k < 9; k++) A[k] = flesh_select(negative, scaled[k], A[k]);
  return negative;
}

/* Filters all eigenvalues; returns the lanes that had negative ones. Other lanes are unchanged. */
static inline flesh_mask flesh_spectrum_filter(flesh_spectrum *spectrum, flesh_eigenvalue_filter filter)
{
  flesh_mask changed = spectrum->twist[0] < 0;
  for (int k = 0; k < 3; k++) {
    changed |= (spectrum->twist[k] < 0) | (spectrum->flip[k] < 0);
    spectrum->twist[k] = flesh_spectrum_filtered(spectrum->twist[k], filter);
    spectrum->flip[k] = flesh_spectrum_filtered(spectrum->flip[k], filter);
  }
  if (flesh_any(flesh_spectrum_definite(spectrum->A) == 0))
    changed |= flesh_spectrum_filter_scaling(spectrum->A, filter);
  return changed;
}

/* Multiplies the Hessian by a positive factor. */
static inline void flesh_spectrum_scale(flesh_spectrum *spectrum, flesh_real factor)
{
  for (int k = 0; k < 9; k++) spectrum->A[k] *= factor;
  for (int k = 0; k < 3; k++) spectrum->twist[k] *= factor, spectrum->flip[k] *= factor;
}

/* Computes the second derivative in direction Y, both in the singular frame: S = d2 psi : Y. */
static inline void flesh_spectrum_multiply(const flesh_spectrum *spectrum, const flesh_real Y[9],
                                           flesh_real S[9])
{
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    flesh_real t = spectrum->twist[k], f = spectrum->flip[k], up = Y[3 * i + j], down = Y[3 * j + i];
    S[4 * i] = flesh_vec3_dot(spectrum->A + 3 * i, (const flesh_real[3]){Y[0], Y[4], Y[8]});
    S[3 * i + j] = 0.5 * (t + f) * up + 0.5 * (f - t) * down;
    S[3 * j + i] = 0.5 * (t + f) * down + 0.5 * (f - t) * up;
  }
}

/* Computes the 3x3 block B of the stiffness between two shape functions, from the Hessian for the directions e_i a^T
 * and e_j b^T in the singular frame. With a = V^T grad_a and b = V^T grad_b the block in world axes is U B U^T (per
 * rest volume). */
static inline void flesh_spectrum_block(const flesh_spectrum *spectrum, const flesh_real a[3],
                                        const flesh_real b[3], flesh_real B[9])
{
  const flesh_real *A = spectrum->A, *t = spectrum->twist, *f = spectrum->flip;
  flesh_real same[3], cross[3], ab[3];
  for (int k = 0; k < 3; k++) {
    same[k] = 0.5 * (t[k] + f[k]);
    cross[k] = 0.5 * (f[k] - t[k]);
    ab[k] = a[k] * b[k];
  }
  B[0] = A[0] * ab[0] + same[2] * ab[1] + same[1] * ab[2];
  B[4] = A[4] * ab[1] + same[2] * ab[0] + same[0] * ab[2];
  B[8] = A[8] * ab[2] + same[1] * ab[0] + same[0] * ab[1];
  B[1] = A[1] * a[0] * b[1] + cross[2] * a[1] * b[0];
  B[3] = A[1] * a[1] * b[0] + cross[2] * a[0] * b[1];
  B[2] = A[2] * a[0] * b[2] + cross[1] * a[2] * b[0];
  B[6] = A[2] * a[2] * b[0] + cross[1] * a[0] * b[2];
  B[5] = A[5] * a[1] * b[2] + cross[0] * a[2] * b[1];
  B[7] = A[5] * a[2] * b[1] + cross[0] * a[1] * b[2];
}

#endif
