/* longest_step.h: the step of a run that took most iterations, beside the median. */
#ifndef FLESH_SHARED_LONGEST_STEP_H
#define FLESH_SHARED_LONGEST_STEP_H

#include <stddef.h>

#include "shared/run_trace.h"

/* A step that takes more than so many times the median is told. */
#define FLESH_LONG_STEP 200

/* Iterations are those of Newton and the linear ones together, of halved steps and after untangling too. */
typedef struct flesh_longest_step {
  long step;       /* from 1; 0: nothing was iterated */
  double t;        /* s, at its end; NaN: it was not finished */
  long iterations;
  double median;   /* of the finished steps that took any */
  double ratio;    /* NaN where fewer than three steps did */
} flesh_longest_step;

/* `unfinished`: iterations of a step that ended the run, 0 where there is none. */
flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long unfinished);
/* "step 7 (t = 0.1 s) took ..." where it is long, else nothing. Returns whether it is. */
int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words);

#endif
