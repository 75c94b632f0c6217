/* material.h: energy densities as functions psi(I_C, J) or of the singular values of F, and the quantities that follow
 * from psi alone.
 *
 * F is the 3x3 deformation gradient, I_C = tr(F^T F), J = det F. 3x3 matrices are row-major [9]: F[3*i+j] = F_ij; vec(F)
 * has the same order, so Hessians are [81], H[9*p+q]. Energies are densities per rest volume [J/m^3], stresses and
 * moduli [Pa].
 *
 *   Neo  mu/2 (I_C-3) - mu log J + lambda/2 (log J)^2     Bonet & Wood 2008
 *   A    mu/2 (I_C-3) - mu log J + lambda/2 (J-1)^2       Ogden 1984
 *   B    mu/2 (J^(-2/3) I_C-3) + lambda/2 (J-1)^2         Bower 2009
 *   C    mu/2 (J^(-2/3) I_C-3) + lambda/2 (J-1)           Wang & Yang 2016
 *   M    mu/2 (I_C-3)                                     Mooney 1940, Rivlin 1948
 *   D    mu/2 (I_C-3) + lambda/2 (J-1)^2
 *   E    mu/2 (I_C-3) + lambda/2 (J-alpha)^2,  alpha = 1 + mu/lambda
 *   S    E's form - mu/2 log(I_C+1),  alpha = 1 + mu/lambda - mu/(4 lambda)
 *                                                         Smith, de Goes & Kim 2018, eq. 14
 *   Fung mu/(2b) (exp(b (I_C-3)) - 1) + lambda/2 (J-alpha)^2,  alpha = 1 + mu/lambda
 *                                                         length term of Fung 1967
 *   AB   mu sum of c_k N^(1-k) (I_C^k - 3^k) + lambda/2 (J-alpha)^2, k = 1 to 5, c = 1/2, 1/20,
 *        11/1050, 19/7000, 519/673750; alpha keeps the rest stress-free
 *                                                         length term of Arruda & Boyce 1993
 *
 * These are psi(I_C, J). The singular values s_1 >= s_2 >= |s_3| of F, where s_3 has the sign of J, define three forms
 * psi(s_1, s_2, s_3), all stress-free at rest:
 *
 *   CR   mu sum (s_i-1)^2 + lambda/2 (sum s_i - 3)^2      Muller & Gross 2004
 *   FCR  mu sum (s_i-1)^2 + lambda/2 (J-1)^2              Stomakhin et al. 2012
 *   StVK mu sum E_i^2 + lambda/2 (sum E_i)^2,  E_i = (s_i^2-1)/2
 *                                                         Saint-Venant 1844, Kirchhoff 1852
 *
 * CR and FCR have a value for every F, but no derivative where s_2 + s_3 = 0 (only at J <= 0), as the polar rotation is
 * not unique there. The stress is that of one of the rotations, and in the twists of the Hessian s_i + s_j counts as at
 * least FLESH_SMALLEST_STRETCH_SUM, which bounds the twists by (4 mu + 2 lambda |sum s_i - 3|) /
 * FLESH_SMALLEST_STRETCH_SUM.
 *
 * Neo, A, B and C are undefined for J <= 0: every function of F then returns FLESH_UNDEFINED. A non-finite F, or a
 * result too large for a double, gives FLESH_NONFINITE. If a function does not return FLESH_OK, the outputs are
 * unchanged. Functions that return no status cannot fail. */
#ifndef FLESH_MATERIAL_H
#define FLESH_MATERIAL_H

#include "flesh/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Poisson's ratio whose lambda, 49 times the small-strain mu, is the penalty of incompressible materials; integrators
 * increase the penalty. */
#define FLESH_REFERENCE_POISSON 0.49

/* Lower bound of the sum of two singular values in the twists of CR and FCR. */
#define FLESH_SMALLEST_STRETCH_SUM 1e-6

