/* longest_step.h: the step of a run that took most iterations, beside the median. */
#ifndef FLESH_RUN_LONGEST_STEP_H
#define FLESH_RUN_LONGEST_STEP_H

#include <stddef.h>

#include "run/run_trace.h"

/* A step that takes more than so many times the median is told. */
#define FLESH_LONG_STEP 200

/* The step whose iterations exceed the median step's most: Newton's, or Newton's and the linear ones together, of halved
 * steps and after untangling too. Medians are of the finished steps that took any. */
typedef struct flesh_longest_step {
  long step;   /* from 1; 0: nothing was iterated, or there is no median */
  double t;    /* s, at its end; NaN: it was not finished */
  long newton, linear;
  double ratio; /* the larger of both; NaN where fewer than three steps iterated */
} flesh_longest_step;

/* `newton`, `linear`: iterations of a step that ended the run, 0 where there is none. */
flesh_longest_step flesh_longest_step_find(const flesh_run_trace *trace, long newton, long linear);
/* "step 7 (to t = 0.1 s) took ..." where it is long, else "". Returns whether it is. */
int flesh_longest_step_tell(const flesh_longest_step *longest, size_t size, char *words);

#endif
