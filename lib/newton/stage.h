/* stage.h: the solve of a stage from beginning to end: where it starts, how small its residual must become, and whether
 * it still makes progress. */
#ifndef FLESH_NEWTON_STAGE_H
#define FLESH_NEWTON_STAGE_H

#include "newton/newton.h"

/* How an iteration ended. */
typedef enum flesh_iteration_end {
  FLESH_ITERATION_STOPPED,  /* by itself: at its tolerance, or without a step */
  FLESH_ITERATION_LIMIT,    /* at the number of iterations it may take */
  FLESH_ITERATION_UNDEFINED /* where the residual has no value, and no shorter step has led out */
} flesh_iteration_end;

/* The owner of Newton's iteration. */
typedef struct flesh_iteration {
  void *data;
  /* Iterates from u [n] until the residual's 2-norm is at most `target` [N], or it ends otherwise. A status that is not
   * FLESH_OK ends the solve. */
  int (*run)(void *data, double target, flesh_iteration_end *end);
} flesh_iteration;

/* Solves the stage from u = 0, or from the one of `guesses` (each [n]; NULL ends them; may be NULL) that has the lowest
 * potential, where that is lower. u [n] belongs to the iteration, and is the solution or the last iterate. FLESH_OK;
 * FLESH_NOT_CONVERGED; FLESH_UNDEFINED or FLESH_NONFINITE where the start has no residual. Adds to *stats. */
int flesh_stage_solve(flesh_newton *newton, const flesh_stage *stage, const double *const *guesses,
                      const flesh_iteration *iteration, double *u, flesh_solve_stats *stats);
/* Whether a solve still makes progress at u [n]: its last iterations, since the potential was *reached (NAN: the first),
 * have at least a tenth of the decrease so far. A restart with half the step would lose that decrease. */
int flesh_stage_gains(flesh_newton *newton, const double *u, double *reached);
/* Adds what the newton's parts have counted to *stats. */
void flesh_stage_count(const flesh_newton *newton, flesh_solve_stats *stats);

#endif
