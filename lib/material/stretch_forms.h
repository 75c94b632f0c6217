/* stretch_forms.h: the energies psi(s_1, s_2, s_3) of the signed singular values of F (svd3.h), for one F or several
 * side by side (lanes.h); formulas and sources in flesh/material.h.
 *
 * With p_i = d psi/d s_i the stress is U diag(p) V^T. The Hessian in the singular frame (spectrum.h) has
 *
 *   A_ij = d2 psi/ds_i ds_j,   twist_k = (p_i + p_j)/(s_i + s_j),   flip_k = (p_i - p_j)/(s_i - s_j).
 *
 * Every form divides analytically, so that no digits are lost where singular values coincide. Only the twists of a form
 * with the term g sum s_i keep a quotient, 2 g/(s_i + s_j): the cone at s_i + s_j = 0 is real. */
#ifndef FLESH_MATERIAL_STRETCH_FORMS_H
#define FLESH_MATERIAL_STRETCH_FORMS_H

#include "material/spectrum.h"

/* psi, its derivatives p and its Hessian in the singular frame. */
typedef struct flesh_stretch_real {
  flesh_real value, p[3];
  flesh_spectrum spectrum;
} flesh_stretch_real;

/* Variables of a form: s, e_i = s_i - 1 and c_i = dJ/ds_i. */
typedef struct flesh_stretches {
  const flesh_real *s;
  flesh_real e[3], c[3];
} flesh_stretches;

/* Computes mu sum e_i^2 = mu (I_C - 2 sum s_i + 3) and `tension` sum s_i. The twists are 2 mu - (4 mu - 2 tension)/(s_i
 * + s_j). */
static inline void flesh_stretch_arap(const flesh_stretches *at, double mu, flesh_real tension, flesh_stretch_real *psi)
{
  flesh_spectrum *H = &psi->spectrum;
  psi->value = mu * (at->e[0] * at->e[0] + at->e[1] * at->e[1] + at->e[2] * at->e[2]);
  for (int k = 0; k < 3; k++) {
    flesh_real sum = at->s[(k + 1) % 3] + at->s[(k + 2) % 3];
    psi->p[k] = 2 * mu * at->e[k] + tension;
    H->twist[k] = 2 * mu + (2 * tension - 4 * mu) / flesh_max(sum, flesh_all(FLESH_SMALLEST_STRETCH_SUM));
    H->flip[k] = H->A[4 * k] = flesh_all(2 * mu);
    H->A[3 * k + (k + 1) % 3] = H->A[3 * ((k + 1) % 3) + k] = flesh_all(0);
  }
}

static inline void flesh_stretch_cr(const flesh_material *m, const flesh_stretches *at, flesh_stretch_real *psi)
{
  flesh_real strain = at->e[0] + at->e[1] + at->e[2];
  flesh_stretch_arap(at, m->mu, m->lambda * strain, psi);
  psi->value += 0.5 * m->lambda * strain * strain;
  for (int k = 0; k < 9; k++) psi->spectrum.A[k] += m->lambda;
}

static inline void flesh_stretch_fcr(const flesh_material *m, const flesh_stretches *at, flesh_stretch_real *psi)
{
  /* J - 1, without its rounding near rest */
  const flesh_real *e = at->e, *s = at->s, *c = at->c;
  flesh_real dilation = e[0] + e[1] + e[2] + (e[0] * e[1] + e[1] * e[2] + e[2] * e[0]) + e[0] * e[1] * e[2];
  flesh_real pressure = m->lambda * dilation;
  flesh_stretch_arap(at, m->mu, flesh_all(0), psi);
  psi->value += 0.5 * m->lambda * dilation * dilation;
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    flesh_real mixed = m->lambda * c[i] * c[j] + pressure * s[k];
    psi->p[i] += pressure * c[i];
    psi->spectrum.twist[i] += pressure * s[i];
    psi->spectrum.flip[i] -= pressure * s[i];
    psi->spectrum.A[4 * i] += m->lambda * c[i] * c[i];
    psi->spectrum.A[3 * i + j] += mixed;
    psi->spectrum.A[3 * j + i] += mixed;
  }
}

static inline void flesh_stretch_stvk(const flesh_material *m, const flesh_stretches *at, flesh_stretch_real *psi)
{
  const flesh_real *s = at->s;
  flesh_real E[3], trace = flesh_all(0), squares = flesh_all(0);
  for (int k = 0; k < 3; k++) {
    E[k] = at->e[k] * (0.5 * at->e[k] + 1);
    trace += E[k];
    squares += E[k] * E[k];
  }
  psi->value = m->mu * squares + 0.5 * m->lambda * trace * trace;
  flesh_real rest = m->lambda * trace - m->mu; /* p_i = s_i (mu s_i^2 + rest) */
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    flesh_real both = s[j] * s[j] + s[k] * s[k], product = s[j] * s[k];
    psi->p[i] = s[i] * (2 * m->mu * E[i] + m->lambda * trace);
    psi->spectrum.twist[i] = m->mu * (both - product) + rest;
    psi->spectrum.flip[i] = m->mu * (both + product) + rest;
    psi->spectrum.A[4 * i] = (3 * m->mu + m->lambda) * s[i] * s[i] + rest;
    psi->spectrum.A[3 * i + j] = psi->spectrum.A[3 * j + i] = m->lambda * s[i] * s[j];
  }
}

/* Computes the form `energy` of the singular values s; returns the lanes in which everything is finite. */
static inline flesh_mask flesh_stretch_form(flesh_energy energy, const flesh_material *m, const flesh_real s[3],
                                            flesh_stretch_real *psi)
{
  flesh_stretches at = {.s = s};
  for (int k = 0; k < 3; k++) {
    at.e[k] = s[k] - 1;
    at.c[k] = s[(k + 1) % 3] * s[(k + 2) % 3];
  }
  switch (energy) {
#define FLESH_FORM_CASE(NAME, name, ...)                                                                               \
  case FLESH_ENERGY_##NAME:                                                                                            \
    flesh_stretch_##name(m, &at, psi);                                                                                 \
    break;
    FLESH_STRETCH_FORM_LIST(FLESH_FORM_CASE)
#undef FLESH_FORM_CASE
  default:
    break;
  }
  const flesh_spectrum *H = &psi->spectrum;
  flesh_real check = 0 * psi->value;
  for (int k = 0; k < 3; k++) check += 0 * psi->p[k] + 0 * H->twist[k] + 0 * H->flip[k];
  for (int k = 0; k < 9; k++) check += 0 * H->A[k];
  return check == 0;
}

#endif
