/* told.h: what was measured of an experiment as a linear function of its states, and derivatives of a motion by that. */
#ifndef FLESH_FIT_TOLD_H
#define FLESH_FIT_TOLD_H

#include "fit/fit.h"
#include "flesh/sensitivity.h"

typedef struct flesh_fit_told {
  const flesh_fit_experiment *e;
  int count, room;
  double *times; /* [count] s, of the states, ascending */
} flesh_fit_told;

/* Sees a measured number that is told by state s, with a weight: of `row` among those of the experiment, and of its column `c`
 * of probes, or -1: of positions. */
typedef void flesh_fit_told_see(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c);
void flesh_fit_told_visit(const flesh_fit_told *told, int s, flesh_fit_told_see *see, void *data);
int flesh_fit_told_add(flesh_fit_told *told, double t); /* FLESH_ERR_MEMORY */
/* A measured coordinate at positions x [3*nodes], and x += y times its derivative by them. */
double flesh_fit_told_position(const flesh_fit_measured *m, const flesh_fit_datum *d, const double *x);
void flesh_fit_told_give(const flesh_fit_measured *m, const flesh_fit_datum *d, double y, double *x);

/* A recorded motion of an experiment. */
typedef struct flesh_fit_motion flesh_fit_motion;
/* Runs the motion at p, which is borrowed, and records it. Returns new. The errors of runs. */
int flesh_fit_motion_create(flesh_fit *fit, int experiment, const double *p, flesh_fit_motion **motion);
void flesh_fit_motion_destroy(flesh_fit_motion **motion);
/* to [count of its measured numbers][stride], from column k on: derivatives along changes k [count][parameters] of all
 * parameters, by differences of length h [count]; of 0 no column. */
int flesh_fit_motion_along(flesh_fit_motion *motion, int count, const double *changes, const double *h, double *to);
/* gradient [tets] of the sum of y [its measured numbers] times them. */
int flesh_fit_motion_back(flesh_fit_motion *motion, const flesh_tet_parameter *parameter, const double *y, double *gradient);

#endif
