/* linear_solver.c: PCG or a direct factorisation as a SUNLinearSolver that returns guarded Newton steps. */
#include <math.h>
#include <string.h>

#include "sparse/pcg.h"
#include "sundials/problem.h"
#include "sundials/sunlinsol.h"
#include "sundials/vector.h"

/* What a new preconditioner costs, in iterations: as many may be lost to an old one before it is made. And how many
 * iterations of one solve are given to an old one. */
enum { NEW_ONE = 6, PATIENCE = 150 };

/* The first tenfolds are the fastest, the more so the newer a preconditioner: solves by more than these are compared
 * with their like. */
static const double DEEP = 3;

typedef struct solver {
  flesh_linear_solver_report report; /* first */
  flesh_problem *problem;
  N_Vector scaling; /* of the residual, from KINSOL; NULL: none */
} solver;

/* KINSOL wants to know that products with the matrix could be given; ours come from the block matrix. */
static int solver_set_products(SUNLinearSolver S, void *data, SUNATimesFn times)
{
  (void)S, (void)data, (void)times;
  return 0;
}

static int solver_set_scaling(SUNLinearSolver S, N_Vector residual_scaling, N_Vector unknown_scaling)
{
  (void)unknown_scaling;
  ((solver *)S->content)->scaling = residual_scaling;
  return 0;
}

/* A preconditioner made for an earlier iterate serves until the iterations lost to its age would have paid for a new
 * one. */
static int prepare(flesh_problem *problem)
{
  if (problem->direct && problem->kept) return FLESH_OK;
  if (problem->preconditioner && problem->paces[0] + problem->paces[1] > 0 && problem->lost < NEW_ONE)
    return FLESH_OK;
  return flesh_problem_factor(problem);
}

static int solver_setup(SUNLinearSolver S, SUNMatrix A)
{
  (void)A;
  solver *self = S->content;
  int status = self->problem->zeroed ? FLESH_NOT_POSITIVE : prepare(self->problem);
  /* A direct solver that meets an indefinite matrix is given the projected one in the solve. */
  if (status == FLESH_NOT_POSITIVE && self->problem->options.projection == FLESH_PROJECTION_DEMAND)
    status = FLESH_OK, self->problem->projected = -1;
  return self->report.last_flag = status;
}

/* Whether what may end a solve from outside does so. */
static int asked_to_stop(void *data)
{
  flesh_problem *problem = data;
  if (problem->stop && !problem->stopped) problem->stopped = problem->stop(problem->stop_data);
  return problem->stopped;
}

/* K p = b by at most `limit` iterations. Where negative curvature is to be followed and is met, p goes downhill along
 * it and counts as solved. */
static int conjugate_gradients(solver *self, int limit, const double *b, double tolerance, double *p)
{
  flesh_problem *problem = self->problem;
  flesh_pcg_result result;
  /* Three directions are enough to get on; more make a Newton iteration dearer, not fewer. */
  const flesh_pcg_guide guide = {.beyond = problem->follow && !problem->projected ? 3 : 0,
                                 .stop = asked_to_stop, .stop_data = problem,
                                 .single = problem->single, .same = problem->solved};
  const double *weights = self->scaling ? N_VGetArrayPointer(self->scaling) : NULL;
  int status = problem->linear->pcg_guided(problem->pcg, problem->K, problem->preconditioner, &guide, weights,
                                           tolerance, limit, b, p, &result);
  problem->solved = 1;
  self->report.iterations += result.iterations;
  self->report.residual = result.residual;
  problem->stats.linear += result.iterations;
  if (result.single) problem->stats.linear_single += result.iterations;
  if (status == FLESH_NOT_POSITIVE && guide.beyond) {
    problem->beyond = 1;
    return FLESH_OK;
  }
  if (result.iterations == 0) return status;
  const double tenfolds = fmax(log10(result.first / result.residual), 0.1);
  double *pace = &problem->paces[tenfolds > DEEP];
  if (*pace == 0) *pace = result.iterations / tenfolds;
  problem->lost = fmax(0, problem->lost + result.iterations - *pace * tenfolds);
  return status;
}

