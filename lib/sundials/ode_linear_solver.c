/* ode_linear_solver.c: Newton's equations of CVODE and ARKODE with one half eliminated, as a SUNLinearSolver.
 *
 * A free dof has p x + q v = b1 and K x + D v = M b2, with the entries of the matrix (for I - gamma df/dy: p = 1, q =
 * -gamma, gamma K and M + gamma C). With w = x - b1/p = -(q/p) v, in which nothing cancels in short steps:
 *
 *   (p D - q K) w = -q M b2 + (q/p) K b1,
 *
 * which for I - gamma df/dy has the symmetric matrix M + gamma C + gamma^2 K. Constrained dofs have x and v = b over the
 * matrix's diagonal, and are in no other row. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "linear/block_matrix.h"
#include "linear/pcg.h"
#include "sundials/pair_matrix.h"
#include "sundials/ode_problem.h"
#include "sundials/sunlinsol.h"
#include "sundials/vector.h"

typedef struct solver {
  flesh_linear_solver_report report; /* first */
  flesh_ode_problem *problem;
  N_Vector scaling;      /* scaling of the residual, from CVODE; NULL: none */
  double *mass;          /* [n] lumped mass of each dof; of own nodes */
  double *weights;       /* [n] weights of the condensed residual */
  double *right, *other; /* [n], [n] */
} solver;

static int solver_set_scaling(SUNLinearSolver S, N_Vector residual_scaling, N_Vector unknown_scaling)
{
  (void)unknown_scaling;
  ((solver *)S->content)->scaling = residual_scaling;
  return 0;
}

/* Returns the matrix, if it is of this solver's problem; else NULL, with a sentence. */
static const flesh_pair_matrix *matrix_of(const solver *self, SUNMatrix matrix)
{
  const flesh_pair_matrix *A = flesh_pair_matrix_of(matrix);
  if (A && A->rhs == self->problem) return A;
  flesh_fail(FLESH_ERR_ARGUMENT, "the matrix must be this problem's own of flesh_ode_sunmatrix_create");
  return NULL;
}

static int condense(solver *self, const flesh_pair_matrix *A)
{
  flesh_ode_problem *problem = self->problem;
  flesh_ida_problem *motion = problem->motion;
  if (A->rows.from_x == 0 || A->rows.from_v == 0 || A->rows.identity == 0) return FLESH_NOT_POSITIVE;
  int status = flesh_ode_make_condensed(problem, 0);
  if (status) return status;
  flesh_block_matrix *condensed = problem->condensed.A;
  for (size_t k = 0; k < 9 * (size_t)condensed->row_start[condensed->rows]; k++)
    condensed->values[k] = A->rows.from_x * A->D->values[k] - A->rows.from_v * A->K->values[k];
  flesh_block_fix(condensed, motion->constraints.fixed, flesh_block_mean_diagonal(condensed), NULL);
  for (int d = 0; d < problem->n; d++) self->other[d] = 1;
  flesh_block_multiply_of_team(motion->evaluation.team, motion->jacobian.D, self->other, self->mass);
  return flesh_ode_factor(problem);
}

static int solver_setup(SUNLinearSolver S, SUNMatrix matrix)
{
  solver *self = S->content;
  const flesh_pair_matrix *A = matrix_of(self, matrix);
  return flesh_sunlinsol_flag_setup(&self->report, A ? condense(self, A) : FLESH_ERR_ARGUMENT);
}

/* Computes the weights of a condensed residual in the rows of v', in CVODE's units. */
static void weigh(const solver *self, double from_v)
{
  const double *scale = self->scaling ? flesh_ida_read(self->problem->motion, self->scaling, 1, 2) : NULL;
  if (scale) scale += self->problem->n;
  for (int d = 0; d < self->problem->n; d++)
    self->weights[d] = self->mass[d] > 0 ? (scale ? scale[d] : 1) / (self->mass[d] * fabs(from_v)) : 0;
}

