/* newton.c: one Newton iteration, from the matrix over the direction to the step. */
#include "newton/newton.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "effect/effect.h"
#include "mesh/edges.h"
#include "newton/mechanisms.h"
#include "system/ranks.h"
#include "system/velocity_scale.h"

static const double most_operations = 1e10; /* limit for a tangent's factorisation: some 20 s */

/* One iteration: its starting point, and the step in the making. */
typedef struct iteration {
  flesh_step step;
  double tolerance; /* N, tolerance of the linear solve */
  int guarded;      /* the step is scaled by the line search, and may follow negative curvature */
  int may_filter;   /* an indefinite matrix is filtered, not refused */
} iteration;

int flesh_newton_asked_to_stop(void *data)
{
  flesh_newton *self = data;
  int *stopped = &self->iterations.stopped;
  if (!*stopped) *stopped = self->equations.fatal;
  if (!*stopped) *stopped = flesh_ask_together(self->equations.team, self->stop.stop, self->stop.data);
  return *stopped;
}

static int filters_always(const flesh_newton *self)
{
  return self->options.eigenvalue_filter >= FLESH_FILTER_CLAMP_ALWAYS;
}

/* Chooses the filter by the rule of Chen et al. 2024, "Trust-Region Eigenvalue Filtering", who trust the model to within a
 * hundredth. It saves a tenth of the iterations in dynamics and none in statics. Trusting it to within a fifth saves a
 * third of a shear's, but tangles stretched bodies. */
static flesh_eigenvalue_filter choose_filter(const flesh_newton *self)
{
  flesh_eigenvalue_filter eigenvalue_filter = self->options.eigenvalue_filter;
  if (filters_always(self)) eigenvalue_filter += FLESH_FILTER_CLAMP - FLESH_FILTER_CLAMP_ALWAYS;
  if (eigenvalue_filter == FLESH_FILTER_AUTO)
    eigenvalue_filter = self->equations.stage.shift.a != 0 ? FLESH_FILTER_TRUST_REGION : FLESH_FILTER_ABSOLUTE;
  if (eigenvalue_filter == FLESH_FILTER_TRUST_REGION)
    return fabs(self->iterations.model_ratio - 1) < 0.01 ? FLESH_FILTER_CLAMP : FLESH_FILTER_ABSOLUTE;
  return eigenvalue_filter;
}

/* Whether an indefinite matrix is assembled again without its negative eigenvalues. */
static int filters_where_indefinite(const flesh_newton *self)
{
  return !filters_always(self) && self->options.eigenvalue_filter != FLESH_FILTER_NONE;
}

static flesh_eigenvalue_filter first_filter(const flesh_newton *self)
{
  return filters_always(self) ? choose_filter(self) : FLESH_FILTER_NONE;
}

static int assemble(flesh_newton *self, const double *u, flesh_eigenvalue_filter filter)
{
  self->tangent.known = 0;
  int status = flesh_direction_assemble(&self->direction, u, filter);
  if (!status) flesh_matrix_policy_assembled(&self->policy);
  return status;
}

/* Whether the next solve uses a factorisation. It then needs no new preconditioner; volume arcs use the old one. */
static int goes_by_factors(const flesh_newton *self)
{
  return self->direction.fallback_state == FLESH_FALLBACK_IN_USE && !self->iterations.follow_curvature;
}

/* Assembles a matrix at the iterate itself, and prepares the solves with it. */
static int assemble_and_factor(flesh_newton *self, const iteration *it, flesh_eigenvalue_filter filter)
{
  const int status = assemble(self, it->step.u, filter);
  return status || goes_by_factors(self) ? status : flesh_matrix_policy_refresh(&self->policy);
}

