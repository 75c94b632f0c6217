/* motion.c: the discrete adjoint and tangents of a recorded motion. A stage moves the point by x = x0 + s_x u, v = v0 + s_v
 * u, a = a0 + s_a u, its base and the end of the step being linear in what is known and in u (method_map.h). With a bar
 * over the derivative of Q by a quantity, backward over a step: ubar = F_u^T Ybar'; K^T lambda = ubar; Ybar = F_y^T Ybar' -
 * A^T (K_x^T lambda, C^T lambda, M lambda), where K_x^T lambda = (ubar - s_v C^T lambda - s_a M lambda)/s_x takes no product
 * with K_x. What is lagged or frozen adds its own derivative to the state that was read. */
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "sensitivity/trajectory.h"

/* A stage of no time, whose unknown is the acceleration: K is M, as K_x has no share in it. */
static const double no_time = 1e-30;

/* The arrays of a pass over the trajectory, [n] each. */
typedef struct pass {
  flesh_trajectory *self;
  flesh_method_map map;
  double *known[FLESH_KNOWN], *next[FLESH_KNOWN], *stages[FLESH_MAP_STAGES]; /* derivatives, or of Q by them */
  double *lambda, *c, *m, *lag, *force, *moves; /* room */
  double *base;                                 /* [5*n] of a stage */
  flesh_stage stage;
  unsigned follows;
  int before;                        /* forward: a solve of the part has ended, at `ended` [2][n] */
  double *ended[2];
  int count;                         /* of parameters, as are the next */
  const flesh_parameter *parameters;
  double *gradient;
  unsigned char *same; /* [count][1 + effects] of each parameter, flesh_parameter_compare's */
  flesh_tangent_visit visit; /* forward: sees the derivatives of states, with visit_data; NULL: nobody does */
  void *visit_data;
  int call;                  /* of the next state that it sees */
  double end;                /* of the last part */
} pass;

static pass pass_of(flesh_trajectory *self)
{
  pass p = {.self = self};
  double *room = self->vectors;
  const size_t n = (size_t)self->n;
  memset(room, 0, (5 + 3 * (size_t)FLESH_MAP_COLUMNS) * n * sizeof *room);
  for (int k = 0; k < FLESH_KNOWN; k++, room += 2 * n) p.known[k] = room, p.next[k] = room + n;
  for (int k = 0; k < FLESH_MAP_STAGES; k++, room += n) p.stages[k] = room;
  double **const own[] = {&p.lambda, &p.c, &p.m, &p.lag, &p.force, &p.moves};
  for (int k = 0; k < 6; k++, room += n) *own[k] = room;
  p.base = room;
  for (int k = 0; k < 2; k++) p.ended[k] = room + (5 + (size_t)k) * n;
  return p;
}

/* Takes the parameters, and finds what they leave as it is. */
static int take_parameters(pass *p, int count, const flesh_parameter *parameters, double *gradient)
{
  const flesh_system *system = p->self->system;
  const size_t each = 1 + (size_t)flesh_system_effect_count(system);
  p->count = count;
  p->parameters = parameters;
  p->gradient = gradient;
  memset(gradient, 0, (size_t)count * sizeof *gradient);
  p->same = flesh_calloc((size_t)count * each + 1, 1);
  if (!p->same) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d parameters", count);
  for (int k = 0; k < count; k++) {
    unsigned char *same = p->same + (size_t)k * each;
    *same = (unsigned char)flesh_parameter_compare(&parameters[k], system, same + 1);
  }
  return FLESH_OK;
}

/* Linearises a solve of a part. */
static int linearise(pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory_stage(p->self, part, &p->map, solve, p->base, &p->stage);
  p->follows = p->stage.frozen_at_solution ? 1u << FLESH_FROZEN_X | 1u << FLESH_FROZEN_V : 0;
  const double *u = part->solves[solve].u, *at_end = p->self->prescribed.x[FLESH_PRESCRIBED_POINTS - 1];
  for (int d = 0; d < p->self->n && p->stage.shift.x != 1; d++) /* such a stage is the only one of its step */
    p->self->tangent.end[d] = p->self->prescribed.fixed[d] ? at_end[d] : p->stage.x0[d] + u[d];
  return flesh_stage_tangent_set(&p->self->tangent, &p->stage, u, p->follows);
}

