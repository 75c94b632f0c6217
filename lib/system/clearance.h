/* clearance.h: how far a run's body is from obstacles, measured now and then and kept from step to step, and whether its
 * surfaces are far from each other: an effect is not evaluated while body and obstacle have moved less than that.
 * Belongs to a run; the effects are const. */
#ifndef FLESH_SYSTEM_CLEARANCE_H
#define FLESH_SYSTEM_CLEARANCE_H

#include <stddef.h>

#include "base/archive.h"
#include "flesh/system.h"
#include "system/effect_view.h"

/* With the maximum norm of dofs a node's displacement is sqrt(3) times that at most. */
struct flesh_clearance {
  const flesh_system *system;       /* borrowed */
  flesh_threads *threads;           /* borrowed, may be NULL */
  const flesh_proximity *proximity; /* borrowed, of the same run */
  int n, effects;
  int measures; /* some effect has a clearance */
  int known;
  /* The last measurement: when, where, and how much farther than its reach each effect was, m; 0: not, or unknown. */
  double t, *x /* [n] */, low[3], high[3], *free /* [effects] */;
  /* How much of `free` is left at the start of the stage, by which nodes may come nearer, m. */
  double *left, least_left; /* [effects]; the least, of effects that limit steps */
  /* How far a node is from where the stage begins, at most, m: at the point at hand, and at any point of the stage. */
  double moved, moved_most;
  /* Whether the surfaces that a run remembers are far from each other: where the stage begins, at all points of it that
   * were asked for, and at the point at hand. */
  int begins_far, stays_far, is_far;
  double *u; /* [n] the unknowns asked for last, */
  int u_known, u_far; /* and what was found */
};
typedef struct flesh_clearance flesh_clearance;

/* Nothing is allocated where no effect of the finished system has a clearance or a memory: then nothing is ever clear.
 * FLESH_ERR_MEMORY. */
int flesh_clearance_create(const flesh_system *system, flesh_threads *threads, const flesh_proximity *proximity,
                           flesh_clearance *clearance);
void flesh_clearance_clear(flesh_clearance *clearance);
/* Nothing is known of how far the body is. */
void flesh_clearance_forget(flesh_clearance *clearance);
void flesh_clearance_archive(flesh_clearance *clearance, flesh_archive *archive);

/* A stage at t begins at x0 [n], its lagged state is x_lag [n] at t_lag; ways to it lead from x_from [n]. Looks again,
 * at the lagged state, where half of an effect's clearance is used up. */
void flesh_clearance_begin(flesh_clearance *clearance, double t, const double *x0, double t_lag, const double *x_lag,
                           const double *x_from);

/* Whether surfaces are far from each other at x0 + shift u, x0 [n] and shift being the stage's; not where u is NULL.
 * Collective: all ranks say the same. */
int flesh_clearance_is_far(flesh_clearance *clearance, const double *x0, double shift, const double *u);

/* How far dofs that change by u [n] times `shift` take a node at most, m; INFINITY where a number is none, 0 where no
 * effect has a clearance. */
double flesh_clearance_moved(const flesh_clearance *clearance, double shift, const double *u);
/* Whether effect k cannot be felt at the point at hand. */
static inline int flesh_clearance_holds(const flesh_clearance *clearance, int k)
{
  return clearance && clearance->free &&
         (flesh_proximity_of(clearance->proximity, k) ? clearance->is_far : clearance->moved < clearance->left[k]);
}

#endif
