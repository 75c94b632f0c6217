/* ida_problem.c: evaluates the equations of motion and their matrices for IDA. */
#include "sundials/ida_problem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "base/threads.h"
#include "flesh/sundials_abi.h"
#include "linear/block_matrix.h"
#include "linear/pcg.h"
#include "sundials/problem.h"
#include "sundials/vector.h"
#include "sundials/version.h"
#include "system/feasible_step.h"
#include "system/ranks.h"

/* Whether velocities or accelerations of one node enter the residual of another, on any rank; asked at a disturbed rest
 * shape, in motion, so that no entry is zero by chance. */
static int find_coupling(flesh_ida_problem *self)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  uint32_t random = 2463534242u; /* xorshift (Marsaglia 2003) */
  for (int d = 0; d < self->n; d++) {
    random ^= random << 13, random ^= random >> 17, random ^= random << 5;
    self->v[d] = self->velocity * (random * 0x1p-31 - 1);
    self->x[d] = X[d] + 1e-6 * self->length * (random * 0x1p-31 - 1);
    self->a[d] = 0;
  }
  const flesh_point point = {.load = 1, .x = self->x, .v = self->v, .a = self->a};
  if (flesh_system_jacobian(self->system, &point, &(flesh_shift){.v = 1, .a = 1}, self->D)) return 1;
  double couples = !flesh_block_is_diagonal(self->D);
  flesh_team_largest(self->team, 1, &couples);
  return couples > 0;
}

/* FLESH_ERR_ARGUMENT with what such a system cannot have. */
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
                      "which IDA, CVODE and ARKODE do not know; take a method of fixed steps");
  if (flesh_system_internal_count(system))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "an effect has internal variables (a weld that breaks), which change at the ends of steps: IDA, CVODE "
                      "and ARKODE go on from a history of smooth steps; take a method of fixed steps");
  if (flesh_sunindex(2 * (int64_t)flesh_system_unknowns(system)) < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%lld unknowns are too many for the %d-bit indices of this SUNDIALS",
                      2 * (long long)flesh_system_unknowns(system), FLESH_SUNDIALS_INDEX_SIZE);
  return flesh_newton_check_team(system, options);
}

/* What needs no other rank. */
static int allocate(flesh_ida_problem *self)
{
  const size_t n = (size_t)self->n, bytes = n * sizeof(double);
  double **arrays[] = {&self->x_prescribed, &self->v_prescribed, &self->a_prescribed, &self->x, &self->v,
                       &self->a,            &self->right,        &self->change};
  int failed = !(self->fixed = calloc(n + 1, 1));
  failed |= !(self->work = calloc(1, 4 * bytes + 1));
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++)
    failed |= !(*arrays[k] = calloc(1, bytes + 1));
  if (flesh_system_limits_step(self->system)) failed |= !(self->x_accepted = calloc(1, bytes + 1));
  if (self->team) failed |= !(self->room[0] = calloc(1, 6 * bytes + 1));
  for (size_t k = 1; k < 3 && self->room[0]; k++) self->room[k] = self->room[0] + 2 * k * n;
  if (failed) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", 2 * self->n);
  int status = flesh_system_matrix_create(self->system, &self->K);
  if (!status) status = flesh_system_matrix_create(self->system, &self->D);
  return status ? status : flesh_threads_create(self->options.threads, &self->threads);
}

static int create_solver(flesh_ida_problem *self)
{
  const flesh_solver_options *options = &self->options;
  if (options->linear_solver != FLESH_LINEAR_PCG)
    return flesh_direct_create(options->linear_solver, self->K, &self->direct);
  int status = self->linear->preconditioner_create(options->preconditioner, self->K,
                                                   flesh_mesh_positions(flesh_system_mesh(self->system)), self->threads,
                                                   &self->preconditioner);
  return status ? status : self->linear->pcg_space_create(self->K, 0, self->threads, &self->pcg);
}

/* The body's longest side, of all ranks. */
static double find_length(const flesh_ida_problem *self)
{
  double low[3], high[3], length = 0;
  flesh_ida_box(self, low, high);
  for (int c = 0; c < 3; c++) length = fmax(length, high[c] - low[c]);
  return length;
}