/* Linearises the acceleration with which a method begins at the known state. */
static int linearise_start(pass *p, const flesh_recorded_part *part)
{
  flesh_trajectory *self = p->self;
  const double *x = part->known[FLESH_KNOWN_X], *v = part->known[FLESH_KNOWN_V];
  memset(p->moves, 0, (size_t)self->n * sizeof *p->moves);
  p->stage = (flesh_stage){.t = part->taken.begin, .load = 1, .prescribed_fraction = 1, .shift = {.x = no_time, .a = 1},
                           .x0 = x, .v0 = v, .a0 = part->known[FLESH_KNOWN_VECTORS], .x_lag = x, .v_lag = v,
                           .t_lag = part->taken.begin, .internal = part->internal,
                           .multipliers = part->solves[0].multipliers};
  p->follows = 1u << FLESH_FROZEN_X | 1u << FLESH_FROZEN_V; /* nothing is lagged or frozen there */
  return flesh_stage_tangent_set(&self->tangent, &p->stage, p->moves, p->follows);
}

/* Whether the method begins there with the acceleration that balances the forces, which is no part of its own. */
static int begins_by_acceleration(const pass *p, const flesh_recorded_part *part)
{
  return part->taken.anew && part->taken.acceleration && !p->self->tangent.multipliers;
}

/* Dofs that a method of order 2 constrains in the part are where the motion has them, whatever was known. */
static void forget_constrained(pass *p, const flesh_recorded_part *part, double *const *of)
{
  flesh_trajectory *self = p->self;
  if (!part->taken.second) return;
  flesh_prescribed_set(&self->prescribed, part->taken.begin, part->taken.end, part->known[FLESH_KNOWN_X]);
  for (int d = 0; d < self->n; d++)
    for (int k = 0; k < FLESH_KNOWN && self->prescribed.fixed[d]; k++) of[k][d] = 0;
}

static void add(int n, double scale, const double *x, double *y)
{
  for (int d = 0; d < n && scale != 0; d++) y[d] += scale * x[d];
}

/* The bars of the bases, at which x0, v0 and a0 have those of x, v and a, go to what they are made of. */
static void give_bases(pass *p, const flesh_recorded_part *part, int at, const double *x, const double *v, const double *a)
{
  const int n = p->self->n;
  for (int k = 0; k < FLESH_KNOWN + at; k++) {
    double *bar = k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN];
    if (k < FLESH_KNOWN && !part->known[k]) continue;
    add(n, p->map.x0[at][k], x, bar);
    add(n, p->map.v0[at][k], v, bar);
    if (a) add(n, p->map.a0[at][k], a, bar);
  }
}

/* The derivative of the residual along lambda by what is read goes to the state that was read. `before`: the stage of the
 * solve that has ended where this one lags; -1: it lags a state that was known before the part. */
static void give_readings(pass *p, const flesh_recorded_part *part, int at, int before)
{
  flesh_trajectory *self = p->self;
  const int n = self->n, lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL;
  double *zero = p->moves;
  memset(zero, 0, (size_t)n * sizeof *zero);
  for (int k = 0; k < FLESH_READINGS; k++) {
    if ((p->follows >> k & 1) || k >= FLESH_OWN_V || !flesh_couplings_any(&self->tangent.couplings, (flesh_reading)k)) continue;
    memset(p->lag, 0, (size_t)n * sizeof *p->lag);
    flesh_couplings_add(&self->tangent.couplings, (flesh_reading)k, 1, -1, p->lambda, p->lag);
    const int of_v = flesh_reading_is_of_v((flesh_reading)k), lagged = k == FLESH_LAGGED_X || k == FLESH_LAGGED_V;
    if (lagged && before < 0) add(n, 1, p->lag, p->known[lags_stage ? FLESH_KNOWN_LAGGED_X + of_v : FLESH_KNOWN_X + of_v]);
    else give_bases(p, part, lagged ? before : at, of_v ? zero : p->lag, of_v ? p->lag : zero, NULL);
    if (!lagged || before < 0) continue;
    const flesh_shift *shift = &p->map.shift[before];
    add(n, of_v ? shift->v : shift->x, p->lag, p->stages[before]);
  }
}

