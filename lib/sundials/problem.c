/* problem.c: the life of a problem, and its stages. */
#include "sundials/problem.h"

#include <stdlib.h>

#include "base/error.h"
#include "sundials/version.h"

int flesh_problem_create_with(const flesh_system *system, const flesh_solver_options *options,
                              flesh_stage_solver solve_stage, flesh_problem **problem)
{
  *problem = NULL;
  int status = flesh_sundials_check();
  if (status) return status;
  flesh_problem *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a solver");
  status = flesh_newton_init(system, options, solve_stage, &self->newton);
  if (status) {
    free(self);
    return status;
  }
  self->self = self;
  *problem = self;
  return FLESH_OK;
}

int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options, flesh_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  return flesh_problem_create_with(system, options, NULL, problem);
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
