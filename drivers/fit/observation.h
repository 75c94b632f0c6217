/* observation.h: the observation operator of an experiment: its measured numbers as linear functions of its states; and
 * derivatives of a motion with it. */
#ifndef FLESH_FIT_OBSERVATION_H
#define FLESH_FIT_OBSERVATION_H

#include "fit/fit.h"
#include "flesh/sensitivity.h"

typedef struct flesh_fit_observation {
  const flesh_fit_experiment *e;
  int count, room;
  double *times; /* [count] times of the states, s, ascending; owned */
} flesh_fit_observation;

int flesh_fit_observation_add(flesh_fit_observation *observation, double t); /* FLESH_ERR_MEMORY */
/* Adds what state s contributes to the measured numbers: number i of the experiment is y[i * stride]. x [3*nodes]:
 * positions, or their changes; columns [columns of probes]: values, or their changes. */
void flesh_fit_observation_apply(const flesh_fit_observation *observation, int s, const double *x, const double *columns,
                                 double *y, int stride);
/* Adds the transposed product with y [its measured numbers] to x and columns. */
void flesh_fit_observation_transpose(const flesh_fit_observation *observation, int s, const double *y, double *x,
                                     double *columns);

/* A recorded motion of an experiment. */
typedef struct flesh_fit_motion flesh_fit_motion;
/* Runs the motion at p, which is borrowed, and records it as a new object. Fails with the errors of runs. */
int flesh_fit_motion_create(flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_fit_motion **motion);
void flesh_fit_motion_destroy(flesh_fit_motion **motion);
/* Computes to [its measured numbers][count]: derivatives along `changes` [count][parameters] of all parameters, by
 * differences of length h [count]. A column whose h is 0 stays 0. */
int flesh_fit_motion_along(flesh_fit_motion *motion, int count, const double *changes, const double *h, double *to);
/* Computes the gradient [tets] of the sum of y [its measured numbers] times the measured quantities. */
int flesh_fit_motion_back(flesh_fit_motion *motion, const flesh_tet_parameter *parameter, const double *y, double *gradient);

#endif