/* c = C^T lambda with what of v is followed, m = M lambda. */
static int multiply(pass *p)
{
  flesh_stage_tangent *tangent = &p->self->tangent;
  int status = flesh_stage_tangent_damping_times(tangent, 1, p->lambda, p->c);
  if (!status) status = flesh_stage_tangent_mass_times(tangent, p->lambda, p->m);
  if (!status && (p->follows >> FLESH_FROZEN_V & 1))
    flesh_couplings_add(&tangent->couplings, FLESH_FROZEN_V, 1, 1, p->lambda, p->c);
  return status;
}

/* Adds what each parameter changes in the residual, and in constrained dofs by the bars of u. */
static int add_parameters(pass *p, const double *bar)
{
  flesh_trajectory *self = p->self;
  const size_t each = 1 + (size_t)flesh_system_effect_count(self->system);
  int status = FLESH_OK;
  for (int k = 0; k < p->count && !status; k++) {
    const unsigned char *same = p->same + (size_t)k * each;
    status = flesh_stage_tangent_force(&self->tangent, &p->parameters[k], *same ? same + 1 : NULL, p->force, p->moves);
    for (int d = 0; d < self->n && !status && !bar; d++)
      if (p->moves[d] != 0)
        status = flesh_fail(FLESH_ERR_ARGUMENT, "a parameter that moves prescribed dofs has sensitivities by backward-euler "
                                                "only");
    for (int d = 0; d < self->n && !status; d++)
      p->gradient[k] += (bar ? bar[d] * p->moves[d] : 0) - p->lambda[d] * p->force[d];
  }
  return status;
}

/* One solve, backward. */
static int solve_back(pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory *self = p->self;
  const int at = part->solves[solve].at, before = solve > 0 ? part->solves[solve - 1].at : -1;
  const flesh_shift *shift = &p->stage.shift;
  double *bar = p->stages[at], *kx = p->lag;
  const double *pressed = self->tangent.pressed;
  int status = linearise(p, part, solve);
  if (!status) status = flesh_stage_tangent_solve(&self->tangent, 1, bar, NULL, p->lambda);
  if (!status) status = multiply(p);
  for (int d = 0; d < self->n; d++) bar[d] -= pressed[d];
  if (!status) status = add_parameters(p, part->taken.second ? NULL : bar);
  if (status) return status;
  for (int d = 0; d < self->n; d++) {
    kx[d] = (shift->v * p->c[d] + shift->a * p->m[d] - bar[d]) / shift->x - pressed[d];
    p->c[d] = -p->c[d];
    p->m[d] = -p->m[d];
  }
  give_bases(p, part, at, kx, p->c, p->m);
  memset(bar, 0, (size_t)self->n * sizeof *bar);
  give_readings(p, part, at, before);
  return FLESH_OK;
}

/* The acceleration with which the method has begun, backward. */
static int start_back(pass *p, const flesh_recorded_part *part)
{
  flesh_trajectory *self = p->self;
  double *bar = p->known[FLESH_KNOWN_VECTORS];
  int status = linearise_start(p, part);
  if (!status) status = flesh_stage_tangent_solve(&self->tangent, 1, bar, NULL, p->lambda);
  if (!status) status = flesh_stage_tangent_stiffness_times(&self->tangent, 1, p->lambda, p->lag);
  if (!status) status = flesh_stage_tangent_damping_times(&self->tangent, 1, p->lambda, p->c);
  if (status) return status;
  add(self->n, -1, p->lag, p->known[FLESH_KNOWN_X]);
  add(self->n, -1, p->c, p->known[FLESH_KNOWN_V]);
  for (int k = 0; k < FLESH_OWN_V; k++)
    flesh_couplings_add(&self->tangent.couplings, (flesh_reading)k, 1, -1, p->lambda,
                        p->known[FLESH_KNOWN_X + flesh_reading_is_of_v((flesh_reading)k)]);
  memset(bar, 0, (size_t)self->n * sizeof *bar);
  return add_parameters(p, NULL);
}

