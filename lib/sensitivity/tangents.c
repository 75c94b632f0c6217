/* tangents.c: tangents of a recorded motion by several parameters, which share each stage's linearisation. With w = du +
 * dx0/s_x a solve is K w = -C (dv0 - s_v dx0/s_x) - M (da0 - s_a dx0/s_x) - dr/dp. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "sensitivity/pass.h"

typedef struct tangents {
  flesh_trajectory *self;
  int count;
  flesh_motion_pass *of; /* [count] a pass for each parameter */
  int before;            /* 1: a solve of the part has ended, at pass.ended */
  flesh_tangent_visit visit;
  void *data;
  int call;              /* call that begins with the next state to visit */
  double end;            /* end of the last part */
} tangents;

/* Computes y, the derivative of a base, from those of the known vectors and of the unknowns of earlier stages. */
static void gather_base(const flesh_motion_pass *p, const double columns[FLESH_MAP_COLUMNS], double *y)
{
  memset(y, 0, (size_t)p->self->n * sizeof *y);
  for (int k = 0; k < FLESH_MAP_COLUMNS; k++)
    flesh_add_scaled(p->self->n, columns[k], k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN], y);
}

/* Subtracts from `right` the terms of lagged and frozen states whose derivatives are known; those of x0 and v0 are in
 * `next`. */
static void subtract_readings(const flesh_motion_pass *p, const flesh_recorded_part *part, int before, double *right)
{
  const flesh_couplings *couplings = &p->self->tangent.couplings;
  const int lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL;
  for (int k = 0; k < FLESH_ARGUMENTS; k++) {
    if ((p->follows >> k & 1) || k >= FLESH_OWN_V || !flesh_couplings_any(couplings, (flesh_argument)k)) continue;
    const int of_v = flesh_argument_is_of_v((flesh_argument)k), lagged = k == FLESH_LAGGED_X || k == FLESH_LAGGED_V;
    const double *at_start = p->known[(lags_stage ? FLESH_KNOWN_LAGGED_X : FLESH_KNOWN_X) + of_v];
    const double *read = !lagged ? p->next[of_v] : before ? p->ended[of_v] : at_start;
    flesh_couplings_add(couplings, (flesh_argument)k, 0, -1, read, right);
  }
}

/* Copies constrained dofs of x into y [n]. */
static void take_constrained(const flesh_motion_pass *p, const double *x, double *y)
{
  const flesh_prescribed *prescribed = &p->self->prescribed;
  for (int d = 0; d < prescribed->n; d++)
    if (prescribed->fixed[d]) y[d] = x[d];
}

/* Advances a parameter's derivatives over a linearised solve. If constrained dofs follow their own motion, their bases do
 * not count. */
static int go_on(flesh_motion_pass *p, const flesh_recorded_part *part, int at, int before)
{
  flesh_trajectory *self = p->self;
  flesh_stage_tangent *tangent = &self->tangent;
  const int n = self->n, follow = tangent->prescribed != NULL;
  double *x0 = p->next[0], *v0 = p->next[1], *a0 = p->next[2], *right = p->lag, *u = p->stages[at];
  const flesh_shift *shift = &p->stage.shift;
  int status = flesh_pass_force(p, 0);
  if (status) return status;
  gather_base(p, p->map.x0[at], x0);
  gather_base(p, p->map.v0[at], v0);
  gather_base(p, p->map.a0[at], a0);
  for (int k = 0; k < 3 && follow; k++) flesh_pass_forget_constrained(p, p->next[k]);
  for (int d = 0; d < n; d++) right[d] = -p->force[d];
  subtract_readings(p, part, before, right);
  for (int d = 0; d < n; d++) p->lambda[d] = v0[d] - shift->v / shift->x * x0[d], a0[d] -= shift->a / shift->x * x0[d];
  status = flesh_stage_tangent_mass_times(tangent, a0, p->m);
  if (!status) status = flesh_stage_tangent_damping_times(tangent, 0, p->lambda, p->c);
  if (!status && (p->follows >> FLESH_FROZEN_V & 1))
    flesh_couplings_add(&tangent->couplings, FLESH_FROZEN_V, 0, 1, p->lambda, p->c);
  for (int d = 0; d < n; d++) {
    right[d] -= p->c[d] + p->m[d];
    a0[d] = p->moves[0][d] + (1 - 1 / shift->x) * x0[d]; /* where constraints hold, beside the part that w moves */
  }
  if (shift->x != 1) take_constrained(p, p->reached[0], a0);
  if (!status) status = flesh_stage_tangent_solve(tangent, 0, right, a0, u);
  for (int d = 0; d < n && !status; d++) {
    u[d] += (p->moves[0][d] - x0[d]) / shift->x; /* moves are 0 on free dofs, solutions on constrained ones */
    p->ended[0][d] = x0[d] + shift->x * u[d];
    p->ended[1][d] = follow && self->prescribed.fixed[d] ? p->moves[1][d] : v0[d] + shift->v * u[d];
  }
  return status;
}

