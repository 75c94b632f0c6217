/* adaptive_energy.c: work from internal step to internal step; energies where states are given back, between them. */
#include "time/adaptive_energy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "system/work.h"
#include "system/one_effect.h"

int flesh_adaptive_energy_create(flesh_ida_problem *problem, flesh_energy_watch *watch, flesh_adaptive_energy *energy)
{
  const size_t n = (size_t)problem->n;
  *energy = (flesh_adaptive_energy){.problem = problem, .watch = watch};
  energy->x = calloc(n + 1, sizeof *energy->x);
  energy->u = calloc(n + 1, sizeof *energy->u);
  if (energy->x && energy->u) return FLESH_OK;
  flesh_adaptive_energy_clear(energy);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to watch the energy of %zu unknowns", n);
}

void flesh_adaptive_energy_clear(flesh_adaptive_energy *energy)
{
  free(energy->x);
  free(energy->u);
  *energy = (flesh_adaptive_energy){0};
}

void flesh_adaptive_energy_tolerate(flesh_adaptive_energy *self, double tolerance)
{
  flesh_energy_watch *watch = self->watch;
  const flesh_point point = {.x = flesh_mesh_positions(flesh_system_mesh(watch->system)), .v = self->u, .a = self->u};
  for (int d = 0; d < self->problem->n; d++) self->u[d] = tolerance * self->problem->velocity;
  if (flesh_system_role_energies(watch->system, FLESH_ROLE_INERTIA, &point, NULL, &watch->floor)) watch->floor = 0;
}

/* The moment before an event at t, else t. */
static double before_event(const flesh_adaptive_energy *self, double t)
{
  return t >= self->problem->event ? nextafter(self->problem->event, -INFINITY) : t;
}

/* What has been put in beyond t, within the last internal step. */
static double ahead_of(const flesh_adaptive_energy *self, double t)
{
  const double step = self->t - self->before, put_in = self->watch->balance.supplied - self->supplied;
  return step > 0 && self->t > t ? put_in * fmin((self->t - t) / step, 1) : 0; /* evenly */
}

void flesh_adaptive_energy_start(flesh_adaptive_energy *self, double t, double *y)
{
  const int n = self->problem->n;
  const flesh_state state = {.t = t, .x = y, .v = y + n};
  self->later = 0;
  flesh_energy_watch_jump(self->watch, t, &state);
  memcpy(self->x, y, (size_t)n * sizeof *y);
  self->t = self->before = t;
  self->supplied = self->watch->balance.supplied;
}

/* W of the internal step to t: of reactions and forces there, and what changes with time at a place. */
void flesh_adaptive_energy_count(flesh_adaptive_energy *self, double t, const double *y)
{
  flesh_ida_problem *problem = self->problem;
  flesh_energy_watch *watch = self->watch;
  const double from = self->t, to = before_event(self, t);
  double work = 0, part = 0;
  int status = FLESH_OK;
  for (int d = 0; d < problem->n; d++) /* reactions at ghosts are their owners' */
    if (problem->fixed[d]) work += (to - from) * problem->reactions[d] * problem->v_prescribed[d];
  flesh_team_sum(problem->team, 1, &work);
  watch->balance.supplied += self->later;
  self->later = 0;
  self->supplied = watch->balance.supplied;
  if (watch->kinds & FLESH_WORK_OF_FORCES) {
    const flesh_point point = flesh_ida_point(problem, t, y, NULL);
    status = flesh_system_work_of_forces(problem->system, &point, from, to, NULL, watch->scratch, &part);
    work += part;
  }
  flesh_energy_watch_supply(watch, from, to, to, work, 0);
  for (int end = 0; end < 2 && !status && watch->kinds & FLESH_WORK_IN_TIME; end++) {
    const flesh_state state = {.x = (double *)(end ? y : self->x), .v = (double *)y + problem->n}; /* only read */
    status = flesh_system_work_in_time(problem->system, from, to, &state, NULL, 0, &part);
    watch->balance.supplied += part / 2;
  }
  if (status) watch->known = 0;
  memcpy(self->x, y, (size_t)problem->n * sizeof *y);
  self->before = from;
  self->t = t;
}

int flesh_adaptive_energy_judge(flesh_adaptive_energy *self, const flesh_state *state)
{
  flesh_energy_watch *watch = self->watch;
  watch->balance.supplied += self->later;
  self->later = ahead_of(self, state->t);
  watch->balance.supplied -= self->later;
  int status = flesh_energy_watch_meet(watch, before_event(self, state->t), state, NULL, NULL);
  if (status) return status < 0 ? status : FLESH_OK;
  return flesh_energy_watch_judge(watch, state, 0);
}
