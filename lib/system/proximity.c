/* proximity.c: the memories of effects that couple nodes near each other, and the growing pattern. */
#include "system/proximity.h"

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "system/parts.h"

int flesh_system_has_proximity(const flesh_system *system)
{
  for (int k = 0; k < system->entry_count; k++)
    if (system->entries[k].effect->operations->proximity) return 1;
  return 0;
}

int flesh_proximity_create(const flesh_system *system, flesh_threads *threads, flesh_proximity *self)
{
  *self = (flesh_proximity){.system = system, .effects = system->entry_count};
  if (!flesh_system_has_proximity(system)) return FLESH_OK;
  self->near = flesh_calloc((size_t)self->effects + 1, sizeof *self->near);
  int status = self->near ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d effects", self->effects);
  for (int k = 0; k < self->effects && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_proximity *can = effect->operations->proximity;
    if (can) status = can->create(effect, threads, &self->near[k]);
  }
  if (status) flesh_proximity_clear(self);
  return status;
}

void flesh_proximity_clear(flesh_proximity *self)
{
  for (int k = 0; self->near && k < self->effects; k++)
    if (self->near[k]) self->system->entries[k].effect->operations->proximity->destroy(self->near[k]);
  flesh_free(self->near);
  flesh_layout_clear(&self->layout);
  *self = (flesh_proximity){0};
}

size_t flesh_proximity_memory(const flesh_proximity *self)
{
  size_t bytes = flesh_layout_memory(&self->layout);
  for (int k = 0; self->near && k < self->effects; k++)
    if (self->near[k]) bytes += self->system->entries[k].effect->operations->proximity->memory(self->near[k]);
  return bytes;
}

/* Whether the matrix has what every effect couples at the point. */
static int covers(const flesh_proximity *self, flesh_point *point, const flesh_block_matrix *K)
{
  int all = 1;
  for (int k = 0; k < self->effects && all; k++) {
    const flesh_effect *effect = self->system->entries[k].effect;
    if (!(point->near = self->near[k])) continue;
    all = effect->operations->proximity->covers(effect, point, K);
  }
  return all;
}

/* The system's pattern with the cells of all effects. */
static int lay_out(const flesh_proximity *self, flesh_point *point, flesh_layout *layout)
{
  const flesh_cells **cells = flesh_malloc(((size_t)self->effects + 1) * sizeof *cells);
  int status = cells ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d effects", self->effects), count = 0;
  for (int k = 0; k < self->effects && !status; k++) {
    const flesh_effect *effect = self->system->entries[k].effect;
    if (!(point->near = self->near[k])) continue;
    status = effect->operations->proximity->coupled(effect, point, &cells[count]);
    count++;
  }
  if (!status) status = flesh_layout_create(self->system, count, cells, layout);
  flesh_free(cells);
  return status;
}

int flesh_proximity_cover(flesh_proximity *self, const flesh_point *point, flesh_block_matrix *K, int *grown)
{
  flesh_point at = *point;
  flesh_layout layout;
  *grown = 0;
  if (!self->near || covers(self, &at, K)) return FLESH_OK;
  int status = lay_out(self, &at, &layout);
  if (status) return status;
  const flesh_pattern *pattern = &layout.pattern;
  double *values = flesh_huge_pages_calloc(((size_t)pattern->row_start[pattern->rows] * 9 + 1) * sizeof *values);
  if (!values) {
    flesh_layout_clear(&layout);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %d blocks", pattern->row_start[pattern->rows]);
  }
  flesh_free(K->values);
  flesh_layout_clear(&self->layout);
  self->layout = layout;
  *K = flesh_pattern_matrix(&self->layout.pattern, values);
  K->layout = &self->layout;
  *grown = 1;
  return FLESH_OK;
}
