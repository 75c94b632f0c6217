/* problem.c: creation and destruction of a problem, and its stages. */
#include "sundials/problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sundials/vector.h"
#include "sundials/version.h"
#include "system/ranks.h"

int flesh_problem_create_empty(flesh_problem **problem)
{
  int status = flesh_sundials_check();
  *problem = status ? NULL : calloc(1, sizeof **problem);
  if (*problem) (*problem)->head = (flesh_user_data){*problem, "flesh_problem"};
  return status || *problem ? status : flesh_fail(FLESH_ERR_MEMORY, "no memory for a solver");
}

/* Makes room for vectors of a system that is shared out among ranks. */
static int make_rooms(flesh_problem *self)
{
  const size_t n = (size_t)self->newton.equations.n;
  if (!self->newton.equations.team) return FLESH_OK;
  self->room[0] = malloc((3 * n + 1) * sizeof *self->room[0]);
  for (size_t k = 1; k < 3 && self->room[0]; k++) self->room[k] = self->room[0] + k * n;
  return self->room[0] ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for vectors of ranks");
}

int flesh_problem_create_local(const flesh_system *system, const flesh_solver_options *options,
                               flesh_stage_solver solver, flesh_problem **problem)
{
  int status = flesh_problem_create_empty(problem);
  if (!status) status = flesh_newton_init_local(system, options, solver, &(*problem)->newton);
  return status ? status : make_rooms(*problem);
}

int flesh_problem_create_collective(const flesh_system *system, int status, flesh_problem *problem)
{
  return flesh_newton_init_collective(system, status, problem ? &problem->newton : NULL);
}

int flesh_problem_create(const flesh_system *system, const flesh_solver_options *options, flesh_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  int status = flesh_problem_create_local(system, options, (flesh_stage_solver){0}, problem);
  status = flesh_problem_create_collective(system, status, *problem);
  if (status) flesh_problem_destroy(problem);
  return status;
}

void flesh_problem_destroy(flesh_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_newton_clear(&(*problem)->newton);
  flesh_scalar_view_clear(&(*problem)->view);
  free((*problem)->room[0]);
  free(*problem);
  *problem = NULL;
}

int flesh_problem_set_stage(flesh_problem *self, const flesh_stage *stage)
{
  FLESH_NEED({self, "problem"}, {stage, "stage"}, {stage ? stage->x0 : NULL, "stage->x0"});
  if (!isfinite(stage->shift.x) || stage->shift.x == 0) /* prescribed positions are divided by it */
    return flesh_fail(FLESH_ERR_ARGUMENT, "the stage's shift.x is %g; it must be finite and not 0", stage->shift.x);
  if (!isfinite(stage->t) || !isfinite(stage->load) || !isfinite(stage->prescribed_fraction))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the stage's t is %g s, its load %g and its prescribed_fraction %g; they must be finite",
                      stage->t, stage->load, stage->prescribed_fraction);
  flesh_newton_set_stage(&self->newton, stage);
  self->staged = 1;
  return FLESH_OK;
}

void flesh_problem_freeze(flesh_problem *self, const double *u) { flesh_newton_freeze(&self->newton, u); }

void flesh_problem_start(const flesh_problem *self, double *u) { flesh_equations_start(&self->newton.equations, u); }

int flesh_problem_solve(flesh_problem *self, const double *u, int count, double *b, double tolerance)
{
  FLESH_NEED({self, "problem"}, {b, "b"});
  flesh_newton *newton = &self->newton;
  if (count < 0) return flesh_fail(FLESH_ERR_ARGUMENT, "count is %d right-hand sides; it must not be negative", count);
  if (!(tolerance >= 1e-13 && tolerance < 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the tolerance of a solve is %g; it must be in [1e-13, 1)", tolerance);
  if (!self->staged)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the flesh_problem has no stage; flesh_problem_set_stage comes first");
  if (!u && !newton->tangent.known)
    return flesh_fail(FLESH_ERR_ARGUMENT, "u is NULL, but no solve at this stage has made a matrix before");
  int status = u ? flesh_newton_factor_tangent(newton, u) : FLESH_OK;
  const size_t n = (size_t)newton->equations.n;
  for (int k = 0; k < count && !status; k++) {
    status = flesh_newton_solve_tangent(newton, b + (size_t)k * n, tolerance, newton->equations.trial);
    if (!status) memcpy(b + (size_t)k * n, newton->equations.trial, n * sizeof *b);
  }
  return status;
}

flesh_solve_stats *flesh_problem_stats(flesh_problem *self) { return &self->newton.stats; }

const double *flesh_problem_read(const flesh_problem *self, N_Vector v, int partial, int room)
{
  const flesh_equations *equations = &self->newton.equations;
  return flesh_vector_read(v, equations->team, equations->n, partial, self->room[room]);
}

double *flesh_problem_open(const flesh_problem *self, N_Vector v, int room)
{
  return flesh_vector_open(v, self->newton.equations.team, self->newton.equations.n, self->room[room]);
}

void flesh_problem_close(const flesh_problem *self, N_Vector v, const double *written)
{
  flesh_vector_close(v, self->newton.equations.team, self->newton.equations.n, written);
}
