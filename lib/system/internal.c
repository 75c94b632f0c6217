/* internal.c: counts and updates the internal variables of a system's effects. */
#include "system/internal.h"

#include "base/error.h"
#include "effect/effect.h"
#include "system/effect_point.h"

int flesh_system_internal_count(const flesh_system *system) { return system->internal_count; }

int flesh_system_update_internal(const flesh_system *system, const flesh_point *point, double *internal, int *changed)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {internal, "internal"}, {changed, "changed"});
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_point full = flesh_effect_point(system, point, of_ranks);
  int status = FLESH_OK;
  *changed = 0;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_internal *can = effect->operations->internal;
    if (!can) continue;
    flesh_effect_point_turn(system, k, point->internal, of_ranks, &full);
    status = can->update(effect, &full, internal + system->entries[k].internal, changed);
    if (status > 0)
      status = flesh_fail(FLESH_ERR_NONFINITE, "the internal variables of effect %s have no value at t = %g s",
                          effect->operations->name, point->t);
  }
  status = flesh_team_agree(system->team, status);
  double any = *changed; /* bits that hang on how a rank numbers its nodes become the same */
  if (!status) flesh_team_largest(system->team, 1, &any);
  if (!status && any > 0) flesh_team_largest(system->team, system->internal_count, internal);
  *changed = any > 0;
  return status;
}

int flesh_system_internal_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum)
{
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_point full = flesh_effect_point(system, point, of_ranks);
  int status = FLESH_OK;
  *sum = 0;
  for (int k = 0; k < system->entry_count && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    if (!effect->operations->internal || !effect->operations->energy) continue;
    flesh_effect_point_turn(system, k, point->internal, of_ranks, &full);
    energies[k] = 0;
    status = effect->operations->energy(effect, &full, &energies[k]);
    status = flesh_team_agree(system->team, status);
    if (!status) flesh_team_sum(system->team, 1, &energies[k]);
    *sum += energies[k];
  }
  return status;
}
