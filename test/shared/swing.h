/* swing.h: a bar swings from a clamped end; compares its most expensive step with the median one by counters: of Newton
 * iterations, and of work. Work counts an assembly with its preconditioner and residual as sixteen linear iterations,
 * and an iteration of nonlinear elimination as 45 linear iterations times its fraction of the elements; these are about
 * the costs on the benchmark bar. */
#ifndef FLESH_TEST_SWING_H
#define FLESH_TEST_SWING_H

#include "body.h"
#include "test.h"

typedef struct swing {
  int cells[3], steps;
  double size[3], poisson, gravity; /* acceleration in units of 9.81 m/s^2 */
  int follow, eliminate;            /* techniques of the solver that are switched on */
  int enough;                       /* Newton iterations after which a step is accepted as it is; 0: none */
} swing;

typedef struct swing_cost {
  double newton, work; /* ratios of the most expensive step to the median one */
  int total_newton, total_linear, total_patches;
} swing_cost;

static inline int swing_ascending(const void *a, const void *b)
{
  return *(const int *)a - *(const int *)b;
}

static inline double swing_worst_over_median(int count, int *values)
{
  qsort(values, (size_t)count, sizeof *values, swing_ascending);
  return (double)values[count - 1] / values[count / 2];
}

static inline swing_cost swing_run(const swing *s)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_mesh *mesh = test_box(s->cells[0], s->cells[1], s->cells[2], s->size[0], s->size[1], s->size[2]);
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, s->poisson, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81 * s->gravity));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-6; /* whose costs the limits assume */
  if (!s->follow)
    options.techniques &= ~(unsigned)(FLESH_TECHNIQUE_NEGATIVE_CURVATURE | FLESH_TECHNIQUE_LONGER_STEPS);
  if (!s->eliminate) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_NONLINEAR_ELIMINATION;
  if (s->enough) options.max_newton = s->enough, options.accept_unconverged = 1;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  int newton[60], work[60];
  swing_cost cost = {0};
  for (int k = 0; k < s->steps; k++) {
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
    CHECK(stats.potential_rises == 0 && stats.solves == 1);
    cost.total_newton += newton[k] = stats.newton;
    cost.total_linear += stats.linear;
    work[k] = stats.linear + 16 * stats.assemblies + (int)lround(45 * stats.subdomain_share);
    cost.total_patches += stats.subdomains;
  }
  cost.newton = swing_worst_over_median(s->steps, newton);
  cost.work = swing_worst_over_median(s->steps, work);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return cost;
}

#endif
