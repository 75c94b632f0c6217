/* checkpoints.h: saved integrators from which steps are taken again. As the number of steps to come is not known in a run,
 * they are at equal distances, which double where there is no room. Where steps are taken again that number is known, and
 * others lie between them by the binomial schedule (Griewank & Walther 2000, Algorithm 799: revolve; replay.c). */
#ifndef FLESH_SENSITIVITY_CHECKPOINTS_H
#define FLESH_SENSITIVITY_CHECKPOINTS_H

#include "time/integrator.h"

typedef struct flesh_checkpoint {
  int at, call;           /* parts of steps before it; the call of flesh_integrator_step under way */
  int block;              /* that begins there, from 0 on */
  flesh_step_place place; /* in that */
  void *data;             /* [bytes] of flesh_integrator_save, with the state */
  size_t bytes;
} flesh_checkpoint;

typedef struct flesh_checkpoints {
  int count, room;
  flesh_checkpoint *all; /* [count] from the first part on */
  size_t bytes;
  int spacing;           /* blocks between those of the run */
} flesh_checkpoints;

/* Saves the integrator, which has forgotten its solvers, as the last checkpoint, `at` without data, if all together are then
 * within `budget` bytes; `may_thin`: others may go for it, and so may it. The first one is always saved, and stays.
 * FLESH_ERR_MEMORY, and what flesh_integrator_save returns. */
int flesh_checkpoints_add(flesh_checkpoints *checkpoints, const flesh_integrator *integrator, const flesh_checkpoint *at,
                          int may_thin, size_t budget);
/* Drops those from part `at` on. */
void flesh_checkpoints_drop(flesh_checkpoints *checkpoints, int at);
void flesh_checkpoints_clear(flesh_checkpoints *checkpoints);

#endif
