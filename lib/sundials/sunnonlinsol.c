/* sunnonlinsol.c: flesh's Newton as a SUNNonlinearSolver: an integrator's implicit equation becomes a stage. */
#include "flesh/sunnonlinsol.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sundials/compatibility.h"
#include "sundials/kinsol.h"
#include "sundials/ode_problem.h"
#include "linear/block_matrix.h"
#include "sundials/vector.h"

/* Number of earlier accelerations kept, from which the next one is extrapolated. */
enum { KEPT = 3 };

typedef struct solution {
  double t, *a; /* s, [n] */
} solution;

typedef struct content {
  flesh_ida_problem *motion;            /* borrowed: constraints, scales, the accepted state */
  flesh_ode_problem *ode;               /* NULL: the integrator is IDA */
  flesh_arkode_system_data arkode_data; /* NULL: it is not ARKODE */
  flesh_cvode_system_data cvode_data;
  flesh_nonlinear *nonlinear;
  double *memory;                /* memory of all the arrays below */
  double *predicted, *known;     /* [2n] y as the integrator predicts it; (x^, v^) */
  double *v0, *a0;               /* [n] base of the stage */
  double *guesses[2];            /* [n] */
  double *y, solved_at;          /* [2n] last solution, and its time, s; NAN: none since the start */
  solution last[KEPT];           /* newest first */
  int count;                     /* number of solutions in `last` */
  long starts;                   /* value of accepted.starts to which all this belongs */
  double g;                      /* s, length g of the last stage */
  long iterations, failures;     /* counts of the last solve */
} content;

/* Largest ratio of a solve's last residual to its first, so that an error test sees a correction and not the error of the
 * solve. In the tiny steps after a jump even the first residual would be within the tolerance. */
static const double depth = 0.1;

/* The integrator's equation at t, with x^ and v^ in `known` and the predicted y in `predicted`. */
typedef struct equation {
  double t, g;
} equation;

static int read_into(const flesh_ida_problem *motion, N_Vector v, double *to)
{
  const double *from = flesh_ida_read(motion, v, 0, 0);
  if (!from) return FLESH_ERR_ARGUMENT;
  memcpy(to, from, 2 * (size_t)motion->evaluation.n * sizeof *to);
  return FLESH_OK;
}

/* Computes known = predicted + factor * v. */
static int add_known(content *self, double factor, N_Vector v)
{
  const double *from = flesh_ida_read(self->motion, v, 0, 0);
  if (!from) return FLESH_ERR_ARGUMENT;
  for (int d = 0; d < 2 * self->motion->evaluation.n; d++) self->known[d] = self->predicted[d] + factor * from[d];
  return FLESH_OK;
}

/* Reads the integrator's equation. IDA: y' = ypred' + cj (y - ypred). ARKODE: y = zpred + sdata + gamma f(y). CVODE: y =
 * ypred - rl1 zn1 + gamma f(y). */
static int read_equation(content *self, void *integrator, equation *e)
{
  N_Vector predicted, other, unused[3];
  sunrealtype t, g, factor = 1;
  void *user_data;
  int failed;
  if (self->arkode_data) {
    failed = self->arkode_data(integrator, &t, &predicted, &unused[0], &unused[1], &g, &other, &user_data);
  } else if (self->cvode_data) {
    failed = self->cvode_data(integrator, &t, &predicted, &unused[0], &unused[1], &g, &factor, &other, &user_data);
    factor = -factor;
  } else {
    failed = IDAGetNonlinearSystemData(integrator, &t, &predicted, &other, &unused[0], &unused[1], &unused[2], &g,
                                       &user_data);
    g = 1 / g;
    factor = -g;
  }
  if (failed) return flesh_fail(FLESH_ERR_SUNDIALS, "the integrator does not provide its nonlinear system");
  *e = (equation){t, g};
  if (!(g > 0)) return flesh_fail(FLESH_ERR_ARGUMENT, "the integrator steps back in time, which is no minimisation");
  int status = read_into(self->motion, predicted, self->predicted);
  return status ? status : add_known(self, factor, other);
}

/* Sums x1 y1 and x2 y2 over the body's free dofs, and counts these. */
static void sum_free(const flesh_ida_problem *motion, const double *x1, const double *y1, const double *x2, const double *y2,
                     double sums[3])
{
  sums[0] = sums[1] = sums[2] = 0;
  for (int d = 0; d < motion->evaluation.own; d++) {
    if (motion->constraints.fixed[d]) continue;
    sums[0] += x1[d] * y1[d];
    sums[1] += x2[d] * y2[d];
    sums[2]++;
  }
  flesh_team_sum(motion->evaluation.team, 3, sums);
}

/* Finds the norm of the residual [N] that leaves an error of `tolerance` in the norm with these weights, if the mass alone
 * resists; 0 where the mass has no value. */
