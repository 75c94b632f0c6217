/* names.c: what solvers, outcomes, settings and runs of the battery are called. */
#include <stdio.h>

#include "hardcases/hardcases.h"
#include "newton/mechanisms.h"

#define NAME(id, name, ...) name,

const char *flesh_hardcases_solver_name(flesh_hardcases_solver solver)
{
  static const char *const names[] = {FLESH_HARDCASES_SOLVER_LIST(NAME)};
#define WITHOUT(id, name, doc) "without-" name,
  static const char *const without[] = {FLESH_MECHANISM_ROWS(WITHOUT) NULL};
  if (solver < FLESH_HARDCASES_WITHOUT) return names[solver];
  return flesh_hardcases_left_out(solver) ? without[solver - FLESH_HARDCASES_WITHOUT] : NULL;
}

flesh_technique flesh_hardcases_left_out(flesh_hardcases_solver solver)
{
  const unsigned bit = solver < FLESH_HARDCASES_WITHOUT ? 0 : 1u << (solver - FLESH_HARDCASES_WITHOUT);
  return (flesh_technique)(bit & FLESH_TECHNIQUES_ALL);
}

const char *flesh_hardcases_outcome_name(flesh_hardcases_outcome outcome)
{
  static const char *const names[] = {FLESH_HARDCASES_OUTCOME_LIST(NAME)};
  return names[outcome];
}

void flesh_hardcases_setting_title(const flesh_hardcases_setting *s, char title[112])
{
  char constants[16] = "", step[32] = "", element[24] = "", body[40] = "";
  if (s->body) snprintf(body, sizeof body, "%.38s ", s->body->name);
  if (s->constants != FLESH_CONSTANTS_MATCHED)
    snprintf(constants, sizeof constants, " %s", flesh_constants_name(s->constants));
  if (fabs(s->step * 60 - 1) > 1e-9) snprintf(step, sizeof step, " h=%g", s->step);
  if (s->element != FLESH_ELEMENT_TET4) snprintf(element, sizeof element, " %s", flesh_element_name(s->element));
  snprintf(title, 112, "%s%s%s %g%s%s %s", body, flesh_energy_name(s->energy), constants, s->poisson, step, element,
           flesh_hardcases_solver_name(s->solver));
}

const char *flesh_hardcases_run_folder(const flesh_hardcases_run *run)
{
  const flesh_hardcases_setting *s = run->setting;
  char seed[24] = "", constants[16] = "", step[24] = "", element[24] = "";
  if (run->row->flags & FLESH_HARDCASES_RANDOM) snprintf(seed, sizeof seed, "_seed%d", run->seed);
  if (s->constants != FLESH_CONSTANTS_MATCHED)
    snprintf(constants, sizeof constants, "_%s", flesh_constants_name(s->constants));
  if (!(run->row->step > 0) && fabs(s->step * 60 - 1) > 1e-9)
    snprintf(step, sizeof step, "_h%g", s->step);
  if (s->element != FLESH_ELEMENT_TET4) snprintf(element, sizeof element, "_%s", flesh_element_name(s->element));
  return flesh_path("cases/%s%s%s%s_%s%s_%g%s%s_%s", s->body ? s->body->name : "", s->body ? "_" : "", run->row->name, seed,
                    flesh_energy_name(s->energy), constants, flesh_hardcases_poisson(run), step, element,
                    flesh_hardcases_solver_name(s->solver));
}
