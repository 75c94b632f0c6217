/* line_search.h: scales a direction so that the incremental potential falls. It has the only rule by which a step is
 * accepted, and measures how well the quadratic model predicted the accepted one. */
#ifndef FLESH_NEWTON_LINE_SEARCH_H
#define FLESH_NEWTON_LINE_SEARCH_H

#include "newton/direction.h"

/* Sufficient decrease of Armijo; Nocedal & Wright 2006, section 3.1. */
static const double flesh_armijo = 1e-4;
/* A step was too short where it has lowered the potential by more than so many times what its quadratic model predicts. */
static const double flesh_short_gain = 1.2;

/* A step in the making. The search fills in what stands below the direction's kind. */
typedef struct flesh_step {
  const double *u, *b; /* [n] the iterate; the residual there is -b */
  double *p;           /* [n] the direction, then the step */
  flesh_direction_kind kind;
  double start, value;      /* J, potentials at u and at u + p */
  double length;            /* as a multiple of the direction */
  double cut;               /* that over the first try; 1 where it was not cut, or lengthened */
  double predicted, actual; /* J, decrease at the quadratic model's minimum along p, and at u + p */
  double model_ratio;       /* actual over predicted decrease by the true Hessian; NaN: not measured */
  int too_short_locally;    /* it lowered the potential more than predicted, and few nodes carry the residual */
  int unpredicted;          /* the quadratic model did not predict what happened */
} flesh_step;

/* All but `equations` belongs to the stage. */
typedef struct flesh_search {
  flesh_equations *equations; /* borrowed */
  double first_potential; /* of its first iterate; NaN before */
  double gain;            /* J, by which the last step has lowered the potential; 0: there was none */
  int shortened;          /* the last accepted step was not its first try */
  int steps, stalls;      /* how many were accepted; 1: bodies that touch let them lead nowhere */
  double asked_potential; /* J, where that was asked last */
  int short_filtered;     /* how many of the last accepted steps in a row were filtered, whole and too short */
} flesh_search;

/* Scales the direction so that the potential falls (Armijo, with the approximate Wolfe condition of Hager & Zhang 2005
 * where round-off dominates). FLESH_OK; FLESH_NOT_POSITIVE where it is no descent direction; FLESH_NOT_CONVERGED where no
 * length is accepted. */
int flesh_search_run(flesh_search *search, flesh_step *step);

/* Whether the last step of the stage, which led to u [n], has lowered the potential by more than round-off moves it. */
int flesh_search_makes_progress(flesh_search *search, const double *u);

/* at = u + scale p [n], rounded as KINSOL rounds it once p is scaled (no fused product and sum): what is known of the
 * iterate that is accepted then holds for KINSOL's next one. */
void flesh_step_to(const flesh_equations *equations, const double *u, double scale, const double *p, double *at);

/* Whether few nodes carry the residual r [n]: its participation ratio, 1 where all carry the same, is below 0.01. Overwrites
 * the equations' scratch. */
int flesh_is_local(const flesh_equations *equations, const double *r);

#endif
