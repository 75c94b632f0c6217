/* recovery.h: what is tried where a solve fails or ends in a tangle: a step in halves, a load in increments, tangled
 * nodes repositioned; and the report where all of that fails. Nothing here solves: callers pass how to. */
#ifndef FLESH_TIME_RECOVERY_RECOVERY_H
#define FLESH_TIME_RECOVERY_RECOVERY_H

#include "base/team.h"
#include "flesh/integrator.h"
#include "time/recovery/untangle.h"

typedef struct flesh_recovery {
  const flesh_mesh *mesh;     /* borrowed */
  const flesh_team *team;     /* borrowed; NULL: none */
  int max_cutbacks;           /* halvings of a step or of a load increment */
  flesh_untangler *untangler; /* NULL: not wanted */
  int tangled;                /* as flesh_recovery_is_tangled has found last */
  flesh_failure failure;      /* of the last solve that failed */
} flesh_recovery;

/* Borrows the finished system. FLESH_ERR_MEMORY. */
int flesh_recovery_create(const flesh_system *system, const flesh_solver_options *options, flesh_recovery *recovery);
void flesh_recovery_clear(flesh_recovery *recovery);
size_t flesh_recovery_memory(const flesh_recovery *recovery);

/* Whether the body at x [3*n], where a step begins, may be tangled: more than one tet in 400 is inverted; or that has been
 * so (or may have been, before the first step) and some are still strained as much as what winds once more around an
 * edge. What has come there without inversion is not tangled. Collective. */
int flesh_recovery_is_tangled(flesh_recovery *recovery, const double *x);

/* A time span: its length stands beside its ends, whose difference is rounded. */
typedef struct flesh_span {
  double begin, end, h; /* s */
} flesh_span;

/* Takes the state through a part of a span, which begins where the last one has ended; `depth`: how often it has been
 * halved. A status > 0 has changed nothing. */
typedef int flesh_step_attempt(void *data, const flesh_span *part, int depth);

/* Takes the span's parts one after the other, and halves those that fail: a walk over the binary subdivision, so that
 * depth is bounded by max_cutbacks and work by its leaves. Failed parts are counted in *stats. The status of the part
 * that failed at the greatest depth, or a negative one at once. */
int flesh_recovery_step(const flesh_recovery *recovery, const flesh_span *span, flesh_step_attempt *attempt, void *data,
                        flesh_solve_stats *stats);

/* An increment of a load that goes from 0 to 1. */
typedef struct flesh_load_increment {
  double from, to; /* of the load */
  double fraction; /* of the prescribed displacement from the result at `from` to the full load's */
  int depth;       /* how often the whole has been halved to make it */
} flesh_load_increment;

/* Solves for equilibrium at increment->to, from where increment->from has led. A status > 0 has changed nothing. */
typedef int flesh_load_attempt(void *data, const flesh_load_increment *increment);

/* Raises the load from 0 to 1, by halves first, by increments that halve where one fails and double where it does not.
 * The status of the smallest increment, where that fails, or a negative one at once. */
int flesh_recovery_raise_load(const flesh_recovery *recovery, flesh_load_attempt *attempt, void *data);

/* Records in *failure the tet with the smallest J of a body at x [3*n] where a solve fails. Its other members stay. */
void flesh_failure_look(const flesh_mesh *mesh, const double *x, flesh_failure *failure);
/* What ranks have looked at becomes the worst of them, with the tet's number in the body. The worst node stays that of
 * each rank. Collective. */
void flesh_failure_meet(const flesh_team *team, flesh_failure *failure);
/* FLESH_ERR_SOLVE, or FLESH_ERR_NONFINITE, with the recovery's failure in words. */
int flesh_recovery_fail(const flesh_recovery *recovery);

#endif
