/* ode.c: the equations of motion as y' = f(t, y) for CVODE and ARKODE, with products by df/dy and a preconditioner.
 * Constraints, events, mass and scales are those of an IDA problem that is never given to IDA. */
#include "flesh/ode.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "linear/block_matrix.h"
#include "sundials/problem.h"
#include "sundials/ode_problem.h"
#include "sundials/vector.h"
#include "system/ranks.h"
#include "system/state.h"

static const double mass_tolerance = 1e-14;

/* Returns the problem of user_data; NULL, with a sentence, if there is none, or if its constraints and mass are not known
 * yet. */
flesh_ode_problem *flesh_ode_problem_of(const void *user_data)
{
  flesh_ode_problem *problem = flesh_user_data_problem(user_data, "flesh_ode_problem");
  if (!problem) return NULL;
  if (problem->motion->constraints.started) return problem;
  flesh_fail(FLESH_ERR_ARGUMENT, "the flesh_ode_problem has not been started; flesh_ode_start comes first");
  return NULL;
}

/* Makes this rank's part, without the others; NULL without memory. */
static flesh_ode_problem *create_here(const flesh_system *system)
{
  const size_t n = (size_t)flesh_system_unknowns(system) + 1;
  flesh_ode_problem *self = calloc(1, sizeof *self);
  double *numbers = self ? calloc(7 * n, sizeof *numbers) : NULL;
  if (!numbers) {
    free(self);
    return NULL;
  }
  self->head = (flesh_user_data){self, "flesh_ode_problem"};
  self->n = flesh_system_unknowns(system);
  self->inverse = numbers;
  self->rate = numbers + 3 * n;
  self->room = numbers + 5 * n;
  return self;
}

int flesh_ode_problem_create(const flesh_system *system, const flesh_solver_options *options,
                             flesh_ode_problem **problem)
{
  FLESH_NEED({problem, "problem"});
  *problem = NULL;
  FLESH_NEED({system, "system"}, {options, "options"});
  if (!flesh_system_has_role(system, FLESH_ROLE_INERTIA))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the system has no inertia; a right-hand side y' = f(t, y) needs it");
  flesh_ida_problem *motion;
  flesh_ode_problem *self = create_here(system);
  int status = self ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d unknowns", 2 * flesh_system_unknowns(system));
  status = flesh_ida_problem_create_after(status, system, options, &motion);
  if (self) self->motion = motion;
  if (status) {
    flesh_ode_problem_destroy(&self);
    return status;
  }
  *problem = self;
  return FLESH_OK;
}

void flesh_ode_problem_destroy(flesh_ode_problem **problem)
{
  if (!problem || !*problem) return;
  flesh_ode_problem *self = *problem;
  if (self->condensed.preconditioner) self->motion->solver.linear->preconditioner_destroy(&self->condensed.preconditioner);
  flesh_ida_problem_destroy(&self->motion);
  flesh_block_matrix_destroy(&self->K);
  flesh_block_matrix_destroy(&self->C);
  flesh_block_matrix_destroy(&self->condensed.A);
  flesh_block_matrix_destroy(&self->condensed.C);
  flesh_direct_destroy(&self->condensed.direct);
  free(self->inverse); /* the other vectors are in the same allocation */
  free(self);
  *problem = NULL;
}

flesh_solve_stats *flesh_ode_stats(flesh_ode_problem *self) { return &self->motion->stats; }

double flesh_ode_event(const flesh_ode_problem *self) { return flesh_ida_event(self->motion); }

int flesh_ode_tolerances(const flesh_ode_problem *self, double tolerance, N_Vector atol)
{
  FLESH_NEED({self, "problem"});
  return flesh_ida_tolerances(self->motion, tolerance, atol);
}

int flesh_ode_get_state(flesh_ode_problem *self, double t, N_Vector y, flesh_state *state)
{
  FLESH_NEED({self, "problem"});
  FLESH_NEED_STATE(state);
  return flesh_ida_get_state(self->motion, t, y, state);
}

int flesh_ode_vector_create(const flesh_ode_problem *self, SUNContext context, N_Vector *y)
{
  FLESH_NEED({self, "problem"}, {context, "context"}, {y, "y"});
  return flesh_ida_vector_create(self->motion, context, y);
}