/* The built-in forms, in three lists, ROW(NAME, name, text, full name, needs J > 0, constants it takes, colour in plots,
 * formula, source, limit, its text, at the limit, matched mu, matched lambda, alpha, volume term).
 *
 * flesh_psi_<name> (lib/material/psi_forms.h) computes the formula of a form of the invariants, flesh_stretch_<name>
 * (lib/material/stretch_forms.h) that of a form of the singular values. A form that cannot be matched has residual
 * stress at rest. Raw constants need lambda > limit(mu), or = as well where "at the limit" is 1; a form without
 * lambda has no limit, and NULL as its text. The matched mu and lambda are those of the formula, from the
 * small-strain ones; alpha follows from those of the formula. The volume term is the factor of lambda, without terms
 * linear in J (flesh_volume_term). */
#define FLESH_NEO_HOOKEAN_FORM_LIST(ROW)                                                           \
  ROW(NEO, neo, "Neo", "bonet-wood-neo-hookean", 1, RAW_OR_MATCHED, "#0072B2",                     \
      "mu/2 (I_C-3) - mu log J + lambda/2 (log J)^2", "Bonet & Wood 2008",                         \
      -2 * mu / 3, "-2/3 mu", 0, mu, lambda, 1, LOGARITHMIC)                                       \
  ROW(A, a, "A", "ogden-neo-hookean", 1, RAW_OR_MATCHED, "#56B4E9",                                \
      "mu/2 (I_C-3) - mu log J + lambda/2 (J-1)^2", "Ogden 1984",                                  \
      0, "0", 1, mu, lambda, 1, QUADRATIC)                                                         \
  ROW(B, b, "B", "bower-neo-hookean", 1, RAW_OR_MATCHED, "#D55E00",                                \
      "mu/2 (J^(-2/3) I_C-3) + lambda/2 (J-1)^2", "Bower 2009",                                    \
      0, "0", 0, mu, lambda + 2 * mu / 3, 1, QUADRATIC)                                            \
  ROW(C, c, "C", "wang-yang-neo-hookean", 1, RAW, "#E69F00",                                       \
      "mu/2 (J^(-2/3) I_C-3) + lambda/2 (J-1)", "Wang & Yang 2016",                                \
      0, "0", 1, mu, lambda, 1, NONE)                                                              \
  ROW(M, m, "M", "mooney-neo-hookean", 0, RAW, "#8C8C8C",                                          \
      "mu/2 (I_C-3)", "Mooney 1940, Rivlin 1948",                                                  \
      -INFINITY, NULL, 0, mu, lambda, 1, NONE)                                                     \
  ROW(D, d, "D", "log-free-neo-hookean", 0, RAW_OR_AS_E, "#AA3399",                                \
      "mu/2 (I_C-3) + lambda/2 (J-1)^2", "Smith, de Goes & Kim 2018, section 3",                   \
      0, "0", 1, mu, lambda, 1, QUADRATIC)                                                         \
  ROW(E, e, "E", "rest-stable-neo-hookean", 0, RAW_OR_MATCHED, "#009E60",                          \
      "mu/2 (I_C-3) + lambda/2 (J-alpha)^2", "Smith, de Goes & Kim 2018, section 3",               \
      mu / 3, "mu/3", 0, mu, lambda + mu, 1 + mu / lambda, QUADRATIC)                              \
  ROW(S, s, "S", "stable-neo-hookean", 0, RAW_OR_MATCHED, "#000000",                               \
      "mu/2 (I_C-3) + lambda/2 (J-alpha)^2 - mu/2 log(I_C+1)",                                     \
      "Smith, de Goes & Kim 2018, eq. 14",                                                         \
      mu / 8, "mu/8", 0, 4 * mu / 3, lambda + 5 * mu / 6, 1 + 0.75 * mu / lambda, QUADRATIC)

