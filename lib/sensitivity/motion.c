/* motion.c: the discrete adjoint of a recorded motion. A bar denotes the derivative of Q by a quantity. Backward over a
 * step: ubar = F_u^T Ybar'; K^T lambda = ubar; Ybar = F_y^T Ybar' - A^T (K_x^T lambda, C^T lambda, M lambda), where K_x^T
 * lambda = (ubar - s_v C^T lambda - s_a M lambda)/s_x needs no product with K_x. Lagged and frozen terms add their own
 * derivatives to the bars of the states that they read. */
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "sensitivity/pass.h"
#include "sensitivity/tets.h"

/* Adds the bars x, v and a of the bases x0, v0 and a0 to the bars of what the bases are combined from. */
static void give_bases(flesh_motion_pass *p, const flesh_recorded_part *part, int at, const double *x, const double *v,
                       const double *a)
{
  const int n = p->self->n;
  for (int k = 0; k < FLESH_KNOWN + at; k++) {
    double *bar = k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN];
    if (k < FLESH_KNOWN && !part->known[k]) continue;
    flesh_add_scaled(n, p->map.x0[at][k], x, bar);
    flesh_add_scaled(n, p->map.v0[at][k], v, bar);
    if (a) flesh_add_scaled(n, p->map.a0[at][k], a, bar);
  }
}

/* Adds to the gradients through constrained dofs, which follow their own motion at t: x and v are their bars (NULL: none). */
static int give_constrained(flesh_motion_pass *p, double t, const double *x, const double *v)
{
  const flesh_prescribed *prescribed = &p->self->prescribed;
  const double *const bars[2] = {x, v};
  int moved, status = FLESH_OK;
  for (int k = 0; k < p->count && !status; k++) {
    status = flesh_pass_moves(p, k, t, &moved);
    for (int i = 0; i < 2 && !status && moved; i++)
      for (int d = 0; d < prescribed->n && bars[i]; d++)
        if (prescribed->fixed[d]) p->gradient[k] += bars[i][d] * p->moves[i][d];
  }
  return status;
}

/* Adds the derivative of the residual along lambda by each argument to the bar of the state that was read: for a lagged
 * state, that of the solve before or, in the first solve, one known before the part. */
static int give_readings(flesh_motion_pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory *self = p->self;
  const int n = self->n, lags_stage = part->known[FLESH_KNOWN_LAGGED_X] != NULL, at = part->solves[solve].at;
  const int before = solve > 0 ? part->solves[solve - 1].at : -1;
  int status = FLESH_OK;
  double *zero = p->force;
  memset(zero, 0, (size_t)n * sizeof *zero);
  for (int k = 0; k < FLESH_ARGUMENTS && !status; k++) {
    if ((p->follows >> k & 1) || k >= FLESH_OWN_V || !flesh_couplings_any(&self->tangent.couplings, (flesh_argument)k)) continue;
    memset(p->lag, 0, (size_t)n * sizeof *p->lag);
    flesh_couplings_add(&self->tangent.couplings, (flesh_argument)k, 1, -1, p->lambda, p->lag);
    const int of_v = flesh_argument_is_of_v((flesh_argument)k), lagged = k == FLESH_LAGGED_X || k == FLESH_LAGGED_V;
    if (lagged && before >= 0 && self->tangent.prescribed) {
      status = give_constrained(p, part->solves[solve - 1].stage.t, of_v ? NULL : p->lag, of_v ? p->lag : NULL);
      flesh_pass_forget_constrained(p, p->lag);
    }
    if (lagged && before < 0)
      flesh_add_scaled(n, 1, p->lag, p->known[(lags_stage ? FLESH_KNOWN_LAGGED_X : FLESH_KNOWN_X) + of_v]);
    else give_bases(p, part, lagged ? before : at, of_v ? zero : p->lag, of_v ? p->lag : zero, NULL);
    if (!lagged || before < 0) continue;
    const flesh_shift *shift = &p->map.shift[before];
    flesh_add_scaled(n, of_v ? shift->v : shift->x, p->lag, p->stages[before]);
  }
  return status;
}

/* Computes c = C^T lambda, with followed derivatives by v, and m = M lambda. */
static int multiply(flesh_motion_pass *p)
{
  flesh_stage_tangent *tangent = &p->self->tangent;
  int status = flesh_stage_tangent_damping_times(tangent, 1, p->lambda, p->c);
  if (!status) status = flesh_stage_tangent_mass_times(tangent, p->lambda, p->m);
  if (!status && (p->follows >> FLESH_FROZEN_V & 1))
    flesh_couplings_add(&tangent->couplings, FLESH_FROZEN_V, 1, 1, p->lambda, p->c);
  return status;
}

