/* prescribed.h: the motion of constrained dofs over one smooth piece of time. */
#ifndef FLESH_TIME_PRESCRIBED_H
#define FLESH_TIME_PRESCRIBED_H

#include "flesh/kinsol.h"

enum { FLESH_PRESCRIBED_POINTS = 4 };

/* Positions at equally spaced times; velocities and accelerations are those of the cubic through them, exact to
 * O(h^3) and O(h^2). */
typedef struct flesh_prescribed {
  const flesh_system *system;
  int n;
  uint8_t *fixed;                      /* [n] */
  double *x[FLESH_PRESCRIBED_POINTS];  /* [n] */
  double *now;                         /* [n] positions at the stage */
  double begin, end, h;
} flesh_prescribed;

int flesh_prescribed_create(const flesh_system *system, flesh_prescribed *prescribed);
void flesh_prescribed_clear(flesh_prescribed *prescribed);

/* Prepares begin <= t <= end, both within the piece; nodes that nothing prescribes and no tet uses stay at x [n]. */
void flesh_prescribed_set(flesh_prescribed *prescribed, double begin, double end, const double *x);

/* Writes their velocity and acceleration at `begin` into the constrained dofs of v and a [n]. */
void flesh_prescribed_begin(const flesh_prescribed *prescribed, double *v, double *a);

/* Changes v0 and a0 [n], the stage's base, so that the constrained dofs have the prescribed velocity and
 * acceleration at the stage's time. */
void flesh_prescribed_stage(flesh_prescribed *prescribed, const flesh_stage *stage, double *v0, double *a0);

/* Writes their positions, velocities and accelerations at t, within the span, into the constrained dofs of x, v and a
 * [n]. */
void flesh_prescribed_at(flesh_prescribed *prescribed, double t, double *x, double *v, double *a);

/* Gives the constrained dofs of the state the prescribed positions and velocities at the end. */
void flesh_prescribed_finish(const flesh_prescribed *prescribed, double *x, double *v);

#endif
