/* recovery.h: decides what is tried when a solve fails or ends in a tangle: halves of a step, increments of a load,
 * untangling; and reports when all of that fails. Solves nothing: callers pass how to. */
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
  int tangled;                /* the last answer of flesh_recovery_is_tangled */
  int in_vain;                /* steps of a tangle since a solve last began where softer materials had led */
  flesh_failure failure;      /* of the last solve that failed */
} flesh_recovery;

/* Makes what this rank needs, without the others. Borrows the evaluation of the finished system, and the parts of its
 * body, which may be found later. FLESH_ERR_MEMORY. */
int flesh_recovery_create(const flesh_evaluation *evaluation, const flesh_rigid_parts *parts,
                          const flesh_solver_options *options, flesh_recovery *recovery);
/* Measures the body, once all ranks have made their own. Collective; FLESH_ERR_MEMORY on this rank alone. */
int flesh_recovery_create_collective(flesh_recovery *recovery);
void flesh_recovery_clear(flesh_recovery *recovery);

/* Returns whether the body at x [3*n], where a step begins, may be tangled: more than one tet in 400 is inverted; or
 * that was so before (or may have been, before the first step) and some tets are still strained as much as in an edge
 * that is wound once more. A body that got there without inversion is not tangled. Collective. */
int flesh_recovery_is_tangled(flesh_recovery *recovery, const double *x);
/* Returns whether a step of such a body from x goes through softer materials first: after 0, 1, 2, 4, 8, ... steps in
 * which that was in vain, as it mostly is again. Counts this step as one. Collective. */
int flesh_recovery_softens(flesh_recovery *recovery, const double *x);
/* Returns 0; 1 if as many tets are inverted as begin a tangle; 2 if more than one in twenty is, so that the body is in
 * disorder. */
int flesh_recovery_is_inverted(flesh_recovery *recovery, const double *x);

/* A span of time. Its length is stored beside its ends, because their difference has rounding. */
typedef struct flesh_span {
  double begin, end, h; /* s */
} flesh_span;

/* A span taken in parts, each from where the last one has led; parts that fail are halved. This walks over the binary
 * subdivision: max_cutbacks bounds its depth, the number of leaves its work. */
typedef struct flesh_cutbacks {
  flesh_span span, part;
  int depth;                /* how often the part has been halved */
  unsigned long long place; /* start of the part, in units of the span over 2^depth */
} flesh_cutbacks;

/* Returns the first part: the whole span. */
flesh_cutbacks flesh_cutbacks_of(flesh_span span);
/* Goes on to the next part after one that has ended with `status`. If that is > 0, and has changed nothing, the next
 * part begins at the same place and is halved so many times, to a depth of max_cutbacks at most. Returns whether there
 * is a next part: there is none after the last, after one that failed at the greatest depth, or after a negative
 * status. */
int flesh_cutbacks_next(flesh_cutbacks *cutbacks, int halvings, int max_cutbacks, int status);

/* An increment of a load that goes from 0 to 1. */
typedef struct flesh_load_increment {
  double from, to; /* of the load */
  double fraction; /* share of the prescribed displacement from the result at `from` to that at full load */
  int depth;       /* halvings of the whole load that give its length, which the full load may cut */
} flesh_load_increment;

/* Returns the first increment: the load's first half. */
flesh_load_increment flesh_load_increment_first(void);
/* Goes on to the next increment after one that has ended with `status`, as flesh_cutbacks_next does: half as long after
 * one that failed, else twice as long. */
int flesh_load_increment_next(flesh_load_increment *increment, int max_cutbacks, int status);

/* Returns FLESH_ERR_SOLVE or FLESH_ERR_NONFINITE, with a sentence about the recovery's failure. */
int flesh_recovery_fail(const flesh_recovery *recovery);

#endif