static int part_back(pass *p, const flesh_recorded_part *part)
{
  const int n = p->self->n;
  flesh_trajectory_map(part, &p->map);
  forget_constrained(p, part, p->known);
  for (int k = 0; k < FLESH_KNOWN; k++) {
    double *known = p->known[k];
    p->known[k] = p->next[k];
    p->next[k] = known;
    memset(p->known[k], 0, (size_t)n * sizeof *known);
  }
  for (int s = 0; s < p->map.stages; s++) memset(p->stages[s], 0, (size_t)n * sizeof(double));
  for (int j = 0; j < FLESH_KNOWN; j++)
    for (int k = 0; k < FLESH_KNOWN + p->map.stages; k++)
      add(n, p->map.end[j][k], p->next[j], k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN]);
  int status = FLESH_OK;
  for (int s = part->count - 1; s >= 0 && !status; s--) status = solve_back(p, part, s);
  forget_constrained(p, part, p->known);
  if (!status && begins_by_acceleration(p, part)) status = start_back(p, part);
  if (part->taken.anew) forget_constrained(p, part, p->known);
  return status;
}

/* When call k of the steps has begun, or the last one ended. */
static double time_of(const flesh_trajectory *self, int call, double end)
{
  return call < 0 ? self->calls[0].t : call < self->call_count ? self->calls[call].t : end;
}

/* Adds the bars of the state at which call k has begun, or the last one ended. */
static void add_quantity(pass *p, const flesh_motion_quantity *quantity, int call, double end)
{
  const flesh_trajectory *self = p->self;
  const double *const by[] = {quantity->by_x, quantity->by_v}, begin = time_of(self, 0, end);
  double weight = (time_of(self, call + 1, end) - time_of(self, call - 1, end)) / 2;
  if (quantity->over == FLESH_MEAN) weight /= end - begin;
  if (quantity->over == FLESH_AT_END) weight = call == self->call_count;
  for (int k = 0; k < 2; k++)
    if (by[k]) add(self->n, weight, by[k], p->known[k ? FLESH_KNOWN_V : FLESH_KNOWN_X]);
}

int flesh_trajectory_gradient(flesh_trajectory *self, const flesh_motion_quantity *quantity, int count,
                              const flesh_parameter *parameters, double *gradient, double *by_start)
{
  FLESH_NEED({self, "trajectory"}, {quantity, "quantity"}, {parameters, "parameters"}, {gradient, "gradient"});
  const size_t n = (size_t)self->n;
  double end = 0;
  pass p = pass_of(self);
  flesh_newton_forget(self->tangent.newton); /* so that all gradients have the same bits */
  const flesh_recorded_part *part;
  int status = take_parameters(&p, count, parameters, gradient);
  int call = self->call_count;
  for (int k = self->total - 1; k >= 0 && !status; k--) {
    status = flesh_trajectory_part(self, k, &part);
    if (status) break;
    if (k == self->total - 1) {
      end = part->taken.end;
      add_quantity(&p, quantity, call--, end);
      while (call >= 0 && self->calls[call].t >= end) add_quantity(&p, quantity, call--, end); /* it has failed */
    }
    status = part_back(&p, part);
    while (call >= 0 && part->opens && self->calls[call].t == part->t) add_quantity(&p, quantity, call--, end);
  }
  const int returned = flesh_trajectory_return(self);
  flesh_free(p.same);
  if (!status) status = returned;
  if (status || !by_start) return status;
  memcpy(by_start, p.known[FLESH_KNOWN_X], n * sizeof *by_start);
  memcpy(by_start + n, p.known[FLESH_KNOWN_V], n * sizeof *by_start);
  return FLESH_OK;
}

