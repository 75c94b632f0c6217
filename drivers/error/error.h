/* error.h: error bars of a complete run: companions run the same scene again on another mesh or with other steps; their
 * differences from the run estimate its errors. */
#ifndef FLESH_ERROR_ERROR_H
#define FLESH_ERROR_ERROR_H

#include "cli/overrides.h"
#include "run/runner.h"

/* Runs the companions of the complete run in options->out in its folder error/, adds columns to its history.csv and
 * probes.csv and "error_bars" to its result.json, and prints what they say. FLESH_OK also if there is no bar, with the
 * reason in the result; FLESH_ERR_INTERRUPTED, and errors of files and memory. */
int flesh_error_bars(const flesh_runner_options *options);

/* Adds bars to a run that is already complete, if it has none and its scene asks for them or they are `wanted`. */
int flesh_error_catch_up(const flesh_runner_options *options, int wanted);

/* The functions of `flesh run --to` refine meshes where the error of a quantity arises, until its bar is small
 * enough. */
/* Returns whether `spec` has the form TOLERANCE:COLUMN of --to. */
int flesh_adapt_is_spec(const char *spec);

/* Runs the scene of options->scene_path with the overrides on meshes that are refined until the bar of the column named
 * by `spec` is within its tolerance. The last run is in options->out, with its mesh and with "adapted_mesh" in
 * result.json; the others are in its folder to/. Prints its progress. FLESH_ERR_ARGUMENT if there is no honest bar,
 * FLESH_ERR_BUDGET if the tolerance is not reached, and errors of the runs. */
int flesh_adapt_run(const flesh_runner_options *options, const flesh_texts *overrides, const char *spec);

#endif
