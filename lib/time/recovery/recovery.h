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
  int in_vain;                /* steps of a tangle since softer materials have last led to where a solve began */
  flesh_failure failure;      /* of the last solve that failed */
} flesh_recovery;

/* Makes what this rank needs, without the others. Borrows the evaluation of the finished system, and the parts of its body,
 * which may be found later. FLESH_ERR_MEMORY. */
int flesh_recovery_create(const flesh_evaluation *evaluation, const flesh_rigid_parts *parts,
                          const flesh_solver_options *options, flesh_recovery *recovery);
/* Measures the body, once all ranks have made theirs. Collective; FLESH_ERR_MEMORY on this rank alone. */
int flesh_recovery_create_collective(flesh_recovery *recovery);
void flesh_recovery_clear(flesh_recovery *recovery);

/* Whether the body at x [3*n], where a step begins, may be tangled: more than one tet in 400 is inverted; or that has been
 * so (or may have been, before the first step) and some are still strained as much as what winds once more around an
 * edge. What has come there without inversion is not tangled. Collective. */
int flesh_recovery_is_tangled(flesh_recovery *recovery, const double *x);
/* Whether a step from x of such a body goes through softer materials first, which it mostly does in vain where the last did:
 * after 0, 1, 2, 4, 8, ... steps in vain. Counts it as one. Collective. */
int flesh_recovery_softens(flesh_recovery *recovery, const double *x);
/* 0; 1 where so many tets are inverted as begin a tangle; 2 where more than one in twenty is, a body in disorder. */
int flesh_recovery_is_inverted(flesh_recovery *recovery, const double *x);

/* A time span: its length stands beside its ends, whose difference is rounded. */
typedef struct flesh_span {
  double begin, end, h; /* s */
} flesh_span;

/* A span that is taken in parts, each from where the last one has led, of which those that fail are halved: a walk over
 * the binary subdivision, so that depth is bounded by max_cutbacks and work by its leaves. */
typedef struct flesh_cutbacks {
  flesh_span span, part;
  int depth;                /* how often the part has been halved */
  unsigned long long place; /* of the part, in units of the span over 2^depth */
} flesh_cutbacks;

/* The first part: the whole span. */
flesh_cutbacks flesh_cutbacks_of(flesh_span span);
/* Goes on to the next part after one that has ended with `status`: where that is > 0, and has changed nothing, to the
 * beginning of the same, halved so many times, though to no greater depth than max_cutbacks. Whether there is one: none
 * after the last, after one that failed at the greatest depth, or after a negative status. */
int flesh_cutbacks_next(flesh_cutbacks *cutbacks, int halvings, int max_cutbacks, int status);

/* An increment of a load that goes from 0 to 1. */
typedef struct flesh_load_increment {
  double from, to; /* of the load */
  double fraction; /* of the prescribed displacement from the result at `from` to the full load's */
  int depth;       /* how often the whole is halved to give its length, which the full load may cut */
} flesh_load_increment;

/* The first increment: the load's first half. */
flesh_load_increment flesh_load_increment_first(void);
/* Goes on to the next increment after one that has ended with `status`, as flesh_cutbacks_next: half as long after one
 * that failed, twice as long after others. */
int flesh_load_increment_next(flesh_load_increment *increment, int max_cutbacks, int status);

/* FLESH_ERR_SOLVE, or FLESH_ERR_NONFINITE, with the recovery's failure in words. */
int flesh_recovery_fail(const flesh_recovery *recovery);

#endif
