/* adaptive_options.c: the options of the adaptive methods. */
#include <float.h>
#include <math.h>

#include "base/error.h"
#include "base/team.h"
#include "time/ida.h"

void flesh_adaptive_options_default(flesh_adaptive_options *options)
{
  *options = (flesh_adaptive_options){.tolerance = 1e-4, .max_order = 2, .max_step = INFINITY, .max_steps = 100000};
}

int flesh_adaptive_options_show(const flesh_adaptive_options *options, const flesh_team *team,
                                const flesh_internal_step *step)
{
  return options->observe ? flesh_team_agree(team, options->observe(options->observe_data, step)) : FLESH_OK;
}

int flesh_adaptive_options_check(const flesh_adaptive_options *options)
{
  if (!(options->tolerance >= DBL_EPSILON && options->tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "tolerance is %g; it must be at least %.3g, as rounding allows no less, and below 1",
                      options->tolerance, DBL_EPSILON);
  if (options->max_order < 1 || options->max_order > 5)
    return flesh_fail(FLESH_ERR_ARGUMENT, "max_order is %d; it must be 1 to 5", options->max_order);
  if (!(options->max_step > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "max_step is %g s; it must be positive", options->max_step);
  if (options->max_steps < 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "max_steps is %d; it must be positive", options->max_steps);
  return FLESH_OK;
}
