/* spectrum.h: the Hessian of psi(I_C, J) in the frame of F's singular vectors, where it falls apart
 * into three numbers for twists, three for flips and a 3x3 block for scalings.
 *
 * With F = U diag(sigma) V^T (svd3.h) and Y = U^T X V, the second derivative in direction X is
 *   Y_ii -> sum_j A_ij Y_jj        Y_ij -> (t+f)/2 Y_ij + (f-t)/2 Y_ji,   t = twist[k], f =
 * flip[k], k the index that is neither i nor j. Nothing of size 9x9 is needed to assemble an
 * element. Source: Smith, de Goes & Kim 2018, section 4. */
#ifndef FLESH_MATERIAL_SPECTRUM_H
#define FLESH_MATERIAL_SPECTRUM_H

#include "flesh/material.h"

typedef struct flesh_spectrum {
  double A[9];     /* scaling block, symmetric */
  double twist[3]; /* 2 psi_I + psi_J sigma_k */
  double flip[3];  /* 2 psi_I - psi_J sigma_k */
} flesh_spectrum;

/* FLESH_NONFINITE, spectrum untouched, where an entry overflows. */
int flesh_spectrum_make(const flesh_psi *psi, const double sigma[3], flesh_spectrum *spectrum);

/* What becomes of negative eigenvalues: zero (Teran et al. 2005) or their absolute values (Chen et al. 2024,
 * "Stabler Neo-Hookean Simulation"). */
typedef enum flesh_filter { FLESH_FILTER_CLAMP, FLESH_FILTER_ABSOLUTE } flesh_filter;

/* Returns 1 when there were negative eigenvalues, else 0 (nothing changed). */
int flesh_spectrum_filter(flesh_spectrum *spectrum, flesh_filter filter);

/* The smallest of the nine eigenvalues. */
double flesh_spectrum_smallest(const flesh_spectrum *spectrum);

/* The 3x3 block of the stiffness between two shape functions: B = sum over the Hessian of
 * directions e_i a^T and e_j b^T in the singular frame. With a = V^T grad_a and b = V^T grad_b the
 * block in world axes is U B U^T (per rest volume). */
static inline void flesh_spectrum_block(const flesh_spectrum *spectrum, const double a[3],
                                        const double b[3], double B[9])
{
  const double *A = spectrum->A, *t = spectrum->twist, *f = spectrum->flip;
  double same[3], cross[3], ab[3];
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
