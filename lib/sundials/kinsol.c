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
#include "system/velocity_scale.h"

enum { BATCH = 300 }; /* iterations after which a solve is asked whether it gets anywhere */
enum { CLONES = 8 };  /* as many as KINInit takes, or more */

struct flesh_nonlinear {
  flesh_problem *problem;
  SUNContext context;
  void *kinsol;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector u, scale; /* the weights of residuals */
  flesh_nonlinear *few; /* of the systems of few nodes; NULL: there are none */
  /* All vectors of KINSOL in a solver for systems of few nodes, whose problem is another every time. */
  N_Vector vectors[CLONES + 2];
  int vector_count;
};

/* KINSOL stops on N_VMaxNorm of the scaled residual. Ours is the 2-norm, so that its test is the one that every
 * tolerance of flesh means. */
static sunrealtype two_norm(N_Vector v)
{
  return flesh_norm(flesh_vector_threads(v), (int)N_VGetLength(v), N_VGetArrayPointer(v));
}

/* Hands KINSOL everything. Its options stay. */
static int begin_kinsol(flesh_nonlinear *self, const flesh_solver_options *options)
{
  void *kinsol = self->kinsol;
  int status = flesh_vector_prepare(self->u, CLONES);
  if (status) return status;
  /* Each needs what the ones before have made. */
  int failed = KINInit(kinsol, flesh_kinsol_residual, self->u) || KINSetUserData(kinsol, self->problem) ||
               KINSetLinearSolver(kinsol, self->solver, self->matrix) || KINSetJacFn(kinsol, flesh_kinsol_jacobian);
  self->vector_count = flesh_vector_taken(self->vectors, CLONES);
  flesh_vector_drop();
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL could not begin");
  failed |= KINSetNumMaxIters(kinsol, options->max_newton < BATCH ? options->max_newton : BATCH);
  failed |= KINSetMaxSetupCalls(kinsol, 1);      /* the Jacobian's callback knows when the last one serves */
  failed |= KINSetMaxNewtonStep(kinsol, 1e300);  /* the line search limits steps, not |u|, which starts at 0 */
  failed |= KINSetScaledStepTol(kinsol, 1e-300); /* only a zero step ends a solve by itself */
  failed |= KINSetEtaForm(kinsol, KIN_ETACONSTANT);
  failed |= KINSetEtaConstValue(kinsol, options->linear_tolerance);
  return failed ? flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL refused an option") : FLESH_OK;
}

/* KINSOL for the problem, with vectors of n numbers. */
static int make_kinsol(flesh_nonlinear *self, int n, const flesh_solver_options *options)
{
  if (flesh_suncontext_create(&self->context)) return flesh_fail(FLESH_ERR_SUNDIALS, "SUNDIALS gave no context");
  self->u = N_VNew_Serial(n, self->context);
  if (self->u && !flesh_vector_quicken(self->u, self->problem->newton.threads)) {
    self->u->ops->nvmaxnorm = two_norm;
    self->scale = flesh_vector_clone(self->u);
  }
  self->kinsol = KINCreate(self->context);
  if (!self->u || !self->scale || !self->kinsol)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for KINSOL on %d unknowns", n);
  flesh_sundials_silence(self->context, self->kinsol);
  N_VConst(0, self->u);
  N_VConst(1, self->scale);
  int status = flesh_sunmatrix_create(self->problem, self->context, &self->matrix);
  if (!status) status = flesh_sunlinsol_create(self->problem, self->context, &self->solver);
  return status ? status : begin_kinsol(self, options);
}

/* One for the systems of few nodes: KINSOL without a problem. */
static int create_few(const flesh_solver_options *options, flesh_nonlinear **few)
{
  flesh_nonlinear *self = *few = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a nonlinear solver");
  int status = flesh_problem_create_empty(&self->problem);
  if (!status) status = make_kinsol(self, 1, options);
  if (!status && self->vector_count < 0)
    status = flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL wants more than %d vectors", CLONES);
  if (status) return status;
  self->vectors[self->vector_count++] = self->u;
  self->vectors[self->vector_count++] = self->scale;
  return FLESH_OK;
}

static int solve_few(void *data, const flesh_system *system, const flesh_solver_options *options,
                     const flesh_stage *stage, flesh_stop stop, flesh_solve_stats *stats, double *u);

