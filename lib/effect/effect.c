/* effect.c: making and destroying effects. */
#include "effect/effect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

int flesh_effect_create(const flesh_effect_operations *operations, void *data,
                        flesh_effect **effect)
{
  *effect = malloc(sizeof **effect);
  if (!*effect) {
    if (operations->destroy) operations->destroy(data);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for an effect");
  }
  (*effect)->operations = operations;
  (*effect)->data = data;
  return FLESH_OK;
}

void flesh_effect_destroy(flesh_effect **effect)
{
  if (!effect || !*effect) return;
  if ((*effect)->operations->destroy) (*effect)->operations->destroy((*effect)->data);
  free(*effect);
  *effect = NULL;
}

flesh_instructions flesh_effect_instructions(const flesh_effect *effect)
{
  return effect->operations->instructions ? effect->operations->instructions(effect)
                                          : FLESH_INSTRUCTIONS_AUTO;
}

int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells)
{
  int count = flesh_mesh_tet_count(mesh);
  int *nodes = malloc((size_t)count * 4 * sizeof *nodes);
  if (!nodes) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the nodes of %d tets", count);
  memcpy(nodes, flesh_mesh_tets(mesh), (size_t)count * 4 * sizeof *nodes);
  for (int e = 0; e < count; e++) {
    int *tet = nodes + 4 * e;
    for (int i = 1; i < 4; i++)
      for (int j = i; j > 0 && tet[j] < tet[j - 1]; j--) {
        int swap = tet[j];
        tet[j] = tet[j - 1];
        tet[j - 1] = swap;
      }
  }
  *cells = (flesh_cells){.count = count, .nodes_per_cell = 4, .nodes = nodes};
  return FLESH_OK;
}

void flesh_cells_clear(flesh_cells *cells)
{
  free((void *)cells->nodes);
  *cells = (flesh_cells){0};
}

int flesh_body_check_density(const flesh_body *body)
{
  for (int e = 0; e < flesh_mesh_tet_count(body->mesh); e++)
    if (!(body->density[e] > 0 && body->density[e] < INFINITY))
      return flesh_fail(FLESH_ERR_ARGUMENT,
                        "the density of tet %d is %g kg/m^3; it must be positive", e,
                        body->density[e]);
  return FLESH_OK;
}

double flesh_interval_next_event(double from, double until, double t)
{
  return from > t ? from : until > t ? until : INFINITY;
}