/* Adds to the gradients each parameter's change of the residual, and of constrained dofs with the bars of u (NULL: 0). */
static int add_parameters(flesh_motion_pass *p, const double *bar)
{
  int status = FLESH_OK;
  for (int k = 0; k < p->count && !status; k++) {
    status = flesh_pass_force(p, k);
    for (int d = 0; d < p->self->n && !status; d++)
      p->gradient[k] += (bar ? bar[d] * p->moves[0][d] : 0) - p->lambda[d] * p->force[d];
  }
  if (!p->tets || status) return status;
  status = flesh_varied_tets_set(p->tets, &p->self->tangent.point);
  if (!status) flesh_varied_tets_add(p->tets, p->lambda, p->by_tet);
  return status;
}

/* Goes backward over one solve. */
static int solve_back(flesh_motion_pass *p, const flesh_recorded_part *part, int solve)
{
  flesh_trajectory *self = p->self;
  const int at = part->solves[solve].at;
  const flesh_shift *shift = &p->stage.shift;
  double *bar = p->stages[at], *kx = p->lag, *const bases[3] = {kx, p->c, p->m};
  const double *pressed = self->tangent.pressed;
  int d = 0;
  while (d < self->n && bar[d] == 0) d++;
  if (d == self->n) return FLESH_OK; /* as before an equilibrium that does not depend on the solves before it */
  int status = flesh_pass_linearise(p, part, solve);
  if (!status) status = flesh_stage_tangent_solve(&self->tangent, 1, bar, NULL, p->lambda);
  if (!status) status = multiply(p);
  for (d = 0; d < self->n; d++) bar[d] -= pressed[d];
  const int within = shift->x != 1; /* the step; multipliers then enforce constraints at its end */
  if (!status) status = add_parameters(p, within ? NULL : bar);
  if (!status && within && self->tangent.multipliers) status = give_constrained(p, part->taken.end, bar, NULL);
  if (status) return status;
  for (d = 0; d < self->n; d++) {
    kx[d] = (shift->v * p->c[d] + shift->a * p->m[d] - bar[d]) / shift->x - pressed[d];
    p->c[d] = -p->c[d];
    p->m[d] = -p->m[d];
  }
  for (int k = 0; k < 3 && self->tangent.prescribed; k++) flesh_pass_forget_constrained(p, bases[k]);
  give_bases(p, part, at, kx, p->c, p->m);
  memset(bar, 0, (size_t)self->n * sizeof *bar);
  return give_readings(p, part, solve);
}

/* Goes backward over the acceleration with which the method has begun. */
static int start_back(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  flesh_trajectory *self = p->self;
  double *bar = p->known[FLESH_KNOWN_VECTORS];
  int status = flesh_pass_linearise_start(p, part);
  flesh_pass_forget_constrained(p, bar);
  if (!status) status = flesh_stage_tangent_solve(&self->tangent, 1, bar, NULL, p->lambda);
  if (!status) status = flesh_stage_tangent_read(&self->tangent, p->lambda, p->lag, p->c);
  if (status) return status;
  flesh_pass_forget_constrained(p, p->lag); /* their change with a parameter is part of its force */
  flesh_pass_forget_constrained(p, p->c);
  flesh_add_scaled(self->n, -1, p->lag, p->known[FLESH_KNOWN_X]);
  flesh_add_scaled(self->n, -1, p->c, p->known[FLESH_KNOWN_V]);
  memset(bar, 0, (size_t)self->n * sizeof *bar);
  return add_parameters(p, NULL);
}

/* Goes backward over the end of a part, where constrained dofs are moved to their prescribed positions; a start does not
 * move them. */
static int end_back(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  const flesh_recorded_solve *last = part->count ? &part->solves[part->count - 1] : NULL;
  const int within = last && p->map.shift[last->at].x != 1;
  double *x = p->known[FLESH_KNOWN_X], *v = p->known[FLESH_KNOWN_V], *x_lag = p->known[FLESH_KNOWN_LAGGED_X],
         *v_lag = p->known[FLESH_KNOWN_LAGGED_V];
  flesh_pass_prescribe(p, part, 0);
  int status = within ? give_constrained(p, last->stage.t, x_lag, v_lag) : FLESH_OK;
  for (int d = 0; d < p->self->n && !within; d++)
    if (p->self->prescribed.fixed[d]) x[d] += x_lag[d], v[d] += v_lag[d];
  if (!status && !part->taken.starts) status = give_constrained(p, part->taken.end, x, v);
  for (int k = 0; k < FLESH_KNOWN; k++)
    if (!(part->taken.starts && k < FLESH_KNOWN_VECTORS)) flesh_pass_forget_constrained(p, p->known[k]);
  return status;
}

