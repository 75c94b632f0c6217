/* stage.c: first iterate, convergence criterion and result of a stage's solve. */
#include "newton/stage.h"

#include <math.h>
#include <string.h>

#include "newton/mechanisms.h"
#include "system/edge_force.h"
#include "system/feasible_step.h"
#include "system/one_effect.h"

/* Changes the free dofs of u, the start, so that no effect limits the way there and no node is much nearer to an obstacle
 * than before; FLESH_UNDEFINED where the constrained dofs are in the way. */
static int push_out(flesh_equations *equations, double *u)
{
  const flesh_stage *s = &equations->stage;
  const size_t size = (size_t)equations->n * sizeof *u;
  const int touches = equations->evaluation.proximity.near != NULL;
  double *pushed = equations->scratch + equations->n;
  if (flesh_equations_is_clear(equations, u)) return FLESH_OK;
  const int reaches = flesh_equations_is_feasible(equations, u, 0);
  memcpy(pushed, equations->scratch, size);
  flesh_system_push_out(equations->system, s->t_from, s->x_from, s->t, pushed);
  if (reaches && flesh_same(equations->threads, equations->n, pushed, equations->scratch)) return FLESH_OK;
  flesh_equations_take_free(equations, pushed, u);
  if (flesh_equations_is_feasible(equations, u, 0)) return FLESH_OK;
  if (reaches) flesh_equations_start(equations, u);
  if (reaches || !touches) return reaches ? FLESH_OK : FLESH_UNDEFINED;
  /* Nodes are not pushed out of other bodies: they stay where they were. */
  flesh_equations_take_free(equations, s->x_from, u);
  return flesh_equations_is_feasible(equations, u, 0) ? FLESH_OK : FLESH_UNDEFINED;
}

/* A guess is taken only if the straight way to it could be extended by this fraction without contact. Nearer to an obstacle
 * round-off hides the residual, and the guess would count as solved. */
static const double clear_way = 1e-3;

/* Takes the free dofs of the guess if its potential is lower than *value, which is then updated. */
static void try_guess(flesh_newton *newton, const double *guess, double *value, double *u)
{
  flesh_equations *equations = &newton->equations;
  flesh_constrained *constrained = &equations->constrained;
  double guessed, size, *trial = equations->trial;
  flesh_copy(newton->threads, equations->n, guess, trial);
  for (int k = 0; k < constrained->count; k++)
    trial[constrained->dofs[k]] = u[constrained->dofs[k]];
  /* Guesses are better than keeping the gaps where errors choose the steps. */
  if (!(newton->goal.target > 0)) flesh_equations_keep_gaps(equations, trial);
  /* With near bodies, checking the way costs more than the potential, once pairs have been searched for the first guess. */
  const int last = equations->evaluation.proximity.near && newton->iterations.began;
  if (!last && !flesh_equations_is_feasible(equations, trial, clear_way)) return;
  if (flesh_equations_evaluate(equations, trial, &guessed, &size) || !(guessed < *value)) return;
  if (last && !flesh_equations_is_feasible(equations, trial, clear_way)) return;
  *value = guessed;
  flesh_copy(newton->threads, equations->n, trial, u);
  newton->iterations.began = guess;
}

double flesh_equations_norm(flesh_equations *self, const double *r)
{
  if (!self->weights) return flesh_norm(self->threads, self->n, r);
  for (int d = 0; d < self->n; d++) self->scratch[d] = self->weights[d] * r[d];
  return flesh_norm(self->threads, self->n, self->scratch);
}

/* Judges the end of the iteration at u: FLESH_OK if it has converged or is accepted. */
static int judge(flesh_newton *newton, flesh_iteration_end end, const double *u, double target,
                 flesh_solve_stats *stats)
{
  flesh_equations *equations = &newton->equations;
  if (newton->iterations.stopped) return newton->iterations.stopped;
  if (equations->fatal) return equations->fatal;
  if (end == FLESH_ITERATION_UNDEFINED) return equations->refused ? equations->refused : FLESH_NOT_CONVERGED;
  int status = flesh_equations_residual(equations, u, equations->evaluation.residual.r);
  if (status) return status;
  const double norm = flesh_equations_norm(equations, equations->evaluation.residual.r);
  stats->residual_last = norm;
  if (norm <= target || newton->iterations.converged_by_step) return FLESH_OK;
  /* The line search may have given up, or the iteration stopped, at a residual that cannot be made smaller. */
  if (newton->iterations.at_round_off ||
      (norm <= 16 * flesh_equations_residual_round_off(equations, u) && !flesh_search_makes_progress(&newton->search, u))) {
    stats->at_rounding++;
    return FLESH_OK;
  }
  if (end == FLESH_ITERATION_LIMIT && newton->options.accept_unconverged) {
    stats->unconverged++;
    return FLESH_OK;
  }
  return FLESH_NOT_CONVERGED;
}

