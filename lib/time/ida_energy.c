/* ida_energy.c: work along IDA's interpolant; energies where states are given back. */
#include "time/ida_energy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sundials/compatibility.h"
#include "system/one_effect.h"
#include "system/work.h"

/* Work is refined until two sums differ by less than these parts of the last and of the largest energy of the motion;
 * the error of the last sum is a fifteenth of the difference. */
static const double refine_share = 1e-2, refine_scale = 1e-3;
enum { MOST_PARTS = 64 }; /* of an interval */

int flesh_ida_energy_create(flesh_ida_problem *problem, flesh_energy_watch *watch, flesh_ida_energy *energy)
{
  const size_t n = (size_t)problem->evaluation.n;
  *energy = (flesh_ida_energy){.problem = problem, .watch = watch};
  energy->x = calloc(n + 1, sizeof *energy->x);
  energy->r = calloc(n + 1, sizeof *energy->r);
  if (energy->x && energy->r) return FLESH_OK;
  flesh_ida_energy_clear(energy);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to watch the energy of %zu unknowns", n);
}

void flesh_ida_energy_clear(flesh_ida_energy *energy)
{
  free(energy->x);
  free(energy->r);
  *energy = (flesh_ida_energy){0};
}

void flesh_ida_energy_tolerate(flesh_ida_energy *self, double tolerance)
{
  flesh_energy_watch *watch = self->watch;
  const double *X = flesh_mesh_positions(flesh_system_mesh(watch->system));
  const flesh_point point = flesh_point_at(0, X, self->r, self->r);
  for (int d = 0; d < self->problem->evaluation.n; d++) self->r[d] = tolerance * self->problem->scale.velocity;
  if (flesh_system_kinetic_energies(watch->system, &point, NULL, &watch->floor)) watch->floor = 0;
}

/* Returns the moment before an event at t, or t. */
static double before_event(const flesh_ida_energy *self, double t)
{
  return t >= self->problem->constraints.event ? nextafter(self->problem->constraints.event, -INFINITY) : t;
}

void flesh_ida_energy_start(flesh_ida_energy *self, double t, double *y)
{
  const int n = self->problem->evaluation.n;
  const flesh_state state = {.t = t, .x = y, .v = y + n};
  flesh_energy_watch_jump(self->watch, t, &state);
  memcpy(self->x, y, (size_t)n * sizeof *y);
  self->t = t;
  self->power = NAN;
  self->moves = flesh_ida_moves(self->problem);
}

/* Finds the power [W] of reactions and forces at t, between `from` and `to`. */
static int find_power(const flesh_ida_energy *self, double from, double to, double t, double *power)
{
  flesh_ida_problem *problem = self->problem;
  const flesh_evaluation *e = &problem->evaluation;
  const int forces = self->watch->kinds & FLESH_WORK_OF_FORCES;
  double work = 0;
  *power = 0;
  if (IDAGetDky(self->ida, t, 0, self->y) || IDAGetDky(self->ida, t, 1, self->yp))
    return flesh_fail(FLESH_ERR_SUNDIALS, "IDA could not interpolate at t = %.9g s", t);
  const flesh_point point = flesh_ida_point(problem, t, N_VGetArrayPointer(self->y), N_VGetArrayPointer(self->yp));
  int status = self->moves ? flesh_system_residual(e->system, &point, self->r) : FLESH_OK;
  for (int d = 0; d < e->n; d++)
    if (!problem->constraints.fixed[d]) self->r[d] = 0;
  if (self->moves && !status) *power = flesh_system_product(e->system, problem->constraints.v, self->r);
  if (!status && forces)
    status = flesh_system_work_of_forces(e->system, &point, from, to, NULL, self->watch->scratch, &work);
  *power += work / (to - from);
  return status;
}

/* Finds their work from `from`, where their power is self->power, to `to`, by Simpson's rule with ever more parts. */
static int find_work(flesh_ida_energy *self, double from, double to, double *work)
{
  const flesh_energy_watch *watch = self->watch;
  const double h = to - from, least = refine_scale * fmax(watch->balance.scale, watch->floor);
  double power[MOST_PARTS + 1] = {self->power}, last = NAN;
  int status = isnan(self->power) ? find_power(self, from, to, from, power) : FLESH_OK;
  for (int parts = 2; parts <= MOST_PARTS && !status; parts *= 2) {
    const int stride = MOST_PARTS / parts;
    double sum = power[0];
    for (int k = 1; k <= parts && !status; k++) {
      if (parts == 2 || k % 2) status = find_power(self, from, to, from + k * h / parts, &power[k * stride]);
      sum += (k == parts ? 1 : k % 2 ? 4 : 2) * power[k * stride];
    }
    *work = sum * h / (3 * parts);
    if (fabs(*work - last) <= refine_share * fabs(*work) + least) break;
    last = *work;
  }
  self->power = power[MOST_PARTS];
  return status;
}

/* Finds by how much energies of effects change from `from` to `to` at fixed positions: half at those before, half at
 * those now. */
static int find_work_in_time(flesh_ida_energy *self, double from, double to, double *work)
{
  flesh_ida_problem *problem = self->problem;
  int status = FLESH_OK;
  if (IDAGetDky(self->ida, to, 0, self->y))
    return flesh_fail(FLESH_ERR_SUNDIALS, "IDA could not interpolate at t = %.9g s", to);
  flesh_ida_point(problem, to, N_VGetArrayPointer(self->y), NULL);
  for (int end = 0; end < 2 && !status; end++) {
    const flesh_state state = {.x = end ? problem->evaluation.x : self->x, .v = problem->evaluation.v};
    double part = 0;
    status = flesh_system_work_in_time(problem->evaluation.system, from, to, &state, NULL, 0, &part);
    *work += part / 2;
  }
  memcpy(self->x, problem->evaluation.x, (size_t)problem->evaluation.n * sizeof *self->x);
  return status;
}

int flesh_ida_energy_count(flesh_ida_energy *self, double t)
{
  flesh_energy_watch *watch = self->watch;
  const double from = self->t, to = before_event(self, t);
  double work = 0;
  int status = FLESH_OK;
  if (!(to > from)) return FLESH_OK;
  if (self->moves || watch->kinds & FLESH_WORK_OF_FORCES) status = find_work(self, from, to, &work);
  if (!status && watch->kinds & FLESH_WORK_IN_TIME) status = find_work_in_time(self, from, to, &work);
  self->t = t;
  if (status) watch->known = 0, self->power = NAN;
  else watch->balance.supplied += work;
  return status < 0 ? status : FLESH_OK;
}

int flesh_ida_energy_judge(flesh_ida_energy *self, const flesh_state *state)
{
  int status = flesh_ida_energy_count(self, state->t);
  if (!status) status = flesh_energy_watch_record_state(self->watch, before_event(self, state->t), state, NULL, NULL);
  if (status) return status < 0 ? status : FLESH_OK;
  return flesh_energy_watch_judge(self->watch, state, 0);
}
