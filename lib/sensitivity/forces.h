/* forces.h: derivatives of a sum of forces, such as a probe's reaction, by the state at which they act. */
#ifndef FLESH_SENSITIVITY_FORCES_H
#define FLESH_SENSITIVITY_FORCES_H

#include "sensitivity/stage_tangent.h"

/* The sum weights . r, with nothing lagged or frozen. Everything is borrowed. */
typedef struct flesh_force_sum {
  const flesh_state *state;
  const double *a;               /* [3*n] accelerations, which balance free dofs; NULL: statics, at rest */
  const double *weights;         /* [3*n] */
  const unsigned char *left_out; /* [effects] 1: not part of r; NULL: all are, and free accelerations follow the state */
} flesh_force_sum;

/* Adds the derivatives of the sum to by_x and by_v [3*n], by a tangent of the system that may be used at many states.
 * FLESH_ERR_MEMORY, FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
int flesh_force_slopes(flesh_stage_tangent *tangent, const flesh_force_sum *sum, double *by_x, double *by_v);

#endif