/* Target of a solve with a frozen state, relative to its first residual: a smaller one gains nothing, because the frozen
 * state will change. */
static const double frozen_depth = 0.03;

/* Evaluates the residual's norm at u, and the potential with it if that is needed. */
static int evaluate(flesh_newton *newton, const double *u, double *norm)
{
  flesh_equations *equations = &newton->equations;
  double phi, size;
  /* The residual may have a value even where the potential has none. */
  if (newton->options.line_search == FLESH_LINE_SEARCH_POTENTIAL)
    flesh_equations_evaluate(equations, u, &phi, &size);
  int status = flesh_equations_residual(equations, u, equations->evaluation.residual.r);
  *norm = status ? 0 : flesh_equations_norm(equations, equations->evaluation.residual.r);
  return status;
}

/* Returns the tolerance, larger for a step with softened materials, whose solution is only a first iterate. */
static double tolerance_of(const flesh_newton *newton)
{
  const flesh_equations *equations = &newton->equations;
  const double own = newton->options.newton_tolerance;
  return flesh_equations_is_softened(equations) && equations->stage.shift.a != 0 ? fmax(own, 1e-2) : own;
}

/* Asks for iterations to the solve's target from a residual of norm `norm`; to a larger one if the frozen state will
 * change. */
static int aim(flesh_stage_solve *self, double norm)
{
  self->target = self->freezes ? fmax(self->last_target, frozen_depth * norm) : self->last_target;
  return 1;
}

/* Freezes at the last iterate, and asks for more iterations unless the residual is then at the target or they would change
 * nothing. */
static int freeze(flesh_stage_solve *self)
{
  enum { REPETITIONS = 60 };
  flesh_newton *newton = self->newton;
  const int unsolved = self->stats->at_rounding + self->stats->unconverged;
  const int arrived = newton->iterations.converged_by_step;
  double norm, *r = newton->equations.evaluation.residual.r, *change = newton->equations.work[0];
  if (self->frozen && (newton->stats.newton <= self->newtons + arrived || unsolved > self->unsolved)) return 0;
  if (self->frozen++ == REPETITIONS) self->status = FLESH_NOT_CONVERGED;
  if (self->status) return 0;
  self->newtons = newton->stats.newton;
  self->unsolved = unsolved;
  if (arrived) flesh_copy(newton->threads, newton->equations.n, r, change);
  flesh_newton_freeze(newton, self->u);
  self->status = evaluate(newton, self->u, &norm);
  if (self->status) return 0;
  self->stats->residual_last = norm;
  for (int d = 0; d < newton->equations.n && arrived; d++) change[d] -= r[d];
  newton->iterations.converged_by_step = arrived && flesh_equations_norm(&newton->equations, change) <= self->last_target;
  return norm > self->last_target && !newton->iterations.converged_by_step && aim(self, norm);
}

/* Forces balance if their sum is less than this fraction of the largest. Otherwise they fade together, as in a body that
 * comes to rest without a load: then there is nothing to compare the residual with. */
static const double balanced = 0.1;

/* Computes the 2-norm of one effect's residual at `point`: over the free dofs and, if it couples nodes, the constrained
 * ones, through which reactions pass. */
static int effect_norm(flesh_equations *self, int k, const flesh_point *point, double *norm)
{
  flesh_constrained *constrained = &self->constrained;
  double *r = self->scratch;
  int status = flesh_system_effect_residual(self->system, k, point, r);
  if (!flesh_system_effect(self->system, k)->operations->cells)
    for (int j = 0; j < constrained->count; j++) r[constrained->dofs[j]] = 0;
  *norm = flesh_norm(self->threads, self->n, r);
  return status;
}

/* Finds the largest of the applied load, whose norm is given, and the norms of all other effects at u. Evaluates effects,
 * cheap ones first, until a norm reaches `enough`. */