/* Solves with the prepared matrix. */
static int solve(flesh_newton *self, iteration *it)
{
  flesh_direction *direction = &self->direction;
  /* Without inertia K may be singular: iterations leave directions alone that a factorisation would move far. */
  const int gives_way = self->equations.stage.shift.a != 0 && flesh_uses(&self->options, FLESH_TECHNIQUE_DIRECT_FALLBACK);
  /* A filtered matrix has no negative curvature. Where it is flat, as along free motions of a static body, only following
   * those directions leads on. */
  const int follows = self->iterations.follow_curvature || direction->filter != FLESH_FILTER_NONE;
  const flesh_direction_request request = {.tolerance = it->tolerance, .stop = flesh_newton_asked_to_stop, .stop_data = self,
                                           .max_iterations = self->options.max_linear,
                                           .follow_curvature = it->guarded && follows,
                                           .gives_way = gives_way,
                                           .weights = self->iterations.weights};
  if (goes_by_factors(self)) return FLESH_NOT_CONVERGED;
  const int status = flesh_direction_solve(direction, &request, it->step.b, it->step.p, &it->step.kind);
  self->negative_curvature = it->step.kind == FLESH_DIRECTION_NEGATIVE_CURVATURE;
  return status;
}

/* Solves by a direct factorisation; if that is too expensive, by the truncated solve, which still descends. */
static int solve_directly(flesh_newton *self, iteration *it)
{
  flesh_direction *direction = &self->direction;
  it->step.kind = direction->filter == FLESH_FILTER_NONE ? FLESH_DIRECTION_NEWTON : FLESH_DIRECTION_FILTERED;
  self->negative_curvature = 0;
  int status = FLESH_NOT_CONVERGED;
  if (direction->fallback_state != FLESH_FALLBACK_TOO_EXPENSIVE &&
      flesh_uses(&self->options, FLESH_TECHNIQUE_DIRECT_FALLBACK))
    status = flesh_direction_solve_directly(direction, it->step.b, it->step.p);
  return status == FLESH_NOT_CONVERGED && direction->iterations > 0 ? FLESH_OK : status;
}

/* Whether the next direction should follow negative curvature: after a filtered step that was too short, until one that
 * followed it had to be cut. From then on such steps crawl where tets are stiff against changes of volume. */
static int choose_follow(const flesh_newton *self, const flesh_step *step)
{
  if (filters_always(self) || !flesh_uses(&self->options, FLESH_TECHNIQUE_NEGATIVE_CURVATURE)) return 0;
  if (step->kind == FLESH_DIRECTION_FILTERED) return step->too_short_locally;
  return self->iterations.follow_curvature && !(step->kind == FLESH_DIRECTION_NEGATIVE_CURVATURE && step->length < 1);
}

/* Scales the direction so that the potential falls; FLESH_NOT_POSITIVE also if following negative curvature leads nowhere. */
static int search(flesh_newton *self, iteration *it)
{
  flesh_step *step = &it->step;
  const int follows = step->kind == FLESH_DIRECTION_NEGATIVE_CURVATURE;
  if (!it->guarded) return FLESH_OK;
  if (!follows) flesh_volume_arc_bend(&self->arc, step->u, step->b, step->p);
  const int status = flesh_search_run(&self->search, step);
  if (status) return status == FLESH_NOT_CONVERGED && follows ? FLESH_NOT_POSITIVE : status;
  flesh_newton_iterations *known = &self->iterations;
  known->follow_curvature = choose_follow(self, step);
  known->model_ratio = step->model_ratio;
  return FLESH_OK;
}

/* Finds the step with the present matrix; FLESH_NOT_POSITIVE where that is indefinite. */
static int find_step(flesh_newton *self, iteration *it)
{
  int status = solve(self, it);
  if (status == FLESH_NOT_CONVERGED) status = solve_directly(self, it);
  return status ? status : search(self, it);
}

/* Makes an iteration whose matrix was prepared with `status`. A matrix that turns out indefinite is filtered, once. */
static int run(flesh_newton *self, int status, iteration *it)
{
  if (!status) status = find_step(self, it);
  if (status == FLESH_NOT_POSITIVE && it->may_filter) {
    status = assemble_and_factor(self, it, choose_filter(self));
    if (!status) status = find_step(self, it);
  }
  if (status) return status;
  if (it->guarded) flesh_newton_accelerate(self, &it->step);
  self->stats.newton++;
  return FLESH_OK;
}

