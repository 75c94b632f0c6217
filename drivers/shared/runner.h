/* runner.h: a scene run into a folder: what `flesh run` does and sweeps do many times. */
#ifndef FLESH_SHARED_RUNNER_H
#define FLESH_SHARED_RUNNER_H

#include "shared/result.h"

typedef struct flesh_runner_options {
  const char *out;        /* folder of the results, made when missing; NULL: none are written */
  const char *scene_path; /* for the provenance */
  const char *save_state; /* a copy of the last state; NULL: none */
  double max_seconds;     /* 0: no limit */
  int no_frames;
  int profile; /* clocks are read around every call of an effect, and a table is printed */
  int quiet; /* no report on stdout, no progress line */
  int argc;  /* the command line, for the provenance */
  char **argv;
  int observer_count; /* called besides history and frames */
  const flesh_observer *observers;
} flesh_runner_options;

/* Runs the scene to its end, or until a signal (see interrupt.h) or the budget. In `out`:
 * history.csv, scene.yaml, state.txt (the last good state), result.json, frames/. What an older run
 * left there is replaced; FLESH_ERR_FILE or FLESH_ERR_ARGUMENT, and nothing is touched, where another
 * process has the folder, or where what is there is read by this run or was written by no run. A run
 * that fails keeps what was done and is described by *outcome, whose status is also returned.
 * `figures` is closed by the caller. */
int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome);

#endif
