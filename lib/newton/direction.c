/* direction.c: PCG and direct factorisations for the direction of a Newton step, and a measure of the preconditioner. */
#include "newton/direction.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Decades of reduction from which on a solve counts as deep. Conjugate gradients reduce the residual fastest in their first
 * decades, the more so the newer the preconditioner is: deep solves are compared with each other, and not with shorter
 * ones. */
static const double DEEP = 3;

/* Iterations of a solve after which the fallback is analysed, as the analysis costs 90 to 240 iterations. */
enum { MANY = 250 };

/* Number of a factorisation's operations per block of K that take the time of one iteration: an iteration has a product and
 * two triangular solves of 18 operations a block each, which take 1 to 3 times as long as in a factorisation. */
static const double OPERATIONS = 72;

void flesh_direction_unite_rows(flesh_direction *self)
{
  const flesh_system *system = self->equations->system;
  double *room = self->equations->scratch;
  flesh_system_stiff_rows_unite(system, &self->rows);
  if (flesh_preconditioner_projects(self->equations->options->preconditioner, &self->rows, 0))
    self->inertia = flesh_system_inertia_modulus(system, room, room + self->equations->n);
  else flesh_system_stiff_rows_clear(&self->rows);
}

/* Makes the solvers for matrices of K's pattern. */
static int make_solvers_of_pattern(flesh_direction *self, int before)
{
  const flesh_block_matrix *K = self->equations->K;
  const flesh_mesh *mesh = flesh_system_mesh(self->equations->system);
  const double *X = flesh_mesh_positions(mesh);
  if (self->equations->options->linear_solver != FLESH_LINEAR_PCG)
    return flesh_direct_create(self->equations->options->linear_solver, K, &self->direct);
  const flesh_team *team = self->equations->team;
  int status = self->linear->preconditioner_create(self->equations->options->preconditioner, K, X, flesh_mesh_order(mesh),
                                                   self->equations->threads, &self->preconditioner);
  const int polynomial = (team && team->ranks > 1) || flesh_preconditioner_takes_polynomials(&self->rows);
  if (!status && self->rows.nodes_per_row)
    status = self->linear->preconditioner_project(self->preconditioner, K, &self->rows, X, polynomial);
  if (!status) status = self->linear->pcg_space_create(K, 1, self->equations->threads, &self->pcg);
  return flesh_team_agree(team, status ? status : before);
}

int flesh_direction_make_solvers(flesh_direction *self, int before)
{
  const int status = make_solvers_of_pattern(self, before);
  self->patterns = status ? -1 : self->equations->patterns;
  return status;
}

static void clear_solvers(flesh_direction *self)
{
  if (self->linear) {
    self->linear->preconditioner_destroy(&self->preconditioner);
    self->linear->pcg_space_destroy(&self->pcg);
    self->linear->exact->destroy(&self->fallback);
  }
  flesh_direct_destroy(&self->direct);
}

int flesh_direction_follow_pattern(flesh_direction *self)
{
  if (self->patterns == self->equations->patterns) return FLESH_OK;
  clear_solvers(self);
  self->prepared = 0;
  self->fallback_state = FLESH_FALLBACK_UNUSED;
  self->iterations_per_decade[0] = self->iterations_per_decade[1] = self->excess_iterations = 0;
  return flesh_direction_make_solvers(self, FLESH_OK);
}

int flesh_direction_init(flesh_equations *equations, flesh_direction *self)
{
  *self = (flesh_direction){.equations = equations, .linear = flesh_linear_for(flesh_system_instructions(equations->system))};
  if (equations->options->linear_solver == FLESH_LINEAR_PCG) {
    const int status = flesh_system_stiff_rows_create(equations->system, &self->rows);
    if (status) return status;
  }
  if (!equations->evaluation.proximity.near) return FLESH_OK;
  self->factored = flesh_calloc((size_t)equations->K->rows + 1, sizeof *self->factored);
  return self->factored ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", equations->n);
}

