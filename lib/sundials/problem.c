/* problem.c: the life of a problem, and its stages. */
#include "sundials/problem.h"

#include <stdlib.h>

#include "base/error.h"
#include "sundials/version.h"

int flesh_problem_create_empty(flesh_problem **problem)
{
  int status = flesh_sundials_check();
  *problem = status ? NULL : calloc(1, sizeof **problem);
  if (*problem) (*problem)->self = *problem;
  return status || *problem ? status : flesh_fail(FLESH_ERR_MEMORY, "no memory for a solver");
}

int flesh_problem_create_with(const flesh_system *system, const flesh_solver_options *options,
                              flesh_stage_solver solver, flesh_problem **problem)
{
  int status = flesh_problem_create_empty(problem);
  if (!status) status = flesh_newton_init(system, options, solver, &(*problem)->newton);
  if (status) flesh_problem_destroy(problem);
  return status;
}

int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options, flesh_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  return flesh_problem_create_with(system, options, (flesh_stage_solver){0}, problem);
}

void flesh_problem_destroy(flesh_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_newton_clear(&(*problem)->newton);
  flesh_scalar_view_clear(&(*problem)->view);
  free(*problem);
  *problem = NULL;
}

int flesh_problem_set_stage(flesh_problem *self, const flesh_stage *stage)
{
  FLESH_NEED({self, "problem"}, {stage, "stage"});
  if (!(stage->shift.x != 0)) /* what is prescribed of x is divided by it */
    return flesh_fail(FLESH_ERR_ARGUMENT, "the stage's shift.x is %g; it must not be 0", stage->shift.x);
  flesh_newton_set_stage(&self->newton, stage);
  self->staged = 1;
  return FLESH_OK;
}

void flesh_problem_freeze(flesh_problem *self, const double *u) { flesh_newton_freeze(&self->newton, u); }

void flesh_problem_start(const flesh_problem *self, double *u) { flesh_equations_start(&self->newton.equations, u); }

flesh_solve_stats *flesh_problem_stats(flesh_problem *self) { return &self->newton.stats; }

size_t flesh_problem_memory(const flesh_problem *self) { return sizeof *self + flesh_newton_memory(&self->newton); }