static int largest_force(flesh_equations *self, const double *u, double load, double enough, double *size)
{
  double norm;
  *size = load;
  const flesh_point point = flesh_equations_point(self, u);
  for (int coupled = 0; coupled < 2; coupled++)
    for (int k = 0; k < flesh_system_effect_count(self->system) && !(*size >= enough); k++) {
      const flesh_effect_operations *can = flesh_system_effect(self->system, k)->operations;
      if (!can->residual || can->role == FLESH_ROLE_LOAD || coupled != (can->cells != NULL)) continue;
      if (flesh_clearance_holds(self->evaluation.at_stage.clearance, k)) continue; /* the effect has no force */
      int status = effect_norm(self, k, &point, &norm);
      if (status) return status;
      if (norm < INFINITY) *size = fmax(*size, norm);
    }
  return FLESH_OK;
}

/* Finds the force that strains the softest edge by its own length (system/edge_force.h). */
static int find_edge_force(flesh_equations *self, double *softest)
{
  const flesh_evaluation *e = &self->evaluation;
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  flesh_point rest = flesh_evaluation_point(e, self->stage.t, X, e->zeros, e->zeros);
  flesh_edge_force force;
  rest.internal = self->stage.internal;
  const int status = flesh_system_edge_force(e, FLESH_ROLES_ALL, &rest, self->scratch, &force);
  if (!status) *softest = force.softest;
  return status;
}

/* Lowers the solve's target if the residual, of this norm, meets it but is not small beside the forces that balance each
 * other, inertia among them, as solver.h says of newton_tolerance. The first iterate's residual is a bad measure where an
 * obstacle has just moved into the barrier, a prescribed motion has jumped, or a short step begins with a jolt: it is then
 * far larger than any force at the end of the step. Evaluates effects only as far as needed. */
static int lower_target(flesh_stage_solve *solve, double norm)
{
  flesh_newton *newton = solve->newton;
  flesh_equations *self = &newton->equations;
  const double tolerance = tolerance_of(newton), enough = norm / tolerance;
  double size, load;
  int status = flesh_equations_load_norm(self, solve->u, &load);
  if (status || load >= enough) return status;
  if (solve->first < enough) { /* the load was larger than the first residual */
    solve->last_target = tolerance * fmax(solve->first, load);
    return FLESH_OK;
  }
  status = largest_force(self, solve->u, load, enough, &size);
  if (status || size >= enough) return status;
  if (load == 0 && norm > balanced * size) {
    if (!(newton->edge_force >= 0)) status = find_edge_force(self, &newton->edge_force);
    if (status) return status;
    size = fmax(size, newton->edge_force);
  }
  if (size < enough) solve->last_target = tolerance * size;
  return FLESH_OK;
}

/* Asks for more iterations if the forces that balance each other at the last iterate call for a smaller target. */
static int sharpen(flesh_stage_solve *self)
{
  flesh_newton *newton = self->newton;
  const double norm = self->stats->residual_last;
  if (self->status || norm > self->last_target || newton->iterations.converged_by_step) return 0; /* failed, or solved */
  if (newton->goal.target > 0 || !flesh_uses(&newton->options, FLESH_TECHNIQUE_BALANCED_TARGET)) return 0;
  /* An equilibrium of softened materials is only a start for another. */
  if (flesh_equations_is_softened(&newton->equations) && newton->equations.stage.shift.a == 0) return 0;
  self->status = lower_target(self, norm);
  if (self->status || norm <= self->last_target) return 0;
  self->stats->residual_target = newton->policy.target = self->last_target;
  self->frozen = 0;
  return aim(self, norm);
}

int flesh_stage_continue(flesh_stage_solve *self, int status, flesh_iteration_end end)
{
  flesh_newton *newton = self->newton;
  self->status = status && !newton->iterations.stopped ? status : judge(newton, end, self->u, self->target, self->stats);
  if (self->status) return 0;
  return (self->freezes && freeze(self)) || sharpen(self);
}

/* Target of a solve with this first residual and load. */
static double first_target(const flesh_newton *newton, double first, double load)
{
  const double given = newton->goal.target;
  if (!(given > 0)) return tolerance_of(newton) * fmax(first, load);
  return fmin(fmin(given, newton->goal.of_first * first), load > 0 ? newton->goal.of_load * fmax(first, load) : INFINITY);
}

/* Multiple of the target up to which the residual of a guess is near: evaluating u = 0 would then save no iterations. */
static const double near_enough = 1e3;

/* Whether u, a first guess that was taken, is near the solution. */
static int is_near(flesh_newton *newton, const double *u)
{
  double *r = newton->equations.evaluation.residual.r;
  return newton->iterations.began && !flesh_equations_residual(&newton->equations, u, r) &&
         flesh_equations_norm(&newton->equations, r) <= near_enough * newton->goal.target;
}

