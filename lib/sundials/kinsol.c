/* kinsol.c: owns a KINSOL and solves stages with it. */
#include "sundials/kinsol.h"

#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/team.h"
#include "newton/stage.h"
#include "sundials/compatibility.h"
#include "sundials/problem.h"
#include "sundials/vector.h"
#include "system/feasible_step.h"
#include "system/ranks.h"

enum { BATCH = 300 }; /* iterations after which a solve must show progress */

/* Returns the 2-norm. KINSOL stops on N_VMaxNorm of the scaled residual, which is replaced by this, as all tolerances of
 * flesh are for 2-norms. */
static sunrealtype two_norm(N_Vector v)
{
  return flesh_norm(flesh_vector_threads(v), (int)N_VGetLength(v), N_VGetArrayPointer(v));
}

/* Initialises KINSOL with vectors, callbacks and solver. Its options stay. */
static int begin_kinsol(flesh_nonlinear *self, const flesh_solver_options *options)
{
  void *kinsol = self->kinsol;
  int status = flesh_vector_prepare(self->unknowns, FLESH_KINSOL_CLONES);
  if (status) return status;
  /* Each call needs the results of those before it. */
  int failed = KINInit(kinsol, flesh_kinsol_residual, self->unknowns) || KINSetUserData(kinsol, self->problem) ||
               KINSetLinearSolver(kinsol, self->solver, self->matrix) || KINSetJacFn(kinsol, flesh_kinsol_jacobian);
  self->vector_count = flesh_vector_taken(self->vectors, FLESH_KINSOL_CLONES);
  flesh_vector_drop();
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL could not begin");
  failed |= KINSetNumMaxIters(kinsol, options->max_newton < BATCH ? options->max_newton : BATCH);
  failed |= KINSetMaxSetupCalls(kinsol, 1);      /* the Jacobian's callback decides whether the last one serves */
  failed |= KINSetMaxNewtonStep(kinsol, 1e300);  /* the line search limits steps, not |u|, which starts at 0 */
  failed |= KINSetScaledStepTol(kinsol, 1e-300); /* only a zero step ends a solve by itself */
  failed |= KINSetEtaForm(kinsol, KIN_ETACONSTANT);
  failed |= KINSetEtaConstValue(kinsol, options->linear_tolerance);
  return failed ? flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL refused an option") : FLESH_OK;
}

/* Makes a KINSOL for the problem, with vectors of n numbers. */
static int make_kinsol(flesh_nonlinear *self, int n, const flesh_solver_options *options)
{
  self->newton = &self->problem->newton;
  if (flesh_suncontext_create(&self->context)) return flesh_fail(FLESH_ERR_SUNDIALS, "SUNDIALS gave no context");
  self->unknowns = N_VNew_Serial(n, self->context);
  if (self->unknowns && !flesh_vector_vectorise(self->unknowns, self->newton->threads)) {
    self->unknowns->ops->nvmaxnorm = two_norm;
    self->scale = flesh_vector_clone(self->unknowns);
  }
  self->kinsol = KINCreate(self->context);
  if (!self->unknowns || !self->scale || !self->kinsol)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for KINSOL on %d unknowns", n);
  flesh_sundials_silence(self->context, self->kinsol);
  self->u = N_VGetArrayPointer(self->unknowns);
  N_VConst(0, self->unknowns);
  N_VConst(1, self->scale);
  int status = flesh_sunmatrix_create(self->problem, self->context, &self->matrix);
  if (!status) status = flesh_sunlinsol_create(self->problem, self->context, &self->solver);
  return status ? status : begin_kinsol(self, options);
}

/* Makes a solver for subdomains, which come one after the other: a KINSOL without a problem. */
static int create_subdomain_solver(const flesh_solver_options *options, flesh_nonlinear **solver)
{
  flesh_nonlinear *self = *solver = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a nonlinear solver");
  int status = flesh_problem_create_empty(&self->problem);
  if (!status) status = make_kinsol(self, 1, options);
  if (!status && self->vector_count < 0)
    status = flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL wants more than %d vectors", FLESH_KINSOL_CLONES);
  if (status) return status;
  self->vectors[self->vector_count++] = self->unknowns;
  self->vectors[self->vector_count++] = self->scale;
  return FLESH_OK;
}

static int solve_subdomain(void *data, const flesh_system *system, const flesh_solver_options *options,
                           const flesh_stage *stage, flesh_stop stop, flesh_solve_stats *stats, double *u);

