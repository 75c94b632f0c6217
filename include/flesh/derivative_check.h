/* derivative_check.h: checks that an effect's residual, potential and Jacobian are consistent. */
#ifndef FLESH_DERIVATIVE_CHECK_H
#define FLESH_DERIVATIVE_CHECK_H

#include "flesh/effect.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Number of shifts that flesh_effect_check_derivatives tries: statics (1,0,0) and the midpoint rule with h = 1/60 s
 * (1/2,60,7200). */
enum { FLESH_CHECK_SHIFTS = 2 };

/* Relative errors; 0 is perfect, NaN means that the effect lacks the operation. */
typedef struct flesh_derivative_report {
  /* |d phi - r.du| / sum |r_i du_i|. [0] is also the error of the energy, at rest with nothing lagged, unless the
   * effect is that of something that moves (flesh_effect_time.carry). */
  double potential[FLESH_CHECK_SHIFTS];
  double jacobian[FLESH_CHECK_SHIFTS];  /* |dr - K du| / |K du|; also of a matrix that is overwritten, and of products */
  double evaluate[FLESH_CHECK_SHIFTS];  /* residual and potential from one pass against those computed apart */
  /* asymmetry of the diagonal blocks (of the others only one triangle is stored) */
  double asymmetry;
  double negative; /* most negative curvature of the projected Jacobian found, over its largest
                      curvature; 0 when none */
} flesh_derivative_report;

/* Checks by finite differences that an effect's residual is the gradient of its potential and that its Jacobian is
 * the derivative of its residual; for the library's own effects also that residual and potential in one pass, and
 * the Jacobian that overwrites a matrix, are the same. The check is at (t, x) with velocities and accelerations at
 * random by `seed` (zero for statics), lagged.x near x, lagged.v random and a frozen state on the line, along random
 * directions that move nodes by a small part of the mesh's mean edge; each error is the smallest of several step
 * lengths. An effect with a memory of nearness is checked with one, and with the matrix that solves use, which must
 * be bitwise the same when it is made again after one at another point. x [3*nodes] should be generic (not the rest
 * state, where gradients vanish). Returns the effect's status where it cannot be evaluated (FLESH_UNDEFINED: choose
 * another x). FLESH_ERR_ARGUMENT for a mesh with other counts of nodes or tets than the effect's mesh. Further
 * errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh,
                                             double t, const double *x, unsigned long long seed,
                                             flesh_derivative_report *report);

/* Returns whether every measured error is below `tolerance`; correct effects pass at 1e-6. Cannot fail. */
FLESH_API int flesh_derivative_report_passes(const flesh_derivative_report *report, double tolerance);

#ifdef __cplusplus
}
#endif
#endif