/* Forms that stiffen in tension. */
#define FLESH_STIFFENING_FORM_LIST(ROW)                                                            \
  ROW(FUNG, fung, "Fung", "fung-exponential", 0, RAW_OR_MATCHED, "#B8A200",                        \
      "mu/(2b) (exp(b (I_C-3)) - 1) + lambda/2 (J-alpha)^2", "Fung 1967",                          \
      fmax(0, (1. / 3 - 2 * exponent) * mu), "max(0, (1/3 - 2 b) mu)", 0,                          \
      mu, lambda + (1 - 2 * exponent) * mu, 1 + mu / lambda, QUADRATIC)                            \
  ROW(AB, ab, "AB", "arruda-boyce", 0, RAW_OR_MATCHED, "#6959CD",                                  \
      "mu (1/2 (I_C-3) + 1/(20 N) (I_C^2-9) + 11/(1050 N^2) (I_C^3-27) + "                         \
      "19/(7000 N^3) (I_C^4-81) + 519/(673750 N^4) (I_C^5-243)) + lambda/2 (J-alpha)^2",           \
      "Arruda & Boyce 1993",                                                                       \
      fmax(0, flesh_ab_slope(links) / 3 - 4 * flesh_ab_curvature(links)) * mu,                     \
      "max(0, 2/3 f'(3) - 4 f''(3)) mu", 0,                                                        \
      mu / flesh_ab_slope(links),                                                                  \
      lambda + (1 - 4 * flesh_ab_curvature(links) / flesh_ab_slope(links)) * mu,                   \
      1 + flesh_ab_slope(links) * mu / lambda, QUADRATIC)

/* Forms in terms of the singular values. */
#define FLESH_STRETCH_FORM_LIST(ROW)                                                               \
  ROW(CR, cr, "CR", "co-rotational", 0, RAW_OR_MATCHED, "#CC5B8F",                                 \
      "mu sum (s_i-1)^2 + lambda/2 (sum s_i - 3)^2", "Muller & Gross 2004",                        \
      -2 * mu / 3, "-2/3 mu", 0, mu, lambda, 1, NONE)                                              \
  ROW(FCR, fcr, "FCR", "fixed-co-rotational", 0, RAW_OR_MATCHED, "#7A0019",                        \
      "mu sum (s_i-1)^2 + lambda/2 (J-1)^2", "Stomakhin et al. 2012",                              \
      0, "0", 1, mu, lambda, 1, QUADRATIC)                                                         \
  ROW(STVK, stvk, "StVK", "st-venant-kirchhoff", 0, RAW_OR_MATCHED, "#8C564B",                     \
      "mu sum E_i^2 + lambda/2 (sum E_i)^2, E_i = (s_i^2-1)/2",                                    \
      "Saint-Venant 1844, Kirchhoff 1852",                                                         \
      -2 * mu / 3, "-2/3 mu", 0, mu, lambda, 1, NONE)

/* Volume term of a form: none, lambda/2 (J-1)^2, lambda/2 (log J)^2, or lambda U(J) with a user's own U. */
typedef enum flesh_volume_term {
  FLESH_VOLUME_NONE,
  FLESH_VOLUME_QUADRATIC,
  FLESH_VOLUME_LOGARITHMIC,
  FLESH_VOLUME_USER
} flesh_volume_term;

#define FLESH_INVARIANT_FORM_LIST(ROW)                                                             \
  FLESH_NEO_HOOKEAN_FORM_LIST(ROW) FLESH_STIFFENING_FORM_LIST(ROW)
#define FLESH_FORM_LIST(ROW) FLESH_INVARIANT_FORM_LIST(ROW) FLESH_STRETCH_FORM_LIST(ROW)

/* The constants of forms beyond mu and lambda: ROW(FORM, name, unit, least, usual, doc). `name` is a member of
 * flesh_material, 0 for the other forms, and a key of a scene's material; psi and the formulas of FLESH_FORM_LIST
 * read it. Its value must be at least `least`; if none is given, it is `usual`, a formula of the small-strain mu. */
