/* checkpoints.h: saved integrators from which steps are repeated. In a run the number of steps to come is not known, so
 * that checkpoints are at equal distances, which double when room runs out. When steps are repeated their number is known,
 * and further checkpoints lie between them by the binomial schedule (Griewank & Walther 2000, Algorithm 799: revolve;
 * replay.c). */
#ifndef FLESH_SENSITIVITY_CHECKPOINTS_H
#define FLESH_SENSITIVITY_CHECKPOINTS_H

#include "time/integrator.h"

typedef struct flesh_checkpoint {
  int at, call;           /* number of parts of steps before it; number of the current call of flesh_integrator_step */
  int block;              /* number of the block that begins there, from 0 on */
  flesh_step_place place; /* in that */
  void *data;             /* [bytes] data of flesh_integrator_save, with the state */
  size_t bytes;
} flesh_checkpoint;

typedef struct flesh_checkpoints {
  int count, room;
  flesh_checkpoint *all; /* [count] in order, from the first part on */
  size_t bytes;
  int spacing;           /* number of blocks between the run's checkpoints */
} flesh_checkpoints;

/* Saves the integrator, which has forgotten its solvers, as the last checkpoint, described by `at` without data, if all
 * checkpoints then fit `budget` bytes. `may_thin`: others, or this one, may be dropped to make room. The first one is
 * always saved, and stays. FLESH_ERR_MEMORY, and the errors of flesh_integrator_save. */
int flesh_checkpoints_add(flesh_checkpoints *checkpoints, const flesh_integrator *integrator, const flesh_checkpoint *at,
                          int may_thin, size_t budget);
/* Drops the checkpoints from part `at` on. */
void flesh_checkpoints_drop(flesh_checkpoints *checkpoints, int at);
void flesh_checkpoints_clear(flesh_checkpoints *checkpoints);

#endif
