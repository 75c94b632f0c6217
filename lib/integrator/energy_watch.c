/* energy_watch.c: the energy of the states of a run while nothing is moved from outside. */
#include "integrator/energy_watch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

int flesh_energy_watch_create(const flesh_system *system, flesh_energy_watch *watch)
{
  size_t n = (size_t)flesh_system_unknowns(system);
  *watch = (flesh_energy_watch){.system = system};
  watch->energies = calloc((size_t)flesh_system_effect_count(system) + 1, sizeof(double));
  watch->zeros = calloc(n + 1, sizeof(double));
  watch->v_prescribed = calloc(n + 1, sizeof(double));
  watch->a_prescribed = calloc(n + 1, sizeof(double));
  watch->fixed = calloc(n + 1, 1);
  if (watch->energies && watch->zeros && watch->v_prescribed && watch->a_prescribed && watch->fixed)
    return FLESH_OK;
  flesh_energy_watch_clear(watch);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory to watch the energy of %zu unknowns", n);
}

void flesh_energy_watch_clear(flesh_energy_watch *watch)
{
  free(watch->energies);
  free(watch->zeros);
  free(watch->v_prescribed);
  free(watch->a_prescribed);
  free(watch->fixed);
  *watch = (flesh_energy_watch){0};
}

/* Sum of the energies at (t, x, v); NaN where one has no value. */
static double total(flesh_energy_watch *watch, double t, const flesh_state *state, double *kinetic)
{
  const flesh_point point = {.t = t, .load = 1, .x = state->x, .v = state->v, .a = watch->zeros};
  double sum = 0;
  if (flesh_system_energies(watch->system, &point, watch->energies)) return NAN;
  *kinetic = 0;
  for (int e = 0; e < flesh_system_effect_count(watch->system); e++) {
    sum += watch->energies[e];
    if (!strcmp(flesh_system_effect(watch->system, e)->operations->name, "inertia"))
      *kinetic += watch->energies[e];
  }
  return sum;
}

/* Whether handles move at t, or a load acts whose work no energy tells. */
static int is_driven(flesh_energy_watch *watch, double t)
{
  for (int e = 0; e < flesh_system_effect_count(watch->system); e++) {
    const flesh_effect_operations *operations = flesh_system_effect(watch->system, e)->operations;
    if (operations->external && !operations->energy) return 1;
  }
  int n = flesh_system_unknowns(watch->system);
  flesh_system_fixed(watch->system, t, watch->fixed);
  memset(watch->v_prescribed, 0, (size_t)n * sizeof(double));
  flesh_system_prescribe_velocity(watch->system, t, watch->v_prescribed, watch->a_prescribed);
  for (int d = 0; d < n; d++)
    if (watch->fixed[d] && watch->v_prescribed[d] != 0) return 1;
  return 0;
}

void flesh_energy_watch_see(flesh_energy_watch *watch, const flesh_state *state, int restart)
{
  double kinetic, ignored, energy = total(watch, state->t, state, &kinetic);
  if (!isfinite(energy) || is_driven(watch, state->t)) {
    watch->watching = 0;
    return;
  }
  watch->kinetic = fmax(watch->kinetic, kinetic);
  /* A target that moves changes the energy of a state that stands still. */
  if (watch->watching && !restart &&
      !(fabs(total(watch, watch->begin, state, &ignored) - energy) <= 1e-12 * fabs(energy)))
    restart = 1;
  if (!watch->watching || restart) {
    watch->watching = 1;
    watch->begin = state->t;
    watch->least = energy;
    return;
  }
  watch->least = fmin(watch->least, energy);
  if (watch->kinetic > 0) watch->gain = fmax(watch->gain, (energy - watch->least) / watch->kinetic);
}
