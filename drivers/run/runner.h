/* runner.h: runs a scene into a folder, as `flesh run` does once and sweeps do many times. */
#ifndef FLESH_RUN_RUNNER_H
#define FLESH_RUN_RUNNER_H

#include "run/runner_options.h"

/* Runs the scene to its end, or until a signal (see interrupt.h) or the end of the budget. Writes into `out`:
 * history.csv, scene.yaml, state.txt (the last good state), result.json, frames/. Files of an older run there are
 * replaced. FLESH_ERR_FILE or FLESH_ERR_ARGUMENT, with nothing touched, if another process uses the folder, or if its
 * files are read by this run or were not written by a run. A failed run keeps its results up to then and is described
 * by *outcome, whose status is also returned. The caller closes `figures`. */
int flesh_runner_run(const flesh_scene *scene, const flesh_runner_options *options,
                     flesh_figures *figures, flesh_outcome *outcome);

#endif
