/* runner.h: a scene run into a folder: what `flesh run` does and sweeps do many times. */
#ifndef FLESH_RUN_RUNNER_H
#define FLESH_RUN_RUNNER_H

#include "run/runner_options.h"

/* Runs the scene to its end, or until a signal (see interrupt.h) or the budget. In `out`:
 * history.csv, scene.yaml, state.txt (the last good state), result.json, frames/. What an older run
 * left there is replaced; FLESH_ERR_FILE or FLESH_ERR_ARGUMENT, and nothing is touched, where another
 * process has the folder, or where what is there is read by this run or was written by no run. A run
 * that fails keeps what was done and is described by *outcome, whose status is also returned.
 * `figures` is closed by the caller. */
int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome);

#endif
