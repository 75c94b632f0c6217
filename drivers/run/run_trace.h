/* run_trace.h: what is kept of every step of a run, and what it says at the run's end. */
#ifndef FLESH_RUN_RUN_TRACE_H
#define FLESH_RUN_RUN_TRACE_H

#include <stddef.h>

#include "flesh/observer.h"
#include "flesh/scene.h"

typedef struct flesh_run_trace_row {
  double t, kinetic, strain; /* s, J, J relative to the mesh's rest shape */
  long newton, linear, cuts; /* iterations, and attempts at parts of the step that were thrown away */
  long step;                 /* 0: the start */
} flesh_run_trace_row;

/* Zero-initialise. */
typedef struct flesh_run_trace {
  int count, room;
  flesh_run_trace_row *rows;
} flesh_run_trace;

int flesh_run_trace_observe(void *trace, const flesh_step_record *record);
void flesh_run_trace_clear(flesh_run_trace *trace);

/* A step that takes more than so many times the median is told. */
#define FLESH_LONG_STEP 100

/* The step whose iterations exceed the median step's most: Newton's, or Newton's and the linear ones together, of halved
 * steps and after untangling too. Medians are of the finished steps that took any. */
typedef struct flesh_longest_step {
  long step;   /* from 1; 0: nothing was iterated, or there is no median */
  double t;    /* s, at its end; NaN: it was not finished */
  long newton, linear, cuts;
  double ratio; /* the larger of both; NaN where fewer than three steps iterated */
} flesh_longest_step;

/* `newton`, `linear`: iterations of a step that ended the run, 0 where there is none. */
flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long newton, long linear);
/* "step 7 (to t = 0.1 s) took ..." where it is long, else "". Returns whether it is. */
int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words);

/* The strain energy, J above that of a free body at rest, of a state in which the body rests without being held: its
 * kinetic energy has been below 1e-4 of it and it has changed by less than a thousandth over the last tenth of the
 * motion (five steps at least; an equilibrium rests), its nodes balance, and neither loads nor obstacles nor displaced
 * constraints act on it. 0 where that is not so, and where its material has no rest. */
double flesh_stressed_rest(const flesh_scene *scene, const flesh_run_trace *trace, const flesh_state *state);

#endif
