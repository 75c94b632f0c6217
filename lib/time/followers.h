/* followers.h: Newton's method for equilibria with loads that follow the shape, r(x; x) = 0, where a solve by its potential
 * has r(x; y) = 0 for the y that it lags. It has the whole derivative, which is not symmetric. */
#ifndef FLESH_TIME_FOLLOWERS_H
#define FLESH_TIME_FOLLOWERS_H

#include "newton/newton.h"
#include "time/mixing.h"

typedef struct flesh_followers {
  flesh_newton *newton; /* borrowed */
  flesh_point point;
  double step;          /* m, of differences */
  int contracts;        /* to first order, a solve with lagged loads halves the error of the iterate */
  flesh_mixing mixing;  /* of directions */
  double *r, *change, *moved, *back; /* [n] each, in one array */
} flesh_followers;

/* Allocates the memory; `wanted` 0: nothing. FLESH_ERR_MEMORY. */
int flesh_followers_create(flesh_newton *newton, int wanted, flesh_followers *self);
void flesh_followers_clear(flesh_followers *self);

/* Takes the state, to which the last solve has led, to where the 2-norm of the forces on free dofs is at most `target`
 * [N], or at round-off, and adds to *stats. FLESH_NOT_CONVERGED, with the state where the last step has led it, or an
 * error. On FLESH_NOT_CONVERGED `contracts` tells whether solves with lagged loads are likely to lead on. */
int flesh_followers_improve(flesh_followers *self, double target, flesh_state *state, flesh_solve_stats *stats);

#endif
