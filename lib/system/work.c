/* work.c: the work of external effects on a body. */
#include "system/work.h"
#include "base/error.h"

#include <math.h>
#include <string.h>

#include "effect/effect.h"
#include "system/clearance.h"
#include "system/effect_view.h"
#include "system/one_effect.h"
#include "system/parts.h"
#include "system/position_potential.h"
#include "system/ranks.h"

static flesh_work_kind kind_of(const flesh_effect *effect)
{
  const flesh_effect_operations *can = effect->operations;
  if (flesh_effect_has_trait(effect, FLESH_IS_PASSIVE)) return 0;
  if (flesh_effect_in_time(effect)->carry || !can->energy) return can->residual ? FLESH_WORK_OF_FORCES : 0;
  return FLESH_WORK_IN_TIME;
}

static int has_kind(const flesh_effect *effect, int kind) { return (int)kind_of(effect) == kind; }

int flesh_system_work_kinds(const flesh_system *system)
{
  int kinds = 0;
  for (int k = 0; k < flesh_system_effect_count(system); k++)
    kinds |= (int)kind_of(flesh_system_effect(system, k));
  return kinds;
}

int flesh_system_work_of_forces(const flesh_system *system, const flesh_point *point, double t_from, double t_to,
                                const double *u, double *scratch, double *work)
{
  const size_t n = (size_t)flesh_system_unknowns(system);
  static const double moment = 1e-3; /* fraction of a step over which the velocity of moving obstacles is measured */
  const double h = t_to - t_from, begin = u ? t_from : fmax(t_from, point->t - moment * h);
  const double end = u ? t_to : begin + moment * h;
  double *r = scratch, *carried = scratch + n;
  double of_ranks[flesh_effect_sums_room(system)];
  flesh_effect_view view = flesh_effect_view_with(system, point, of_ranks);
  double works[system->entry_count + 1], shares[system->entry_count + 1];
  int status = FLESH_OK;
  for (int k = 0; k < system->entry_count; k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    const flesh_effect_time *in_time = flesh_effect_in_time(effect);
    const double *along = u ? u : point->v;
    double share = u ? 1 : h, sum = 0;
    int moves = !status;
    works[k] = shares[k] = 0;
    if (status || kind_of(effect) != FLESH_WORK_OF_FORCES || flesh_clearance_holds(view.environment.clearance, k)) continue;
    if (in_time->carry) {
      memset(carried, 0, n * sizeof *carried);
      moves = in_time->carry(effect, point, begin, end, carried);
      along = carried;
      share = u ? 1 : 1 / moment;
    }
    if (moves) {
      memset(r, 0, n * sizeof *r);
      status = effect->operations->residual(effect, flesh_effect_view_turn(&view, k), r);
    }
    for (size_t d = 0; d < n && moves; d++) sum += r[d] * along[d];
    works[k] = sum;
    shares[k] = share;
  }
  /* Forces are partial, and displacements include ghosts. An obstacle that moves on one rank may stand still on another,
   * which adds 0. */
  status = flesh_team_sum_agreed(system->team, status, system->entry_count, works);
  *work = 0;
  for (int k = 0; k < system->entry_count && !status; k++) *work -= shares[k] * works[k];
  return status;
}

int flesh_system_work_in_time(const flesh_system *system, double t_from, double t_to, const flesh_state *state,
                              const double *energies, int at_end, double *work)
{
  double found[2][system->entry_count + 1], sum;
  int status = FLESH_OK;
  for (int end = 0; end < 2 && !status; end++) {
    flesh_point point = flesh_point_at(end ? t_to : t_from, state->x, state->v, state->v);
    point.internal = state->internal;
    if (energies && end == at_end) memcpy(found[end], energies, (size_t)system->entry_count * sizeof *energies);
    else status = flesh_system_some_energies(system, has_kind, FLESH_WORK_IN_TIME, &point, found[end], &sum);
  }
  *work = 0;
  for (int k = 0; k < system->entry_count && !status; k++)
    if (has_kind(system->entries[k].effect, FLESH_WORK_IN_TIME)) *work += found[1][k] - found[0][k];
  return status;
}

int flesh_system_energies(const flesh_system *system, const flesh_point *point, double *energies)
{
  FLESH_NEED({system, "system"}, {point, "point"}, {energies, "energies"});
  return flesh_system_energies_by_position(system, point, &(flesh_position_potential){0}, energies);
}