int flesh_ida_problem_create(const flesh_system *system, const flesh_solver_options *options,
                             flesh_ida_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  const flesh_team *team = flesh_system_team(system);
  int status = check_system(system, options);
  if (!status) status = flesh_sundials_check();
  flesh_ida_problem *self = status ? NULL : calloc(1, sizeof *self);
  if (!status && !self) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for an IDA problem");
  if (self) {
    *self = (flesh_ida_problem){.self = self, .system = system, .team = team, .options = *options, .event = INFINITY,
                                .linear = flesh_linear_for(flesh_system_instructions(system)),
                                .n = flesh_system_unknowns(system)};
    status = allocate(self);
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
  self->length = find_length(self);
  self->velocity = flesh_ida_scale_of_velocity(self);
  self->couples = find_coupling(self);
  *problem = self;
  return FLESH_OK;
}

void flesh_ida_problem_destroy(flesh_ida_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_ida_problem *self = *problem;
  double *arrays[] = {self->x_prescribed, self->v_prescribed, self->a_prescribed, self->x,
                      self->v,            self->a,            self->right,        self->change,
                      self->work,         self->K_values,     self->D_values,     self->x_accepted,
                      self->room[0]};
  for (size_t k = 0; k < sizeof arrays / sizeof arrays[0]; k++) free(arrays[k]);
  free(self->fixed);
  flesh_block_matrix_destroy(&self->K);
  flesh_block_matrix_destroy(&self->D);
  self->linear->preconditioner_destroy(&self->preconditioner);
  self->linear->pcg_space_destroy(&self->pcg);
  flesh_direct_destroy(&self->direct);
  flesh_threads_destroy(&self->threads);
  flesh_scalar_view_clear(&self->view);
  free(self);
  *problem = NULL;
}

const double *flesh_ida_read(const flesh_ida_problem *self, N_Vector v, int partial, int room)
{
  return flesh_vector_read(v, self->team, 2 * (sunindextype)self->n, partial, self->room[room]);
}

double *flesh_ida_open(const flesh_ida_problem *self, N_Vector v, int room)
{
  return flesh_vector_open(v, self->team, 2 * (sunindextype)self->n, self->room[room]);
}

void flesh_ida_close(const flesh_ida_problem *self, N_Vector v, const double *written)
{
  flesh_vector_close(v, self->team, 2 * (sunindextype)self->n, written);
}

int flesh_ida_check_sparse(const flesh_ida_problem *self)
{
  return self->team ? flesh_fail(FLESH_ERR_ARGUMENT, "the body is shared out among ranks, and a SUNSparseMatrix is that of "
                                                     "one; take the problem's own matrix, or products")
                    : FLESH_OK;
}

flesh_solve_stats *flesh_ida_stats(flesh_ida_problem *problem) { return &problem->stats; }

void flesh_ida_scales(const flesh_ida_problem *problem, double *length, double *velocity)
{
  *length = problem->length;
  *velocity = problem->velocity;
}

double flesh_ida_event(const flesh_ida_problem *problem) { return problem->event; }

/* IDA steps onto the event; the constraints there are those before it. */
static double time_before_event(const flesh_ida_problem *self, double t)
{
  return t >= self->event ? nextafter(self->event, self->begin) : t;
}

static void prescribe(flesh_ida_problem *self, double t)
{
  if (t == self->t_prescribed) return;
  flesh_system_prescribe(self->system, t, self->x_prescribed);
  flesh_system_prescribe_velocity(self->system, t, self->v_prescribed, self->a_prescribed);
  self->t_prescribed = t;
}

/* Between events motions are polynomials; behind the last one nothing moves. */
int flesh_ida_moves(flesh_ida_problem *self)
{
  double moves = 0;
  if (!(self->event < INFINITY)) return 0;
  prescribe(self, self->begin + 0.4 * (self->event - self->begin));
  for (int d = 0; d < self->n; d++)
    if (self->fixed[d] && self->v_prescribed[d] != 0) moves = 1;
  flesh_team_largest(self->team, 1, &moves);
  return moves > 0;
}

flesh_point flesh_ida_point(flesh_ida_problem *self, double t, const double *y, const double *yp)
{
  const int n = self->n;
  t = time_before_event(self, t);
  prescribe(self, t);
  memcpy(self->x, y, (size_t)n * sizeof *y);
  memcpy(self->v, y + n, (size_t)n * sizeof *y);
  if (yp) memcpy(self->a, yp + n, (size_t)n * sizeof *y);
  else memset(self->a, 0, (size_t)n * sizeof *y);
  for (int d = 0; d < n; d++)
    if (self->fixed[d]) {
      self->x[d] = self->x_prescribed[d];
      self->v[d] = self->v_prescribed[d];
      self->a[d] = self->a_prescribed[d];
    }
  return (flesh_point){.t = t, .load = 1, .x = self->x, .v = self->v, .a = self->a,
                       .threads = self->threads, .costs = self->costs};
}

void flesh_ida_accept(flesh_ida_problem *self, double t, const double *x)
{
  if (!self->x_accepted) return;
  memcpy(self->x_accepted, x, (size_t)self->n * sizeof *x);
  self->t_accepted = t;
  self->accepted = 1;
}

int flesh_ida_evaluate(flesh_ida_problem *self, double t, const double *y, const double *yp, double *F)
{
  const int n = self->n;
  const flesh_point point = flesh_ida_point(self, t, y, yp);
  self->stats.residuals++;
  int status = self->accepted && flesh_system_max_feasible_step(self->system, NULL, NULL, self->t_accepted,
                                                                  self->x_accepted, point.t, point.x) < 1
                   ? FLESH_UNDEFINED
                   : flesh_system_residual(self->system, &point, F + n);
  if (!status && !(flesh_norm(self->threads, n, F + n) < INFINITY)) status = FLESH_NONFINITE;
  self->refused = status;
  if (status) return status;
  for (int d = 0; d < n; d++)
    if (self->fixed[d]) {
      F[d] = y[d] - self->x[d];
      F[n + d] = y[n + d] - self->v[d];
    } else {
      F[d] = yp[d] - y[n + d];
    }
  return FLESH_OK;
}

int flesh_ida_assemble(flesh_ida_problem *self, double t, double cj, const double *y, const double *yp,
                       flesh_ida_content content)
{
  const flesh_point point = flesh_ida_point(self, t, y, yp);
  flesh_shift shift = {.x = 1, .filter = self->options.eigenvalue_filter >= FLESH_FILTER_CLAMP_ALWAYS};
  if (content == FLESH_IDA_CONDENSED) shift.v = cj, shift.a = cj * cj;
  self->content = FLESH_IDA_NOTHING;
  self->cj = self->from_x = cj;
  self->from_v = -1;
  self->identity = 1;
  self->stats.assemblies++;
  self->stats.projections += shift.filter;
  int status = flesh_system_jacobian(self->system, &point, &shift, self->K);
  shift.x = 0, shift.v = 1, shift.a = cj;
  if (!status) status = flesh_system_jacobian(self->system, &point, &shift, self->D);
  if (status) return status;
  const double diagonal = content == FLESH_IDA_CONDENSED ? flesh_block_mean_diagonal(self->K) : 0;
  flesh_block_fix(self->K, self->fixed, diagonal, self->threads);
  flesh_block_fix(self->D, self->fixed, 0, self->threads);
  self->D_is_diagonal = flesh_block_is_diagonal(self->D);
  self->content = content;
  return FLESH_OK;
}

void flesh_ida_separate(flesh_ida_problem *self)
{
  if (self->content == FLESH_IDA_CONDENSED) {
    for (size_t k = 0; k < 9 * (size_t)self->K->row_start[self->K->rows]; k++)
      self->K->values[k] -= self->cj * self->D->values[k];
    flesh_block_fix(self->K, self->fixed, 0, self->threads);
  } else if (self->content != FLESH_IDA_APART) {
    flesh_block_combine(0, self->K, NULL);
    flesh_block_combine(0, self->D, NULL);
    self->from_x = self->from_v = self->identity = 0;
  }
  self->content = FLESH_IDA_APART;
}

int flesh_ida_condense(flesh_ida_problem *self)
{
  if (self->content == FLESH_IDA_CONDENSED) return FLESH_OK;
  if (self->content != FLESH_IDA_APART || self->from_x == 0 || self->from_v == 0 || self->identity == 0)
    return FLESH_NOT_POSITIVE;
  self->cj = -self->from_x / self->from_v;
  for (size_t k = 0; k < 9 * (size_t)self->K->row_start[self->K->rows]; k++)
    self->K->values[k] += self->cj * self->D->values[k];
  flesh_block_fix(self->K, self->fixed, flesh_block_mean_diagonal(self->K), self->threads);
  self->content = FLESH_IDA_CONDENSED;
  return FLESH_OK;
}

int flesh_ida_factor(flesh_ida_problem *self)
{
  return self->direct ? flesh_direct_factor(self->direct, self->K)
                      : self->linear->preconditioner_setup(self->preconditioner, self->K, self->fixed);
}

int flesh_ida_solve(flesh_ida_problem *self, double tolerance, const double *b, double *x)
{
  if (self->direct) return flesh_direct_solve(self->direct, b, x);
  flesh_pcg_result result;
  const flesh_pcg_request request = {.A = self->K, .preconditioner = self->preconditioner, .b = b,
                                     .tolerance = tolerance * flesh_norm(self->threads, self->n, b),
                                     .max_iterations = self->options.max_linear};
  int status = self->linear->pcg(self->pcg, &request, x, &result);
  self->stats.linear += result.iterations;
  return status;
}

void flesh_ida_damping_times(const flesh_ida_problem *self, const double *x, double *y)
{
  const flesh_block_matrix *D = self->D;
  if (!self->D_is_diagonal) {
    flesh_block_multiply(D, x, y);
    return;
  }
  for (int i = 0; i < D->rows; i++) {
    const double *b = D->values + 9 * (size_t)D->row_start[i];
    for (int c = 0; c < 3; c++)
      y[3 * i + c] = b[3 * c] * x[3 * i] + b[3 * c + 1] * x[3 * i + 1] + b[3 * c + 2] * x[3 * i + 2];
  }
}

/* K x = A x - cj D x, A being the condensed matrix; A and D have no rows and columns of constrained dofs, but for A's
 * diagonal, which does not count here. */
void flesh_ida_multiply(flesh_ida_problem *self, const double *x, double *z)
{
  const int n = self->n;
  const double *v = x + n, cj = self->cj;
  double *free_x = self->change, *product = self->right, *mixed = self->work;
  for (int d = 0; d < n; d++) {
    free_x[d] = self->fixed[d] ? 0 : x[d];
    mixed[d] = self->fixed[d] ? 0 : v[d] - cj * x[d];
  }
  flesh_team_share(self->team, free_x); /* x may be a residual, which is nothing at ghosts */
  flesh_team_share(self->team, mixed);
  flesh_block_multiply(self->K, free_x, product);
  flesh_ida_damping_times(self, mixed, free_x);
  for (int d = 0; d < n; d++) product[d] += free_x[d];
  flesh_team_collect(self->team, product);
  for (int d = 0; d < n; d++) {
    const double position = x[d], velocity = v[d];
    z[d] = self->fixed[d] ? self->identity * position : self->from_x * position + self->from_v * velocity;
    z[n + d] = self->fixed[d] ? self->identity * velocity : product[d];
  }
}

size_t flesh_ida_memory(const flesh_ida_problem *self)
{
  const size_t vectors = (self->x_accepted ? 14 : 13) + (self->room[0] ? 6 : 0);
  size_t bytes = sizeof *self + (size_t)self->n * (vectors * sizeof(double) + 1);
  bytes += 2 * (size_t)self->K->row_start[self->K->rows] * 9 * sizeof(double);
  if (self->preconditioner) bytes += self->linear->preconditioner_memory(self->preconditioner);
  if (self->pcg) bytes += self->linear->pcg_space_memory(self->pcg);
  if (self->direct) bytes += flesh_direct_memory(self->direct);
  return bytes;
}
