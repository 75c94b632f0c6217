/* derivative_check.h: differentiates an effect: its residual must be the gradient of its potential,
 * and its Jacobian the derivative of its residual. */
#ifndef FLESH_SYSTEM_DERIVATIVE_CHECK_H
#define FLESH_SYSTEM_DERIVATIVE_CHECK_H

#include "flesh/effect.h"
#include "flesh/mesh.h"

/* The two shifts tried: statics (1,0,0) and backward Euler with h = 1/60 s (1,60,3600). */
enum { FLESH_CHECK_SHIFTS = 2 };
extern const flesh_shift flesh_check_shifts[FLESH_CHECK_SHIFTS];

/* Relative errors; 0 is perfect, NaN where the effect lacks the operation. */
typedef struct flesh_derivative_report {
  double potential[FLESH_CHECK_SHIFTS]; /* |d phi - r.du| / sum |r_i du_i| */
  double jacobian[FLESH_CHECK_SHIFTS];  /* |dr - K du| / |K du| */
  double asymmetry;                     /* of the diagonal blocks (the others are stored once) */
  double negative; /* most negative curvature of the projected Jacobian found, over its largest
                      curvature; 0 when none */
} flesh_derivative_report;

/* Differentiates at (t, x) with random velocities and accelerations (zero for statics) along random
 * directions that move nodes by a small part of the mesh's mean edge; each error is the best of
 * several step lengths. x [3*nodes] should be generic (not the rest state, where gradients vanish).
 * Returns the effect's status where it cannot be evaluated (FLESH_UNDEFINED: choose another x). */
int flesh_effect_check_derivatives(const flesh_effect *effect, const flesh_mesh *mesh, double t,
                                   const double *x, unsigned long long seed,
                                   flesh_derivative_report *report);

/* Whether every error that was measured is below `tolerance`. */
int flesh_derivative_report_passes(const flesh_derivative_report *report, double tolerance);

#endif
