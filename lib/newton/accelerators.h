/* accelerators.h: techniques that take an accepted Newton step further. Each proposes another step, which is taken only
 * where its potential is lower than that of the accepted one. */
#ifndef FLESH_NEWTON_ACCELERATORS_H
#define FLESH_NEWTON_ACCELERATORS_H

#include "newton/line_search.h"

/* Services of the iteration that accelerators work for. */
typedef struct flesh_accelerator_services {
  void *data;
  /* The Newton step q [n] from u, where the residual is -b of the given norm: with a matrix assembled there, filtered
   * where it must be, and unscaled. It counts as a Newton iteration. Another matrix is then K. */
  int (*newton_step)(void *data, const double *u, const double *b, double norm, double *q);
  /* Minimises the stage's potential over the few nodes that carry the residual r at u, all others constrained: w [n], so
   * that u + w has less of it as far as a model shows. FLESH_NOT_CONVERGED where they are no small part of the body. */
  int (*solve_subdomain)(void *data, const double *u, const double *r, double *w);
} flesh_accelerator_services;

/* The step that the line search accepted, or an accelerator after that. */
typedef struct flesh_accepted_step {
  const double *u, *r; /* [n] the iterate and its residual */
  const double *p;     /* [n] the step */
  double start, value; /* J, potentials at u and u + p */
  double cut;          /* its length over that of the first try; 1: it was not cut */
  flesh_direction_kind kind;
  int unpredicted; /* the quadratic model did not predict it */
} flesh_accepted_step;

typedef struct flesh_accelerators {
  flesh_equations *equations;          /* borrowed */
  const flesh_solver_options *options; /* borrowed */
  flesh_solve_stats *stats;            /* borrowed */
  flesh_accelerator_services services;
  double *proposal, *trial; /* [n] */
  double *work;             /* [2*n] of a proposal in the making */
  /* The watchdog's memory in a stage: steps cut so far, cuts to let pass before the next try and after the next that
   * fails, and how long the next one may be (2-norm; 0: not known). */
  struct {
    int cuts, pause, next_pause;
    double length;
  } watchdog;
} flesh_accelerators;

/* The watchdog (watchdog.c): writes a step from step->u to accelerators->proposal. Whether there is one. */
int flesh_watchdog_propose(flesh_accelerators *accelerators, const flesh_accepted_step *step);
/* Tells it whether the proposal was taken. */
void flesh_watchdog_learn(flesh_accelerators *accelerators, int taken);

/* Services may lack functions, and then what needs them is not there. FLESH_ERR_MEMORY. */
int flesh_accelerators_init(flesh_equations *equations, const flesh_solver_options *options, flesh_solve_stats *stats,
                            const flesh_accelerator_services *services, flesh_accelerators *accelerators);
void flesh_accelerators_clear(flesh_accelerators *accelerators);
size_t flesh_accelerators_memory(const flesh_accelerators *accelerators);
void flesh_accelerators_begin_stage(flesh_accelerators *accelerators);

/* Takes p [n], the step described, to where accelerators get it. */
void flesh_accelerators_run(flesh_accelerators *accelerators, flesh_accepted_step step, double *p);

#endif
