/* run_trace.h: records every step of a run; what the record tells at the run's end. */
#ifndef FLESH_RUN_RUN_TRACE_H
#define FLESH_RUN_RUN_TRACE_H

#include <stddef.h>

#include "flesh/observer.h"
#include "flesh/scene.h"

typedef struct flesh_run_trace_row {
  double t, kinetic, strain; /* s; J; J relative to the mesh's rest shape */
  long newton, linear, cuts; /* iterations; rejected attempts at parts of the step */
  long step;                 /* 0: the start */
} flesh_run_trace_row;

/* Zero-initialise. */
typedef struct flesh_run_trace {
  int count, room;
  flesh_run_trace_row *rows;
} flesh_run_trace;

int flesh_run_trace_observe(void *trace, const flesh_step_record *record);
void flesh_run_trace_clear(flesh_run_trace *trace);

/* A step that takes more than this many times the median is reported. */
#define FLESH_LONG_STEP 100

/* The step whose iterations exceed the median step's by the largest factor: Newton iterations, or Newton and linear
 * ones together, those of halved steps and after untangling included. The medians are over the finished steps that
 * iterated. */
typedef struct flesh_longest_step {
  long step;   /* counted from 1; 0: no step iterated, or there is no median */
  double t;    /* s, at the step's end; NaN: the step was not finished */
  long newton, linear, cuts;
  double ratio; /* the larger of the two factors; NaN if fewer than three steps iterated */
} flesh_longest_step;

/* Finds the longest step. `newton`, `linear`: iterations of a step that ended the run, 0 if there is none. */
flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long newton, long linear);
/* Prints "step 7 (to t = 0.1 s) took ..." into `words` if the step is long, else "". Returns whether it is. */
int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words);

/* Returns the strain energy, J above that of a free body at rest, of a state in which the body rests without being held
 * by loads: its kinetic energy has been below 1e-4 of that energy, which has changed by less than a thousandth over the
 * last tenth of the motion (five steps at least; an equilibrium rests), its nodes balance, and neither loads nor
 * obstacles nor displaced constraints act on it. Returns 0 if that is not so, and if the material has no state at
 * rest. */
double flesh_stressed_rest(const flesh_scene *scene, const flesh_run_trace *trace, const flesh_state *state);

#endif