/* Makes what this rank needs, without the others. */
static int create_here(const flesh_system *system, const flesh_solver_options *options, flesh_nonlinear *self)
{
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a nonlinear solver");
  int status = flesh_solver_options_check(options);
  if (!status && flesh_newton_eliminates(system, options)) status = create_few(options, &self->few);
  if (status) return status;
  const flesh_stage_solver solver = {self->few, self->few ? solve_few : NULL};
  status = flesh_problem_create_here(system, options, solver, &self->problem);
  return status ? status : make_kinsol(self, self->problem->newton.equations.n, options);
}

int flesh_nonlinear_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                 flesh_nonlinear **nonlinear)
{
  flesh_nonlinear *self = *nonlinear = status ? NULL : calloc(1, sizeof *self);
  if (!status) status = create_here(system, options, self);
  status = flesh_problem_meet(system, status, self ? self->problem : NULL);
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
  flesh_nonlinear_destroy(&self->few);
  if (self->kinsol) KINFree(&self->kinsol);
  if (self->solver) SUNLinSolFree(self->solver);
  if (self->matrix) SUNMatDestroy(self->matrix);
  if (self->scale) N_VDestroy(self->scale);
  if (self->u) N_VDestroy(self->u);
  if (self->context) SUNContext_Free(&self->context);
  flesh_problem_destroy(&self->problem);
  free(self);
  *nonlinear = NULL;
}

void flesh_nonlinear_go_on(flesh_nonlinear *self) { self->problem->newton.policy.stage_continues = 1; }

int flesh_nonlinear_began_at(const flesh_nonlinear *self, const double *guess)
{
  return self->problem->newton.began == guess;
}

int flesh_nonlinear_ran_away(const flesh_nonlinear *self) { return self->problem->newton.ran_away; }

const double *flesh_nonlinear_unknowns(const flesh_nonlinear *self)
{
  return N_VGetArrayPointer(self->u);
}

int flesh_nonlinear_worst_node(const flesh_nonlinear *self)
{
  const flesh_equations *equations = &self->problem->newton.equations;
  const flesh_known_residual *residual = &equations->evaluation.residual;
  if (!residual->known) return -1;
  return flesh_evaluation_worst_node(&equations->evaluation, 1, residual->r, NULL);
}

flesh_newton *flesh_nonlinear_newton(flesh_nonlinear *self) { return &self->problem->newton; }

flesh_evaluation *flesh_nonlinear_evaluation(flesh_nonlinear *self)
{
  return &self->problem->newton.equations.evaluation;
}

void *flesh_nonlinear_kinsol(const flesh_nonlinear *self) { return self->kinsol; }

size_t flesh_nonlinear_memory(const flesh_nonlinear *self)
{
  /* KINSOL clones seven vectors of its own beside u and scale. */
  return sizeof *self + (self->few ? sizeof *self->few : 0) + flesh_problem_memory(self->problem) +
         9 * (size_t)self->problem->newton.equations.n * sizeof(double);
}

void flesh_nonlinear_forget(flesh_nonlinear *self)
{
  self->problem->staged = self->problem->zeroed = 0;
  flesh_newton_forget(&self->problem->newton);
}

int flesh_nonlinear_archive(flesh_nonlinear *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->problem->staged);
  FLESH_ARCHIVE(archive, self->problem->zeroed);
  return flesh_newton_archive(&self->problem->newton, archive);
}

void flesh_nonlinear_set_target(flesh_nonlinear *self, double target)
{
  self->problem->newton.given_target = target;
}

void flesh_nonlinear_weigh(flesh_nonlinear *self, const double *weights)
{
  flesh_equations *equations = &self->problem->newton.equations;
  double *own = N_VGetArrayPointer(self->scale);
  if (weights) memcpy(own, weights, (size_t)equations->n * sizeof *own);
  else if (equations->weights) N_VConst(1, self->scale);
  equations->weights = weights ? own : NULL;
}

double flesh_nonlinear_norm(flesh_nonlinear *self, const double *r)
{
  return flesh_equations_norm(&self->problem->newton.equations, r);
}

void flesh_nonlinear_set_depth(flesh_nonlinear *self, double of_first, double of_load, double of_node)
{
  self->problem->newton.given_depth = of_first;
  self->problem->newton.given_share = of_load;
  self->problem->newton.given_mass = of_node;
}

void flesh_nonlinear_soften(flesh_nonlinear *self, const flesh_system *softened)
{
  flesh_equations *equations = &self->problem->newton.equations;
  equations->system = softened ? softened : equations->evaluation.system;
}