/* Computes the derivative of the acceleration with which the method has begun, once it is linearised. */
static int begin(flesh_motion_pass *p)
{
  flesh_stage_tangent *tangent = &p->self->tangent;
  const size_t bytes = (size_t)p->self->n * sizeof(double);
  double *right = p->lag, *a = p->known[FLESH_KNOWN_VECTORS], *x = p->lambda, *v = p->m; /* derivatives of free dofs */
  int status = flesh_pass_force(p, 0);
  memcpy(x, p->known[FLESH_KNOWN_X], bytes);
  memcpy(v, p->known[FLESH_KNOWN_V], bytes);
  flesh_pass_forget_constrained(p, x);
  flesh_pass_forget_constrained(p, v);
  if (!status) status = flesh_stage_tangent_stiffness_times(tangent, 0, x, right);
  if (!status) status = flesh_stage_tangent_damping_times(tangent, 0, v, p->c);
  if (status) return status;
  for (int d = 0; d < p->self->n; d++) right[d] = -right[d] - p->c[d] - p->force[d];
  for (int k = 0; k < FLESH_OWN_V; k++)
    flesh_couplings_add(&tangent->couplings, (flesh_argument)k, 0, -1, flesh_argument_is_of_v((flesh_argument)k) ? v : x, right);
  return flesh_stage_tangent_solve(tangent, 0, right, NULL, a);
}

/* Linearises a solve or, if it is -1, the beginning, once, and advances all parameters over it. */
static int solve_all(tangents *t, const flesh_recorded_part *part, int solve)
{
  flesh_motion_pass *first = t->of;
  int status = solve < 0 ? flesh_pass_linearise_start(first, part) : flesh_pass_linearise(first, part, solve);
  for (int k = 0; k < t->count && !status; k++) {
    flesh_motion_pass *p = &t->of[k];
    p->stage = first->stage;
    p->follows = first->follows;
    status = solve < 0 ? begin(p) : go_on(p, part, part->solves[solve].at, t->before);
  }
  t->before = 1;
  return status;
}

static int visit_all(const tangents *t, double time)
{
  int status = FLESH_OK;
  for (int k = 0; k < t->count && !status; k++)
    status = t->visit(t->data, k, time, t->of[k].known[FLESH_KNOWN_X], t->of[k].known[FLESH_KNOWN_V]);
  return status;
}

/* Visits the derivatives of the states at which calls up to a time have begun. */
static int show(tangents *t, double time)
{
  const flesh_trajectory *self = t->self;
  int status = FLESH_OK;
  for (; t->call < self->call_count && self->calls[t->call].t <= time && !status; t->call++)
    if (self->calls[t->call].t == time) status = visit_all(t, time);
  return status;
}

/* Lets the free dofs of y [n], derivatives of x or v, follow a jump of the constrained ones to `to` [n], as masses follow
 * an impact. */
static int jump(flesh_motion_pass *p, const flesh_recorded_part *part, int of_v, const double *to, double *y)
{
  flesh_trajectory *self = p->self;
  double *by = p->lag, *right = p->m, largest = 0;
  for (int d = 0; d < self->n; d++) by[d] = self->prescribed.fixed[d] ? to[d] - y[d] : 0, largest = fmax(largest, fabs(by[d]));
  if (largest == 0 && !part->jump) return FLESH_OK;
  int status = flesh_pass_linearise_start(p, part);
  if (!status) status = flesh_stage_tangent_mass_times(&self->tangent, by, right);
  if (!status && part->jump)
    status = flesh_stage_tangent_mass_force(&self->tangent, p->parameters, part->jump + (of_v ? self->n : 0), p->force);
  if (!status && part->jump) flesh_add_scaled(self->n, 1, p->force, right);
  if (!status) status = flesh_newton_solve_tangent(self->tangent.newton, right, self->tangent.tolerance, by);
  flesh_add_scaled(self->n, -1, by, y);
  take_constrained(p, to, y);
  return status;
}

/* Finds the parameter's change of constrained dofs at t. */
static int find_reached(flesh_motion_pass *p, double t)
{
  int moved;
  const int status = flesh_pass_moves(p, 0, t, &moved);
  for (int k = 0; k < 2; k++) memcpy(p->reached[k], p->moves[k], (size_t)p->self->n * sizeof(double));
  return status;
}

/* Sets the known derivatives of constrained dofs at the beginning of the part, and finds those at its end. */
static int prescribe(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  int status = FLESH_OK;
  if (flesh_pass_jumps(p, part)) {
    flesh_pass_prescribe(p, part, 1);
    status = find_reached(p, part->taken.begin);
    for (int k = 0; k < 2 && !status; k++) status = jump(p, part, k, p->reached[k], p->known[FLESH_KNOWN_X + k]);
  }
  flesh_pass_prescribe(p, part, 0);
  for (int k = FLESH_KNOWN_VECTORS; k < FLESH_KNOWN_LAGGED_X; k++) flesh_pass_forget_constrained(p, p->known[k]);
  return status || part->taken.starts ? status : find_reached(p, part->taken.end);
}

