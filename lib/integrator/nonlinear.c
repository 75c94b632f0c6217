/* nonlinear.c: owns a KINSOL and solves stages with it. */
#include "integrator/nonlinear.h"

#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "integrator/patch.h"
#include "sundials/compatibility.h"
#include "sundials/problem.h"
#include "sundials/vector.h"

enum { BATCH = 300 }; /* iterations after which a solve is asked whether it gets anywhere */

struct flesh_nonlinear {
  flesh_problem *problem;
  SUNContext context;
  void *kinsol;
  SUNMatrix matrix;
  SUNLinearSolver solver;
  N_Vector u, ones;
};

/* KINSOL stops on N_VMaxNorm of the scaled residual. Ours is the 2-norm, so that its test is the one that every
 * tolerance of flesh means. */
static sunrealtype two_norm(N_Vector v)
{
  return flesh_norm(flesh_vector_threads(v), (int)N_VGetLength(v), N_VGetArrayPointer(v));
}

static int kinsol_options(flesh_nonlinear *self)
{
  const flesh_solver_options *options = &self->problem->options;
  void *kinsol = self->kinsol;
  int failed = KINInit(kinsol, flesh_kinsol_residual, self->u);
  failed |= KINSetUserData(kinsol, self->problem);
  failed |= KINSetLinearSolver(kinsol, self->solver, self->matrix);
  failed |= KINSetJacFn(kinsol, flesh_kinsol_jacobian);
  failed |= KINSetNumMaxIters(kinsol, options->max_newton < BATCH ? options->max_newton : BATCH);
  failed |= KINSetMaxSetupCalls(kinsol, 1);      /* the Jacobian's callback knows when the last one serves */
  failed |= KINSetMaxNewtonStep(kinsol, 1e300);  /* the guard limits steps, not |u|, which starts at 0 */
  failed |= KINSetScaledStepTol(kinsol, 1e-300); /* only a zero step ends a solve by itself */
  failed |= KINSetEtaForm(kinsol, KIN_ETACONSTANT);
  failed |= KINSetEtaConstValue(kinsol, options->linear_tolerance);
  return failed ? flesh_fail(FLESH_ERR_SUNDIALS, "KINSOL refused an option") : FLESH_OK;
}

int flesh_nonlinear_create(const flesh_system *system, const flesh_solver_options *options,
                           flesh_nonlinear **nonlinear)
{
  *nonlinear = NULL;
  flesh_nonlinear *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a nonlinear solver");
  int status = flesh_problem_create(system, options, &self->problem);
  if (!status && options->nonlinear_elimination) self->problem->patch = flesh_patch_solve;
  if (!status && flesh_suncontext_create(&self->context))
    status = flesh_fail(FLESH_ERR_SUNDIALS, "SUNDIALS gave no context");
  if (!status) {
    self->u = N_VNew_Serial(self->problem->n, self->context);
    if (self->u && !flesh_vector_quicken(self->u, self->problem->threads)) {
      self->u->ops->nvmaxnorm = two_norm;
      self->ones = N_VClone(self->u);
    }
    self->kinsol = KINCreate(self->context);
    if (!self->u || !self->ones || !self->kinsol)
      status = flesh_fail(FLESH_ERR_MEMORY, "no memory for KINSOL on %d unknowns", self->problem->n);
  }
  if (!status) {
    flesh_sundials_silence(self->context, self->kinsol);
    N_VConst(0, self->u);
    N_VConst(1, self->ones);
    status = flesh_sunmatrix_create(self->problem, self->context, &self->matrix);
  }
  if (!status) status = flesh_sunlinsol_create(self->problem, self->context, &self->solver);
  if (!status) status = kinsol_options(self);
  if (status) {
    flesh_nonlinear_destroy(&self);
    return status;
  }
  *nonlinear = self;
  return FLESH_OK;
}

void flesh_nonlinear_destroy(flesh_nonlinear **nonlinear)
{
  if (!nonlinear || !*nonlinear) return;
  flesh_nonlinear *self = *nonlinear;
  if (self->kinsol) KINFree(&self->kinsol);
  if (self->solver) SUNLinSolFree(self->solver);
  if (self->matrix) SUNMatDestroy(self->matrix);
  if (self->ones) N_VDestroy(self->ones);
  if (self->u) N_VDestroy(self->u);
  if (self->context) SUNContext_Free(&self->context);
  flesh_problem_destroy(&self->problem);
  free(self);
  *nonlinear = NULL;
}

void flesh_nonlinear_go_on(flesh_nonlinear *self) { self->problem->goes_on = 1; }

