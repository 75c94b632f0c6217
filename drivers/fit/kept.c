/* kept.c: keeps the equilibria of a run from which what was measured is taken. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "fit/fit.h"
#include "run/start.h"

void flesh_fit_state_free(flesh_state *state)
{
  free(state->x);
  *state = (flesh_state){0};
}

void flesh_fit_kept_clear(flesh_fit_kept *kept)
{
  for (int k = 0; k < kept->count; k++) flesh_fit_state_free(&kept->states[k]);
  free(kept->states);
  free(kept->p);
  *kept = (flesh_fit_kept){0};
}

int flesh_fit_state_copy(const flesh_state *from, int nodes, flesh_state *to)
{
  const int multipliers = from->multiplier_count, status = flesh_state_make(nodes, multipliers, 0, to);
  if (status) return status;
  to->t = from->t;
  memcpy(to->x, from->x, 3 * (size_t)nodes * sizeof *to->x);
  if (multipliers) memcpy(to->multipliers, from->multipliers, (size_t)multipliers * sizeof *to->x);
  return FLESH_OK;
}

/* Whether a number is measured after `low` and before `high`, or at `at`. */
static int is_measured(const flesh_fit_experiment *e, double low, double at, double high)
{
  for (int k = 0; k < e->measured_count; k++)
    for (int d = 0; d < e->measured[k].count; d++) {
      const double t = e->measured[k].data[d].t;
      if (t == at || (t > low && t < high)) return 1;
    }
  return 0;
}

/* The row before the last is dropped where nothing was measured about it. */
int flesh_fit_keep(void *experiment, const flesh_step_record *record)
{
  flesh_fit_experiment *e = experiment;
  flesh_fit_kept *kept = &e->kept;
  if (kept->count) {
    flesh_state *last = &kept->states[kept->count - 1];
    const double at = last->t;
    if (!is_measured(e, kept->before, at, record->state->t)) {
      flesh_fit_state_free(last);
      kept->count--;
      kept->has_start &= kept->count > 0;
    }
    kept->before = at;
  } else kept->before = record->state->t;
  if (!flesh_grow(&kept->states, sizeof *kept->states, kept->count, &kept->room))
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the equilibria of a fit");
  kept->has_start |= record->step == 0;
  const int status = flesh_fit_state_copy(record->state, e->nodes, &kept->states[kept->count]);
  kept->count += !status;
  return status;
}