void flesh_nonlinear_set_stop(flesh_nonlinear *self, int (*stop)(void *data), void *data)
{
  self->problem->newton.stop = (flesh_stop){stop, data};
}

/* Translates KINSOL's return. */
static int end_of(int flag, flesh_iteration_end *end)
{
  *end = flag == KIN_MAXITER_REACHED ? FLESH_ITERATION_LIMIT : FLESH_ITERATION_STOPPED;
  if (flag == KIN_SYSFUNC_FAIL || flag == KIN_REPTD_SYSFUNC_ERR || flag == KIN_FIRST_SYSFUNC_ERR)
    *end = FLESH_ITERATION_UNDEFINED;
  return flag == KIN_MEM_FAIL ? flesh_fail(FLESH_ERR_MEMORY, "KINSOL ran out of memory") : FLESH_OK;
}

/* The limits of a solve: extensions left, and iterations of max_newton that are used up. */
typedef struct allowance {
  int extensions;
  long used;
} allowance;

/* KINSol, but no more iterations than are left. A smaller limit that a program has set holds unless few are left. */
static int run_kinsol(flesh_nonlinear *self, const allowance *allowed)
{
  const flesh_solver_options *options = &self->problem->newton.options;
  const int strategy = options->line_search == FLESH_LINE_SEARCH_RESIDUAL ? KIN_LINESEARCH : KIN_NONE;
  const long most = options->max_newton < BATCH ? options->max_newton : BATCH;
  const long left = options->max_newton - allowed->used;
  if (left <= 0) return KIN_MAXITER_REACHED;
  if (left < most) KINSetNumMaxIters(self->kinsol, left);
  const int flag = KINSol(self->kinsol, self->u, strategy, self->scale, self->scale);
  if (left < most) KINSetNumMaxIters(self->kinsol, most);
  return flag;
}

/* KINSOL's iterations to the target, BATCH at a time while they get somewhere, max_newton in all and that again for every
 * extension. */