static int invert_mass(flesh_ode_problem *self)
{
  const flesh_block_matrix *M = self->motion->jacobian.K;
  const flesh_team *team = self->motion->evaluation.team;
  int status = FLESH_OK;
  self->mass_is_diagonal = flesh_block_is_diagonal_of_team(team, M);
  if (!self->mass_is_diagonal) return FLESH_OK;
  for (int i = 0; i < M->rows; i++)
    memcpy(self->inverse + 9 * (size_t)i, M->values + 9 * (size_t)M->row_start[i], 9 * sizeof *self->inverse);
  if (team) team->operations->add_ghosts(team->data, &(flesh_team_vector){9, 9, NULL, self->inverse, 0});
  for (int i = 0; i < self->motion->evaluation.own / 3 && !status; i++) {
    double block[9];
    memcpy(block, self->inverse + 9 * (size_t)i, sizeof block);
    if (!flesh_block_invert(block, self->inverse + 9 * (size_t)i)) status = FLESH_NOT_POSITIVE;
  }
  return flesh_team_agree(team, status);
}

int flesh_ode_start(flesh_ode_problem *self, const flesh_state *state, N_Vector y)
{
  FLESH_NEED({self, "problem"});
  FLESH_NEED_STATE(state);
  if (!flesh_ida_open(self->motion, y, 0)) return FLESH_ERR_ARGUMENT;
  N_Vector yp = flesh_vector_clone(y);
  int status = yp ? FLESH_OK
                  : flesh_fail(FLESH_ERR_MEMORY, "N_VClone made no vector: there is no memory, or the SUNContext holds an "
                                                 "error of an earlier call");
  status = flesh_team_agree(self->motion->evaluation.team, status);
  if (!status) status = flesh_ida_start(self->motion, state, y, yp);
  if (yp) N_VDestroy(yp);
  return status ? status : invert_mass(self);
}

int flesh_ode_divide_by_mass(flesh_ode_problem *self, const double *b, double *y)
{
  if (!self->mass_is_diagonal) return flesh_ida_solve(self->motion, mass_tolerance, b, y);
  for (int i = 0; i < self->motion->evaluation.own / 3; i++) {
    const double *B = self->inverse + 9 * (size_t)i, *p = b + 3 * i;
    for (int c = 0; c < 3; c++) y[3 * i + c] = B[3 * c] * p[0] + B[3 * c + 1] * p[1] + B[3 * c + 2] * p[2];
  }
  return FLESH_OK;
}

int flesh_ode_rhs(sunrealtype t, N_Vector y_vector, N_Vector ydot, void *data)
{
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  const int n = self->n;
  flesh_ida_problem *motion = self->motion;
  const double *y = flesh_ida_read_at(motion, t, y_vector);
  double *xdot = y ? flesh_ida_open(motion, ydot, 1) : NULL, *r = self->rate;
  if (!xdot) return FLESH_ERR_ARGUMENT;
  double *vdot = xdot + n;
  const flesh_point point = flesh_ida_point(motion, t, y, NULL);
  motion->stats.residuals++;
  int status = flesh_system_residual(motion->evaluation.system, &point, r);
  if (status) return status;
  if (!(flesh_norm(motion->threads, n, r) < INFINITY)) return FLESH_NONFINITE;
  for (int d = 0; d < n; d++) r[d] = motion->constraints.fixed[d] ? 0 : -r[d];
  status = flesh_ode_divide_by_mass(self, r, vdot);
  if (status) return status;
  for (int d = 0; d < n; d++) {
    xdot[d] = motion->constraints.fixed[d] ? motion->constraints.v[d] : y[n + d];
    if (motion->constraints.fixed[d]) vdot[d] = motion->constraints.a[d];
  }
  flesh_ida_close(motion, ydot, xdot);
  return FLESH_OK;
}

/* Assembles C = dr/dv of the free dofs at the point; *damped: whether it is not zero. */
static int assemble_damping(flesh_ode_problem *self, const flesh_point *point, flesh_block_matrix *C, int *damped)
{
  int status = flesh_system_jacobian(self->motion->evaluation.system, point, &(flesh_shift){.v = 1}, C);
  if (status) return status;
  flesh_block_fix(C, self->motion->constraints.fixed, 0, NULL);
  int any = 0;
  for (size_t k = 0; k < 9 * (size_t)C->row_start[C->rows] && !any; k++) any = C->values[k] != 0;
  *damped = flesh_team_any(self->motion->evaluation.team, any);
  return FLESH_OK;
}

