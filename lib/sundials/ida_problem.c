/* ida_problem.c: evaluates the equations of motion and their matrices for IDA. */
#include "sundials/ida_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "flesh/sundials_abi.h"
#include "linear/block_matrix.h"
#include "linear/pcg.h"
#include "math/xorshift.h"
#include "sundials/problem.h"
#include "sundials/vector.h"
#include "system/velocity_scale.h"
#include "sundials/version.h"
#include "system/feasible_step.h"
#include "system/ranks.h"

/* Finds whether velocities or accelerations of one node enter the residual of another, on any rank. It checks a disturbed
 * rest shape in motion, so that no entry is zero by chance. */
static int find_coupling(flesh_ida_problem *self)
{
  flesh_evaluation *e = &self->evaluation;
  const double *X = flesh_mesh_positions(flesh_system_mesh(e->system));
  uint32_t random = flesh_xorshift_first;
  for (int d = 0; d < e->n; d++) {
    flesh_xorshift(&random);
    e->v[d] = self->scale.velocity * (random * 0x1p-31 - 1);
    e->x[d] = X[d] + 1e-6 * self->scale.length * (random * 0x1p-31 - 1);
    e->a[d] = 0;
  }
  const flesh_point point = flesh_point_at(0, e->x, e->v, e->a);
  if (flesh_system_jacobian(e->system, &point, &(flesh_shift){.v = 1, .a = 1}, self->jacobian.D)) return 1;
  return !flesh_block_is_diagonal_of_team(e->team, self->jacobian.D);
}

/* Checks that the system can be integrated. FLESH_ERR_ARGUMENT, naming what it cannot have. */
static int check_system(const flesh_system *system, const flesh_solver_options *options)
{
  if (!flesh_system_has_role(system, FLESH_ROLE_INERTIA))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the system has no inertia; IDA needs an equation of motion");
  if (flesh_system_multiplier_count(system))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the body has incompressible tets (poisson 0.5), whose motion is a differential-algebraic system "
                      "of index 3: IDA, CVODE and ARKODE cannot judge the error of its pressures; take a method of "
                      "fixed steps, or poisson below 0.5");
  if (flesh_system_has_proximity(system))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "bodies touch each other (contact: between): the pattern of the Jacobian grows where they meet, "
                      "which IDA, CVODE and ARKODE do not know; take adaptive or a method of fixed steps");
  if (flesh_system_internal_count(system))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "an effect has internal variables (a weld that breaks), which change at the ends of steps: IDA, CVODE "
                      "and ARKODE go on from a history of smooth steps; take adaptive or a method of fixed steps");
  if (flesh_sunindex(2 * (int64_t)flesh_system_unknowns(system)) < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%lld unknowns are too many for the %d-bit indices of this SUNDIALS",
                      2 * (long long)flesh_system_unknowns(system), FLESH_SUNDIALS_INDEX_SIZE);
  const int status = flesh_solver_options_check(options);
  return status ? status : flesh_newton_check_team(system, options);
}

/* Allocates this rank's memory, without the other ranks. */
static int allocate(const flesh_system *system, flesh_ida_problem *self)
{
  const size_t n = (size_t)flesh_system_unknowns(system), bytes = n * sizeof(double);
  const flesh_team *team = flesh_system_team(system);
  flesh_ida_constraints *constraints = &self->constraints;
  double **arrays[] = {&constraints->x,     &constraints->v, &constraints->a, &self->solver.right,
                       &self->solver.change, &self->accepted.x, &self->accepted.v};
  int failed = !(constraints->fixed = calloc(n + 1, 1));
  failed |= !(self->solver.work = calloc(1, 4 * bytes + 1));
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++)
    failed |= !(*arrays[k] = calloc(1, bytes + 1));
  if (team) failed |= !(self->room[0] = calloc(1, 6 * bytes + 1));
  for (size_t k = 1; k < 3 && self->room[0]; k++) self->room[k] = self->room[0] + 2 * k * n;
  if (failed) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %zu unknowns", 2 * n);
  int status = flesh_system_matrix_create(system, &self->jacobian.K);
  if (!status) status = flesh_system_matrix_create(system, &self->jacobian.D);
  if (!status) status = flesh_threads_create(self->options.threads, &self->threads);
  return status ? status : flesh_evaluation_create(system, self->threads, &self->evaluation);
}