/* y = the derivative of a base, of what is known and of the unknowns of stages before. */
static void gather_base(const pass *p, const double columns[FLESH_MAP_COLUMNS], double *y)
{
  memset(y, 0, (size_t)p->self->n * sizeof *y);
  for (int k = 0; k < FLESH_MAP_COLUMNS; k++)
    add(p->self->n, columns[k], k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN], y);
}

/* right -= what effects read of lagged and frozen states whose derivatives are known. */
static void subtract_readings(pass *p, const flesh_recorded_part *part, const double *x0, const double *v0, double *right)
{
  const flesh_couplings *couplings = &p->self->tangent.couplings;
  const int lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL;
  for (int k = 0; k < FLESH_READINGS; k++) {
    if ((p->follows >> k & 1) || k >= FLESH_OWN_V || !flesh_couplings_any(couplings, (flesh_reading)k)) continue;
    const int of_v = flesh_reading_is_of_v((flesh_reading)k), lagged = k == FLESH_LAGGED_X || k == FLESH_LAGGED_V;
    const double *at_start = p->known[(lags_stage ? FLESH_KNOWN_LAGGED_X : FLESH_KNOWN_X) + of_v];
    const double *read = !lagged ? (of_v ? v0 : x0) : p->before ? p->ended[of_v] : at_start;
    flesh_couplings_add(couplings, (flesh_reading)k, 0, -1, read, right);
  }
}

/* One solve, forward. With w = du + dx0/s_x: K w = -C (dv0 - s_v dx0/s_x) - M (da0 - s_a dx0/s_x) - dr/dp. */
static int solve_on(pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory *self = p->self;
  flesh_stage_tangent *tangent = &self->tangent;
  const int n = self->n, at = part->solves[solve].at;
  double *x0 = p->next[0], *v0 = p->next[1], *a0 = p->next[2], *right = p->lag, *u = p->stages[at];
  int status = linearise(p, part, solve);
  const flesh_shift *shift = &p->stage.shift;
  if (!status) status = flesh_stage_tangent_force(tangent, p->parameters, NULL, p->force, p->moves);
  for (int d = 0; d < n && !status && part->taken.second; d++)
    if (p->moves[d] != 0)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "a parameter that moves prescribed dofs has sensitivities by backward-euler only");
  if (status) return status;
  gather_base(p, p->map.x0[at], x0);
  gather_base(p, p->map.v0[at], v0);
  gather_base(p, p->map.a0[at], a0);
  for (int d = 0; d < n; d++) right[d] = -p->force[d];
  subtract_readings(p, part, x0, v0, right);
  for (int d = 0; d < n; d++) p->lambda[d] = v0[d] - shift->v / shift->x * x0[d], a0[d] -= shift->a / shift->x * x0[d];
  status = flesh_stage_tangent_mass_times(tangent, a0, p->m);
  if (!status) status = flesh_stage_tangent_damping_times(tangent, 0, p->lambda, p->c);
  if (!status && (p->follows >> FLESH_FROZEN_V & 1))
    flesh_couplings_add(&tangent->couplings, FLESH_FROZEN_V, 0, 1, p->lambda, p->c);
  for (int d = 0; d < n; d++) {
    right[d] -= p->c[d] + p->m[d];
    a0[d] = p->moves[d] + (1 - 1 / shift->x) * x0[d]; /* where constraints hold, beside what w moves */
  }
  if (!status) status = flesh_stage_tangent_solve(tangent, 0, right, a0, u);
  for (int d = 0; d < n && !status; d++) {
    u[d] += p->moves[d] - x0[d] / shift->x; /* moves are 0 on free dofs, solutions on constrained ones */
    p->ended[0][d] = x0[d] + shift->x * u[d];
    p->ended[1][d] = v0[d] + shift->v * u[d];
  }
  p->before = 1;
  return status;
}