int flesh_ode_assemble(flesh_ode_problem *self, double t, const double *y, int project, flesh_block_matrix *K,
                       flesh_block_matrix *C, int *damped)
{
  flesh_ida_problem *motion = self->motion;
  const flesh_point point = flesh_ida_point(motion, t, y, NULL);
  motion->stats.assemblies++;
  motion->stats.projections += project;
  int status = flesh_system_jacobian(motion->evaluation.system, &point, &(flesh_shift){.x = 1, .filter = project}, K);
  if (status) return status;
  flesh_block_fix(K, motion->constraints.fixed, 0, NULL);
  return assemble_damping(self, &point, C, damped);
}

/* Makes the matrices that do not exist yet, on all ranks or none. */
static int make_matrices(flesh_ode_problem *self, flesh_block_matrix **first, flesh_block_matrix **second)
{
  const flesh_evaluation *e = &self->motion->evaluation;
  int status = FLESH_OK;
  if (!*first) status = flesh_system_matrix_create(e->system, first);
  if (!status && second && !*second) status = flesh_system_matrix_create(e->system, second);
  return flesh_team_agree(e->team, status);
}

int flesh_ode_jacobian_times_setup(sunrealtype t, N_Vector y_vector, N_Vector fy, void *data)
{
  (void)fy;
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  const double *y = flesh_ida_read_at(self->motion, t, y_vector);
  if (!y) return FLESH_ERR_ARGUMENT;
  const int status = make_matrices(self, &self->K, &self->C);
  return status ? status : flesh_ode_assemble(self, t, y, 0, self->K, self->C, &self->damped);
}

int flesh_ode_jacobian_times(N_Vector v_vector, N_Vector Jv, sunrealtype t, N_Vector y, N_Vector fy, void *data,
                             N_Vector tmp)
{
  (void)t, (void)y, (void)fy, (void)tmp;
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  const int n = self->n;
  const flesh_ida_problem *motion = self->motion;
  const double *u = flesh_ida_read(motion, v_vector, 0, 0);
  double *xdot = u ? flesh_ida_open(motion, Jv, 1) : NULL;
  if (!xdot) return FLESH_ERR_ARGUMENT;
  if (!self->K)
    return flesh_fail(FLESH_ERR_ARGUMENT, "flesh_ode_jacobian_times needs flesh_ode_jacobian_times_setup beside it");
  double *force = self->rate, *vdot = xdot + n;
  const uint8_t *fixed = motion->constraints.fixed;
  const flesh_block_term terms[] = {{1, self->K, u}, {1, self->C, u + n}};
  flesh_block_sum_of_team(motion->evaluation.team, self->damped ? 2 : 1, terms, self->room, force);
  for (int d = 0; d < n; d++) force[d] = fixed[d] ? 0 : -force[d];
  int status = flesh_ode_divide_by_mass(self, force, vdot);
  for (int d = 0; d < n; d++) {
    xdot[d] = fixed[d] ? 0 : u[n + d];
    if (fixed[d]) vdot[d] = 0;
  }
  flesh_ida_close(motion, Jv, xdot);
  return status;
}

int flesh_ode_make_condensed(flesh_ode_problem *self, int damping)
{
  flesh_ode_condensed *c = &self->condensed;
  const flesh_solver_options *options = &self->motion->options;
  const int status = make_matrices(self, &c->A, damping ? &c->C : NULL);
  if (status || c->preconditioner || c->direct) return status;
  if (options->linear_solver != FLESH_LINEAR_PCG)
    return flesh_direct_create(options->linear_solver, c->A, &c->direct);
  const flesh_ida_problem *motion = self->motion;
  const flesh_mesh *mesh = flesh_system_mesh(motion->evaluation.system);
  return motion->solver.linear->preconditioner_create(options->preconditioner, c->A, flesh_mesh_positions(mesh),
                                                      flesh_mesh_order(mesh), motion->threads, &c->preconditioner);
}