void flesh_direction_clear(flesh_direction *self)
{
  clear_solvers(self);
  flesh_system_stiff_rows_clear(&self->rows);
  flesh_free(self->factored);
  memset(self, 0, sizeof *self);
}

void flesh_direction_begin_stage(flesh_direction *self)
{
  const flesh_shift *shift = &self->equations->stage.shift;
  if (self->fallback_state > FLESH_FALLBACK_AT_HAND) self->fallback_state = FLESH_FALLBACK_AT_HAND;
  if (self->rows.nodes_per_row)
    self->rows.projection_disabled = !flesh_preconditioner_projects(self->equations->options->preconditioner, &self->rows,
                                                        self->inertia * shift->a / shift->x);
}

int flesh_direction_assemble(flesh_direction *self, const double *u, flesh_eigenvalue_filter filter)
{
  self->matrix++;
  int status = flesh_equations_assemble(self->equations, u, filter);
  if (!status) status = flesh_direction_follow_pattern(self);
  if (status) return status;
  self->filter = filter;
  self->assembled = 1;
  if (self->rows.count && !self->rows.projection_disabled) {
    const flesh_point point = flesh_equations_point(self->equations, u);
    flesh_system_stiff_values(self->equations->system, &point, &self->equations->stage.shift, &self->rows);
  }
  return FLESH_OK;
}

void flesh_direction_overwritten(flesh_direction *self)
{
  self->matrix++;
  for (size_t d = 0; d < 3 * (size_t)self->rows.count * (size_t)self->rows.nodes_per_row; d++) self->rows.values[d] = 0;
}

/* Sum of a node's diagonal. */
static float stiffness_of(const flesh_block_matrix *K, int node)
{
  const double *block = K->values + 9 * (size_t)K->row_start[node];
  return (float)(block[0] + block[4] + block[8]);
}

int flesh_direction_stiffened(const flesh_direction *self)
{
  const flesh_block_matrix *K = self->equations->K;
  int count = 0;
  for (int i = 0; self->factored && K->layout && i < K->rows; i++) {
    const float now = stiffness_of(K, i), then = self->factored[i];
    count += now > 2 * then || then > 2 * now;
  }
  return (int)flesh_team_total(self->equations->team, count); /* over all ranks, so that they decide alike */
}

int flesh_direction_factor(flesh_direction *self, int single)
{
  const flesh_block_matrix *K = self->equations->K;
  self->single = single;
  for (int i = 0; self->factored && K->layout && i < K->rows; i++) self->factored[i] = stiffness_of(K, i);
  self->iterations_per_decade[0] = self->iterations_per_decade[1] = self->excess_iterations = 0;
  int status = self->direct
                   ? flesh_direct_factor(self->direct, K)
                   : self->linear->preconditioner_setup(self->preconditioner, K, self->equations->constrained.is);
  self->prepared = !status;
  return status;
}

/* Learns from a solve that ended with `result` how well the preconditioner does. */
static void learn(flesh_direction *self, const flesh_pcg_result *result)
{
  const double decades = fmax(log10(result->first / result->residual), 0.1);
  double *usual = &self->iterations_per_decade[decades > DEEP];
  if (*usual == 0) *usual = result->iterations / decades;
  self->excess_iterations = fmax(0, self->excess_iterations + result->iterations - *usual * decades);
}

/* Analyses the pattern for the fallback, unless a factorisation costs more than max_linear iterations. */
static int analyse(flesh_direction *self)
{
  const flesh_equations *equations = self->equations;
  const double most = equations->options->max_linear * OPERATIONS * equations->K->row_start[equations->K->rows];
  const double *X = flesh_mesh_positions(flesh_system_mesh(equations->system));
  if (self->fallback || self->fallback_state == FLESH_FALLBACK_TOO_EXPENSIVE) return FLESH_OK;
  const int status = equations->team ? FLESH_OK : self->linear->exact->create(equations->K, X, most, &self->fallback);
  if (!status && !self->fallback) self->fallback_state = FLESH_FALLBACK_TOO_EXPENSIVE;
  return status;
}