static int iterate(flesh_nonlinear *self, allowance *allowed, double target, flesh_iteration_end *end)
{
  flesh_newton *newton = &self->problem->newton;
  const double *u = N_VGetArrayPointer(self->u);
  double reached = NAN;
  KINSetFuncNormTol(self->kinsol, target);
  for (;;) {
    long last = 0;
    const int flag = run_kinsol(self, allowed);
    KINGetNumNonlinSolvIters(self->kinsol, &last);
    allowed->used += last;
    if (flag != KIN_MAXITER_REACHED) return end_of(flag, end);
    if (last == BATCH && allowed->used + BATCH <= newton->options.max_newton && flesh_stage_gains(newton, u, &reached))
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
  int more = flesh_stage_begin(&self->problem->newton, stage, guesses, N_VGetArrayPointer(self->u), stats, &solve);
  while (more) {
    const int status = iterate(self, &allowed, solve.target, &end);
    more = flesh_stage_goes_on(&solve, status, end);
  }
  return flesh_stage_end(&solve);
}

/* KINSOL of the systems of few nodes gets this one, with vectors of the reserve that the thread is in. */
static int hand_system(flesh_nonlinear *few, const flesh_system *system, const flesh_solver_options *options)
{
  int n = flesh_system_unknowns(system), failed = 0;
  size_t apart;
  double *values = flesh_huge_pages_vectors((size_t)few->vector_count, (size_t)n, &apart);
  if (!values) return flesh_fail(FLESH_ERR_MEMORY, "no memory for KINSOL on %d unknowns", n);
  for (int k = 0; k < few->vector_count; k++) flesh_vector_attach(few->vectors[k], n, values + (size_t)k * apart);
  N_VConst(1, few->scale);
  few->problem->staged = few->problem->zeroed = 0;
  failed |= KINSetNumMaxIters(few->kinsol, options->max_newton < BATCH ? options->max_newton : BATCH);
  failed |= KINSetEtaConstValue(few->kinsol, options->linear_tolerance);
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL refused an option");
  return flesh_newton_init(system, options, (flesh_stage_solver){0}, &few->problem->newton);
}

/* Solves a system of few nodes. A flesh_stage_solver. */
static int solve_few(void *data, const flesh_system *system, const flesh_solver_options *options,
                     const flesh_stage *stage, flesh_stop stop, flesh_solve_stats *stats, double *u)
{
  flesh_nonlinear *few = data;
  int status = hand_system(few, system, options);
  if (status) return status;
  few->problem->newton.stop = stop;
  status = flesh_nonlinear_solve(few, stage, NULL, 0, stats);
  memcpy(u, flesh_nonlinear_unknowns(few), (size_t)flesh_system_unknowns(system) * sizeof *u);
  flesh_newton_clear(&few->problem->newton);
  return status;
}

int flesh_nonlinear_acceleration(flesh_nonlinear *self, const flesh_state *state, double t, double *a,
                                 flesh_solve_stats *stats)
{
  flesh_newton *newton = &self->problem->newton;
  memset(&newton->stats, 0, sizeof newton->stats);
  int status = flesh_newton_acceleration(newton, state, t, a);
  flesh_stage_count(newton, stats);
  return status;
}

int flesh_nonlinear_apply_constraint_jump(flesh_nonlinear *self, double t, const double *x_prescribed,
                                          const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats)
{
  flesh_newton *newton = &self->problem->newton;
  memset(&newton->stats, 0, sizeof newton->stats);
  int status = flesh_newton_apply_constraint_jump(newton, t, x_prescribed, v_prescribed, x, v);
  flesh_stage_count(newton, stats);
  return status;
}

/* Adds what has been counted since `before`, which is the stage's: the next one is judged by that. */
static void add_since(flesh_newton *newton, const flesh_solve_stats *before, flesh_solve_stats *stats)
{
  stats->linear += newton->stats.linear - before->linear;
  stats->linear_single += newton->stats.linear_single - before->linear_single;
  stats->assemblies += newton->stats.assemblies - before->assemblies;
  newton->stats = *before;
}

int flesh_nonlinear_filter_error(flesh_nonlinear *self, const double *b, double *p, double *product, flesh_solve_stats *stats)
{
  flesh_newton *newton = &self->problem->newton;
  const flesh_solve_stats before = newton->stats;
  const int status = flesh_newton_filter_error(newton, N_VGetArrayPointer(self->u), b, p);
  *product = flesh_dot(newton->threads, newton->equations.n, b, p);
  add_since(newton, &before, stats);
  return status;
}

int flesh_nonlinear_keep_volumes(flesh_nonlinear *self, double *p, flesh_solve_stats *stats)
{
  flesh_newton *newton = &self->problem->newton;
  const flesh_solve_stats before = newton->stats;
  const int status = flesh_newton_keep_volumes(newton, N_VGetArrayPointer(self->u), p);
  add_since(newton, &before, stats);
  return status;
}

double flesh_nonlinear_velocity_scale(flesh_nonlinear *self)
{
  flesh_newton *newton = &self->problem->newton;
  flesh_equations *equations = &newton->equations;
  flesh_evaluation *e = &equations->evaluation;
  double *const room[FLESH_VELOCITY_SCALE_ROOM] = {e->x, equations->scratch, e->v, e->a,
                                                   equations->scratch + equations->n};
  flesh_newton_overwritten(newton);
  flesh_evaluation_forget(e);
  double mass;
  return flesh_system_velocity_scale(e->system, equations->K, room, &mass);
}

int flesh_nonlinear_is_clear(const flesh_nonlinear *self)
{
  return flesh_equations_is_clear(&self->problem->newton.equations, N_VGetArrayPointer(self->u));
}

flesh_point flesh_nonlinear_point(flesh_nonlinear *self)
{
  return flesh_equations_point(&self->problem->newton.equations, N_VGetArrayPointer(self->u));
}

const double *flesh_nonlinear_reactions(const flesh_nonlinear *self, const int **constrained, int *count)
{
  const flesh_equations *equations = &self->problem->newton.equations;
  *constrained = equations->constrained.dofs;
  *count = equations->constrained.count;
  return equations->evaluation.residual.reactions;
}

void flesh_nonlinear_progress(const flesh_nonlinear *self, flesh_progress *progress)
{
  const flesh_newton *newton = &self->problem->newton;
  progress->newton = newton->stats.newton;
  progress->linear = newton->stats.linear;
  progress->residual = newton->policy.previous_norm;
  progress->target = newton->policy.target;
}

int flesh_nonlinear_defined(flesh_nonlinear *self, double t, const double *x, const double *v, double *energies,
                            flesh_solve_stats *stats)
{
  double sum = 0;
  flesh_equations *equations = &self->problem->newton.equations;
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