int flesh_ode_factor(flesh_ode_problem *self)
{
  const flesh_ode_condensed *c = &self->condensed;
  const flesh_ida_problem *motion = self->motion;
  if (c->direct) return flesh_direct_factor(c->direct, c->A);
  return motion->solver.linear->preconditioner_setup(c->preconditioner, c->A, motion->constraints.fixed);
}

int flesh_ode_preconditioner_setup(sunrealtype t, N_Vector y_vector, N_Vector fy, flesh_sunboolean jok,
                                   flesh_sunboolean *jcur, sunrealtype gamma, void *data)
{
  FLESH_NEED({jcur, "jcur"});
  (void)fy, (void)jok; /* a new gamma costs an assembly, as a new y does */
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  flesh_ida_problem *motion = self->motion;
  const double *y = flesh_ida_read_at(motion, t, y_vector);
  if (!y) return FLESH_ERR_ARGUMENT;
  if (!(fabs(gamma) > 0 && fabs(gamma) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "gamma is %g s; it must be finite and not 0", gamma);
  flesh_ode_condensed *c = &self->condensed;
  int status = flesh_ode_make_condensed(self, 1);
  if (status) return status;
  const flesh_point point = flesh_ida_point(motion, t, y, NULL);
  const int project = motion->options.eigenvalue_filter >= FLESH_FILTER_CLAMP_ALWAYS;
  const flesh_shift shift = {.x = gamma * gamma, .v = gamma, .a = 1, .filter = project};
  motion->stats.assemblies++;
  motion->stats.projections += project;
  status = flesh_system_jacobian(motion->evaluation.system, &point, &shift, c->A);
  if (!status) status = assemble_damping(self, &point, c->C, &c->damped);
  if (status) return status;
  flesh_block_fix(c->A, motion->constraints.fixed, flesh_block_mean_diagonal(c->A), NULL);
  c->gamma = gamma;
  *jcur = 1;
  return flesh_ode_factor(self);
}

/* Solves z1 - gamma z2 = r1 and M z2 + gamma (K z1 + C z2) = M r2. With w = z1 - r1 = gamma z2, in which nothing cancels: A
 * w = gamma M r2 + (M + gamma C) r1 - A r1. Constrained dofs have z = r, and are in no other row. */
int flesh_ode_preconditioner_solve(sunrealtype t, N_Vector y, N_Vector fy, N_Vector r, N_Vector z, sunrealtype gamma,
                                   sunrealtype delta, int lr, void *data)
{
  (void)t, (void)y, (void)fy, (void)gamma, (void)delta, (void)lr;
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  const int n = self->n;
  const flesh_ida_problem *motion = self->motion;
  const double *r1 = flesh_ida_read(motion, r, 0, 0);
  double *z1 = r1 ? flesh_ida_open(motion, z, 1) : NULL;
  if (!z1) return FLESH_ERR_ARGUMENT;
  const double *r2 = r1 + n;
  double *z2 = z1 + n, *free1 = self->room, *product = self->room + n, *mixed = self->rate, *right = self->rate + n;
  const flesh_ode_condensed *c = &self->condensed;
  if (!c->C)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "flesh_ode_preconditioner_solve needs flesh_ode_preconditioner_setup before it");
  for (int d = 0; d < n; d++) {
    free1[d] = motion->constraints.fixed[d] ? 0 : r1[d];
    mixed[d] = motion->constraints.fixed[d] ? 0 : c->gamma * r2[d] + r1[d];
  }
  const flesh_block_term terms[] = {{1, motion->jacobian.D, mixed}, {-1, c->A, free1}, {c->gamma, c->C, free1}};
  flesh_block_sum_of_team(motion->evaluation.team, c->damped ? 3 : 2, terms, product, right);
  for (int d = 0; d < n; d++)
    if (motion->constraints.fixed[d]) right[d] = 0;
  double *w = product;
  int status = FLESH_OK;
  if (c->direct) status = flesh_direct_solve(c->direct, right, w);
  else self->motion->solver.linear->preconditioner_apply(c->preconditioner, right, w);
  if (status) return status;
  for (int d = 0; d < n; d++) {
    const double first = r1[d], second = r2[d];
    z1[d] = motion->constraints.fixed[d] ? first : first + w[d];
    z2[d] = motion->constraints.fixed[d] ? second : w[d] / c->gamma;
  }
  flesh_ida_close(motion, z, z1);
  return FLESH_OK;
}
