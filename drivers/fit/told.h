/* told.h: the measured numbers of an experiment as linear functions of its states, and derivatives of a motion with
 * them. */
#ifndef FLESH_FIT_TOLD_H
#define FLESH_FIT_TOLD_H

#include "fit/fit.h"
#include "flesh/sensitivity.h"

typedef struct flesh_fit_told {
  const flesh_fit_experiment *e;
  int count, room;
  double *times; /* [count] times of the states, s, ascending */
} flesh_fit_told;

/* Receives a measured number to which state s contributes with a weight: number `row` of the experiment, from column
 * `c` of probes, or from positions if c is -1. */
typedef void flesh_fit_told_see(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c);
void flesh_fit_told_visit(const flesh_fit_told *told, int s, flesh_fit_told_see *see, void *data);
int flesh_fit_told_add(flesh_fit_told *told, double t); /* FLESH_ERR_MEMORY */
/* Returns a measured coordinate at positions x [3*nodes]; adds y times its derivative by the positions to x. */
double flesh_fit_told_position(const flesh_fit_measured *m, const flesh_fit_datum *d, const double *x);
void flesh_fit_told_give(const flesh_fit_measured *m, const flesh_fit_datum *d, double y, double *x);

/* A recorded motion of an experiment. */
typedef struct flesh_fit_motion flesh_fit_motion;
/* Runs the motion at p, which is borrowed, and records it as a new object. Fails with the errors of runs. */
int flesh_fit_motion_create(flesh_fit *fit, int experiment, const double *p, flesh_fit_motion **motion);
void flesh_fit_motion_destroy(flesh_fit_motion **motion);
/* Computes to [its measured numbers][count]: derivatives along `changes` [count][parameters] of all parameters, by
 * differences of length h [count]. A column whose h is 0 stays 0. */
int flesh_fit_motion_along(flesh_fit_motion *motion, int count, const double *changes, const double *h, double *to);
/* Computes the gradient [tets] of the sum of y [its measured numbers] times the measured quantities. */
int flesh_fit_motion_back(flesh_fit_motion *motion, const flesh_tet_parameter *parameter, const double *y, double *gradient);

#endif