/* Makes this rank's part, without the others. */
static int create_local(const flesh_system *system, const flesh_solver_options *options, flesh_nonlinear *self)
{
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a nonlinear solver");
  int status = flesh_solver_options_check(options);
  if (!status && flesh_newton_uses_elimination(system, options))
    status = create_subdomain_solver(options, &self->subdomain_solver);
  if (status) return status;
  const flesh_stage_solver solver = {self->subdomain_solver, self->subdomain_solver ? solve_subdomain : NULL};
  status = flesh_problem_create_local(system, options, solver, &self->problem);
  return status ? status : make_kinsol(self, self->problem->newton.equations.n, options);
}

int flesh_nonlinear_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                 flesh_nonlinear **nonlinear)
{
  flesh_nonlinear *self = *nonlinear = status ? NULL : calloc(1, sizeof *self);
  if (!status) status = create_local(system, options, self);
  status = flesh_problem_create_collective(system, status, self ? self->problem : NULL);
  if (status) flesh_nonlinear_destroy(nonlinear);
  return status;
}

int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options, flesh_nonlinear **nonlinear)
{
  return flesh_nonlinear_create_after(FLESH_OK, system, options, nonlinear);
}

void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear)
{
  if (!nonlinear || !*nonlinear) return;
  flesh_nonlinear *self = *nonlinear;
  flesh_nonlinear_destroy(&self->subdomain_solver);
  if (self->kinsol) KINFree(&self->kinsol);
  if (self->solver) SUNLinSolFree(self->solver);
  if (self->matrix) SUNMatDestroy(self->matrix);
  if (self->scale) N_VDestroy(self->scale);
  if (self->unknowns) N_VDestroy(self->unknowns);
  if (self->context) SUNContext_Free(&self->context);
  flesh_problem_destroy(&self->problem);
  free(self);
  *nonlinear = NULL;
}

void flesh_nonlinear_forget(flesh_nonlinear *self)
{
  self->problem->staged = self->problem->zeroed = 0;
  flesh_newton_forget(self->newton);
}

int flesh_nonlinear_archive(flesh_nonlinear *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->problem->staged);
  FLESH_ARCHIVE(archive, self->problem->zeroed);
  return flesh_newton_archive(self->newton, archive);
}

void flesh_nonlinear_set_weights(flesh_nonlinear *self, const double *weights)
{
  flesh_equations *equations = &self->newton->equations;
  double *own = N_VGetArrayPointer(self->scale);
  if (weights) memcpy(own, weights, (size_t)equations->n * sizeof *own);
  else if (equations->weights) N_VConst(1, self->scale);
  equations->weights = weights ? own : NULL;
}

/* Translates KINSOL's return value. */
static int end_of(int flag, flesh_iteration_end *end)
{
  *end = flag == KIN_MAXITER_REACHED ? FLESH_ITERATION_LIMIT : FLESH_ITERATION_STOPPED;
  if (flag == KIN_SYSFUNC_FAIL || flag == KIN_REPTD_SYSFUNC_ERR || flag == KIN_FIRST_SYSFUNC_ERR)
    *end = FLESH_ITERATION_UNDEFINED;
  return flag == KIN_MEM_FAIL ? flesh_fail(FLESH_ERR_MEMORY, "KINSOL ran out of memory") : FLESH_OK;
}

/* Limits of a solve: extensions left, and iterations of max_newton used up. */
typedef struct allowance {
  int extensions;
  long used;
} allowance;

/* Calls KINSol with at most the iterations that are left. A smaller limit set by a program holds until fewer are left. */
static int run_kinsol(flesh_nonlinear *self, const allowance *allowed)
{
  const flesh_solver_options *options = &self->newton->options;
  const int strategy = options->line_search == FLESH_LINE_SEARCH_RESIDUAL ? KIN_LINESEARCH : KIN_NONE;
  const long most = options->max_newton < BATCH ? options->max_newton : BATCH;
  const long left = options->max_newton - allowed->used;
  if (left <= 0) return KIN_MAXITER_REACHED;
  if (left < most) KINSetNumMaxIters(self->kinsol, left);
  const int flag = KINSol(self->kinsol, self->unknowns, strategy, self->scale, self->scale);
  if (left < most) KINSetNumMaxIters(self->kinsol, most);
  return flag;
}

/* Iterates with KINSOL to the target, BATCH iterations at a time while they make progress, max_newton in total and again
 * for every extension. */
