/* line_search.h: scales a direction so that the incremental potential falls. It has the only rule for accepting steps, and
 * measures how well the quadratic model predicted the accepted one. */
#ifndef FLESH_NEWTON_LINE_SEARCH_H
#define FLESH_NEWTON_LINE_SEARCH_H

#include "newton/direction.h"

/* Armijo's constant of sufficient decrease; Nocedal & Wright 2006, section 3.1. */
static const double flesh_armijo = 1e-4;
/* A step was too short if the potential fell by more than this multiple of the quadratic model's prediction. */
static const double flesh_short_gain = 1.2;

/* A step in the making. The search fills in the fields below the direction's kind. */
typedef struct flesh_step {
  const double *u, *b; /* [n] the iterate; the residual there is -b */
  double *p;           /* [n] the direction, then the step */
  flesh_direction_kind kind;
  double start, value;      /* J, potentials at u and at u + p */
  double length;            /* length of p as a multiple of the direction */
  double cut;               /* length relative to the first try; 1 if the step was not cut, or lengthened */
  double predicted, actual; /* J, decrease at the quadratic model's minimum along p, and actual decrease at u + p */
  double model_ratio;       /* actual over predicted decrease by the true Hessian; NaN: not measured */
  int too_short_locally;    /* the step lowered the potential more than predicted, and few nodes carry the residual */
  int unpredicted;          /* the quadratic model did not predict the result */
} flesh_step;

/* The search of a stage; all but `equations` begins anew with each stage. */
typedef struct flesh_search {
  flesh_equations *equations; /* borrowed */
  double first_potential; /* J, potential at the first iterate; NaN before */
  double gain;            /* J, decrease of the potential by the last step; 0: there was none */
  int shortened;          /* 1: the last step accepted was not its first try */
  int steps, stalls;      /* number of accepted steps; 1: they make no progress because bodies touch */
  double asked_potential; /* J, potential when progress was last judged */
  int short_filtered;     /* number of the last accepted steps in a row that were filtered, whole and too short */
} flesh_search;

/* Scales the direction so that the potential falls (Armijo, with the approximate Wolfe condition of Hager & Zhang 2005
 * where round-off dominates). FLESH_OK; FLESH_NOT_POSITIVE if the direction does not descend; FLESH_NOT_CONVERGED if no
 * length is accepted. */
int flesh_search_run(flesh_search *search, flesh_step *step);

/* Whether the stage's last step, which led to u [n], has lowered the potential by more than its round-off. */
int flesh_search_makes_progress(flesh_search *search, const double *u);

/* Computes at = u + scale p [n], rounded as KINSOL rounds it once p is scaled (without fused multiply-add): results cached
 * for the accepted iterate then hold for KINSOL's next one. */
void flesh_step_to(const flesh_equations *equations, const double *u, double scale, const double *p, double *at);

/* Whether few nodes carry the residual r [n]: its participation ratio, which is 1 if all carry the same, is below 0.01.
 * Overwrites the equations' scratch. */
int flesh_is_local(const flesh_equations *equations, const double *r);

#endif
