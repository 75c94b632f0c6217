/* forces.h: how a sum of forces at a state, as of a probe's reaction, depends on that state. */
#ifndef FLESH_SENSITIVITY_FORCES_H
#define FLESH_SENSITIVITY_FORCES_H

#include "sensitivity/stage_tangent.h"

/* weights . r, where nothing is lagged or frozen. All is borrowed. */
typedef struct flesh_force_sum {
  const flesh_state *state;
  const double *a;               /* [3*n] with what balances free dofs; NULL: statics, at rest */
  const double *weights;         /* [3*n] */
  const unsigned char *left_out; /* [effects] 1: no part of r; NULL: all are, and free accelerations follow the state */
} flesh_force_sum;

/* by_x and by_v [3*n] += its derivatives, by a tangent of the system that may serve at many states. FLESH_ERR_MEMORY,
 * FLESH_ERR_ARGUMENT, FLESH_ERR_SOLVE. */
int flesh_force_slopes(flesh_stage_tangent *tangent, const flesh_force_sum *sum, double *by_x, double *by_v);

#endif