static int iterate(flesh_nonlinear *self, allowance *allowed, double target, flesh_iteration_end *end)
{
  flesh_newton *newton = self->newton;
  double reached = NAN;
  KINSetFuncNormTol(self->kinsol, target);
  for (;;) {
    long last = 0;
    const int flag = run_kinsol(self, allowed);
    KINGetNumNonlinSolvIters(self->kinsol, &last);
    allowed->used += last;
    if (flag != KIN_MAXITER_REACHED) return end_of(flag, end);
    if (last == BATCH && allowed->used + BATCH <= newton->options.max_newton &&
        flesh_stage_makes_progress(newton, self->u, &reached))
      continue;
    if (allowed->extensions-- <= 0) return end_of(flag, end);
    allowed->used = 0;
  }
}

int flesh_nonlinear_solve(flesh_nonlinear *self, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats)
{
  allowance allowed = {.extensions = extensions};
  flesh_stage_solve solve;
  flesh_iteration_end end = FLESH_ITERATION_STOPPED;
  self->problem->staged = 1;
  int more = flesh_stage_begin(self->newton, stage, guesses, self->u, stats, &solve);
  while (more) {
    const int status = iterate(self, &allowed, solve.target, &end);
    more = flesh_stage_continue(&solve, status, end);
  }
  return flesh_stage_end(&solve);
}

/* Gives this system to KINSOL of the solver for subdomains, with vectors from the thread's reserve. */
static int hand_system(flesh_nonlinear *self, const flesh_system *system, const flesh_solver_options *options)
{
  int n = flesh_system_unknowns(system), failed = 0;
  size_t stride;
  double *values = flesh_huge_pages_vectors((size_t)self->vector_count, (size_t)n, &stride);
  if (!values) return flesh_fail(FLESH_ERR_MEMORY, "no memory for KINSOL on %d unknowns", n);
  for (int k = 0; k < self->vector_count; k++) flesh_vector_attach(self->vectors[k], n, values + (size_t)k * stride);
  self->u = N_VGetArrayPointer(self->unknowns);
  N_VConst(1, self->scale);
  self->problem->staged = self->problem->zeroed = 0;
  failed |= KINSetNumMaxIters(self->kinsol, options->max_newton < BATCH ? options->max_newton : BATCH);
  failed |= KINSetEtaConstValue(self->kinsol, options->linear_tolerance);
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL refused an option");
  return flesh_newton_init(system, options, (flesh_stage_solver){0}, self->newton);
}

/* Solves a stage of a subdomain; a flesh_stage_solver. */
static int solve_subdomain(void *data, const flesh_system *system, const flesh_solver_options *options,
                           const flesh_stage *stage, flesh_stop stop, flesh_solve_stats *stats, double *u)
{
  flesh_nonlinear *self = data;
  int status = hand_system(self, system, options);
  if (status) return status;
  self->newton->stop = stop;
  status = flesh_nonlinear_solve(self, stage, NULL, 0, stats);
  memcpy(u, self->u, (size_t)flesh_system_unknowns(system) * sizeof *u);
  flesh_newton_clear(self->newton);
  return status;
}

int flesh_nonlinear_is_clear(const flesh_nonlinear *self)
{
  return flesh_equations_is_clear(&self->newton->equations, self->u);
}

flesh_point flesh_nonlinear_point(flesh_nonlinear *self)
{
  return flesh_equations_point(&self->newton->equations, self->u);
}

const double *flesh_nonlinear_reactions(const flesh_nonlinear *self, const int **constrained, int *count)
{
  const flesh_equations *equations = &self->newton->equations;
  *constrained = equations->constrained.dofs;
  *count = equations->constrained.count;
  return equations->evaluation.residual.reactions;
}

int flesh_nonlinear_defined(flesh_nonlinear *self, double t, const double *x, const double *v, double *energies,
                            flesh_solve_stats *stats)
{
  double sum = 0;
  flesh_equations *equations = &self->newton->equations;
  flesh_evaluation *e = &equations->evaluation;
  if (x != e->x) memcpy(e->x, x, (size_t)equations->n * sizeof *x);
  memset(e->a, 0, (size_t)equations->n * sizeof *e->a);
  stats->potentials++;
  flesh_point point = flesh_evaluation_point(e, t, e->x, v, e->a);
  point.multipliers = equations->stage.multipliers;
  point.internal = equations->stage.internal;
  int status = flesh_system_energies(e->system, &point, energies);
  for (int e = 0; !status && e < flesh_system_effect_count(equations->system); e++) sum += energies[e];
  return status || isfinite(sum) ? status : FLESH_NONFINITE;
}