static int create_solver(flesh_ida_problem *self)
{
  flesh_ida_matrices *J = &self->jacobian;
  const flesh_solver_options *options = &self->options;
  const flesh_mesh *mesh = flesh_system_mesh(self->evaluation.system);
  flesh_ida_solver *solver = &self->solver;
  if (options->linear_solver != FLESH_LINEAR_PCG)
    return flesh_direct_create(options->linear_solver, J->K, &solver->direct);
  int status = solver->linear->preconditioner_create(options->preconditioner, J->K, flesh_mesh_positions(mesh),
                                                     flesh_mesh_order(mesh), self->threads, &solver->preconditioner);
  return status ? status : solver->linear->pcg_space_create(J->K, 0, self->threads, &solver->pcg);
}

int flesh_ida_problem_create_after(int status, const flesh_system *system, const flesh_solver_options *options,
                                   flesh_ida_problem **problem)
{
  const flesh_team *team = flesh_system_team(system);
  *problem = NULL;
  if (!status) status = check_system(system, options);
  if (!status) status = flesh_sundials_check();
  flesh_ida_problem *self = status ? NULL : calloc(1, sizeof *self);
  if (!status && !self) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for an IDA problem");
  if (self) {
    *self = (flesh_ida_problem){.head = {self, "flesh_ida_problem"}, .options = *options, .constraints = {.event = INFINITY},
                                .solver = {.linear = flesh_linear_for(flesh_system_instructions(system))}};
    status = allocate(system, self);
  }
  status = flesh_team_agree(team, status); /* from here on ranks call each other */
  if (!status) {
    flesh_threads_set_team(self->threads, team);
    status = flesh_team_agree(team, create_solver(self));
  }
  if (status) {
    flesh_ida_problem_destroy(&self);
    return status;
  }
  self->scale.length = flesh_system_length_scale(system);
  self->scale.velocity = flesh_ida_scale_of_velocity(self);
  self->jacobian.couples = find_coupling(self);
  *problem = self;
  return FLESH_OK;
}

int flesh_ida_problem_create(const flesh_system *system, const flesh_solver_options *options,
                             flesh_ida_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  return flesh_ida_problem_create_after(FLESH_OK, system, options, problem);
}

void flesh_ida_problem_destroy(flesh_ida_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_ida_problem *self = *problem;
  const flesh_ida_constraints *constraints = &self->constraints;
  double *arrays[] = {constraints->x,    constraints->v,   constraints->a,       self->solver.right,    self->solver.change,
                      self->solver.work, self->accepted.x, self->accepted.v,   self->sparse.K_values, self->sparse.D_values,
                      self->room[0]};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) free(arrays[k]);
  free(self->constraints.fixed);
  flesh_evaluation_clear(&self->evaluation);
  flesh_block_matrix_destroy(&self->jacobian.K);
  flesh_block_matrix_destroy(&self->jacobian.D);
  self->solver.linear->preconditioner_destroy(&self->solver.preconditioner);
  self->solver.linear->pcg_space_destroy(&self->solver.pcg);
  flesh_direct_destroy(&self->solver.direct);
  flesh_threads_destroy(&self->threads);
  flesh_scalar_view_clear(&self->sparse.view);
  free(self);
  *problem = NULL;
}

const double *flesh_ida_read(const flesh_ida_problem *self, N_Vector v, int partial, int room)
{
  return flesh_vector_read(v, self->evaluation.team, 2 * (sunindextype)self->evaluation.n, partial, self->room[room]);
}

