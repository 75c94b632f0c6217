/* derivative_check.h: checks that an effect's residual, potential and Jacobian are consistent. */
#ifndef FLESH_DERIVATIVE_CHECK_H
#define FLESH_DERIVATIVE_CHECK_H

#include "flesh/effect.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The shifts with which flesh_effect_check_derivatives checks: statics (1,0,0) and the midpoint rule with h = 1/60 s
 * (1/2,60,7200). */
enum { FLESH_CHECK_SHIFTS = 2 };

/* Relative errors; 0 is perfect, NaN where the effect lacks the operation. */
typedef struct flesh_derivative_report {
  /* |d phi - r.du| / sum |r_i du_i|. [0] also covers the energy, at rest with nothing lagged, unless the effect acts
   * against something that moves (flesh_effect_time.carry). */
  double potential[FLESH_CHECK_SHIFTS];
  double jacobian[FLESH_CHECK_SHIFTS];  /* |dr - K du| / |K du|; covers a matrix set anew and products, too */
  double evaluate[FLESH_CHECK_SHIFTS];  /* residual and potential in one pass, compared with each alone */
  double asymmetry;                     /* of the diagonal blocks (the others are stored once) */
  /* Most negative curvature found of the projected Jacobian, relative to its largest curvature; 0 when none. */
  double negative;
} flesh_derivative_report;

/* Checks by differences that an effect's residual is the gradient of its potential and its Jacobian the derivative
 * of its residual, and that the library's own effects give the same in one pass and in a matrix that is set anew.
 * The point is (t, x) with random velocities and accelerations (zero for statics), lagged.x near x, lagged.v random
 * and a frozen state on the line; random directions move nodes by a small part of the mesh's mean edge, and each
 * error is the best of several step lengths. An effect that caches near pairs is checked with its cache and with the
 * matrix that solves use: a matrix rebuilt after an evaluation elsewhere must have the same bits. x [3*nodes] should
 * be generic (not the rest state, where gradients vanish). Returns the effect's status where it cannot be evaluated
 * (FLESH_UNDEFINED: choose another x). FLESH_ERR_ARGUMENT if the numbers of nodes or tets of `mesh` are not those of
 * the effect's mesh. */
FLESH_API int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh,
                                             double t, const double *x, unsigned long long seed,
                                             flesh_derivative_report *report);

/* Returns whether every error that was measured is below `tolerance`; correct effects pass 1e-6. Cannot fail. */
FLESH_API int flesh_derivative_report_passes(const flesh_derivative_report *report, double tolerance);

#ifdef __cplusplus
}
#endif
#endif