static int find_target(const content *self, const equation *e, N_Vector weights, double tolerance, double *target)
{
  const flesh_ida_problem *motion = self->motion;
  const double *w = flesh_ida_read(motion, weights, 0, 0), all = motion->evaluation.all;
  if (!w) return FLESH_ERR_ARGUMENT;
  double sums[3];
  sum_free(motion, w, w, w + motion->evaluation.n, w + motion->evaluation.n, sums);
  const double weight = sqrt((sums[0] + sums[1] / (e->g * e->g)) / sums[2]), mass = 3 * motion->scale.mass / all;
  *target = sums[2] > 0 && weight > 0 ? tolerance * sqrt(2 * all) * mass / (e->g * e->g * weight) : 0;
  return FLESH_OK;
}

/* Drops what belongs to an earlier start, and finds the accepted state: IDA and CVODE have accepted a solution if they ask
 * for a later time; after a failure they go back. */
static int follow(content *self, const equation *e)
{
  flesh_ida_problem *motion = self->motion;
  const flesh_ida_accepted *accepted = &motion->accepted;
  if (self->starts != accepted->starts) {
    self->starts = accepted->starts;
    self->solved_at = NAN;
    self->count = 0;
    self->g = 0;
  }
  if (!self->arkode_data) {
    if (e->t > self->solved_at) flesh_ida_accept(motion, self->solved_at, self->y, self->y + motion->evaluation.n);
    return FLESH_OK;
  }
  /* A stage is at most g/gamma ahead of the step's start, and gamma exceeds 0.1 in all tables of ARKODE. */
  if (e->t - accepted->t <= 40 * e->g) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "the solver is not told of accepted steps; call ARKStepSetPostprocessStepFn(arkode, flesh_ode_accept)");
}

/* Makes the stage with the base x = x0 + u, v = v0 + u/g, a = a0 + u/g^2, x0 being the accepted state. Constrained dofs
 * have the velocity and the acceleration of their motion. */
static flesh_stage make_stage(content *self, const equation *e)
{
  flesh_ida_problem *motion = self->motion;
  const flesh_ida_constraints *held = &motion->constraints;
  const flesh_ida_accepted *from = &motion->accepted;
  const int n = motion->evaluation.n;
  const double g = e->g, t = flesh_ida_prescribe(motion, e->t);
  for (int d = 0; d < n; d++) {
    const int fixed = held->fixed[d];
    const double x = fixed ? held->x[d] - g * held->v[d] : self->known[d],
                 v = fixed ? held->v[d] - g * held->a[d] : self->known[n + d];
    self->v0[d] = (from->x[d] - x) / g;
    self->a0[d] = (self->v0[d] - v) / g;
  }
  return (flesh_stage){.t = t, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 1 / g, .a = 1 / (g * g)},
                       .x0 = from->x, .v0 = self->v0, .a0 = self->a0, .x_lag = from->x, .v_lag = from->v,
                       .t_lag = from->t};
}

/* Extrapolates the acceleration of a dof to t from those at two times. */
static double extrapolate(const content *self, double t, int d)
{
  const solution *p = &self->last[0], *q = &self->last[1];
  return p->a[d] + (t - p->t) / (p->t - q->t) * (p->a[d] - q->a[d]);
}

/* Makes first iterates besides u = 0: the integrator's prediction and, for ARKODE, which predicts hardly anything, a motion
 * with the extrapolated acceleration. */
static void make_guesses(content *self, const equation *e, const double *guesses[3])
{
  const flesh_ida_accepted *from = &self->motion->accepted;
  const int n = self->motion->evaluation.n;
  int count = 0;
  if (self->arkode_data && self->count > 1) {
    double *u = self->guesses[count];
    for (int d = 0; d < n; d++)
      u[d] = self->known[d] - from->x[d] + e->g * (self->known[n + d] + e->g * extrapolate(self, e->t, d));
    guesses[count++] = u;
  }
  double *u = self->guesses[count];
  for (int d = 0; d < n; d++) u[d] = self->predicted[d] - from->x[d];
  guesses[count++] = u;
  guesses[count] = NULL;
}

/* Keeps the solution's acceleration; replaces one of the same time. */
static void remember(content *self, const equation *e, const double *u)
{
  const double near = 1e-3 * e->g, g2 = e->g * e->g;
  const int again = self->count && fabs(self->last[0].t - e->t) < near;
  if (!again) {
    const solution oldest = self->last[KEPT - 1];
    memmove(self->last + 1, self->last, (KEPT - 1) * sizeof oldest);
    self->last[0] = oldest;
    if (self->count < KEPT) self->count++;
  }
  self->last[0].t = e->t;
  for (int d = 0; d < self->motion->evaluation.n; d++) self->last[0].a[d] = self->a0[d] + u[d] / g2;
}