/* Advances the known derivatives to the part's end. */
static void end_part(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  const size_t bytes = (size_t)p->self->n * sizeof(double);
  const int within = part->count > 0 && p->map.shift[part->solves[part->count - 1].at].x != 1;
  for (int j = 0; j < FLESH_KNOWN; j++) gather_base(p, p->map.end[j], p->next[j]);
  for (int j = 0; j < FLESH_KNOWN; j++) memcpy(p->known[j], p->next[j], bytes);
  if (!part->taken.second) return;
  for (int k = 0; k < 2; k++) {
    take_constrained(p, p->reached[k], p->known[FLESH_KNOWN_X + k]);
    take_constrained(p, within ? p->ended[k] : p->reached[k], p->known[FLESH_KNOWN_LAGGED_X + k]);
  }
}

/* Implements flesh_part_visit. */
static int part_on(void *data, const flesh_recorded_part *part)
{
  tangents *t = data;
  /* An equilibrium is solved for again at the time that it has reached. */
  int status = part->opens ? show(t, part->t) : FLESH_OK;
  if (status) return status;
  flesh_trajectory_map(part, &t->of[0].map);
  for (int k = 1; k < t->count; k++) t->of[k].map = t->of[0].map;
  for (int k = 0; k < t->count && part->taken.second && !status; k++) status = prescribe(&t->of[k], part);
  if (!status && flesh_pass_begins_by_acceleration(t->of, part)) status = solve_all(t, part, -1);
  t->before = 0;
  for (int s = 0; s < part->count && !status; s++) status = solve_all(t, part, s);
  for (int k = 0; k < t->count; k++) end_part(&t->of[k], part);
  t->end = part->taken.end;
  return status;
}

/* Makes the passes of all parameters in `room`, with the derivatives of the first state. */
static int take_all(tangents *t, const flesh_parameter *parameters, const double *start, double *room)
{
  const size_t n = (size_t)t->self->n;
  int status = FLESH_OK;
  for (int k = 0; k < t->count && !status; k++) {
    flesh_motion_pass *p = &t->of[k];
    *p = flesh_pass_of(t->self, k ? room + (size_t)(k - 1) * FLESH_PASS_ARRAYS * n : t->self->vectors);
    status = flesh_pass_take_parameters(p, 1, &parameters[k]);
    if (start) memcpy(p->known[FLESH_KNOWN_X], start + 2 * n * (size_t)k, n * sizeof *start);
    if (start) memcpy(p->known[FLESH_KNOWN_V], start + 2 * n * (size_t)k + n, n * sizeof *start);
  }
  return status;
}

int flesh_trajectory_tangents(flesh_trajectory *self, int count, const flesh_parameter *parameters, const double *start,
                              flesh_tangent_visit visit, void *data)
{
  FLESH_NEED({self, "trajectory"}, {parameters, "parameters"}, {visit, "visit"});
  if (count < 1) return flesh_fail(FLESH_ERR_ARGUMENT, "the number of parameters is %d; it must be at least 1", count);
  const int recorded = flesh_trajectory_check(self);
  if (recorded) return recorded;
  const size_t numbers = (size_t)(count - 1) * FLESH_PASS_ARRAYS * (size_t)self->n;
  double *room = flesh_malloc((numbers + 1) * sizeof *room);
  tangents t = {.self = self, .count = count, .of = flesh_calloc((size_t)count, sizeof *t.of), .visit = visit, .data = data};
  int status = room && t.of ? take_all(&t, parameters, start, room)
                            : flesh_fail(FLESH_ERR_MEMORY, "no memory for the tangents by %d parameters", count);
  flesh_newton_forget(self->tangent.newton);
  if (!status) status = flesh_trajectory_visit(self, part_on, &t);
  if (!status) status = visit_all(&t, t.end);
  for (int k = 0; k < count && t.of; k++) flesh_free(t.of[k].same);
  flesh_free(t.of);
  flesh_free(room);
  return status;
}

/* Room for the derivatives of the last state. */
typedef struct last_tangent {
  size_t bytes;
  double *dx, *dv;
} last_tangent;

/* Copies the derivatives of the last state; a flesh_tangent_visit. */
static int keep_last(void *data, int k, double t, const double *dx, const double *dv)
{
  const last_tangent *last = data;
  (void)k;
  (void)t;
  memcpy(last->dx, dx, last->bytes);
  memcpy(last->dv, dv, last->bytes);
  return FLESH_OK;
}

int flesh_trajectory_tangent(flesh_trajectory *self, const flesh_parameter *parameter, double *dx, double *dv)
{
  FLESH_NEED({self, "trajectory"}, {parameter, "parameter"}, {dx, "dx"}, {dv, "dv"});
  last_tangent last = {(size_t)self->n * sizeof *dx, dx, dv};
  memset(dx, 0, last.bytes);
  memset(dv, 0, last.bytes);
  return flesh_trajectory_tangents(self, 1, parameter, NULL, keep_last, &last);
}
