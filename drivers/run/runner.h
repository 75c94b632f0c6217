/* runner.h: runs a scene into a folder, as `flesh run` does once and sweeps do many times. */
#ifndef FLESH_RUN_RUNNER_H
#define FLESH_RUN_RUNNER_H

#include "run/checkpoint.h"
#include "run/ranks.h"

/* How a scene is to be run, beside what the scene says. */
typedef struct flesh_runner_options {
  const char *out;        /* folder of the results, made if it does not exist; NULL: no results are written */
  const char *scene_path; /* for the provenance */
  const char *save_state; /* file for a copy of the last state; NULL: none */
  double max_seconds;     /* budget; 0: no limit */
  double begun;           /* monotonic seconds from which the budget counts; 0: from the first step */
  flesh_checkpoint_times checkpoint;
  const flesh_checkpoint *resume; /* checkpoint in `out` from which the run resumes; NULL: it starts */
  const flesh_ranks *ranks; /* ranks that have shared out the scene; each of them runs it. NULL: one process */
  int no_frames;
  int profile; /* measure the time of every call of an effect, and print a table */
  int quiet; /* print no report on stdout and no line of progress */
  int argc;  /* the command line, for the provenance */
  char **argv;
  int observer_count; /* called in addition to history and frames */
  const flesh_observer *observers;
} flesh_runner_options;

/* Runs the scene to its end, or until a signal (see interrupt.h) or the end of the budget. Writes into `out`:
 * history.csv, scene.yaml, state.txt (the last good state), result.json, frames/. Files of an older run there are
 * replaced. FLESH_ERR_FILE or FLESH_ERR_ARGUMENT, with nothing touched, if another process uses the folder, or if its
 * files are read by this run or were not written by a run. A failed run keeps its results up to then and is described
 * by *outcome, whose status is also returned. The caller closes `figures`. */
int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome);

#endif
