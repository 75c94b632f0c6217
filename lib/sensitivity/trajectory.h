/* trajectory.h: a recorded motion: of each part of a step where it began, and the unknowns that solved its stages. Of the
 * parts that there is no room for, checkpoints are kept, from which the integrator takes them again with the same bits: at
 * the beginning of each block of parts its solvers forget what they have learned, so that little needs to be saved. */
#ifndef FLESH_SENSITIVITY_TRAJECTORY_H
#define FLESH_SENSITIVITY_TRAJECTORY_H

#include "sensitivity/checkpoints.h"
#include "sensitivity/method_map.h"
#include "sensitivity/stage_tangent.h"
#include "time/integrator.h"

/* Parts of a group, whose first one keeps what is known to it. */
enum { FLESH_GROUP = 8 };
/* Numbers of the arrays of a pass over the motion (pass.h), over n. */
enum { FLESH_PASS_ARRAYS = 17 + 2 * FLESH_KNOWN + FLESH_MAP_STAGES };

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
  int opens;                  /* it is the first of a call of flesh_integrator_step */
  double *known[FLESH_KNOWN]; /* [n] each; NULL: 0 or not read by a stage, and lagged ones: the state's own */
  int follows;                /* they are found from the part before, and are not kept */
  unsigned reads;             /* bits of those that a stage reads */
  double *internal;           /* NULL: none */
  double *jump;               /* [2*n] that of x and v before the part; NULL: none */
  int count;
  flesh_recorded_solve *solves; /* [count] */
  size_t bytes;
} flesh_recorded_part;

/* A call of flesh_integrator_step. */
typedef struct flesh_recorded_call {
  double t, h; /* s */
} flesh_recorded_call;

/* How far the integrator has come, in the run or in taking it again. */
typedef struct flesh_pass {
  int at, call;   /* parts taken; the call under way */
  int block;      /* the part at which the last block has begun; -1: none has */
  int blocks;     /* that have begun */
  int last, next; /* where steps are taken again: the block that is wanted; that which is saved next, -1: none is */
  int limit;      /* the integrator stops there; -1: it takes new steps */
  int opens;      /* a call has begun, and no part of it has been taken */
  int started;    /* the last part is one with which the method begins, and no other has followed */
  size_t bytes;   /* of the parts of the block so far */
} flesh_pass;

/* Sees a part with what is known to it. */
typedef int (*flesh_part_visit)(void *data, const flesh_recorded_part *part);

struct flesh_trajectory {
  flesh_integrator *integrator; /* borrowed; NULL: it is gone */
  const flesh_system *system;
  int n;
  flesh_tape tape;
  size_t budget;            /* bytes */
  int total;                /* parts */
  int first, count, room;   /* of those that are kept */
  flesh_recorded_part *parts;
  flesh_recorded_part next; /* its solves, of the try under way */
  double *internal;         /* after the last part; NULL: none */
  double *reached[FLESH_KNOWN]; /* [n] each, after the last part, as found from the parts before; NULL: not known */
  double *found[FLESH_KNOWN]; /* likewise, of the part that was asked for last */
  flesh_recorded_part view;   /* of that, borrowed */
  int block_count, block_room;
  int *blocks;              /* [block_count] the parts at which the run's have begun */
  size_t kept, block_bytes; /* of the parts that are kept; of those of a block, at most */
  size_t most;              /* bytes held at the same time, at most */
  int repeated;             /* parts that were taken again */
  int call_count, call_room;
  flesh_recorded_call *calls;
  flesh_checkpoints checkpoints;
  flesh_pass now;
  void *aside;              /* [aside_bytes] the integrator at the run's end while it takes parts again; NULL: it is there */
  size_t aside_bytes;
  flesh_pass run;           /* the run's, meanwhile, as is the next */
  double *run_reached[FLESH_KNOWN];
  flesh_stage_tangent tangent;
  flesh_prescribed prescribed;
  flesh_part_visit visit;   /* sees parts that are taken again, with visit_data; NULL: nobody does */
  void *visit_data;
  double *vectors, *bases;  /* room: [FLESH_PASS_ARRAYS*n]; [3*n] */
};

/* The stage of a solve, with x0, v0 and a0 [n] and the lagged state in `room` [5*n]. */
void flesh_trajectory_stage(flesh_trajectory *trajectory, const flesh_recorded_part *part, const flesh_method_map *map,
                            int solve, double *room, flesh_stage *stage);
/* Bytes of x and v. */
static inline size_t flesh_trajectory_state(const flesh_trajectory *trajectory)
{
  return 2 * (size_t)trajectory->n * sizeof(double);
}
/* FLESH_ERR_ARGUMENT where no step is recorded. */
int flesh_trajectory_check(const flesh_trajectory *trajectory);
/* Frees the kept parts before `first`. */
void flesh_trajectory_forget(flesh_trajectory *trajectory, int first);
/* Whether the part under way is only passed, on the way to a block that is wanted. */
static inline int flesh_trajectory_passes(const flesh_trajectory *trajectory)
{
  const flesh_pass *now = &trajectory->now;
  return now->limit >= 0 && now->at < trajectory->blocks[now->last];
}
/* Drops the last part if the method has begun with it and its step has failed after that, which puts the state back. */
void flesh_trajectory_drop_start(flesh_trajectory *trajectory);
/* Counts the bytes that are held. */
void flesh_trajectory_count(flesh_trajectory *trajectory);

/* flesh_tape.pass. */
int flesh_trajectory_pass(void *data, const flesh_step_place *place);
/* The part k, from 0 on, which is taken again where it is not kept, with those before it; until the next call. FLESH_ERR_ARGUMENT
 * where the integrator is gone; FLESH_ERR_MEMORY, and the errors of its steps. */
int flesh_trajectory_part(flesh_trajectory *trajectory, int k, const flesh_recorded_part **part);
/* Visits all parts from the first one on, which are taken again where they are not kept. The errors of
 * flesh_trajectory_part, and those of `visit`, which end it. */
int flesh_trajectory_visit(flesh_trajectory *trajectory, flesh_part_visit visit, void *data);
/* Brings the integrator back to the run's end. */
int flesh_trajectory_return(flesh_trajectory *trajectory);

/* A copy of numbers; NULL where there is no memory, or nothing to copy. */
double *flesh_trajectory_copy(const double *from, int count);
void flesh_known_clear(double **known);
/* Remembers where the part that is taken begins, unless it follows from the part before. FLESH_ERR_MEMORY. */
int flesh_trajectory_take_known(flesh_trajectory *trajectory, const flesh_taken_part *taken, flesh_recorded_part *part);
/* Takes what is known to a part to the part's end. Columns of `known` that do not follow from what there is are dropped. */
void flesh_known_go_on(flesh_trajectory *trajectory, const flesh_recorded_part *part, double **known);
/* The part, which is kept, with what is known to it; until the next call. FLESH_ERR_MEMORY. */
int flesh_trajectory_find_known(flesh_trajectory *trajectory, const flesh_recorded_part *part,
                                const flesh_recorded_part **found);

/* How a part goes on from what is known. */
void flesh_trajectory_map(const flesh_recorded_part *part, flesh_method_map *map);

#endif
