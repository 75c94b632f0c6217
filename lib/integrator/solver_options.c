/* solver_options.c: the defaults of the nonlinear solve. */
#include "flesh/solver.h"

void flesh_solver_options_default(flesh_solver_options *options)
{
  *options = (flesh_solver_options){
      .newton_tolerance = 1e-6,
      .linear_tolerance = 1e-2,
      .max_newton = 1200,
      .max_linear = 2000,
      .max_halvings = 8,
      .linear_solver = FLESH_LINEAR_PCG,
      .preconditioner = FLESH_PRECONDITIONER_AUTO,
      .projection = FLESH_PROJECTION_DEMAND,
      .filtering = FLESH_FILTERING_AUTO,
      .untangle = 1,
      .follow_curvature = 1,
      .nonlinear_elimination = 1,
      .watchdog = 1,
      .threads = 1,
      .globalization = FLESH_GLOBALIZATION_ENERGY,
  };
}