#define FLESH_FORM_CONSTANT_LIST(ROW)                                                              \
  ROW(FUNG, exponent, NULL, 1e-6, 0.25, "b of Fung's exp(b (I_C-3)), no unit")                     \
  ROW(AB, links, NULL, 1, 25, "N of Arruda & Boyce, number of links of a chain, no unit")

typedef enum flesh_energy {
#define FLESH_FORM_ENUM(NAME, ...) FLESH_ENERGY_##NAME,
  FLESH_FORM_LIST(FLESH_FORM_ENUM)
#undef FLESH_FORM_ENUM
  FLESH_ENERGY_USER, /* psi given by the user */
  FLESH_ENERGY_COUNT = FLESH_ENERGY_USER
} flesh_energy;

/* How the given small-strain Lame constants (mu_L, lambda_L) become the mu, lambda of a form. */
typedef enum flesh_constants {
  FLESH_CONSTANTS_RAW,     /* mu = mu_L, lambda = lambda_L, used directly in the formula */
  FLESH_CONSTANTS_MATCHED, /* the linearisation at rest has the constants (mu_L, lambda_L); not for C, M, D */
  FLESH_CONSTANTS_AS_E     /* D only: E's constants, mu = mu_L, lambda = lambda_L + mu_L */
} flesh_constants;

/* psi and its derivatives with respect to I_C and J at one (I_C, J) [Pa]. */
typedef struct flesh_psi {
  double value;
  double I, J;       /* first derivatives */
  double II, IJ, JJ; /* second derivatives */
} flesh_psi;

struct flesh_material;

/* A user's or a built-in psi: fills *psi and returns 0; returns FLESH_UNDEFINED, *psi unchanged, if the form has no
 * value. It must be a pure function, as several threads call it at once. */
typedef int (*flesh_psi_function)(double I_C, double J, const struct flesh_material *material,
                                  flesh_psi *psi);

/* U(J), the volume part of a psi over its lambda, and its first and second derivatives, no unit. */
typedef struct flesh_volume_part {
  double value, J, JJ;
} flesh_volume_part;

/* A user's U(J): fills *U and returns 0; returns FLESH_UNDEFINED, *U unchanged, if it has no value. It must be pure,
 * as psi must. U' = 0 and U'' = 1 at J = 1, so that lambda is the modulus of small changes of volume; for kappa/4
 * (J^2 - 1 - 2 log J), for instance, lambda = kappa and U = (J^2 - 1 - 2 log J)/4. */
typedef int (*flesh_volume_function)(double J, const struct flesh_material *material, flesh_volume_part *U);

/* A material: plain data, copied freely, const once made. */
typedef struct flesh_material {
  flesh_psi_function psi; /* returns FLESH_UNDEFINED for a form of the singular values */
  /* Pa, constants of the formula; NaN for a user's psi, which may set and use them. A user's lambda says that psi
   * contains lambda U(J), of which FLESH_ELEMENT_TET10_MEAN takes a mean. */
  double mu, lambda;
  flesh_volume_function volume; /* U of a user's psi; NULL: (J-1)^2/2. Not used by built-in forms */
#define FLESH_FORM_CONSTANT(FORM, name, ...) double name;
  FLESH_FORM_CONSTANT_LIST(FLESH_FORM_CONSTANT)
  double alpha; /* rest offset of J; read only: it follows from mu and lambda (E, S; else 1) */
  /* 1: incompressible, Poisson's ratio 1/2. psi and lambda are those of the ratio FLESH_REFERENCE_POISSON; the volume
   * term is a penalty of the constraint J = 1. At J = 1 the term is 0, and the rest of psi does not depend on lambda.
   * Pressures are multipliers of the tets (flesh_state.multipliers), not functions of F. The user sets this member
   * for a psi of their own, whose lambda is then the penalty. */
  int incompressible;
  flesh_energy energy;
  flesh_constants constants;
  /* Young's modulus, Pa, and Poisson's ratio, as given; NaN if the material was given by mu and lambda */
  double young, poisson;
  const void *user;      /* data of the user's psi (FLESH_ENERGY_USER), borrowed */
} flesh_material;