/* Lowers `most` to the iterations after which a solve has cost as much as a factorisation. */
static int limit(flesh_direction *self, int *most)
{
  const int status = self->fallback_state < FLESH_FALLBACK_AT_HAND ? FLESH_OK : analyse(self);
  if (status || !self->fallback) return status;
  const double iteration = OPERATIONS * self->equations->K->row_start[self->equations->K->rows];
  *most = (int)fmin(*most, ceil(self->linear->exact->operations(self->fallback) / iteration));
  return FLESH_OK;
}

int flesh_direction_solve(flesh_direction *self, const flesh_direction_request *request, const double *b, double *p,
                          flesh_direction_kind *kind)
{
  *kind = self->filter == FLESH_FILTER_NONE ? FLESH_DIRECTION_NEWTON : FLESH_DIRECTION_FILTERED;
  if (self->direct) return flesh_direct_solve(self->direct, b, p);
  self->by_factor = 0;
  flesh_pcg_result result;
  /* Three directions of negative curvature suffice: more make an iteration more expensive, and save none. */
  flesh_pcg_request solve = {
      .A = self->equations->K, .preconditioner = self->preconditioner, .b = b, .weights = request->weights,
      .tolerance = request->tolerance, .max_iterations = request->max_iterations,
      .after_indefinite = request->follow_curvature ? 3 : 0,
      .stop = request->stop, .stop_data = request->stop_data, .single = self->single,
      .same = self->rounded_matrix == self->matrix};
  int status = request->gives_way ? limit(self, &solve.max_iterations) : FLESH_OK;
  if (status) return status;
  status = self->linear->pcg(self->pcg, &solve, p, &result);
  self->rounded_matrix = self->matrix;
  self->iterations += result.iterations;
  self->residual = result.residual;
  self->equations->stats->linear += result.iterations;
  if (result.single) self->equations->stats->linear_single += result.iterations;
  if (status == FLESH_NOT_POSITIVE && solve.after_indefinite) {
    *kind = FLESH_DIRECTION_NEGATIVE_CURVATURE;
    return FLESH_OK;
  }
  if (result.iterations > 0) learn(self, &result);
  const int long_enough = request->gives_way && result.iterations > MANY && self->fallback_state == FLESH_FALLBACK_UNUSED;
  if (long_enough) self->fallback_state = FLESH_FALLBACK_AT_HAND;
  return status;
}

int flesh_direction_solve_directly(flesh_direction *self, const double *b, double *p)
{
  int status = analyse(self);
  if (status) return status;
  if (!self->fallback) return FLESH_NOT_CONVERGED;
  self->fallback_state = self->fallback_state == FLESH_FALLBACK_AT_HAND ? FLESH_FALLBACK_CALLED : FLESH_FALLBACK_IN_USE;
  if (self->factor_matrix != self->matrix) status = self->linear->exact->factor(self->fallback, self->equations->K);
  if (status) return status;
  self->factor_matrix = self->matrix;
  self->by_factor = 1;
  self->residual = 0;
  /* The age of the preconditioner is no longer measured: the next solve by PCG gets a new one. */
  self->iterations_per_decade[0] = self->iterations_per_decade[1] = 0;
  self->equations->stats->direct++;
  self->linear->exact->solve(self->fallback, b, p);
  return FLESH_OK;
}

int flesh_direction_precondition(flesh_direction *self, double *z)
{
  double *solution = self->equations->scratch;
  if (!self->direct) {
    self->linear->preconditioner_apply(self->preconditioner, z, z);
    return FLESH_OK;
  }
  int status = flesh_direct_solve(self->direct, z, solution);
  memcpy(z, solution, (size_t)self->equations->n * sizeof *z);
  return status;
}

double flesh_direction_model_error(const flesh_direction *self, const double *r)
{
  return self->pcg && !self->by_factor ? self->linear->pcg_model_error(self->pcg, self->equations->weights, r)
                                       : flesh_equations_norm(self->equations, r);
}