const double *flesh_nonlinear_unknowns(const flesh_nonlinear *self)
{
  return N_VGetArrayPointer(self->u);
}

const double *flesh_nonlinear_positions(const flesh_nonlinear *self) { return self->problem->x; }

int flesh_nonlinear_worst_node(const flesh_nonlinear *self)
{
  if (!self->problem->residual.known) return -1;
  const double *r = self->problem->residual.r;
  int worst = 0;
  for (int d = 0; d < self->problem->n; d++)
    if (fabs(r[d]) > fabs(r[worst])) worst = d;
  return worst / 3;
}

void flesh_nonlinear_set_costs(flesh_nonlinear *self, flesh_costs *costs)
{
  self->problem->costs = costs;
}

flesh_threads *flesh_nonlinear_threads(const flesh_nonlinear *self) { return self->problem->threads; }

void *flesh_nonlinear_kinsol(const flesh_nonlinear *self) { return self->kinsol; }

size_t flesh_nonlinear_memory(const flesh_nonlinear *self)
{
  /* KINSOL clones seven vectors of its own beside u and ones. */
  return sizeof *self + flesh_problem_memory(self->problem) +
         9 * (size_t)self->problem->n * sizeof(double);
}

void flesh_nonlinear_set_stop(flesh_nonlinear *self, int (*stop)(void *data), void *data)
{
  self->problem->stop = stop;
  self->problem->stop_data = data;
}

/* What KINSOL's return means for the stage. */
static int judge(flesh_nonlinear *self, int flag, double target, flesh_solve_stats *stats)
{
  flesh_problem *problem = self->problem;
  const double *u = N_VGetArrayPointer(self->u);
  if (problem->stopped) return problem->stopped;
  if (flag == KIN_MEM_FAIL) return flesh_fail(FLESH_ERR_MEMORY, "KINSOL ran out of memory");
  /* A step into where an energy has no value, without a shorter one that KINSOL could find. */
  if (flag == KIN_SYSFUNC_FAIL || flag == KIN_REPTD_SYSFUNC_ERR || flag == KIN_FIRST_SYSFUNC_ERR)
    return problem->refused ? problem->refused : FLESH_NOT_CONVERGED;
  int status = flesh_problem_residual(problem, u, problem->residual.r);
  if (status) return status;
  double norm = flesh_norm(problem->threads, problem->n, problem->residual.r);
  stats->residual_last = norm;
  if (norm <= target) return FLESH_OK;
  /* The line search may have given up, or KINSOL stopped, on a residual that cannot be made smaller. */
  if (problem->at_rounding || norm <= 16 * flesh_problem_rounding(problem, u)) {
    stats->at_rounding++;
    return FLESH_OK;
  }
  if (flag == KIN_MAXITER_REACHED && problem->options.accept_unconverged) {
    stats->unconverged++;
    return FLESH_OK;
  }
  return FLESH_NOT_CONVERGED;
}

static void add_counts(const flesh_problem *problem, flesh_solve_stats *stats)
{
  stats->newton += problem->stats.newton;
  stats->linear += problem->stats.linear;
  stats->linear_single += problem->stats.linear_single;
  stats->direct += problem->stats.direct;
  stats->assemblies += problem->stats.assemblies;
  stats->projections += problem->stats.projections;
  stats->residuals += problem->stats.residuals;
  stats->potentials += problem->stats.potentials;
  stats->backtracks += problem->stats.backtracks;
  stats->patches += problem->stats.patches;
  stats->patch_newton += problem->stats.patch_newton;
  stats->patch_share += problem->stats.patch_share;
  stats->detours += problem->stats.detours;
  stats->potential_rises += problem->stats.potential_rises;
}

/* Takes the guess for the free dofs where that has the lower potential. */
static void try_guess(flesh_problem *problem, const double *guess, double *u)
{
  double value, guessed, size;
  if (flesh_problem_potential(problem, u, &value, &size)) value = INFINITY;
  flesh_copy(problem->threads, problem->n, guess, problem->step);
  for (int k = 0; k < problem->held_count; k++) problem->step[problem->held[k]] = u[problem->held[k]];
  if (!flesh_problem_reaches(problem, problem->step)) return;
  if (!flesh_problem_evaluate(problem, problem->step, &guessed, &size) && guessed < value)
    flesh_copy(problem->threads, problem->n, problem->step, u);
}

/* Whether a solve still gets somewhere: its last iterations, since the potential was *reached (NAN: the first), took at
 * least a tenth of all that has been gained. Starting again with half the step would throw that away. */
