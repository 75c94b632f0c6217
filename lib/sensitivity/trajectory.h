/* trajectory.h: a recorded motion: for each part of a step, its beginning and the unknowns that solved its stages. Parts
 * for which there is no room are repeated by the integrator from checkpoints, with the same bits: at the beginning of each
 * block of parts its solvers forget what they have learned, so that little needs to be saved. */
#ifndef FLESH_SENSITIVITY_TRAJECTORY_H
#define FLESH_SENSITIVITY_TRAJECTORY_H

#include "sensitivity/checkpoints.h"
#include "sensitivity/method_map.h"
#include "sensitivity/stage_tangent.h"
#include "time/integrator.h"

/* Number of parts in a group, whose first one keeps its known vectors. */
enum { FLESH_GROUP = 8 };
/* Number of vectors [n] in a pass over the motion (pass.h). */
enum { FLESH_PASS_ARRAYS = 17 + 2 * FLESH_KNOWN + FLESH_MAP_STAGES };

/* A solve of a stage. */
typedef struct flesh_recorded_solve {
  flesh_stage stage; /* without its arrays */
  int at, has_v0;    /* number of the stage; 1: it has a v0 */
  double *u;         /* [n] */
  double *multipliers; /* NULL: none */
} flesh_recorded_solve;

typedef struct flesh_recorded_part {
  flesh_taken_part taken;     /* row, own, second, acceleration, anew, begin, end, h; the pointers are not kept */
  flesh_method_memory memory; /* without its arrays */
  int vectors;                /* number of vectors that last from step to step */
  double t, t_lag;
  int opens;                  /* 1: it is the first part of a call of flesh_integrator_step */
  double *known[FLESH_KNOWN]; /* [n] each; NULL: 0, or not read by a stage; NULL lagged ones: the state's own */
  int follows;                /* 1: they are computed from the part before, and not kept */
  unsigned reads;             /* bits of those that a stage reads */
  double *internal;           /* NULL: none */
  double *jump;               /* [2*n] jump of x and v before the part; NULL: none */
  int count;
  flesh_recorded_solve *solves; /* [count] */
  size_t bytes;
} flesh_recorded_part;

/* A call of flesh_integrator_step. */
typedef struct flesh_recorded_call {
  double t, h; /* s */
} flesh_recorded_call;

/* Progress of the integrator, in the run or in its repetition. */
typedef struct flesh_pass {
  int at, call;   /* number of parts taken; number of the current call */
  int block;      /* part at which the last block has begun; -1: none has */
  int blocks;     /* number of blocks that have begun */
  int last, next; /* in a repetition: the block that is wanted, and the next one at which to save, -1: none */
  int limit;      /* part at which a repetition stops; -1: the integrator takes new steps */
  int opens;      /* 1: a call has begun, and no part of it has been taken */
  int started;    /* 1: the last part is one with which the method begins, and no other has followed */
  size_t bytes;   /* bytes of the parts of the block so far */
} flesh_pass;

/* Called with a part and its known vectors. */
typedef int (*flesh_part_visit)(void *data, const flesh_recorded_part *part);

struct flesh_trajectory {
  flesh_integrator *integrator; /* borrowed; NULL: it is gone */
  const flesh_system *system;
  int n;
  flesh_tape tape;
  size_t budget;            /* bytes */
  int total;                /* parts */
  int first, count, room;   /* first and number of the parts that are kept */
  flesh_recorded_part *parts;
  flesh_recorded_part next; /* part of the present try, with its solves */
  double *internal;         /* internal variables after the last part; NULL: none */
  double *reached[FLESH_KNOWN]; /* [n] known vectors after the last part, computed from the parts before; NULL: not known */
  double *found[FLESH_KNOWN]; /* [n] the same for the part that was asked for last */
  flesh_recorded_part view;   /* that part, with borrowed arrays */
  int block_count, block_room;
  int *blocks;              /* [block_count] parts at which the run's blocks have begun */
  size_t kept, block_bytes; /* bytes of the parts that are kept; largest bytes of the parts of a block */
  size_t most;              /* largest number of bytes held at the same time */
  int repeated;             /* number of parts that were repeated */
  int call_count, call_room;
  flesh_recorded_call *calls;
  flesh_checkpoints checkpoints;
  flesh_pass now;
  void *aside;              /* [aside_bytes] the integrator at the run's end while it repeats parts; NULL: it is there */
  size_t aside_bytes;
  flesh_pass run;           /* progress of the run, meanwhile, like the next */
  double *run_reached[FLESH_KNOWN];
  flesh_stage_tangent tangent;
  flesh_prescribed prescribed;
  flesh_part_visit visit;   /* called with parts that are repeated, and visit_data; NULL: none */
  void *visit_data;
  double *vectors, *bases;  /* work space: [FLESH_PASS_ARRAYS*n]; [3*n] */
};