int flesh_newton_step_from(flesh_newton *self, const double *u, const double *b, double norm, double *q)
{
  iteration it = {.step = {.u = u, .b = b, .p = q}, .tolerance = self->options.linear_tolerance * norm,
                  .may_filter = filters_where_indefinite(self)};
  return run(self, assemble_and_factor(self, &it, first_filter(self)), &it);
}

int flesh_newton_uses_elimination(const flesh_system *system, const flesh_solver_options *options)
{
  int sums = 0;
  for (int k = 0; k < flesh_system_effect_count(system); k++)
    sums |= flesh_effect_private_of(flesh_system_effect(system, k))->restrict_to_cells != NULL;
  return sums && options->line_search == FLESH_LINE_SEARCH_POTENTIAL &&
         flesh_uses(options, FLESH_TECHNIQUE_NONLINEAR_ELIMINATION);
}

/* Checks that ranks can share out the solves: that needs conjugate gradients with a preconditioner on each rank. */
int flesh_newton_check_team(const flesh_system *system, const flesh_solver_options *options)
{
  if (!flesh_system_team(system)) return FLESH_OK;
  if (options->linear_solver != FLESH_LINEAR_PCG)
    return flesh_fail(FLESH_ERR_ARGUMENT, "direct solvers do not run on several ranks; set linear_solver: pcg");
  return flesh_system_check_team(system);
}

/* Measures the body as a whole, once all ranks have memory. */
static int measure(flesh_newton *self)
{
  flesh_threads_set_team(self->threads, self->equations.team);
  flesh_equations_measure(&self->equations);
  flesh_equations_find_far_away(&self->equations);
  flesh_direction_unite_rows(&self->direction);
  int status = flesh_volume_arc_init(&self->equations, &self->direction, &self->arc);
  status = flesh_direction_make_solvers(&self->direction, status);
  if (!status) flesh_matrix_policy_measure(&self->policy);
  return status;
}

int flesh_newton_init_local(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                            flesh_newton *self)
{
  *self = (flesh_newton){.options = *options, .solver = solver, .goal = {.of_first = 1, .of_load = INFINITY},
                          .tangent = {.most = most_operations}};
  flesh_equations *equations = &self->equations;
  const int eliminates = solver.solve && flesh_newton_uses_elimination(system, options);
  self->search.equations = equations;
  self->edge_force = NAN;
  int status = flesh_solver_options_check(options);
  if (!status) status = flesh_newton_check_team(system, options);
  if (!status) status = flesh_threads_create(options->threads, &self->threads);
  if (!status) status = flesh_equations_init(system, &self->options, self->threads, &self->stats, equations);
  if (!status) status = flesh_direction_init(equations, &self->direction);
  if (!status) status = flesh_matrix_policy_init(equations, &self->direction, &self->policy);
  if (!status) self->u = flesh_huge_pages_calloc(((size_t)equations->n + 1) * sizeof *self->u);
  if (!status && eliminates) self->reserve = flesh_subdomain_reserve(system);
  if (!status && (!self->u || (eliminates && !self->reserve)))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", equations->n);
  return status;
}

int flesh_newton_init_collective(const flesh_system *system, int status, flesh_newton *self)
{
  status = flesh_team_agree(flesh_system_team(system), status);
  if (!status) status = measure(self);
  if (status && self) flesh_newton_clear(self);
  return status;
}

int flesh_newton_init(const flesh_system *system, const flesh_solver_options *options, flesh_stage_solver solver,
                      flesh_newton *self)
{
  return flesh_newton_init_collective(system, flesh_newton_init_local(system, options, solver, self), self);
}

void flesh_newton_clear(flesh_newton *self)
{
  flesh_free(self->u);
  flesh_volume_arc_clear(&self->arc);
  flesh_matrix_policy_clear(&self->policy);
  flesh_direction_clear(&self->direction);
  flesh_direct_destroy(&self->tangent.pivots);
  flesh_equations_clear(&self->equations);
  flesh_threads_destroy(&self->threads);
  flesh_reserve_destroy(&self->reserve);
  memset(self, 0, sizeof *self);
}