static int goes_on(flesh_problem *problem, const double *u, double *reached)
{
  double value, magnitude, before = isnan(*reached) ? problem->first_potential : *reached;
  if (isnan(before) || flesh_problem_potential(problem, u, &value, &magnitude)) return 0;
  *reached = value;
  return before - value > fmax(0.1 * (problem->first_potential - value), 1e-12 * magnitude);
}

/* KINSOL's iterations, BATCH at a time while they get somewhere, max_newton in all and that again for every
 * extension. A smaller limit that a program has set in KINSOL holds. Returns KINSOL's flag. */
static int iterate(flesh_nonlinear *self, int strategy, int extensions)
{
  flesh_problem *problem = self->problem;
  const int limit = problem->options.max_newton;
  double reached = NAN;
  for (long used = 0, last = 0;;) {
    const int flag = KINSol(self->kinsol, self->u, strategy, self->ones, self->ones);
    if (flag != KIN_MAXITER_REACHED) return flag;
    KINGetNumNonlinSolvIters(self->kinsol, &last);
    used += last;
    if (last == BATCH && used + BATCH <= limit && goes_on(problem, N_VGetArrayPointer(self->u), &reached)) continue;
    if (extensions-- <= 0) return flag;
    used = 0;
  }
}

int flesh_nonlinear_solve(flesh_nonlinear *self, const flesh_stage *stage, const double *const *guesses,
                          int extensions, flesh_solve_stats *stats)
{
  flesh_problem *problem = self->problem;
  double *u = N_VGetArrayPointer(self->u), load;
  int status = flesh_problem_set_stage(problem, stage);
  if (status) return status;
  memset(&problem->stats, 0, sizeof problem->stats);
  stats->residual_first = stats->residual_last = stats->residual_target = 0;
  flesh_problem_start(problem, u);
  status = flesh_problem_clear(problem, u);
  for (; guesses && *guesses && !status; guesses++) try_guess(problem, *guesses, u);
  /* What has no potential may have a residual all the same. */
  double phi, size;
  if (!status && problem->options.globalization == FLESH_GLOBALIZATION_ENERGY)
    flesh_problem_evaluate(problem, u, &phi, &size);
  if (!status) status = flesh_problem_residual(problem, u, problem->residual.r);
  double first = status ? 0 : flesh_norm(problem->threads, problem->n, problem->residual.r);
  if (!status) status = flesh_problem_load_norm(problem, u, &load);
  if (status) return status;
  double target = problem->options.newton_tolerance * fmax(first, load);
  stats->solves++;
  stats->residual_first = stats->residual_last = first;
  stats->residual_target = problem->target = target;
  if (first > target) {
    KINSetFuncNormTol(self->kinsol, target);
    int search = problem->options.globalization == FLESH_GLOBALIZATION_KINSOL;
    int strategy = search ? KIN_LINESEARCH : KIN_NONE;
    status = judge(self, iterate(self, strategy, extensions), target, stats);
  }
  if (!status) flesh_problem_reach(problem, u);
  add_counts(problem, stats);
  return status;
}

int flesh_nonlinear_acceleration(flesh_nonlinear *self, double t, const double *x, const double *v,
                                 double *a, flesh_solve_stats *stats)
{
  memset(&self->problem->stats, 0, sizeof self->problem->stats);
  int status = flesh_problem_acceleration(self->problem, t, x, v, a);
  add_counts(self->problem, stats);
  return status;
}

int flesh_nonlinear_take_up(flesh_nonlinear *self, double t, const double *x_prescribed,
                            const double *v_prescribed, double *x, double *v, flesh_solve_stats *stats)
{
  memset(&self->problem->stats, 0, sizeof self->problem->stats);
  int status = flesh_problem_take_up(self->problem, t, x_prescribed, v_prescribed, x, v);
  add_counts(self->problem, stats);
  return status;
}

int flesh_nonlinear_defined(flesh_nonlinear *self, double t, const double *x, const double *v,
                            flesh_solve_stats *stats)
{
  double phi, magnitude;
  flesh_problem *problem = self->problem;
  if (x != problem->x) memcpy(problem->x, x, (size_t)problem->n * sizeof *x);
  memset(problem->a, 0, (size_t)problem->n * sizeof *problem->a);
  stats->potentials++;
  const flesh_stage *stage = &problem->stage;
  if (flesh_system_way(problem->system, stage->t_lag, stage->x_lag, t, problem->x) < 1)
    return FLESH_UNDEFINED;
  const flesh_point point = {.t = t, .load = 1, .x = problem->x, .v = v, .a = problem->a,
                             .threads = problem->threads, .costs = problem->costs};
  return flesh_system_potential(problem->system, &point, &(flesh_shift){.x = 1}, &phi, &magnitude);
}