/* Makes a material from the small-strain constants (mu_L, lambda_L) [Pa], finite, mu_L > 0; raw uses them directly in
 * the formula. Matched: S mu = 4/3 mu_L, lambda = lambda_L + 5/6 mu_L; E lambda = lambda_L + mu_L; B lambda =
 * lambda_L + 2/3 mu_L; Neo and A unchanged; M, C and D have no matched constants. Limits: raw E needs lambda > mu/3,
 * S lambda > mu/8, B lambda > 0, Neo lambda > -2/3 mu for a stable rest state, A, C and D lambda >= 0 to be bounded
 * from below; matched and as_e need lambda_L > -2/3 mu_L (-1 < poisson < 0.5), and A lambda_L >= 0. Every form needs
 * lambda <= 1e9 mu: above this, rounding errors of the volume term hide other stresses. FLESH_ERR_ARGUMENT with the
 * reason otherwise. */
FLESH_API int flesh_material_from_lame(flesh_energy energy, flesh_constants constants, double mu,
                                       double lambda, flesh_material *material);

/* Makes a material from Young's modulus [Pa] and Poisson's ratio: mu_L = E/(2(1+nu)), lambda_L = E
 * nu/((1+nu)(1-2nu)); nu in (-1, 0.4999999995], or 0.5 for forms with a volume term, with FLESH_ELEMENT_TET10_MEAN
 * only. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_from_young(flesh_energy energy, flesh_constants constants,
                                        double young, double poisson, flesh_material *material);

/* Constants from which a material is made: one small-strain pair, mu, lambda [Pa] or young [Pa], poisson, with the
 * other pair NaN, and the further constants of the form (NaN: the form's usual value). */
typedef struct flesh_material_given {
  double mu, lambda, young, poisson;
  FLESH_FORM_CONSTANT_LIST(FLESH_FORM_CONSTANT)
} flesh_material_given;
#undef FLESH_FORM_CONSTANT

/* Sets all members to NaN. Cannot fail. */
FLESH_API void flesh_material_given_default(flesh_material_given *given);

/* Makes a material as flesh_material_from_lame or flesh_material_from_young does, depending on the given pair, with
 * the other constants of the form. Matched: Fung mu = mu_L, lambda = lambda_L + (1-2b) mu_L; AB mu = mu_L/g, lambda =
 * lambda_L + (1-4h/g) mu_L with g = 2 f'(3), h = f''(3) of its length term mu f(I_C); both need the matched lambda >
 * 0. FLESH_ERR_ARGUMENT as theirs, for none or both of the pairs, and for a constant that the form does not have or
 * that is below its least. */
FLESH_API int flesh_material_from_given(flesh_energy energy, flesh_constants constants,
                                        const flesh_material_given *given,
                                        flesh_material *material);

/* Makes a material of the user's own psi(I_C, J). `user` is borrowed and may be NULL. For FLESH_ELEMENT_TET10_MEAN
 * set the material's `lambda`, and its `volume` if the volume part is not lambda/2 (J-1)^2; a body refuses a psi that
 * is unstable without the volume part whose mean is taken (a sign that psi does not contain this part). Errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_from_psi(flesh_psi_function psi, const void *user,
                                      flesh_material *material);

/* Return "Neo", "A" ... "S", "user"; "raw", "matched", "as_e"; "unknown" for anything else. */
FLESH_API const char *flesh_energy_name(flesh_energy energy);
FLESH_API const char *flesh_constants_name(flesh_constants constants);
/* Inverse of the above (not for "user"), exact spelling; a form's full name ("stable-neo-hookean") also counts.
 * FLESH_ERR_ARGUMENT (with the valid names) otherwise. */
