/* stiff_rows.c: the effects' stiff rows, one after the other. */
#include "system/stiff_rows.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "system/ranks.h"

/* Whether the effect has rows with as many nodes as the others; returns them in `own`. */
static int has_rows(const flesh_effect *effect, int nodes_per_row, flesh_stiff_rows *own)
{
  *own = (flesh_stiff_rows){0};
  const flesh_effect_private *library = flesh_effect_private_of(effect);
  if (library->stiff_rows) library->stiff_rows(effect, own);
  return own->count > 0 && (!nodes_per_row || own->nodes_per_row == nodes_per_row);
}

/* Takes the stiffest ratio of all ranks, and the softest modulus of the rest. */
void flesh_system_stiff_rows_unite(const flesh_system *system, flesh_stiff_rows *rows)
{
  double most[] = {rows->nodes_per_row, rows->first_main, rows->ratio, rows->modulus > 0 ? -rows->modulus : -INFINITY};
  flesh_team_largest(flesh_system_team(system), 4, most);
  rows->nodes_per_row = (int)most[0];
  rows->first_main = (int)most[1];
  rows->ratio = most[2];
  rows->modulus = most[3] > -INFINITY ? -most[3] : 0;
}

int flesh_system_stiff_rows_create(const flesh_system *system, flesh_stiff_rows *rows)
{
  flesh_stiff_rows own;
  *rows = (flesh_stiff_rows){0};
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    if (!has_rows(flesh_system_effect(system, k), rows->nodes_per_row, &own)) continue;
    rows->nodes_per_row = own.nodes_per_row;
    rows->first_main = own.first_main;
    rows->count += own.count;
    rows->ratio = fmax(rows->ratio, own.ratio);
    if (own.modulus > 0) rows->modulus = rows->modulus > 0 ? fmin(rows->modulus, own.modulus) : own.modulus;
  }
  if (!rows->count) return FLESH_OK;
  const size_t m = (size_t)rows->nodes_per_row, all = (size_t)rows->count * m;
  int *nodes = flesh_huge_pages_alloc(all * sizeof *nodes);
  rows->nodes = nodes;
  rows->values = flesh_huge_pages_calloc(3 * all * sizeof *rows->values);
  if (!nodes || !rows->values) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the stiff terms of %zu nodes", all);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    if (!has_rows(flesh_system_effect(system, k), rows->nodes_per_row, &own)) continue;
    memcpy(nodes, own.nodes, (size_t)own.count * m * sizeof *nodes);
    nodes += (size_t)own.count * m;
  }
  return FLESH_OK;
}

void flesh_system_stiff_rows_clear(flesh_stiff_rows *rows)
{
  flesh_free((void *)rows->nodes);
  flesh_free(rows->values);
  *rows = (flesh_stiff_rows){0};
}

void flesh_system_stiff_values(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                               flesh_stiff_rows *rows)
{
  flesh_stiff_rows own;
  float *values = rows->values;
  for (int k = 0; k < flesh_system_effect_count(system) && rows->count; k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    if (!has_rows(effect, rows->nodes_per_row, &own)) continue;
    flesh_effect_private_of(effect)->stiff_values(effect, point, shift, values);
    values += 3 * (size_t)own.count * (size_t)own.nodes_per_row;
  }
}
