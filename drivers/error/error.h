/* error.h: error bars of a run that is complete: the same scene is run again on another mesh or with other steps, by
 * companions whose differences from the run say how far its numbers are off. */
#ifndef FLESH_ERROR_ERROR_H
#define FLESH_ERROR_ERROR_H

#include "cli/overrides.h"
#include "run/runner_options.h"

/* Whether the scene asks for bars. */
int flesh_error_wanted(const flesh_scene *scene);

/* Runs the companions of the complete run in options->out into its folder error/, adds columns to its history.csv and
 * probes.csv and "error_bars" to its result.json, and prints what they say. FLESH_OK also where there is no bar, as the
 * result then says why; FLESH_ERR_INTERRUPTED, and errors of files and memory. */
int flesh_error_bars(const flesh_runner_options *options);

/* Adds bars to a run that was complete before, where it has none and its scene asks for them or they are `wanted`. */
int flesh_error_catch_up(const flesh_runner_options *options, int wanted);

/* `flesh run --to`: meshes that are refined where a quantity's error comes from, until its bar is small enough. */
/* Whether `spec` is one of --to: TOLERANCE:COLUMN. */
int flesh_adapt_is_spec(const char *spec);

/* Runs the scene of options->scene_path with the overrides on meshes refined until the bar of the column that `spec` names
 * is within its tolerance; the last run is in options->out with its mesh, "adapted_mesh" in result.json, the others are in
 * its folder to/. Prints what it does. FLESH_ERR_ARGUMENT where there is no honest bar, FLESH_ERR_BUDGET where the
 * tolerance is not reached, errors of the runs. */
int flesh_adapt_run(const flesh_runner_options *options, const flesh_texts *overrides, const char *spec);

#endif
