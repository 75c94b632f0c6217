/* runner_options.h: what a run is told beside its scene. */
#ifndef FLESH_RUN_RUNNER_OPTIONS_H
#define FLESH_RUN_RUNNER_OPTIONS_H

#include "run/checkpoint.h"
#include "run/ranks.h"

typedef struct flesh_runner_options {
  const char *out;        /* folder of the results, made when missing; NULL: none are written */
  const char *scene_path; /* for the provenance */
  const char *save_state; /* a copy of the last state; NULL: none */
  double max_seconds;     /* 0: no limit */
  double begun;           /* monotonic seconds, from which on they count; 0: from the first step */
  flesh_checkpoint_times checkpoint;
  struct flesh_checkpoint *resume; /* of `out`, from where the run goes on; NULL: it begins */
  const flesh_ranks *ranks; /* that have shared out the scene; every one runs it. NULL: one process */
  int no_frames;
  int profile; /* clocks are read around every call of an effect, and a table is printed */
  int quiet; /* no report on stdout, no progress line */
  int argc;  /* the command line, for the provenance */
  char **argv;
  int observer_count; /* called besides history and frames */
  const flesh_observer *observers;
} flesh_runner_options;

#endif