const double *flesh_ida_read_at(const flesh_ida_problem *self, double t, N_Vector y)
{
  if (isfinite(t)) return flesh_ida_read(self, y, 0, 0);
  flesh_fail(FLESH_ERR_ARGUMENT, "t is %g s; it must be finite", t);
  return NULL;
}

double *flesh_ida_open(const flesh_ida_problem *self, N_Vector v, int room)
{
  return flesh_vector_open(v, self->evaluation.team, 2 * (sunindextype)self->evaluation.n, self->room[room]);
}

void flesh_ida_close(const flesh_ida_problem *self, N_Vector v, const double *written)
{
  flesh_vector_close(v, self->evaluation.team, 2 * (sunindextype)self->evaluation.n, written);
}

int flesh_ida_check_sparse(const flesh_ida_problem *self)
{
  if (!self->evaluation.team) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the body is shared out among ranks, but a SUNSparseMatrix is for a single rank; take "
                                        "the problem's own matrix, or products");
}

flesh_solve_stats *flesh_ida_stats(flesh_ida_problem *problem) { return &problem->stats; }

void flesh_ida_scales(const flesh_ida_problem *problem, double *length, double *velocity)
{
  *length = problem->scale.length;
  *velocity = problem->scale.velocity;
}

double flesh_ida_event(const flesh_ida_problem *problem) { return problem->constraints.event; }

/* Returns t or, at the event, the time just before it: IDA steps onto the event, where the old constraints still hold. */
static double time_before_event(const flesh_ida_problem *self, double t)
{
  const flesh_ida_constraints *held = &self->constraints;
  return t >= held->event ? nextafter(held->event, held->begin) : t;
}

double flesh_ida_prescribe(flesh_ida_problem *self, double t)
{
  flesh_ida_constraints *held = &self->constraints;
  t = time_before_event(self, t);
  if (t == held->t) return t;
  flesh_system_prescribe(self->evaluation.system, t, held->x);
  flesh_system_prescribe_velocity(self->evaluation.system, t, held->v, held->a);
  held->t = t;
  return t;
}

/* Between events motions are polynomials; after the last one nothing moves. */
int flesh_ida_moves(flesh_ida_problem *self)
{
  flesh_ida_constraints *held = &self->constraints;
  double *moving = self->solver.change;
  if (!(held->event < INFINITY)) return 0;
  flesh_ida_prescribe(self, held->begin + 0.4 * (held->event - held->begin));
  for (int d = 0; d < self->evaluation.n; d++) moving[d] = held->fixed[d] ? held->v[d] : 0;
  return flesh_largest(self->threads, self->evaluation.n, moving) > 0;
}

flesh_point flesh_ida_point(flesh_ida_problem *self, double t, const double *y, const double *yp)
{
  flesh_evaluation *e = &self->evaluation;
  flesh_ida_constraints *held = &self->constraints;
  const int n = e->n;
  t = flesh_ida_prescribe(self, t);
  memcpy(e->x, y, (size_t)n * sizeof *y);
  memcpy(e->v, y + n, (size_t)n * sizeof *y);
  if (yp) memcpy(e->a, yp + n, (size_t)n * sizeof *y);
  else memset(e->a, 0, (size_t)n * sizeof *y);
  for (int d = 0; d < n; d++)
    if (held->fixed[d]) {
      e->x[d] = held->x[d];
      e->v[d] = held->v[d];
      e->a[d] = held->a[d];
    }
  flesh_point point = flesh_point_at(t, e->x, e->v, e->a);
  e->environment.starts = t == held->begin;
  point.threads = self->threads;
  point.environment = &e->environment;
  return point;
}

void flesh_ida_accept(flesh_ida_problem *self, double t, const double *x, const double *v)
{
  memcpy(self->accepted.x, x, (size_t)self->evaluation.n * sizeof *x);
  memcpy(self->accepted.v, v, (size_t)self->evaluation.n * sizeof *v);
  self->accepted.t = t;
}

