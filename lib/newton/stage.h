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

/* The solve of a stage, whose iterations are their owner's: as long as flesh_stage_begin or _goes_on says so, the owner
 * iterates from u until the residual's 2-norm is at most `target`, or its iteration ends otherwise. */
typedef struct flesh_stage_solve {
  flesh_newton *newton;
  flesh_solve_stats *stats; /* borrowed */
  double *u;                /* [n] the owner's; the solution or the last iterate */
  double target;            /* N; of the iterations that are wanted */
  int status;               /* of all so far */
  int begun;                /* the first iterate has a residual and a load */
  double first, last_target; /* N; of the first iterate's residual, and of the solve */
  int freezes;              /* whether something freezes at the solution */
  int frozen;               /* how often it has, for this target */
  int newtons, unsolved;    /* what the statistics had when it did last */
} flesh_stage_solve;

/* Takes the stage, and u = 0 or the one of `guesses` (each [n]; NULL ends them; may be NULL) that has the lowest
 * potential, where that is lower. Whether iterations are wanted. */
int flesh_stage_begin(flesh_newton *newton, const flesh_stage *stage, const double *const *guesses, double *u,
                      flesh_solve_stats *stats, flesh_stage_solve *solve);
/* The owner has iterated: with that status, which ends the solve unless it is FLESH_OK, and to that end. Whether more
 * iterations are wanted. */
int flesh_stage_continue(flesh_stage_solve *solve, int status, flesh_iteration_end end);
/* Adds to the statistics what the solve took. FLESH_OK; FLESH_NOT_CONVERGED; FLESH_UNDEFINED or FLESH_NONFINITE where
 * the start has no residual. */
int flesh_stage_end(flesh_stage_solve *solve);
/* Whether a solve still makes progress at u [n]: its last iterations, since the potential was *reached (NAN: the first),
 * have at least a tenth of the decrease so far. A restart with half the step would lose that decrease. */
int flesh_stage_makes_progress(flesh_newton *newton, const double *u, double *reached);
/* Adds what the newton's parts have counted to *stats. */
void flesh_stage_count(const flesh_newton *newton, flesh_solve_stats *stats);

#endif