/* Goes backward over the jump of constrained dofs before the part, with the response of the free ones, for the bars of
 * positions or velocities. */
static int jump_back(flesh_motion_pass *p, const flesh_recorded_part *part, int of_v)
{
  flesh_trajectory *self = p->self;
  double *bar = p->known[of_v ? FLESH_KNOWN_V : FLESH_KNOWN_X], *free = p->c, *before = p->m;
  memcpy(free, bar, (size_t)self->n * sizeof *free);
  int status = flesh_newton_solve_tangent(self->tangent.newton, free, self->tangent.tolerance, p->lambda);
  for (int k = 0; k < p->count && !status && part->jump; k++) {
    status = flesh_stage_tangent_mass_force(&self->tangent, &p->parameters[k], part->jump + (of_v ? self->n : 0), p->force);
    for (int d = 0; d < self->n; d++) p->gradient[k] -= p->lambda[d] * p->force[d];
  }
  if (!status) status = flesh_stage_tangent_mass_times(&self->tangent, p->lambda, before);
  for (int d = 0; d < self->n; d++)
    if (self->prescribed.fixed[d]) bar[d] -= before[d];
  if (!status) status = give_constrained(p, part->taken.begin, of_v ? NULL : bar, of_v ? bar : NULL);
  for (int d = 0; d < self->n; d++)
    if (self->prescribed.fixed[d]) bar[d] = before[d];
  return status;
}

/* Goes backward over the beginning of the method: the acceleration, and jumps of constrained dofs. */
static int begin_back(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  const int jumps = flesh_pass_jumps(p, part), accelerates = flesh_pass_begins_by_acceleration(p, part);
  int status = FLESH_OK, some = 0;
  if (accelerates) status = start_back(p, part);
  for (int d = 0; d < p->self->n && jumps; d++) some |= p->self->prescribed.fixed[d];
  if (!status && some && !accelerates) status = flesh_pass_linearise_start(p, part);
  for (int k = 0; k < 2 && !status && some; k++) status = jump_back(p, part, k);
  return status;
}

static int part_back(flesh_motion_pass *p, const flesh_recorded_part *part)
{
  const int n = p->self->n;
  flesh_trajectory_map(part, &p->map);
  int status = part->taken.second ? end_back(p, part) : FLESH_OK;
  if (status) return status;
  for (int k = 0; k < FLESH_KNOWN; k++) {
    double *known = p->known[k];
    p->known[k] = p->next[k];
    p->next[k] = known;
    memset(p->known[k], 0, (size_t)n * sizeof *known);
  }
  for (int s = 0; s < p->map.stages; s++) memset(p->stages[s], 0, (size_t)n * sizeof(double));
  for (int j = 0; j < FLESH_KNOWN; j++)
    for (int k = 0; k < FLESH_KNOWN + p->map.stages; k++)
      flesh_add_scaled(n, p->map.end[j][k], p->next[j], k < FLESH_KNOWN ? p->known[k] : p->stages[k - FLESH_KNOWN]);
  for (int s = part->count - 1; s >= 0 && !status; s--) status = solve_back(p, part, s);
  for (int k = FLESH_KNOWN_VECTORS; k < FLESH_KNOWN_LAGGED_X && part->taken.second; k++)
    flesh_pass_forget_constrained(p, p->known[k]);
  return status ? status : begin_back(p, part);
}

/* Returns the time at which call k of the steps has begun, or the last one ended. */
static double time_of(const flesh_trajectory *self, int call, double end)
{
  return call < 0 ? self->calls[0].t : call < self->call_count ? self->calls[call].t : end;
}

/* A quantity whose derivatives are wanted, or a `visit` that adds them. */
typedef struct asking {
  const flesh_motion_quantity *quantity;
  flesh_adjoint_visit visit;
  void *data;
} asking;