FLESH_API int flesh_energy_from_name(const char *name, flesh_energy *energy);
FLESH_API int flesh_constants_from_name(const char *name, flesh_constants *constants);

/* Computes the small-strain constants of the linearisation at F = I, for any psi: mu_L = psi_I - psi_J/2, lambda_L =
 * psi_J + 4 psi_II + 4 psi_IJ + psi_JJ (for a form of the singular values, from the Hessian's entries), and the
 * residual stress at rest, P(I) = rest_stress * identity, rest_stress = 2 psi_I + psi_J [Pa]. Any output may be NULL.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_small_strain(const flesh_material *material, double *mu,
                                          double *lambda, double *rest_stress);

/* Computes the ratio J* = s^3, s being the uniform scale at which a free body is at rest: the first minimum of psi(s
 * I) on the way from F = I, in shrinking if it is in tension there, else in swelling. 1 for the forms without stress
 * at rest (also C with lambda = 0, which is at rest at any volume); for D the larger root of mu + lambda (s^3-1) s =
 * 0. FLESH_UNDEFINED if there is none (M, C, and D below lambda/mu = 4^(4/3)/3 = 2.1165). Further errors:
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_rest_ratio(const flesh_material *material, double *volume_ratio);

/* Computes the energy density psi(F) [J/m^3]. Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_energy(const flesh_material *material, const double F[9], double *psi);

/* Computes the first Piola-Kirchhoff stress P = 2 psi_I F + psi_J cof F [9], Pa; for psi(s) it is U diag(d psi/d s_i)
 * V^T. Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_stress(const flesh_material *material, const double F[9], double P[9]);

/* Computes the Hessian d vec(P)/d vec(F) [81], symmetric, Pa. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_hessian(const flesh_material *material, const double F[9],
                                     double H[81]);

/* Computes the Hessian's nine eigenpairs in closed form from F = U diag(s) V^T (Smith, de Goes & Kim 2018, section
 * 4): values[0..2] of the scaling block, ascending, [3..5] of the twists, 2 psi_I + psi_J s_k, [6..8] of the flips, 2
 * psi_I - psi_J s_k; for psi(s) the twists are (psi_i + psi_j)/(s_i + s_j) and the flips (psi_i - psi_j)/(s_i - s_j).
 * vectors[9*k ..] is the unit eigenvector vec(Q_k) of values[k]. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_eigen(const flesh_material *material, const double F[9],
                                   double values[9], double vectors[81]);

/* Computes the Hessian with its negative eigenvalues set to zero [81]: positive semi-definite. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_material_hessian_projected(const flesh_material *material, const double F[9],
                                               double H[81]);

/* Treatment of the negative eigenvalues of an element's Hessian. Elements and effects accept the first three; in
 * solver options the solver may choose between them. A solver uses the true Hessian first, and filters once that
 * shows negative curvature; with a filter whose name ends in ALWAYS, it filters in every iteration. */
typedef enum flesh_eigenvalue_filter {
  FLESH_FILTER_NONE,     /* eigenvalues stay as they are */
  FLESH_FILTER_CLAMP,    /* set to zero (Teran et al. 2005) */
  FLESH_FILTER_ABSOLUTE, /* replaced by absolute values (Chen et al. 2024, "Stabler Neo-Hookean Simulation") */
  /* Set to zero after a filtered step whose decrease the quadratic model predicted to a hundredth, else replaced by
   * absolute values (Chen et al. 2024, "Trust-Region Eigenvalue Filtering"). */
  FLESH_FILTER_TRUST_REGION,
  FLESH_FILTER_AUTO, /* trust region in dynamics, absolute values in statics */
  FLESH_FILTER_CLAMP_ALWAYS,
  FLESH_FILTER_ABSOLUTE_ALWAYS,
  FLESH_FILTER_TRUST_REGION_ALWAYS
} flesh_eigenvalue_filter;

#ifdef __cplusplus
}
#endif
#endif