int flesh_ida_evaluate(flesh_ida_problem *self, double t, const double *y, const double *yp, double *F)
{
  flesh_evaluation *e = &self->evaluation;
  const int n = e->n;
  const flesh_point point = flesh_ida_point(self, t, y, yp);
  self->stats.residuals++;
  int status = self->accepted.limits && flesh_system_max_feasible_step(e->system, NULL, NULL, self->accepted.t,
                                                                  self->accepted.x, point.t, point.x) < 1
                   ? FLESH_UNDEFINED
                   : flesh_system_residual(e->system, &point, F + n);
  if (!status && !(flesh_norm(self->threads, n, F + n) < INFINITY)) status = FLESH_NONFINITE;
  self->refused = status;
  if (status) return status;
  for (int d = 0; d < n; d++)
    if (self->constraints.fixed[d]) {
      F[d] = y[d] - e->x[d];
      F[n + d] = y[n + d] - e->v[d];
    } else {
      F[d] = yp[d] - y[n + d];
    }
  return FLESH_OK;
}

int flesh_ida_assemble(flesh_ida_problem *self, double t, double cj, const double *y, const double *yp,
                       flesh_ida_content content)
{
  flesh_ida_matrices *J = &self->jacobian;
  if (!(fabs(cj) > 0 && fabs(cj) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "cj is %g 1/s; it must be finite and not 0", cj);
  const flesh_point point = flesh_ida_point(self, t, y, yp);
  flesh_shift shift = {.x = 1, .filter = self->options.eigenvalue_filter >= FLESH_FILTER_CLAMP_ALWAYS};
  if (content == FLESH_IDA_CONDENSED) shift.v = cj, shift.a = cj * cj;
  J->content = FLESH_IDA_NOTHING;
  J->cj = J->rows.from_x = cj;
  J->rows.from_v = -1;
  J->rows.identity = 1;
  self->stats.assemblies++;
  self->stats.projections += shift.filter;
  int status = flesh_system_jacobian(self->evaluation.system, &point, &shift, J->K);
  shift.x = 0, shift.v = 1, shift.a = cj;
  if (!status) status = flesh_system_jacobian(self->evaluation.system, &point, &shift, J->D);
  if (status) return self->refused = status;
  const double diagonal = content == FLESH_IDA_CONDENSED ? flesh_block_mean_diagonal(J->K) : 0;
  flesh_block_fix(J->K, self->constraints.fixed, diagonal, self->threads);
  flesh_block_fix(J->D, self->constraints.fixed, 0, self->threads);
  J->D_is_diagonal = flesh_block_is_diagonal(J->D);
  J->content = content;
  return FLESH_OK;
}

void flesh_ida_separate(flesh_ida_problem *self)
{
  flesh_ida_matrices *J = &self->jacobian;
  if (J->content == FLESH_IDA_CONDENSED) {
    for (size_t k = 0; k < 9 * (size_t)J->K->row_start[J->K->rows]; k++)
      J->K->values[k] -= J->cj * J->D->values[k];
    flesh_block_fix(J->K, self->constraints.fixed, 0, self->threads);
  } else if (J->content != FLESH_IDA_APART) {
    flesh_block_combine(0, J->K, NULL);
    flesh_block_combine(0, J->D, NULL);
    J->rows.from_x = J->rows.from_v = J->rows.identity = 0;
  }
  J->content = FLESH_IDA_APART;
}

int flesh_ida_condense(flesh_ida_problem *self)
{
  flesh_ida_matrices *J = &self->jacobian;
  if (J->content == FLESH_IDA_CONDENSED) return FLESH_OK;
  if (J->content != FLESH_IDA_APART || J->rows.from_x == 0 || J->rows.from_v == 0 || J->rows.identity == 0)
    return FLESH_NOT_POSITIVE;
  J->cj = -J->rows.from_x / J->rows.from_v;
  for (size_t k = 0; k < 9 * (size_t)J->K->row_start[J->K->rows]; k++)
    J->K->values[k] += J->cj * J->D->values[k];
  flesh_block_fix(J->K, self->constraints.fixed, flesh_block_mean_diagonal(J->K), self->threads);
  J->content = FLESH_IDA_CONDENSED;
  return FLESH_OK;
}

int flesh_ida_factor(flesh_ida_problem *self)
{
  const flesh_ida_solver *solver = &self->solver;
  const flesh_block_matrix *K = self->jacobian.K;
  return solver->direct ? flesh_direct_factor(solver->direct, K)
                        : solver->linear->preconditioner_setup(solver->preconditioner, K, self->constraints.fixed);
}

int flesh_ida_solve(flesh_ida_problem *self, double tolerance, const double *b, double *x)
{
  const flesh_ida_solver *solver = &self->solver;
  if (solver->direct) return flesh_direct_solve(solver->direct, b, x);
  flesh_pcg_result result;
  const flesh_pcg_request request = {.A = self->jacobian.K, .preconditioner = solver->preconditioner, .b = b,
                                     .tolerance = tolerance * flesh_norm(self->threads, self->evaluation.n, b),
                                     .max_iterations = self->options.max_linear};
  int status = solver->linear->pcg(solver->pcg, &request, x, &result);
  self->stats.linear += result.iterations;
  return status;
}

static void damping_times(const flesh_ida_problem *self, const double *x, double *y)
{
  const flesh_block_matrix *D = self->jacobian.D;
  if (!self->jacobian.D_is_diagonal) {
    flesh_block_multiply(D, x, y);
    return;
  }
  for (int i = 0; i < D->rows; i++) {
    const double *b = D->values + 9 * (size_t)D->row_start[i];
    for (int c = 0; c < 3; c++)
      y[3 * i + c] = b[3 * c] * x[3 * i] + b[3 * c + 1] * x[3 * i + 1] + b[3 * c + 2] * x[3 * i + 2];
  }
}

void flesh_ida_add_products(flesh_ida_problem *self, double scale, double *v, double divisor, double *x, double *y)
{
  const flesh_evaluation *e = &self->evaluation;
  double *product = self->solver.work + e->n;
  flesh_team_update_ghosts(e->team, x); /* x may be a residual, which is not defined at ghosts */
  if (v != x) flesh_team_update_ghosts(e->team, v);
  damping_times(self, v, product);
  for (int d = 0; d < e->n; d++) y[d] += scale * product[d];
  flesh_block_multiply(self->jacobian.K, x, product);
  for (int d = 0; d < e->n; d++) y[d] += product[d] / divisor;
  flesh_team_add_ghosts(e->team, y);
}

/* Uses K x = A x - cj D x, A being the condensed matrix. A and D have no rows and columns of constrained dofs, except A's
 * diagonal, which does not count here. */
void flesh_ida_multiply(flesh_ida_problem *self, const double *x, double *z)
{
  flesh_ida_matrices *J = &self->jacobian;
  flesh_ida_constraints *held = &self->constraints;
  const int n = self->evaluation.n;
  const double *v = x + n, cj = J->cj;
  double *free_x = self->solver.change, *product = self->solver.right, *mixed = self->solver.work;
  for (int d = 0; d < n; d++) {
    free_x[d] = held->fixed[d] ? 0 : x[d];
    mixed[d] = held->fixed[d] ? 0 : v[d] - cj * x[d];
    product[d] = 0;
  }
  flesh_ida_add_products(self, 1, mixed, 1, free_x, product);
  for (int d = 0; d < n; d++) {
    const double position = x[d], velocity = v[d];
    z[d] = held->fixed[d] ? J->rows.identity * position : J->rows.from_x * position + J->rows.from_v * velocity;
    z[n + d] = held->fixed[d] ? J->rows.identity * velocity : product[d];
  }
}
