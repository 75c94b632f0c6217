/* viscous_reference.h: the stress of viscosity in one tet, and its derivative, from the formulas. */
#ifndef FLESH_TEST_VISCOUS_REFERENCE_H
#define FLESH_TEST_VISCOUS_REFERENCE_H

#include <string.h>

#include "flesh/effect.h"
#include "math/eig3.h"
#include "math/mat3.h"

static const double shear = 3, bulk = 5;
static const flesh_shift viscous_shift = {.x = 1.5, .v = 4};

/* Computes S = 2 shear dev E' + bulk tr(E') I for E' = sym(A). */
static inline void viscous_stress(const double A[9], double S[9])
{
  const double trace = flesh_mat3_trace(A);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      S[3 * i + j] = 2 * shear * ((A[3 * i + j] + A[3 * j + i]) / 2 - (i == j) * trace / 3) + bulk * trace * (i == j);
}

/* Computes E' = sym(F_0^T F_0') + sv/sx (E(F) - E(F_0)), P = F S, the value S : E'/2, and the derivative of P by u,
 * column by column: sv F S(sym F^T W) + sx W S, with the last S filtered according to `project`. */
static inline void viscous_law(const double F[9], const double frozen[9], const double frozen_rate[9],
                        flesh_eigenvalue_filter project, double *value, double P[9], double H[81])
{
  const double pace = viscous_shift.v / viscous_shift.x / 2;
  double A[9], B[9], C[9], S[9], w[3], Q[9], turns[9] = {0};
  flesh_mat3_transposed_multiply(frozen, frozen_rate, A);
  flesh_mat3_transposed_multiply(F, F, B);
  flesh_mat3_transposed_multiply(frozen, frozen, C);
  for (int c = 0; c < 9; c++) A[c] += pace * (B[c] - C[c]);
  viscous_stress(A, S);
  flesh_mat3_multiply(F, S, P);
  *value = flesh_mat3_inner(S, A) / 2;
  flesh_eigh3(S, w, Q);
  for (int k = 0; k < 3; k++) {
    const double kept = w[k] > 0 || !project ? w[k] : project == FLESH_FILTER_CLAMP ? 0 : -w[k];
    for (int c = 0; c < 9; c++) turns[c] += kept * Q[3 * (c / 3) + k] * Q[3 * (c % 3) + k];
  }
  for (int q = 0; q < 9; q++) {
    double W[9] = {0}, dP[9], turned[9];
    W[q] = 1;
    flesh_mat3_transposed_multiply(F, W, A);
    viscous_stress(A, S);
    flesh_mat3_multiply(F, S, dP);
    flesh_mat3_multiply(W, turns, turned);
    for (int e = 0; e < 9; e++) H[9 * e + q] = viscous_shift.v * dP[e] + viscous_shift.x * turned[e];
  }
}

#endif
