/* clearance.h: distance of a run's body from obstacles, measured now and then and kept from step to step, and whether its
 * surfaces are far from each other: an effect is not evaluated until body and obstacle have moved by that distance. Belongs
 * to a run; the effects are const. */
#ifndef FLESH_SYSTEM_CLEARANCE_H
#define FLESH_SYSTEM_CLEARANCE_H

#include "base/archive.h"
#include "flesh/system.h"
#include "system/effect_view.h"

/* A node's displacement is at most sqrt(3) times the maximum norm of its dofs. */
struct flesh_clearance {
  const flesh_system *system;       /* borrowed */
  flesh_threads *threads;           /* borrowed, may be NULL */
  const flesh_proximity *proximity; /* borrowed, of the same run */
  int n, effects;
  int measures; /* 1: some effect has a clearance */
  int known;
  /* The last measurement: time, positions, and distance of the body beyond each effect's reach, m; 0: none, or unknown. */
  double t, *x /* [n] */, low[3], high[3], *free /* [effects] */;
  /* How much of `free` is left at the start of the stage for motion of nodes, m. */
  double *left, least_left; /* [effects]; the least of the effects that limit steps */
  /* Largest displacement of a node from the start of the stage, m: at the present point, and at any point of the stage. */
  double moved, moved_most;
  /* Whether the surfaces that a run remembers are far from each other: at the start of the stage, at all points of it that
   * were asked for, and at the present point. */
  int begins_far, stays_far, is_far;
  double *u; /* [n] unknowns asked for last, */
  int u_known, u_far; /* and the answer */
};
typedef struct flesh_clearance flesh_clearance;

/* Makes room for the measurements; allocates nothing if no effect of the finalized system has a clearance or a cache: then
 * nothing is ever clear. FLESH_ERR_MEMORY. */
int flesh_clearance_create(const flesh_system *system, flesh_threads *threads, const flesh_proximity *proximity,
                           flesh_clearance *clearance);
void flesh_clearance_clear(flesh_clearance *clearance);
/* Drops the measurements. */
void flesh_clearance_forget(flesh_clearance *clearance);
void flesh_clearance_archive(flesh_clearance *clearance, flesh_archive *archive);

/* Starts a stage at t that begins at x0 [n] with the lagged state x_lag [n] at t_lag; steps to it lead from x_from [n].
 * Looks again, at the lagged state, if half of an effect's clearance is used up. */
void flesh_clearance_begin(flesh_clearance *clearance, double t, const double *x0, double t_lag, const double *x_lag,
                           const double *x_from);

/* Whether surfaces are far from each other at x0 + shift u, with the stage's x0 [n] and shift; 0 where u is NULL.
 * Collective: all ranks return the same. */
int flesh_clearance_is_far(flesh_clearance *clearance, const double *x0, double shift, const double *u);

/* Returns an upper bound of a node's displacement, m, if dofs change by u [n] times `shift`; INFINITY where a number is not
 * finite, 0 if no effect has a clearance. */
double flesh_clearance_moved(const flesh_clearance *clearance, double shift, const double *u);
/* Whether effect k is too far away to act at the present point. */
static inline int flesh_clearance_holds(const flesh_clearance *clearance, int k)
{
  return clearance && clearance->free &&
         (flesh_proximity_of(clearance->proximity, k) ? clearance->is_far : clearance->moved < clearance->left[k]);
}

#endif