/* Writes the solution as a correction of the prediction. Constrained dofs follow the integrator's own equation. */
static int correct(content *self, const equation *e, N_Vector correction)
{
  const flesh_ida_problem *motion = self->motion;
  const flesh_ida_constraints *held = &motion->constraints;
  const int n = motion->evaluation.n;
  const double *u = self->nonlinear->u;
  double *by = flesh_ida_open(motion, correction, 0);
  if (!by) return FLESH_ERR_ARGUMENT;
  for (int d = 0; d < n; d++) {
    double x = motion->accepted.x[d] + u[d], v = self->v0[d] + u[d] / e->g;
    if (held->fixed[d]) {
      x = self->ode ? self->known[d] + e->g * held->v[d] : held->x[d];
      v = self->ode ? self->known[n + d] + e->g * held->a[d] : held->v[d];
    }
    self->y[d] = x;
    self->y[n + d] = v;
    by[d] = x - self->predicted[d];
    by[n + d] = v - self->predicted[n + d];
  }
  flesh_ida_close(motion, correction, by);
  self->solved_at = e->t;
  return FLESH_OK;
}

/* Computes the norm of flesh_sunnonlinsol_position_norm. */
static double position_norm(void *data, N_Vector e, N_Vector weights)
{
  content *self = data;
  flesh_ida_problem *motion = self->motion;
  const flesh_evaluation *of = &motion->evaluation;
  const int n = of->n;
  const double *x = N_VGetArrayPointer(e), *w = N_VGetArrayPointer(weights);
  double *p = self->guesses[0], *mass_p = self->guesses[1], sums[3];
  for (int d = 0; d < n; d++) p[d] = motion->constraints.fixed[d] ? 0 : x[d] + self->g * x[n + d];
  flesh_block_multiply_of_team(of->team, motion->jacobian.D, p, mass_p);
  sum_free(motion, p, mass_p, w, w, sums);
  return sums[2] > 0 ? sqrt(fmax(0, sums[0]) * sums[1] / (sums[2] * 3 * motion->scale.mass)) : 0;
}

static int solve_stage(content *self, const equation *e, double target)
{
  flesh_solve_stats *stats = &self->motion->stats;
  const int before = stats->newton;
  const double *guesses[3];
  const flesh_stage stage = make_stage(self, e);
  make_guesses(self, e, guesses);
  self->nonlinear->newton->goal.target = target;
  if (fabs(e->g - self->g) < 1e-10 * e->g) self->nonlinear->newton->policy.stage_continues = 1;
  self->g = e->g;
  const int status = flesh_nonlinear_solve(self->nonlinear, &stage, guesses, 0, stats);
  self->nonlinear->newton->goal.target = 0;
  self->iterations = stats->newton - before;
  self->motion->refused = status;
  if (status > 0) /* for messages about it */
    memcpy(self->motion->evaluation.x, self->nonlinear->newton->equations.evaluation.x,
           (size_t)self->motion->evaluation.n * sizeof(double));
  return status;
}

static int solve(SUNNonlinearSolver solver, N_Vector y0, N_Vector correction, N_Vector weights, sunrealtype tolerance,
                 flesh_sunboolean set_up, void *integrator)
{
  (void)y0, (void)set_up;
  content *self = solver->content;
  equation e = {0};
  double target = 0;
  self->iterations = self->failures = 0;
  int status = self->motion->constraints.started
                   ? read_equation(self, integrator, &e)
                   : flesh_fail(FLESH_ERR_ARGUMENT, "the problem has not been started; flesh_ida_start or flesh_ode_start "
                                                    "comes first");
  if (!status) status = follow(self, &e);
  if (!status) status = find_target(self, &e, weights, tolerance, &target);
  if (!status) status = solve_stage(self, &e, target);
  if (!status) status = correct(self, &e, correction);
  if (!status) remember(self, &e, self->nonlinear->u);
  self->failures = status != FLESH_OK;
  return !status ? FLESH_SUN_SUCCESS : status > 0 ? SUN_NLS_CONV_RECVR : FLESH_SUNNLS_FATAL;
}

static SUNNonlinearSolver_Type solver_type(SUNNonlinearSolver solver)
{
  (void)solver;
  return SUNNONLINEARSOLVER_ROOTFIND;
}

/* Ignores the function: the integrator's equation is read from its data. */
static int set_function(SUNNonlinearSolver solver, SUNNonlinSolSysFn function)
{
  (void)solver, (void)function;
  return FLESH_SUN_SUCCESS;
}

static int get_iterations(SUNNonlinearSolver solver, long *count)
{
  *count = ((const content *)solver->content)->iterations;
  return FLESH_SUN_SUCCESS;
}

static int get_failures(SUNNonlinearSolver solver, long *count)
{
  *count = ((const content *)solver->content)->failures;
  return FLESH_SUN_SUCCESS;
}