/* The acceleration with which the method has begun, forward. */
static int start_on(pass *p, const flesh_recorded_part *part)
{
  flesh_stage_tangent *tangent = &p->self->tangent;
  double *right = p->lag, *a = p->known[FLESH_KNOWN_VECTORS];
  int status = linearise_start(p, part);
  if (!status) status = flesh_stage_tangent_force(tangent, p->parameters, NULL, p->force, p->moves);
  if (!status) status = flesh_stage_tangent_stiffness_times(tangent, 0, p->known[FLESH_KNOWN_X], right);
  if (!status) status = flesh_stage_tangent_damping_times(tangent, 0, p->known[FLESH_KNOWN_V], p->c);
  if (status) return status;
  for (int d = 0; d < p->self->n; d++) right[d] = -right[d] - p->c[d] - p->force[d];
  for (int k = 0; k < FLESH_OWN_V; k++)
    flesh_couplings_add(&tangent->couplings, (flesh_reading)k, 0, -1,
                        p->known[FLESH_KNOWN_X + flesh_reading_is_of_v((flesh_reading)k)], right);
  return flesh_stage_tangent_solve(tangent, 0, right, NULL, a);
}

/* Shows the derivatives of the states at which calls up to time t have begun. */
static int show(pass *p, double t)
{
  const flesh_trajectory *self = p->self;
  int status = FLESH_OK;
  for (; p->visit && p->call < self->call_count && self->calls[p->call].t <= t && !status; p->call++)
    if (self->calls[p->call].t == t) status = p->visit(p->visit_data, t, p->known[FLESH_KNOWN_X], p->known[FLESH_KNOWN_V]);
  return status;
}

/* Implements flesh_part_visit. */
static int part_on(void *data, const flesh_recorded_part *part)
{
  pass *p = data;
  const int n = p->self->n;
  int status = show(p, part->t);
  if (status) return status;
  flesh_trajectory_map(part, &p->map);
  forget_constrained(p, part, p->known);
  if (begins_by_acceleration(p, part)) status = start_on(p, part);
  forget_constrained(p, part, p->known);
  p->before = 0;
  for (int s = 0; s < part->count && !status; s++) status = solve_on(p, part, s);
  for (int j = 0; j < FLESH_KNOWN; j++) gather_base(p, p->map.end[j], p->next[j]);
  for (int k = 0; k < FLESH_KNOWN; k++) memcpy(p->known[k], p->next[k], (size_t)n * sizeof(double));
  forget_constrained(p, part, p->known);
  p->end = part->taken.end;
  return status;
}

/* Room for the derivatives of the last state. */
typedef struct last_tangent {
  size_t bytes;
  double *dx, *dv;
} last_tangent;

int flesh_trajectory_tangents(flesh_trajectory *self, const flesh_parameter *parameter, const double *start,
                              flesh_tangent_visit visit, void *data)
{
  FLESH_NEED({self, "trajectory"}, {parameter, "parameter"}, {visit, "visit"});
  const size_t n = (size_t)self->n;
  pass p = pass_of(self);
  p.parameters = parameter;
  p.visit = visit;
  p.visit_data = data;
  if (start) memcpy(p.known[FLESH_KNOWN_X], start, n * sizeof *start);
  if (start) memcpy(p.known[FLESH_KNOWN_V], start + n, n * sizeof *start);
  flesh_newton_forget(self->tangent.newton);
  const int status = flesh_trajectory_visit(self, part_on, &p);
  return status || !self->total ? status : visit(data, p.end, p.known[FLESH_KNOWN_X], p.known[FLESH_KNOWN_V]);
}

/* Copies the derivatives of the last state. Implements flesh_tangent_visit. */
static int keep_last(void *data, double t, const double *dx, const double *dv)
{
  const last_tangent *last = data;
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
  return flesh_trajectory_tangents(self, parameter, NULL, keep_last, &last);
}