/* Adds the bars of the state at which call k has begun, or the last one ended. */
static int add_asked(flesh_motion_pass *p, const asking *asked, int call, double end)
{
  const flesh_trajectory *self = p->self;
  const flesh_motion_quantity *quantity = asked->quantity;
  const double t = time_of(self, call, end), begin = time_of(self, 0, end);
  if (asked->visit) {
    const int again = call < self->call_count && time_of(self, call + 1, end) == t; /* 1: the call has failed */
    return again ? FLESH_OK : asked->visit(asked->data, t, p->known[FLESH_KNOWN_X], p->known[FLESH_KNOWN_V]);
  }
  const double *by[] = {quantity->by_x, quantity->by_v};
  double weight = (time_of(self, call + 1, end) - time_of(self, call - 1, end)) / 2;
  if (quantity->over == FLESH_MEAN) weight /= end - begin;
  if (quantity->over == FLESH_AT_END) weight = call == self->call_count;
  if (quantity->visit && weight != 0) {
    by[0] = memset(p->c, 0, (size_t)self->n * sizeof(double));
    by[1] = memset(p->m, 0, (size_t)self->n * sizeof(double));
    const int status = quantity->visit(quantity->data, t, p->c, p->m);
    if (status) return status;
  }
  for (int k = 0; k < 2; k++)
    if (by[k]) flesh_add_scaled(self->n, weight, by[k], p->known[k ? FLESH_KNOWN_V : FLESH_KNOWN_X]);
  return FLESH_OK;
}

/* Goes backward over all parts, after the parameters were taken. */
static int go_back(flesh_motion_pass *p, const asking *asked)
{
  flesh_trajectory *self = p->self;
  const flesh_recorded_part *part;
  int status = FLESH_OK, call = self->call_count;
  double end = 0;
  flesh_newton_forget(self->tangent.newton); /* so that all gradients have the same bits */
  for (int k = self->total - 1; k >= 0 && !status; k--) {
    status = flesh_trajectory_part(self, k, &part);
    if (status) break;
    if (k == self->total - 1) {
      end = part->taken.end;
      status = add_asked(p, asked, call--, end);
      /* the call has failed */
      while (call >= 0 && self->calls[call].t >= end && !status) status = add_asked(p, asked, call--, end);
    }
    if (!status) status = part_back(p, part);
    while (call >= 0 && part->opens && self->calls[call].t == part->t && !status) status = add_asked(p, asked, call--, end);
  }
  const int returned = flesh_trajectory_return(self);
  return status ? status : returned;
}

int flesh_trajectory_gradient(flesh_trajectory *self, const flesh_motion_quantity *quantity, int count,
                              const flesh_parameter *parameters, double *gradient, double *by_start)
{
  FLESH_NEED({self, "trajectory"}, {quantity, "quantity"}, {parameters, "parameters"}, {gradient, "gradient"});
  const size_t n = (size_t)self->n;
  flesh_motion_pass p = flesh_pass_of(self, self->vectors);
  p.gradient = gradient;
  int status = flesh_trajectory_check(self);
  if (!status && (unsigned)quantity->over > FLESH_MEAN)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "quantity->over is number %d; it must be 0 to %d", (int)quantity->over, FLESH_MEAN);
  if (!status) status = flesh_pass_take_parameters(&p, count, parameters);
  if (status) return status;
  memset(gradient, 0, (size_t)count * sizeof *gradient);
  status = go_back(&p, &(asking){.quantity = quantity});
  flesh_free(p.same);
  if (status || !by_start) return status;
  memcpy(by_start, p.known[FLESH_KNOWN_X], n * sizeof *by_start);
  memcpy(by_start + n, p.known[FLESH_KNOWN_V], n * sizeof *by_start);
  return FLESH_OK;
}

int flesh_trajectory_tet_gradient(flesh_trajectory *self, const flesh_tet_parameter *parameter, flesh_adjoint_visit visit,
                                  void *data, double *gradient)
{
  FLESH_NEED({self, "trajectory"}, {parameter, "parameter"}, {visit, "visit"}, {gradient, "gradient"});
  flesh_varied_tets tets;
  int status = flesh_trajectory_check(self);
  if (status) return status;
  status = flesh_varied_tets_open(parameter, self->system, &tets);
  flesh_motion_pass p = flesh_pass_of(self, self->vectors);
  p.tets = &tets;
  p.by_tet = gradient;
  if (!status) memset(gradient, 0, (size_t)flesh_mesh_tet_count(tets.torn_body.mesh) * sizeof *gradient);
  if (!status) status = go_back(&p, &(asking){.visit = visit, .data = data});
  flesh_varied_tets_clear(&tets);
  return status;
}