static void content_destroy(content *self)
{
  if (!self) return;
  flesh_nonlinear_destroy(&self->nonlinear);
  free(self->memory);
  free(self);
}

static int solver_free(SUNNonlinearSolver solver)
{
  if (!solver) return FLESH_SUN_SUCCESS;
  content_destroy(solver->content);
  solver->content = NULL;
  SUNNonlinSolFreeEmpty(solver);
  return FLESH_SUN_SUCCESS;
}

/* Allocates this rank's part, without the others. */
static content *content_create(flesh_ida_problem *motion)
{
  const size_t n = (size_t)motion->evaluation.n;
  content *self = calloc(1, sizeof *self);
  double *at = self ? self->memory = calloc((10 + KEPT) * n + 1, sizeof *at) : NULL;
  if (!at) {
    free(self);
    return NULL;
  }
  self->motion = motion;
  self->solved_at = NAN;
  self->predicted = at;
  self->known = at + 2 * n;
  self->y = at + 4 * n;
  self->v0 = at + 6 * n;
  self->a0 = at + 7 * n;
  for (size_t k = 0; k < 2; k++) self->guesses[k] = at + (8 + k) * n;
  for (size_t k = 0; k < KEPT; k++) self->last[k].a = at + (10 + k) * n;
  return self;
}

int flesh_sunnonlinsol_position_norm(SUNNonlinearSolver solver, N_Vector y)
{
  FLESH_NEED({solver, "solver"}, {y, "y"});
  if (solver->ops->solve != solve)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the SUNNonlinearSolver is not one of flesh's; it must be of "
                                          "flesh_ida_sunnonlinsol_create or one of those for ARKODE and CVODE");
  return flesh_vector_set_norm(y, position_norm, solver->content);
}

static int create(flesh_ida_problem *motion, SUNContext context, content **made, SUNNonlinearSolver *solver)
{
  SUNNonlinearSolver empty = SUNNonlinSolNewEmpty(context);
  content *self = *made = content_create(motion);
  int status = self && empty ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a SUNNonlinearSolver");
  flesh_nonlinear *nonlinear;
  status = flesh_nonlinear_create_after(status, motion->evaluation.system, &motion->options, &nonlinear);
  if (self) self->nonlinear = nonlinear;
  if (status) {
    content_destroy(self);
    if (empty) SUNNonlinSolFreeEmpty(empty);
    return status;
  }
  self->nonlinear->newton->goal = (flesh_newton_goal){.of_first = depth, .of_load = INFINITY};
  empty->content = self;
  empty->ops->gettype = solver_type;
  empty->ops->solve = solve;
  empty->ops->setsysfn = set_function;
  empty->ops->getnumiters = get_iterations;
  empty->ops->getnumconvfails = get_failures;
  empty->ops->free = solver_free;
  *solver = empty;
  return FLESH_OK;
}

int flesh_ida_sunnonlinsol_create(flesh_ida_problem *problem, SUNContext context, SUNNonlinearSolver *solver)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {solver, "solver"});
  content *made;
  return create(problem, context, &made, solver);
}

/* Makes a solver for ARKODE or CVODE: one of the two functions is NULL. */
static int create_of_ode(flesh_ode_problem *problem, flesh_arkode_system_data arkode_data,
                         flesh_cvode_system_data cvode_data, SUNContext context, SUNNonlinearSolver *solver)
{
  content *made;
  const int status = create(problem->motion, context, &made, solver);
  if (status) return status;
  made->ode = problem;
  made->arkode_data = arkode_data;
  made->cvode_data = cvode_data;
  return FLESH_OK;
}

int flesh_arkode_sunnonlinsol_create(flesh_ode_problem *problem, flesh_arkode_system_data data, SUNContext context,
                                     SUNNonlinearSolver *solver)
{
  FLESH_NEED({problem, "problem"}, {data ? problem : NULL, "data"}, {context, "context"}, {solver, "solver"});
  return create_of_ode(problem, data, NULL, context, solver);
}

int flesh_cvode_sunnonlinsol_create(flesh_ode_problem *problem, flesh_cvode_system_data data, SUNContext context,
                                    SUNNonlinearSolver *solver)
{
  FLESH_NEED({problem, "problem"}, {data ? problem : NULL, "data"}, {context, "context"}, {solver, "solver"});
  return create_of_ode(problem, NULL, data, context, solver);
}

int flesh_ode_accept(sunrealtype t, N_Vector y_vector, void *data)
{
  flesh_ode_problem *self = flesh_ode_problem_of(data);
  if (!self) return FLESH_ERR_ARGUMENT;
  const double *y = flesh_ida_read_at(self->motion, t, y_vector);
  if (!y) return FLESH_ERR_ARGUMENT;
  flesh_ida_accept(self->motion, t, y, y + self->n);
  return FLESH_OK;
}
