/* runner_options.h: how a scene is to be run, beside what the scene says. */
#ifndef FLESH_RUN_RUNNER_OPTIONS_H
#define FLESH_RUN_RUNNER_OPTIONS_H

#include "run/checkpoint.h"
#include "run/ranks.h"

typedef struct flesh_runner_options {
  const char *out;        /* folder of the results, made if it does not exist; NULL: no results are written */
  const char *scene_path; /* for the provenance */
  const char *save_state; /* file for a copy of the last state; NULL: none */
  double max_seconds;     /* budget; 0: no limit */
  double begun;           /* monotonic seconds from which the budget counts; 0: from the first step */
  flesh_checkpoint_times checkpoint;
  struct flesh_checkpoint *resume; /* checkpoint in `out` from which the run resumes; NULL: it starts */
  const flesh_ranks *ranks; /* ranks that have shared out the scene; each of them runs it. NULL: one process */
  int no_frames;
  int profile; /* measure the time of every call of an effect, and print a table */
  int quiet; /* print no report on stdout and no line of progress */
  int argc;  /* the command line, for the provenance */
  char **argv;
  int observer_count; /* called in addition to history and frames */
  const flesh_observer *observers;
} flesh_runner_options;

#endif