/* K p = b by a direct factorisation, where PCG cannot: meshes and materials so uneven that the preconditioner has lost
 * all accuracy. As long as that takes no more arithmetic than PCG has spent in vain. */
static int rescue(solver *self, const double *b, double *p)
{
  flesh_problem *problem = self->problem;
  if (!problem->rescue) {
    /* A product and two triangular solves an iteration, with 18 operations a block. */
    const double spent = 36. * problem->K->row_start[problem->K->rows] * 2 * problem->options.max_linear;
    int status = flesh_direct_create_symmetric(problem->K, spent, &problem->rescue);
    if (status) return status;
  }
  problem->stalled = problem->rescue ? 1 : -1;
  if (!problem->rescue) return FLESH_NOT_CONVERGED;
  int status = flesh_direct_factor(problem->rescue, problem->K);
  if (status) return status;
  problem->stats.direct++;
  return flesh_direct_solve(problem->rescue, b, p);
}

/* K p = b by the method of the options; b is not touched. */
static int solve_linear(solver *self, const double *b, double tolerance, double *p)
{
  flesh_problem *problem = self->problem;
  problem->beyond = 0;
  if (problem->direct) return flesh_direct_solve(problem->direct, b, p);
  if (problem->stalled > 0 && !problem->follow) return rescue(self, b, p);
  const int limit = problem->options.max_linear, before = self->report.iterations;
  const double pace = fmax(problem->paces[0], problem->paces[1]);
  const double patience = pace > 0 ? fmax(PATIENCE, 4 * pace) : limit;
  int status = conjugate_gradients(self, patience < limit ? (int)patience : limit, b, tolerance, p);
  if (status == FLESH_NOT_CONVERGED && patience < limit) {
    status = flesh_problem_factor(problem);
    if (!status) status = conjugate_gradients(self, limit, b, tolerance, p);
  }
  if (status == FLESH_NOT_CONVERGED && problem->stalled >= 0) status = rescue(self, b, p);
  /* A truncated solve still descends. */
  return status == FLESH_NOT_CONVERGED && self->report.iterations > before ? FLESH_OK : status;
}

/* The step from the matrix as it is, scaled by the guard where there is one. `r` = -b. */
static int guarded_step(solver *self, const double *b, double tolerance, const double *r, double *p)
{
  int status = solve_linear(self, b, tolerance, p);
  if (status || self->problem->options.globalization != FLESH_GLOBALIZATION_ENERGY) return status;
  status = flesh_guard_step(self->problem, self->problem->u_matrix, r, p);
  return status == FLESH_NOT_CONVERGED && self->problem->beyond ? FLESH_NOT_POSITIVE : status;
}

/* Whether a residual of this norm is one that rounding alone would leave. Measuring that costs a residual, so it is
 * done only when the norm is suspiciously small or has stopped falling. */
static int at_rounding(flesh_problem *problem, double norm)
{
  const double before = problem->previous_norm;
  problem->previous_norm = norm;
  if (before == 0) {
    const double largest = flesh_largest(problem->threads, problem->n, problem->x);
    double guess = 1e-16 * problem->fixed_scale * largest * sqrt((double)problem->n);
    if (norm > 1e3 * guess) return 0;
  } else if (norm < 0.3 * before) {
    return 0;
  }
  return norm <= 4 * flesh_problem_rounding(problem, problem->u_matrix);
}

/* How deep a stage's first solve goes: as deep as it takes for the new matrix to serve once more, where that is not
 * below what it does not foretell; with a matrix of an earlier stage, about as deep as that. */
