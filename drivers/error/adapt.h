/* adapt.h: `flesh run --to`: meshes that are refined where a quantity's error comes from, until its bar is small enough. */
#ifndef FLESH_ERROR_ADAPT_H
#define FLESH_ERROR_ADAPT_H

#include "cli/overrides.h"
#include "run/runner_options.h"

/* Whether `spec` is one of --to: TOLERANCE:COLUMN. */
int flesh_adapt_is_spec(const char *spec);

/* Runs the scene of options->scene_path with the overrides on meshes refined until the bar of the column that `spec` names
 * is within its tolerance; the last run is in options->out with its mesh, "adapted_mesh" in result.json, the others are in
 * its folder to/. Prints what it does. FLESH_ERR_ARGUMENT where there is no honest bar, FLESH_ERR_BUDGET where the
 * tolerance is not reached, errors of the runs. */
int flesh_adapt_run(const flesh_runner_options *options, const flesh_texts *overrides, const char *spec);

#endif
