/* method_map.c: finds the columns of the map by applying the method to one dof, with 1 for one column and 0 for the
 * others. */
#include "sensitivity/method_map.h"

#include <string.h>

/* Finds a column of the map. */
static void apply(const flesh_method_row *row, const flesh_method_memory *memory, double h, int takes_over, int column,
                  flesh_method_map *map)
{
  double known[FLESH_KNOWN] = {0}, bases[2] = {0}, u = 0, stage_x = 0, stage_v = 0, stage_a = 0;
  flesh_method_memory one = *memory;
  flesh_state state = {.x = &known[FLESH_KNOWN_X], .v = &known[FLESH_KNOWN_V]};
  flesh_stage stage = {0};
  if (column < FLESH_KNOWN) known[column] = 1;
  one.n = 1;
  one.v0 = &bases[0];
  one.a0 = &bases[1];
  for (int k = 0; k < FLESH_METHOD_VECTORS; k++) one.vectors[k] = &known[FLESH_KNOWN_VECTORS + k];
  for (int k = 0; k < map->stages; k++) {
    one.at = k;
    row->stage(&one, &state, h, h, &stage);
    u = column == FLESH_KNOWN + k;
    map->x0[k][column] = stage.x0[0];
    map->v0[k][column] = stage.v0 ? stage.v0[0] : 0;
    map->a0[k][column] = stage.a0 ? stage.a0[0] : 0;
    map->shift[k] = stage.shift;
    stage_x = stage.x0[0] + stage.shift.x * u;
    stage_v = map->v0[k][column] + stage.shift.v * u;
    stage_a = map->a0[k][column] + stage.shift.a * u;
    if (row->keep) row->keep(&one, &stage, &u);
  }
  one.at = 0;
  const int at_end = stage.shift.x == 1;
  flesh_method_finish(row, &one, &u, h, &state);
  if (!row->velocity) known[FLESH_KNOWN_V] = 0; /* an equilibrium has no velocity */
  if (takes_over) known[FLESH_KNOWN_VECTORS] = stage_a;
  known[FLESH_KNOWN_LAGGED_X] = at_end ? state.x[0] : stage_x;
  known[FLESH_KNOWN_LAGGED_V] = at_end ? state.v[0] : stage_v;
  for (int k = 0; k < FLESH_KNOWN; k++) {
    const int lasts = k < FLESH_KNOWN_VECTORS + map->vectors || k >= FLESH_KNOWN_LAGGED_X;
    map->end[k][column] = lasts ? known[k] : 0;
  }
}

void flesh_method_map_find(const flesh_method_row *row, const flesh_method_memory *memory, int vectors, double h,
                           int takes_over, flesh_method_map *map)
{
  memset(map, 0, sizeof *map);
  map->stages = row->stages ? row->stages(memory) : 1;
  map->vectors = vectors;
  for (int column = 0; column < FLESH_KNOWN + map->stages; column++)
    if (column < FLESH_KNOWN_VECTORS + vectors || column >= FLESH_KNOWN_LAGGED_X)
      apply(row, memory, h, takes_over, column, map);
}
