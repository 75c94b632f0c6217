/* stage.h: the solve of a stage from beginning to end: its first iterate, its target, and whether it still makes progress. */
#ifndef FLESH_NEWTON_STAGE_H
#define FLESH_NEWTON_STAGE_H

#include "newton/newton.h"

/* How an iteration ended. */
typedef enum flesh_iteration_end {
  FLESH_ITERATION_STOPPED,  /* by itself: at its tolerance, or without a step */
  FLESH_ITERATION_LIMIT,    /* after the largest number of iterations */
  FLESH_ITERATION_UNDEFINED /* the residual has no value, and shorter steps did not help */
} flesh_iteration_end;

/* The solve of a stage. Its owner makes the iterations: while flesh_stage_begin or flesh_stage_continue says so, the owner
 * iterates from u until the residual's 2-norm is at most `target`, or its iteration ends otherwise. */
typedef struct flesh_stage_solve {
  flesh_newton *newton;
  flesh_solve_stats *stats; /* borrowed */
  double *u;                /* [n] the owner's; the last iterate, and finally the solution */
  double target;            /* N, target of the iterations that are wanted */
  int status;               /* status of all iterations so far */
  int begun;                /* the first iterate has a residual and a load */
  double first, last_target; /* N, residual of the first iterate, and target of the whole solve */
  int freezes;              /* 1: effects freeze at the solution */
  int frozen;               /* number of freezes for this target */
  int newtons, unsolved;    /* counts of the statistics at the last freeze */
} flesh_stage_solve;

/* Sets the stage, and u to 0 or to the one of `guesses` (each [n]; ended by NULL; may be NULL) with the lowest potential,
 * if that is lower. Returns whether iterations are wanted. */
int flesh_stage_begin(flesh_newton *newton, const flesh_stage *stage, const double *const *guesses, double *u,
                      flesh_solve_stats *stats, flesh_stage_solve *solve);
/* Takes the result of the owner's iterations: their status, which ends the solve unless it is FLESH_OK, and how they ended.
 * Returns whether more iterations are wanted. */
int flesh_stage_continue(flesh_stage_solve *solve, int status, flesh_iteration_end end);
/* Adds the counts of the solve to the statistics. FLESH_OK; FLESH_NOT_CONVERGED; FLESH_UNDEFINED or FLESH_NONFINITE where
 * the start has no residual. */
int flesh_stage_end(flesh_stage_solve *solve);
/* Whether a solve still makes progress at u [n]: the iterations since the potential was *reached (NAN: the first) account
 * for at least a tenth of its decrease so far. A restart with half the step would lose that decrease. */
int flesh_stage_makes_progress(flesh_newton *newton, const double *u, double *reached);
/* Adds the counts of the newton's parts to *stats. */
void flesh_stage_count(const flesh_newton *newton, flesh_solve_stats *stats);

#endif
