/* environment.h: what a point of evaluation carries besides the physics: memory, measurements and modes of the run. */
#ifndef FLESH_EFFECT_ENVIRONMENT_H
#define FLESH_EFFECT_ENVIRONMENT_H

#include "flesh/effect.h"

struct flesh_costs;
struct flesh_clearance;
struct flesh_proximity;

/* All pointers are borrowed. A point without an environment has one of zeros. */
typedef struct flesh_environment {
  struct flesh_costs *costs; /* counters of the flesh_system_ functions; NULL: nothing is counted */
  /* Tells which effects are too far from the body to act and need not be evaluated; NULL: all are evaluated. */
  const struct flesh_clearance *clearance;
  /* The run's cache of features near each other; NULL: every call finds them again. */
  const struct flesh_proximity *proximity;
  int tangents; /* 1: derivatives of contact are true tangents too, not secants to where a solve may end */
  /* [3*n] positions relative to a node, for a body so far from the origin that x lacks digits of its shape; NULL: x is
   * exact enough. Effects that depend only on differences of positions may use these. */
  const double *relative;
  double unloaded; /* fraction of the follower loads that is not applied yet, because statics raise them separately */
  double past; /* s: velocities of obstacles are means over this time before the point (a step of statics); 0: they are
                * not averaged */
  int update; /* number of the matrix that forces are predicted for; one number is skipped where a solve begins */
  short starts; /* 1: a step starts at the point, so velocities that jump there take the value after the jump, else the
                 * value before */
  short within_step; /* 1: internal variables are updated within a step, not at its end or at an event */
  /* The members below are set by the flesh_system_ functions for each effect (system/effect_view.h). */
  void *near;      /* the effect's part of `proximity` */
  void *predicted; /* memory for the effect's predictions (flesh_effect_private.predictions); NULL: none */
  /* Sums over the ranks that share the body (flesh_effect_ranks); NULL: there is one rank and the effect computes
   * them. */
  const double *sums;
  /* Internal variables of all effects. flesh_effect_internal.update of an effect that takes bonds reads from them
   * whether bonds hold (flesh_bond.variable); NULL everywhere else. */
  const double *all_internal;
} flesh_environment;

/* Returns the point's environment, never NULL. */
static inline const flesh_environment *flesh_environment_of(const flesh_point *point)
{
  static const flesh_environment none = {0};
  return point->environment ? point->environment : &none;
}

/* Returns the part of the environment that also applies to effects of another system at the same point. */
static inline flesh_environment flesh_environment_elsewhere(const flesh_point *point)
{
  const flesh_environment *own = flesh_environment_of(point);
  return (flesh_environment){.starts = own->starts, .past = own->past};
}

/* Returns positions for effects that depend only on their differences. */
static inline const double *flesh_relative_positions(const flesh_point *point)
{
  const double *relative = flesh_environment_of(point)->relative;
  return relative ? relative : point->x;
}

#endif