/* Starts from u = 0, pushed out, or from the guess with the lowest potential. Where errors choose steps, a guess is seldom
 * worse than u = 0, which is then skipped if the last solve was easy or the first guess is near the solution. */
static int find_start(flesh_newton *newton, const double *const *guesses, int easy, double *u)
{
  flesh_equations *equations = &newton->equations;
  const int guessed = guesses && *guesses, trusts = guessed && newton->goal.target > 0 && newton->goal.node_mass > 0;
  double value = INFINITY, size;
  flesh_equations_start(equations, u);
  if (trusts) try_guess(newton, *guesses, &value, u);
  const int alone = trusts && (easy || is_near(newton, u));
  if (trusts && !alone) flesh_equations_start(equations, u), newton->iterations.began = NULL;
  int status = alone ? FLESH_UNDEFINED : push_out(equations, u);
  if (guessed && !status && flesh_equations_potential(equations, u, &value, &size)) value = INFINITY;
  if (alone) guesses++; /* the guess has been tried */
  for (; guessed && *guesses; guesses++) try_guess(newton, *guesses, &value, u);
  if (newton->iterations.began) status = FLESH_OK;
  else if (alone) status = push_out(equations, u);
  if (guessed && !status) flesh_volume_arc_start(&newton->arc, u);
  return status;
}

int flesh_stage_begin(flesh_newton *newton, const flesh_stage *stage, const double *const *guesses, double *u,
                      flesh_solve_stats *stats, flesh_stage_solve *self)
{
  flesh_equations *equations = &newton->equations;
  *self = (flesh_stage_solve){.newton = newton, .stats = stats, .u = u};
  flesh_newton_set_stage(newton, stage);
  const int easy = newton->stats.backtracks == 0;
  memset(&newton->stats, 0, sizeof newton->stats);
  stats->residual_first = stats->residual_last = stats->residual_target = 0;
  int status = find_start(newton, guesses, easy, u);
  self->freezes = equations->evaluation.frozen && stage->frozen_at_solution;
  if (self->freezes && !status) flesh_newton_freeze(newton, u);
  if (!status) status = evaluate(newton, u, &self->first);
  double load = 0;
  if (!status) status = flesh_equations_load_norm(equations, u, &load);
  newton->iterations.first_load = load;
  if (equations->fatal) status = equations->fatal;
  self->status = status;
  self->begun = !status;
  if (status) return 0;
  const double first = self->first;
  self->last_target = first_target(newton, first, load);
  stats->solves += !flesh_equations_is_softened(equations);
  stats->residual_first = stats->residual_last = first;
  stats->residual_target = newton->policy.target = self->last_target;
  if (first <= self->last_target) return 0;
  /* Skips the solve if the first residual is at round-off: a free body that just moves on. */
  return !(load == 0 && flesh_equations_at_round_off(equations, u, first)) && aim(self, first);
}

int flesh_stage_end(flesh_stage_solve *self)
{
  if (!self->begun) return self->status;
  if (!self->status) flesh_newton_end_stage(self->newton, self->u);
  flesh_stage_count(self->newton, self->stats);
  return self->status;
}

int flesh_stage_makes_progress(flesh_newton *newton, const double *u, double *reached)
{
  const double first = newton->search.first_potential, before = isnan(*reached) ? first : *reached;
  double value, magnitude;
  if (isnan(before) || flesh_equations_potential(&newton->equations, u, &value, &magnitude)) return 0;
  *reached = value;
  return before - value > fmax(0.1 * (first - value), 1e-12 * magnitude);
}

void flesh_stage_count(const flesh_newton *newton, flesh_solve_stats *stats)
{
  const flesh_solve_stats *counted = &newton->stats;
  stats->newton += counted->newton;
  stats->linear += counted->linear;
  stats->linear_single += counted->linear_single;
  stats->direct += counted->direct;
  stats->assemblies += counted->assemblies;
  stats->projections += counted->projections;
  stats->residuals += counted->residuals;
  stats->potentials += counted->potentials;
  stats->backtracks += counted->backtracks;
  stats->subdomains += counted->subdomains;
  stats->subdomain_newton += counted->subdomain_newton;
  stats->subdomain_share += counted->subdomain_share;
  stats->watchdog_steps += counted->watchdog_steps;
  stats->potential_rises += counted->potential_rises;
}