void flesh_newton_set_stage(flesh_newton *self, const flesh_stage *stage)
{
  const int changed = flesh_equations_set_stage(&self->equations, stage);
  flesh_direction_begin_stage(&self->direction);
  flesh_matrix_policy_begin_stage(&self->policy, changed, &self->stats);
  self->search = (flesh_search){.equations = &self->equations, .first_potential = NAN};
  self->iterations = (flesh_newton_iterations){.watchdog.next_pause = 1, .model_ratio = NAN, .first_load = NAN};
  self->tangent.known = 0;
}

void flesh_newton_overwritten(flesh_newton *self)
{
  flesh_matrix_policy_overwritten(&self->policy);
  flesh_direction_overwritten(&self->direction);
  self->tangent.known = 0;
}

void flesh_newton_freeze(flesh_newton *self, const double *u)
{
  if (flesh_equations_freeze(&self->equations, u)) self->search.first_potential = NAN;
  self->iterations.converged_by_step = 0;
}

void flesh_newton_end_stage(flesh_newton *self, const double *u)
{
  flesh_matrix_policy_end_stage(&self->policy, u);
  flesh_equations_save_end(&self->equations, u);
}

int flesh_newton_matrix(flesh_newton *self, const double *u, const double *r)
{
  if (self->iterations.converged_by_step) return FLESH_OK;
  const int usable = self->direction.filter == FLESH_FILTER_NONE && !self->negative_curvature;
  int status = FLESH_OK;
  if (!(r && flesh_matrix_policy_keep(&self->policy, usable, r))) status = assemble(self, u, first_filter(self));
  if (!status && u != self->u) flesh_copy(self->threads, self->equations.n, u, self->u);
  return status;
}

int flesh_newton_prepare(flesh_newton *self, int usable)
{
  if (self->iterations.converged_by_step) return FLESH_OK;
  int status = !usable ? FLESH_NOT_POSITIVE : goes_by_factors(self) ? FLESH_OK : flesh_matrix_policy_prepare(&self->policy);
  self->iterations.must_filter = status == FLESH_NOT_POSITIVE && filters_where_indefinite(self);
  return self->iterations.must_filter ? FLESH_OK : status;
}

/* A step that lowers the potential by this factor more than its matrix predicts was too short, as those with the secants
 * of friction. */
static const double more_than_predicted = 1.25;

/* Whether the step was a whole Newton step, not too short, and its inertia, as a residual, is at the target. Forces stiffer
 * than inertia, as of contact and friction, leave larger residuals, which would move nothing either. */
static int converges_by_step(flesh_newton *self, const flesh_step *step)
{
  if (!(self->goal.target > 0 && self->goal.node_mass > 0) || step->kind != FLESH_DIRECTION_NEWTON || step->length != 1) return 0;
  if (self->search.gain > more_than_predicted * step->predicted) return 0;
  const double inertia = self->goal.node_mass * self->equations.stage.shift.a;
  return fmax(inertia * flesh_equations_norm(&self->equations, step->p), self->direction.residual) <= self->policy.target;
}

/* Whether the step had to be cut although even the whole of it is below the last digit of positions: no step helps. */
static int moves_nothing(const flesh_newton *self, const flesh_step *step)
{
  const flesh_equations *equations = &self->equations;
  const double *x = equations->far_away ? equations->relative : equations->evaluation.x;
  if (!(step->cut < 1)) return 0;
  const double largest = flesh_largest(self->threads, equations->n, x);
  return flesh_largest(self->threads, equations->n, step->p) <= step->cut * DBL_EPSILON * largest;
}

/* Edges and loads that are this many times as large as at first are on the way to no equilibrium. */
static const double runaway = 10;
/* Distance from the start of an equilibrium, in lengths of the body or of prescribed displacements. */
static const double free_distance = 1000;