/* Makes the stage of a solve, with x0, v0 and a0 [n] and the lagged state in `room` [5*n]. */
void flesh_trajectory_stage(flesh_trajectory *trajectory, const flesh_recorded_part *part, const flesh_method_map *map,
                            int solve, double *room, flesh_stage *stage);
/* Returns the bytes of x and v. */
static inline size_t flesh_trajectory_state(const flesh_trajectory *trajectory)
{
  return 2 * (size_t)trajectory->n * sizeof(double);
}
/* Checks that steps are recorded. FLESH_ERR_ARGUMENT. */
int flesh_trajectory_check(const flesh_trajectory *trajectory);
/* Frees the kept parts before `first`. */
void flesh_trajectory_forget(flesh_trajectory *trajectory, int first);
/* Whether the current part is only passed, on the way to a block that is wanted. */
static inline int flesh_trajectory_passes(const flesh_trajectory *trajectory)
{
  const flesh_pass *now = &trajectory->now;
  return now->limit >= 0 && now->at < trajectory->blocks[now->last];
}
/* Drops the last part if the method has begun with it and its step has failed afterwards, which restores the state. */
void flesh_trajectory_drop_start(flesh_trajectory *trajectory);
/* Counts the bytes that are held. */
void flesh_trajectory_count(flesh_trajectory *trajectory);

/* flesh_tape.pass. */
int flesh_trajectory_pass(void *data, const flesh_step_place *place);
/* Gives part k, from 0 on, until the next call. If it is not kept, it is repeated with those before it.
 * FLESH_ERR_ARGUMENT if the integrator is gone; FLESH_ERR_MEMORY, and the errors of its steps. */
int flesh_trajectory_part(flesh_trajectory *trajectory, int k, const flesh_recorded_part **part);
/* Visits all parts from the first one on, and repeats those that are not kept. Returns the errors of flesh_trajectory_part,
 * and those of `visit`, which end it. */
int flesh_trajectory_visit(flesh_trajectory *trajectory, flesh_part_visit visit, void *data);
/* Restores the integrator at the run's end. */
int flesh_trajectory_return(flesh_trajectory *trajectory);

/* Copies `count` numbers; NULL if there is no memory, or nothing to copy. */
double *flesh_trajectory_copy(const double *from, int count);
void flesh_known_clear(double **known);
/* Records the beginning of the part, unless it follows from the part before. FLESH_ERR_MEMORY. */
int flesh_trajectory_take_known(flesh_trajectory *trajectory, const flesh_taken_part *taken, flesh_recorded_part *part);
/* Advances the known vectors from the part's beginning to its end, and drops those that depend on unknown ones. */
void flesh_known_go_on(flesh_trajectory *trajectory, const flesh_recorded_part *part, double **known);
/* Gives in *found a part that is kept, with its known vectors, until the next call. FLESH_ERR_MEMORY. */
int flesh_trajectory_find_known(flesh_trajectory *trajectory, const flesh_recorded_part *part,
                                const flesh_recorded_part **found);

/* Finds the method's map for a part. */
void flesh_trajectory_map(const flesh_recorded_part *part, flesh_method_map *map);

#endif
