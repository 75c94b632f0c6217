/* solver_options.c: defaults and limits of the nonlinear solve's options. */
#include <limits.h>

#include "base/error.h"
#include "newton/equations.h"

void flesh_solver_options_default(flesh_solver_options *options)
{
  *options = (flesh_solver_options){
      .newton_tolerance = 1e-4,
      .linear_tolerance = 1e-2,
      .max_newton = 1200,
      .max_linear = 2000,
      .max_cutbacks = 8,
      .lag_iterations = 0,
      .linear_solver = FLESH_LINEAR_PCG,
      .preconditioner = FLESH_PRECONDITIONER_AUTO,
      .eigenvalue_filter = FLESH_FILTER_AUTO,
      .techniques = FLESH_TECHNIQUES_ALL,
      .threads = 1,
      .line_search = FLESH_LINE_SEARCH_POTENTIAL,
  };
}

int flesh_solver_options_check(const flesh_solver_options *o)
{
  const struct {
    const char *name;
    double value;
  } fractions[] = {{"newton_tolerance", o->newton_tolerance},
                   {"linear_tolerance", o->linear_tolerance}};
  for (int k = 0; k < 2; k++)
    if (!(fractions[k].value > 0 && fractions[k].value < 1))
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %g; it must be > 0 and < 1", fractions[k].name,
                        fractions[k].value);
  const struct {
    const char *name;
    long long value, low, high;
  } integers[] = {{"max_newton", o->max_newton, 1, INT_MAX},
                  {"max_linear", o->max_linear, 1, INT_MAX},
                  {"max_cutbacks", o->max_cutbacks, 0, 30},
                  {"lag_iterations", o->lag_iterations, 0, 1000},
                  {"linear_solver", o->linear_solver, 0, FLESH_LINEAR_CHOLMOD},
                  {"preconditioner", o->preconditioner, 0, FLESH_PRECONDITIONER_VOLUME_PROJECTION},
                  {"eigenvalue_filter", o->eigenvalue_filter, 0, FLESH_FILTER_TRUST_REGION_ALWAYS},
                  {"line_search", o->line_search, 0, FLESH_LINE_SEARCH_RESIDUAL},
                  {"techniques", o->techniques, 0, FLESH_TECHNIQUES_ALL},
                  {"threads", o->threads, 0, FLESH_THREADS_MAX}};
  for (size_t k = 0; k < sizeof integers / sizeof integers[0]; k++)
    if (integers[k].value < integers[k].low || integers[k].value > integers[k].high)
      return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %lld; it must be in %lld to %lld", integers[k].name,
                        integers[k].value, integers[k].low, integers[k].high);
  return FLESH_OK;
}
