/* run_trace.c: what is kept of every step of a run, to judge it at its end. */
#include "run/run_trace.h"

#include <stdlib.h>

#include "base/error.h"
#include "system/one_effect.h"

int flesh_run_trace_observe(void *data, const flesh_step_record *record)
{
  flesh_run_trace *trace = data;
  if (trace->count == trace->room) {
    const int room = trace->room ? 2 * trace->room : 256;
    void *grown = realloc(trace->rows, sizeof *trace->rows * (size_t)room);
    if (!grown) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
    trace->rows = grown;
    trace->room = room;
  }
  const double kinetic = flesh_system_role_energy(record->system, FLESH_ROLE_INERTIA, record->energies);
  double strain = 0;
  for (int e = 0; e < flesh_system_effect_count(record->system); e++)
    if (flesh_system_effect(record->system, e)->operations->role == FLESH_ROLE_ELASTICITY)
      strain += record->energies[e] - record->rest_energies[e];
  trace->rows[trace->count].t = record->state->t;
  trace->rows[trace->count].step = record->step;
  trace->rows[trace->count].newton = record->step ? record->stats->newton : 0;
  trace->rows[trace->count].linear = record->step ? record->stats->linear : 0;
  trace->rows[trace->count].kinetic = kinetic;
  trace->rows[trace->count++].strain = strain;
  return FLESH_OK;
}

void flesh_run_trace_clear(flesh_run_trace *trace)
{
  free(trace->rows);
  *trace = (flesh_run_trace){0};
}
