/* error.h: error bars of a run that is complete: the same scene is run again on another mesh or with other steps, by
 * companions whose differences from the run say how far its numbers are off. */
#ifndef FLESH_ERROR_ERROR_H
#define FLESH_ERROR_ERROR_H


#include "run/runner_options.h"

/* Whether the scene asks for bars. */
int flesh_error_wanted(const flesh_scene *scene);

/* Runs the companions of the complete run in options->out into its folder error/, adds columns to its history.csv and
 * probes.csv and "error_bars" to its result.json, and prints what they say. FLESH_OK also where there is no bar, as the
 * result then says why; FLESH_ERR_INTERRUPTED, and errors of files and memory. */
int flesh_error_bars(const flesh_runner_options *options);

/* Adds bars to a run that was complete before, where it has none and its scene asks for them or they are `wanted`. */
int flesh_error_catch_up(const flesh_runner_options *options, int wanted);

#endif