static double first_forcing(const flesh_problem *problem, double norm, double tolerance)
{
  const double drift = problem->drift * problem->age;
  if (problem->kept) return drift > 0 ? 0.5 * drift * norm : tolerance;
  const double departure = problem->bend * norm * norm;
  const double enough = departure > 0 ? problem->target * norm / (6 * problem->softness * departure) : 0;
  return enough < tolerance && enough > departure ? enough : tolerance;
}

/* A solve with a matrix that serves again goes to this share of what it will not foretell: deeper would be in vain. */
static const double DEPARTED = 0.8;

/* Where Newton's iteration converges fast, the linear tolerance follows it (Eisenstat & Walker 1996, choice 2), so that
 * the last step is not spoiled by it. It is never less than half the target, which would be in vain, and just that
 * where the target is near. What only comes back from a larger residual does not converge. */
static double forcing(flesh_problem *problem, double norm, double tolerance)
{
  const double before = problem->smallest_norm, rate = norm / before, least = 0.5 * problem->target;
  if (!(before > 0) || norm < before) problem->smallest_norm = norm;
  if (problem->target == 0) return tolerance;
  if (!(before > 0)) return fmax(least, first_forcing(problem, norm, tolerance));
  if (problem->kept) return fmax(least, DEPARTED * problem->next_departure);
  const double foreseen = 0.9 * rate * rate * norm;
  return foreseen < 20 * least ? least : fmin(tolerance, foreseen);
}

/* The Newton step q from u, where the residual is -b of the given norm, unguarded. */
static int newton_step(solver *self, const double *u, const double *b, double norm, double *q)
{
  flesh_problem *problem = self->problem;
  const int follow = problem->follow;
  int status, project = problem->options.projection == FLESH_PROJECTION_ALWAYS;
  problem->follow = 0;
  do {
    status = flesh_problem_assemble(problem, u, project);
    if (!status) status = flesh_problem_factor(problem);
    if (!status) status = solve_linear(self, b, problem->options.linear_tolerance * norm, q);
  } while (status == FLESH_NOT_POSITIVE && problem->options.projection == FLESH_PROJECTION_DEMAND && !project++);
  problem->follow = follow;
  problem->stats.newton += !status;
  return status;
}

/* The watchdog technique (Chamberlain, Powell, Lemarechal & Pedersen 1982). What is stiff turns along arcs: a straight
 * step strains it, and is cut to almost nothing by the potential, again and again. Then a multiple of the step p that
 * has been cut to the share `cut` is taken although the potential rises. There the residual is that of what is
 * strained, and one or two Newton steps take it back; where they end below the cut step, p is all of this. */
