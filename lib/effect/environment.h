/* environment.h: what a point of evaluation carries beside physics: the memory and the measurements of the run. */
#ifndef FLESH_EFFECT_ENVIRONMENT_H
#define FLESH_EFFECT_ENVIRONMENT_H

#include "flesh/effect.h"

struct flesh_costs;
struct flesh_clearance;
struct flesh_proximity;

/* Everything is borrowed; a point without an environment has one of zeros. */
typedef struct flesh_environment {
  struct flesh_costs *costs; /* where the flesh_system_ functions count; NULL: nowhere */
  /* Which effects are too far from the body to act and are not evaluated; NULL: all are. */
  const struct flesh_clearance *clearance;
  /* The run's memory of nodes near each other; NULL: each finds it out at every call. */
  const struct flesh_proximity *proximity;
  /* 1: friction is as stiff as its secant to rest (geometry/slip.h), as a step of a solve has been cut. */
  int slips_to_rest;
  int tangents; /* 1: of contact, too, derivatives are those at the point, not secants to where a solve may end */
  /* [3*n] positions less those of a node, of a body so far from the origin that x lacks digits of its shape; NULL: x has them
   * all. What depends on differences of positions alone may take these. */
  const double *relative;
  double unloaded; /* the fraction of loads that follow the shape which is not on yet, as statics raise them alone */
  double past; /* s: velocities of obstacles are their means over so long, a step of statics, before the point; 0: they are not */
  int update; /* number of the matrix that is predicted for; one is left out where a solve begins */
  short starts; /* 1: steps begin at the point; velocities that jump there are those that follow, else those before */
  short within_step; /* 1: an update of internal variables is not that at a step's end, or at an event, but of a part of it */
  /* The flesh_system_ functions set the rest for the effect at hand (system/effect_view.h). */
  void *near;      /* its part of `proximity` */
  void *predicted; /* its memory of predictions (flesh_effect_private.predictions); NULL: there is none */
  /* Its sums over the ranks that share out the body (flesh_effect_ranks); NULL: there is one rank, and it finds them
   * itself. */
  const double *sums;
  /* Internal variables of all effects, in which flesh_effect_internal.update of an effect that takes bonds reads whether
   * bonds hold (flesh_bond.variable); NULL everywhere else. */
  const double *all_internal;
} flesh_environment;

/* The point's environment, never NULL. */
static inline const flesh_environment *flesh_environment_of(const flesh_point *point)
{
  static const flesh_environment none = {0};
  return point->environment ? point->environment : &none;
}

/* The part of an environment that holds for the effects of another system at the same point, too. */
static inline flesh_environment flesh_environment_elsewhere(const flesh_point *point)
{
  const flesh_environment *own = flesh_environment_of(point);
  return (flesh_environment){.starts = own->starts, .past = own->past};
}

/* Positions of which differences alone count. */
static inline const double *flesh_relative_positions(const flesh_point *point)
{
  const double *relative = flesh_environment_of(point)->relative;
  return relative ? relative : point->x;
}

#endif
