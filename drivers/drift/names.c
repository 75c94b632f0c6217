/* names.c: what solvers, forms, cases and ends of the comparison are called. */
#include <stdio.h>

#include "drift/drift.h"

const char *flesh_drift_solver_name(flesh_drift_solver solver)
{
  return solver == FLESH_DRIFT_PLAIN ? "plain" : "guarded";
}

void flesh_drift_variant_title(flesh_drift_variant variant, char title[16])
{
  int named = variant.constants != FLESH_CONSTANTS_MATCHED;
  snprintf(title, 16, "%s%s%s", flesh_energy_name(variant.energy), named ? " " : "",
           named ? flesh_constants_name(variant.constants) : "");
}

void flesh_drift_case_folder(const flesh_drift_plan *plan, const flesh_drift_case *c, char folder[256])
{
  const flesh_drift_variant *v = &plan->variants[c->variant];
  snprintf(folder, 256, "runs/%s_%s_%s_%g_%s", plan->scenes[c->scene].name, flesh_energy_name(v->energy),
           flesh_constants_name(v->constants), plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver));
}

const char *flesh_drift_status_word(const flesh_drift_case *c)
{
  if (c->figures.crashed_by) return "crashed";
  switch (c->figures.status) {
  case FLESH_OK: return c->figures.stressed_rest > 0 ? "stressed rest" : "complete";
  case FLESH_UNDEFINED: return "undefined";
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE: return "non-finite";
  case FLESH_ERR_BUDGET: return "out of budget";
  case FLESH_ERR_INTERRUPTED: return c->figures.tets ? "interrupted" : "not run";
  case FLESH_ERR_ARGUMENT: return "refused";
  case FLESH_ERR_ENERGY: return "energy grew";
  default: return "not converged";
  }
}
