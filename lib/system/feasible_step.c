/* feasible_step.c: how far effects let a body move, and which positions they allow. */
#include "system/feasible_step.h"

#include <math.h>

#include "base/error.h"
#include "effect/effect.h"
#include "system/parts.h"

int flesh_system_limits_step(const flesh_system *system) { return system->limits_step; }

double flesh_system_max_feasible_step(const flesh_system *system, const flesh_proximity *proximity,
                                      const double *internal, double t_from, const double *x_from, double t_to,
                                      const double *x_to)
{
  double fraction = 1;
  for (int k = 0; system->limits_step && k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    if (!barrier->max_feasible_step) continue;
    fraction = fmin(fraction, barrier->max_feasible_step(effect, flesh_proximity_of(proximity, k),
                                                         flesh_internal_of(system, k, internal), t_from, x_from, t_to,
                                                         x_to));
  }
  return system->limits_step ? flesh_team_least(system->team, fraction) : fraction;
}

int flesh_system_tunnelled(const flesh_system *system, const flesh_proximity *proximity, const double *internal,
                           double t_from, const double *x_from, double t_to, const double *x_to)
{
  int passed = 0;
  for (int k = 0; system->limits_step && k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    const flesh_effect_private *can = flesh_effect_private_of(effect);
    void *near = flesh_proximity_of(proximity, k);
    if (barrier->tunnelled) passed |= barrier->tunnelled(effect, t_from, x_from, t_to, x_to);
    if (can->tunnelled && near)
      passed |= can->tunnelled(near, system->team, flesh_internal_of(system, k, internal), x_from, x_to);
  }
  return system->limits_step && flesh_team_any(system->team, passed);
}

void flesh_system_push_out(const flesh_system *system, double t_from, const double *x_from,
                        double t_to, double *x_to)
{
  for (int k = 0; system->limits_step && k < system->entry_count; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    if (barrier->push_out) barrier->push_out(effect, t_from, x_from, t_to, x_to);
  }
  if (system->limits_step) flesh_team_update_ghosts(system->team, x_to); /* each node's position is its owner's */
}

int flesh_system_keep_gaps(const flesh_system *system, const flesh_proximity *proximity, const double *internal,
                            const double *x_from, double *x)
{
  int changed = 0;
  for (int k = 0; proximity->near && k < system->entry_count; k++) {
    const flesh_effect_private *can = flesh_effect_private_of(system->entries[k].effect);
    if (can->keep_gaps && proximity->near[k])
      changed |= can->keep_gaps(proximity->near[k], system->team, flesh_internal_of(system, k, internal), x_from, x);
  }
  return changed;
}

int flesh_system_check_with(const flesh_system *system, const double *internal, double t, const double *x)
{
  const unsigned long said = flesh_fail_count();
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_barrier *barrier = flesh_effect_as_barrier(effect);
    if (!barrier->check) continue;
    status = flesh_effect_returned(effect, said, barrier->check(effect, flesh_internal_of(system, k, internal), t, x));
  }
  return flesh_team_agree(system->team, status);
}

int flesh_system_check(const flesh_system *system, double t, const double *x)
{
  FLESH_NEED({system, "system"}, {x, "x"});
  return flesh_system_check_with(system, NULL, t, x);
}
