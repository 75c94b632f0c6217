/* impact.c: the energy that contact owes to the motion, and how velocities give it back. */
#include "time/impact.h"

#include <math.h>
#include <string.h>

#include "effect/effect.h"
#include "system/one_effect.h"

/* The part of the gain that ends a run from which on it is given back: below, runs have the bits of the rule by itself. */
static const double counts = 2e-3;

/* The forces of contact at the state, with friction or without: a body at rest has none. */
static int find_forces(const flesh_energy_watch *watch, const flesh_state *state, int friction, double stored, double *forces)
{
  flesh_state at_rest = *state;
  if (!friction) at_rest.v = watch->evaluation->zeros;
  if (stored == 0) {
    memset(forces, 0, (size_t)watch->n * sizeof *forces);
    return FLESH_OK;
  }
  const flesh_point point = flesh_energy_watch_point(watch, state->t, &at_rest, NULL);
  return flesh_system_forces(watch->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, forces);
}

/* momentum [n] = the mass matrix times v [n]. */
static int find_momentum(const flesh_energy_watch *watch, const flesh_state *state, const double *v, double *momentum)
{
  const flesh_point point = flesh_energy_watch_point(watch, state->t, state, v);
  return flesh_system_forces(watch->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, momentum);
}

/* Whether an obstacle moves from t_from to t_to: what contact puts in then is not known. */
static int obstacles_move(flesh_impact *self, const flesh_energy_watch *watch, const flesh_state *from, double t_to)
{
  const flesh_point point = flesh_energy_watch_point(watch, from->t, from, NULL);
  for (int k = 0; k < watch->effects; k++) {
    const flesh_effect *effect = flesh_system_effect(watch->system, k);
    const flesh_effect_time *in_time = flesh_effect_in_time(effect);
    if (effect->operations->role == FLESH_ROLE_CONTACT && in_time->carry && in_time->carry(effect, &point, from->t, t_to, self->by))
      return 1;
  }
  return 0;
}

static double stored_in(const flesh_energy_watch *watch)
{
  return flesh_system_role_energy(watch->system, FLESH_ROLE_CONTACT, watch->energies);
}

int flesh_impact_begin(flesh_impact *self, const flesh_energy_watch *watch, const flesh_method_row *row,
                       const flesh_method_memory *memory, const flesh_state *state)
{
  self->on = self->by && row && row->trapezoidal && row->trapezoidal(memory) && watch->known;
  self->turned = 0;
  self->owes = self->owed;
  if (!self->on) return FLESH_OK;
  self->stored = stored_in(watch);
  return find_forces(watch, state, 0, self->stored, self->impulse[0]);
}

/* Scales what of v is in the span of the impulses so that the motion gives back what is owed. */
static int give_back(flesh_impact *self, const flesh_energy_watch *watch, const uint8_t *fixed, const flesh_state *end,
                     double *v)
{
  const flesh_system *system = watch->system;
  double A[2][2], b[2], c[2] = {0, 0};
  for (int d = 0; d < watch->n; d++) self->by[d] = 1;
  int status = find_momentum(watch, end, self->by, self->mass);
  for (int i = 0; i < 2 && !status; i++) {
    double *w = self->impulse[i];
    for (int d = 0; d < watch->n; d++) w[d] = fixed[d] || self->mass[d] == 0 ? 0 : w[d] / self->mass[d];
    status = find_momentum(watch, end, w, self->by);
    b[i] = status ? 0 : flesh_system_product(system, v, self->by);
    for (int j = 0; j <= i && !status; j++) A[i][j] = A[j][i] = flesh_system_product(system, self->impulse[j], self->by);
  }
  if (status) return status;
  const double determinant = A[0][0] * A[1][1] - A[0][1] * A[0][1];
  if (determinant > 1e-9 * A[0][0] * A[1][1]) {
    c[0] = (A[1][1] * b[0] - A[0][1] * b[1]) / determinant;
    c[1] = (A[0][0] * b[1] - A[0][1] * b[0]) / determinant;
  } else {
    const int k = A[1][1] > A[0][0];
    if (A[k][k] > 0) c[k] = b[k] / A[k][k];
  }
  const double kinetic = (c[0] * b[0] + c[1] * b[1]) / 2;
  if (!(kinetic > 0)) return FLESH_OK;
  const double scale = sqrt(fmax(1 - self->owes / kinetic, 0));
  self->owes += kinetic * (scale * scale - 1);
  for (int d = 0; d < watch->n; d++) {
    self->impulse[0][d] = (scale - 1) * (c[0] * self->impulse[0][d] + c[1] * self->impulse[1][d]);
    v[d] += self->impulse[0][d];
  }
  self->turned = 1;
  return FLESH_OK;
}

int flesh_impact_end(flesh_impact *self, flesh_energy_watch *watch, const uint8_t *fixed, const flesh_state *state,
                     const flesh_state *end, double *v)
{
  if (!self->on || !watch->known) return FLESH_OK;
  const double stored = stored_in(watch);
  if ((stored == 0 && self->stored == 0) || obstacles_move(self, watch, state, end->t)) return FLESH_OK;
  int status = find_forces(watch, end, 0, stored, self->impulse[1]);
  if (status) return status;
  for (int d = 0; d < watch->n; d++) self->by[d] = (end->x[d] - state->x[d]) / 2;
  self->owes += stored - self->stored - flesh_system_product(watch->system, self->by, self->impulse[0]) -
                flesh_system_product(watch->system, self->by, self->impulse[1]);
  if (!(fabs(self->owes) > counts * watch->limit * flesh_energy_watch_scale(watch))) return FLESH_OK;
  status = find_forces(watch, state, 1, self->stored, self->impulse[0]);
  if (!status) status = find_forces(watch, end, 1, stored, self->impulse[1]);
  if (!status) status = give_back(self, watch, fixed, end, v);
  return status || !self->turned ? status : flesh_energy_watch_turn(watch, end);
}

void flesh_impact_accept(flesh_impact *self, int n, double *v)
{
  self->owed = self->owes;
  for (int d = 0; d < n && self->turned; d++) v[d] += self->impulse[0][d];
}
