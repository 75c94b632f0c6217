/* derivative_check.h: whether an effect's residual, potential and Jacobian belong together. */
#ifndef FLESH_DERIVATIVE_CHECK_H
#define FLESH_DERIVATIVE_CHECK_H

#include "flesh/effect.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The shifts that flesh_effect_check_derivatives takes: statics (1,0,0) and the midpoint rule with h = 1/60 s
 * (1/2,60,7200). */
enum { FLESH_CHECK_SHIFTS = 2 };

/* Relative errors; 0 is perfect, NaN where the effect lacks the operation. */
typedef struct flesh_derivative_report {
  /* |d phi - r.du| / sum |r_i du_i|; [0] of the energy, too, at rest with nothing lagged, unless the effect is of
   * something that moves (flesh_effect_time.carry) */
  double potential[FLESH_CHECK_SHIFTS];
  double jacobian[FLESH_CHECK_SHIFTS];  /* |dr - K du| / |K du|; of a matrix set anew and of products, too */
  double evaluate[FLESH_CHECK_SHIFTS];  /* residual and potential in one pass against both */
  double asymmetry;                     /* of the diagonal blocks (the others are stored once) */
  double negative; /* most negative curvature of the projected Jacobian found, over its largest
                      curvature; 0 when none */
} flesh_derivative_report;

/* Whether an effect's residual is the gradient of its potential and its Jacobian the derivative of its residual, by
 * differences, and whether the library's own effects give the same in one pass and in a matrix that is set anew: at
 * (t, x) with random velocities and accelerations (zero for statics), lagged.x near x, lagged.v random and a frozen
 * state on the line, along random directions that move nodes by a small part of the mesh's mean edge; each error is
 * the best of several step lengths. An effect that remembers nearness is checked with a memory, and with the matrix
 * that solves use: it must have the same bits when it is made again after one elsewhere. x [3*nodes] should be generic
 * (not the rest state, where gradients vanish). Returns the effect's status where it cannot be evaluated
 * (FLESH_UNDEFINED: choose another x). FLESH_ERR_ARGUMENT for a mesh with other counts of nodes or tets than that of
 * the effect. */
FLESH_API int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh,
                                             double t, const double *x, unsigned long long seed,
                                             flesh_derivative_report *report);

/* Whether every error that was measured is below `tolerance`; 1e-6 is what correct effects pass. Cannot fail. */
FLESH_API int flesh_derivative_report_passes(const flesh_derivative_report *report, double tolerance);

#ifdef __cplusplus
}
#endif
#endif