/* Solves the condensed equations for w; `tolerance` 0: that of the options. */
static int solve_condensed(solver *self, double from_v, double tolerance, double *w)
{
  flesh_ode_problem *problem = self->problem;
  flesh_ida_problem *motion = problem->motion;
  flesh_ode_condensed *c = &problem->condensed;
  if (c->direct) return flesh_direct_solve(c->direct, self->right, w);
  weigh(self, from_v);
  if (!(tolerance > 0)) {
    for (int d = 0; d < problem->n; d++) self->other[d] = self->weights[d] * self->right[d];
    tolerance = motion->options.linear_tolerance * flesh_norm(motion->threads, problem->n, self->other);
  }
  flesh_pcg_result result;
  const flesh_pcg_request request = {.A = c->A, .preconditioner = c->preconditioner, .b = self->right,
                                     .weights = self->weights, .tolerance = tolerance,
                                     .max_iterations = motion->options.max_linear};
  int status = motion->solver.linear->pcg(motion->solver.pcg, &request, w, &result);
  self->report.iterations = result.iterations;
  self->report.residual = result.residual;
  motion->stats.linear += result.iterations;
  return status;
}

static int solve(solver *self, const flesh_pair_matrix *A, const double *b, double tolerance, double *x)
{
  const int n = self->problem->n;
  const flesh_ida_problem *motion = self->problem->motion;
  const uint8_t *fixed = motion->constraints.fixed;
  const double p = A->rows.from_x, q = A->rows.from_v, *b1 = b, *b2 = b + n;
  double *right = self->right, *w = self->problem->rate;
  for (int d = 0; d < n; d++) {
    w[d] = fixed[d] ? 0 : -q * b2[d];
    w[n + d] = fixed[d] ? 0 : q / p * b1[d];
  }
  const flesh_block_term terms[] = {{1, motion->jacobian.D, w}, {1, A->K, w + n}};
  flesh_block_sum_of_team(motion->evaluation.team, 2, terms, self->other, right);
  for (int d = 0; d < n; d++)
    if (fixed[d]) right[d] = 0;
  int status = solve_condensed(self, q, tolerance, w);
  if (status) return status;
  for (int d = 0; d < n; d++) {
    const double first = b1[d], second = b2[d];
    x[d] = fixed[d] ? first / A->rows.identity : w[d] + first / p;
    x[n + d] = fixed[d] ? second / A->rows.identity : -p / q * w[d];
  }
  return FLESH_OK;
}

static int solver_solve(SUNLinearSolver S, SUNMatrix matrix, N_Vector x, N_Vector b, sunrealtype tolerance)
{
  solver *self = S->content;
  const flesh_ida_problem *motion = self->problem->motion;
  const flesh_pair_matrix *A = matrix_of(self, matrix);
  const double *right = A ? flesh_ida_read(motion, b, 0, 0) : NULL;
  double *solution = right ? flesh_ida_open(motion, x, 1) : NULL;
  self->report.iterations = 0;
  self->report.residual = 0;
  int status = solution ? flesh_sunlinsol_ready(&self->report) : FLESH_ERR_ARGUMENT;
  if (!status) status = solve(self, A, right, tolerance, solution);
  if (solution) flesh_ida_close(motion, x, solution);
  return flesh_sunlinsol_flag(&self->report, status);
}

int flesh_ode_sunlinsol_create(flesh_ode_problem *problem, SUNContext context, SUNLinearSolver *linear_solver)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {linear_solver, "solver"});
  int direct = problem->motion->options.linear_solver != FLESH_LINEAR_PCG;
  int status = flesh_sunlinsol_make(sizeof(solver) + 4 * sizeof(double) * (size_t)problem->n,
                                    direct ? SUNLINEARSOLVER_DIRECT : SUNLINEARSOLVER_MATRIX_ITERATIVE, context,
                                    linear_solver);
  if (status) return status;
  solver *self = (*linear_solver)->content;
  self->problem = problem;
  self->mass = (double *)(self + 1);
  self->weights = self->mass + problem->n;
  self->right = self->weights + problem->n;
  self->other = self->right + problem->n;
  (*linear_solver)->ops->setscalingvectors = solver_set_scaling;
  (*linear_solver)->ops->setup = solver_setup;
  (*linear_solver)->ops->solve = solver_solve;
  return FLESH_OK;
}