static void go_beyond(solver *self, double *p)
{
  enum { LEGS = 2, LONGEST_PAUSE = 8 };
  /* A step cut to less is worth it; the first goes so many times as far; the residual there at least so many times as
   * large tells that something stiff is strained; what remains of the strain grows by this power of the way. */
  static const double worth = 0.3, first = 8, wall = 10, order = 6;
  flesh_problem *problem = self->problem;
  const int n = problem->n;
  double *from = problem->work + 2 * (size_t)n, *to = from + n, *b = problem->work + n, *q = problem->step;
  const double cut = problem->cut, length = flesh_norm(problem->threads, n, p) / cut;
  double start, reached, value = INFINITY, norm, magnitude;
  if (!(cut < worth) || problem->beyond || !problem->options.watchdog || ++problem->cuts < 2) return;
  if (problem->pause > 0) {
    problem->pause--;
    return;
  }
  memcpy(from, problem->u_matrix, (size_t)n * sizeof *from);
  for (int d = 0; d < n; d++) to[d] = from[d] + p[d];
  if (flesh_problem_potential(problem, from, &start, &magnitude) ||
      flesh_problem_potential(problem, to, &reached, &magnitude))
    return;
  const double s = fmin(1, problem->stride > 0 ? fmax(problem->stride / length, 2 * cut) : first * cut);
  for (int d = 0; d < n; d++) to[d] = from[d] + s / cut * p[d];
  /* Otherwise it is nothing stiff that has cut the step. */
  if (flesh_problem_residual(problem, to, b)) return;
  if (flesh_norm(problem->threads, n, b) < wall * flesh_norm(problem->threads, n, problem->gradient)) return;
  const double falls = -s / cut * flesh_dot(problem->threads, n, problem->gradient, p);
  double before = INFINITY;
  for (int leg = 0; leg < LEGS && !(value < reached); leg++) {
    value = INFINITY;
    if (flesh_problem_residual(problem, to, b) || !((norm = flesh_norm(problem->threads, n, b)) < before)) break;
    for (int d = 0; d < n; d++) b[d] = -b[d];
    if (newton_step(self, to, b, norm, q)) break;
    before = norm;
    for (int d = 0; d < n; d++) to[d] += q[d];
    if (flesh_problem_potential(problem, to, &value, &magnitude)) value = INFINITY;
  }
  const int lower = value < reached && flesh_problem_way(problem, from, to) == 1;
  /* What is gained grows by the first power: the best way for the next. */
  const double excess = fmax(value - (start - falls * (1 - s / 2)), 1e-6 * falls);
  problem->stride = s * length * fmin(fmax(pow(falls / (order * excess), 1 / (order - 1)), 0.1), 4);
  if (lower) {
    for (int d = 0; d < n; d++) p[d] = to[d] - from[d];
    problem->next_pause = 1;
    problem->stats.detours++;
  } else {
    problem->pause = problem->next_pause;
    if (problem->next_pause < LONGEST_PAUSE) problem->next_pause *= 2;
  }
}

static int solver_solve(SUNLinearSolver S, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  (void)A;
  solver *self = S->content;
  flesh_problem *problem = self->problem;
  const double *right = flesh_vector_data(b, problem->n);
  double *p = right ? flesh_vector_data(x, problem->n) : NULL, *gradient = problem->gradient;
  if (!p) return self->report.last_flag = FLESH_ERR_ARGUMENT;
  self->report.iterations = 0;
  if (asked_to_stop(problem)) return self->report.last_flag = problem->stopped;
  const double norm = flesh_norm(problem->threads, problem->n, right);
  tolerance = forcing(problem, norm, tolerance);
  if (at_rounding(problem, norm)) {
    problem->at_rounding = 1;
    memset(p, 0, (size_t)problem->n * sizeof *p);
    return self->report.last_flag = 0;
  }
  for (int d = 0; d < problem->n; d++) gradient[d] = -right[d];
  int demand = problem->options.projection == FLESH_PROJECTION_DEMAND;
  int status = problem->projected < 0 ? FLESH_NOT_POSITIVE
                                      : guarded_step(self, right, tolerance, gradient, p);
  if (status == FLESH_NOT_POSITIVE && demand) {
    status = flesh_problem_assemble(problem, problem->u_matrix, 1);
    if (!status) status = flesh_problem_factor(problem);
    if (!status) status = guarded_step(self, right, tolerance, gradient, p);
  }
  problem->stats.newton += !status;
  if (!status && problem->options.globalization == FLESH_GLOBALIZATION_ENERGY) go_beyond(self, p);
  return self->report.last_flag = status;
}

int flesh_sunlinsol_create(flesh_problem *problem, SUNContext context, SUNLinearSolver *linear_solver)
{
  int status = flesh_sunlinsol_make(sizeof(solver), SUNLINEARSOLVER_MATRIX_ITERATIVE, context, linear_solver);
  if (status) return status;
  SUNLinearSolver S = *linear_solver;
  ((solver *)S->content)->problem = problem;
  S->ops->setatimes = solver_set_products;
  S->ops->setscalingvectors = solver_set_scaling;
  S->ops->setup = solver_setup;
  S->ops->solve = solver_solve;
  return FLESH_OK;
}
