/* trajectory.h: a recorded motion: of each part of a step where it began, and the unknowns that solved its stages. */
#ifndef FLESH_SENSITIVITY_TRAJECTORY_H
#define FLESH_SENSITIVITY_TRAJECTORY_H

#include "sensitivity/method_map.h"
#include "sensitivity/stage_tangent.h"
#include "time/integrator.h"

/* A solve of a stage. */
typedef struct flesh_recorded_solve {
  flesh_stage stage; /* without its arrays */
  int at, has_v0;    /* the stage's number; it has a v0 */
  double *u;         /* [n] */
  double *multipliers; /* NULL: none */
} flesh_recorded_solve;

typedef struct flesh_recorded_part {
  flesh_taken_part taken;     /* row, own, second, acceleration, anew, begin, end, h; the pointers are not kept */
  flesh_method_memory memory; /* without its arrays */
  int vectors;                /* that last from step to step */
  double t, t_lag;
  double *known[FLESH_KNOWN]; /* [n] each; NULL: 0, and lagged ones: the state's own */
  double *internal;           /* NULL: none */
  int count;
  flesh_recorded_solve *solves; /* [count] */
} flesh_recorded_part;

struct flesh_trajectory {
  flesh_integrator *integrator; /* borrowed; NULL: it is gone */
  const flesh_system *system;
  int n;
  flesh_tape tape;
  int count, room;
  flesh_recorded_part *parts;
  flesh_recorded_part next; /* its solves, of the try under way */
  flesh_state end;          /* x and v after the last part */
  flesh_stage_tangent tangent;
  flesh_prescribed prescribed;
  double *vectors;          /* room */
};

/* The stage of a solve, with x0, v0 and a0 [n] and the lagged state in `room` [5*n]. */
void flesh_trajectory_stage(flesh_trajectory *trajectory, const flesh_recorded_part *part, const flesh_method_map *map,
                            int solve, double *room, flesh_stage *stage);
/* How a part goes on from what is known. */
void flesh_trajectory_map(const flesh_recorded_part *part, flesh_method_map *map);

#endif