static double squared_length(const double *x, size_t a, size_t b)
{
  const double d[3] = {x[3 * b] - x[3 * a], x[3 * b + 1] - x[3 * a + 1], x[3 * b + 2] - x[3 * a + 2]};
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

/* Whether the root mean square of the edges at x is absurdly large beside those at rest or at the stage's start. */
static int is_overstretched(const flesh_equations *equations, const double *x)
{
  const flesh_mesh *mesh = flesh_system_mesh(equations->system);
  const double *X = flesh_mesh_positions(mesh), *from = equations->stage.x_from;
  const int *tet = flesh_mesh_tets(mesh);
  double before = 0, now = 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++, tet += 4)
    for (int e = 0; e < 6; e++) {
      const size_t a = (size_t)tet[flesh_edge_corners[e][0]], b = (size_t)tet[flesh_edge_corners[e][1]];
      before += fmax(squared_length(X, a, b), squared_length(from, a, b));
      now += squared_length(x, a, b);
    }
  return flesh_team_total(equations->team, now) > runaway * runaway * flesh_team_total(equations->team, before);
}

/* Tells how the iterate of an equilibrium moves without bound; 0: it does not. FLESH_RUNS_FREE: a body that nothing holds
 * falls where nothing stops it. 1: loads that grow with the shape, as a balloon's pressure, stretch it: a node has gone
 * farther than prescribed motions ask for, edges are absurdly long, and the loads have grown by the factor `runaway`. */
static int runs_away(flesh_newton *self)
{
  flesh_equations *equations = &self->equations;
  const flesh_constrained *constrained = &equations->constrained;
  double load, prescribed = flesh_system_length_scale(equations->system);
  if (equations->stage.shift.a != 0) return 0;
  for (int k = 0; k < constrained->count; k++) prescribed = fmax(prescribed, fabs(self->u[constrained->dofs[k]]));
  flesh_team_largest(equations->team, 1, &prescribed);
  const double farthest = flesh_largest(self->threads, equations->n, self->u);
  if (farthest > free_distance * prescribed) return FLESH_RUNS_FREE;
  return farthest > runaway / 2 * prescribed &&
         is_overstretched(equations, flesh_equations_point(equations, self->u).x) &&
         !flesh_equations_load_norm(equations, self->u, &load) && load > runaway * self->iterations.first_load;
}

/* Relative tolerance of a linear solve if the residual is mostly round-off but the potential still falls: a solve this
 * exact finds the rest of the residual. */
static const double beneath_round_off = 1e-6;

int flesh_newton_step(flesh_newton *self, const double *weights, const double *b, double tolerance, double *p)
{
  flesh_newton_iterations *known = &self->iterations;
  self->direction.iterations = 0;
  if (flesh_newton_asked_to_stop(self)) return known->stopped;
  known->ran_away = runs_away(self);
  if (self->search.stalls || known->ran_away) return FLESH_NOT_CONVERGED;
  const double norm = flesh_equations_norm(&self->equations, b);
  const int converged = known->converged_by_step;
  const int at_round_off =
      !converged && (flesh_matrix_policy_at_round_off(&self->policy, norm, self->u) || known->moved_nothing);
  tolerance = flesh_matrix_policy_tolerance(&self->policy, norm, tolerance);
  if (converged || (at_round_off && !flesh_search_makes_progress(&self->search, self->u))) {
    known->at_round_off |= !converged;
    memset(p, 0, (size_t)self->equations.n * sizeof *p);
    return FLESH_OK;
  }
  if (at_round_off) tolerance = fmin(tolerance, beneath_round_off * norm);
  known->weights = weights;
  iteration it = {.step = {.u = self->u, .b = b, .p = p}, .tolerance = tolerance,
                  .guarded = flesh_equations_are_guarded(&self->equations),
                  .may_filter = filters_where_indefinite(self) && !known->must_filter};
  const int status = run(self, known->must_filter ? assemble_and_factor(self, &it, choose_filter(self)) : FLESH_OK, &it);
  known->converged_by_step = !status && converges_by_step(self, &it.step);
  known->moved_nothing = !status && it.guarded && moves_nothing(self, &it.step);
  return status;
}
