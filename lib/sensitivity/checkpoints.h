/* checkpoints.h: saved integrators from which steps are taken again, thinned out online, as the number of steps to come
 * is not known: Wang, Moin & Iaccarino 2009, "Minimal repetition dynamic checkpointing algorithm for unsteady adjoint
 * calculation", SIAM Journal on Scientific Computing 31. Steps are repeated as seldom as by the binomial schedule of a
 * known number (Griewank & Walther 2000, Algorithm 799: revolve). */
#ifndef FLESH_SENSITIVITY_CHECKPOINTS_H
#define FLESH_SENSITIVITY_CHECKPOINTS_H

#include "time/integrator.h"

typedef struct flesh_checkpoint {
  int at, call;           /* parts of steps before it; the call of flesh_integrator_step under way */
  int level;
  flesh_step_place place; /* in that */
  void *data;             /* [bytes] of flesh_integrator_save, with the state */
  size_t bytes;
} flesh_checkpoint;

typedef struct flesh_checkpoints {
  int count, room;
  flesh_checkpoint *all; /* [count] from the first part on */
  size_t bytes;
} flesh_checkpoints;

/* Saves the integrator, which has forgotten its solvers, as the last checkpoint; others go for it until all together are
 * within `budget` bytes. The first one stays; where there is no room beside it, there is no other.
 * FLESH_ERR_MEMORY, and what flesh_integrator_save returns. */
int flesh_checkpoints_add(flesh_checkpoints *checkpoints, const flesh_integrator *integrator, int at, int call,
                          const flesh_step_place *place, size_t budget);
/* Drops those from part `at` on. */
void flesh_checkpoints_drop(flesh_checkpoints *checkpoints, int at);
void flesh_checkpoints_clear(flesh_checkpoints *checkpoints);

#endif
