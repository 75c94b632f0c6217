/* proximity.c: caches of effects that couple nodes near each other, and the growing pattern. */
#include "system/proximity.h"

#include <limits.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "linear/block_matrix.h"
#include "system/clearance.h"

static size_t predictions_of(const flesh_proximity *self, int k)
{
  const flesh_effect *effect = self->system->entries[k].effect;
  const flesh_effect_private *can = flesh_effect_private_of(effect);
  return can->predictions ? can->predictions(effect) : 0;
}

static int remember_predictions(flesh_proximity *self)
{
  size_t all = 0;
  for (int k = 0; k < self->effects; k++) all += predictions_of(self, k);
  if (!all) return FLESH_OK;
  self->predicted = flesh_calloc((size_t)self->effects, sizeof *self->predicted);
  int failed = !self->predicted;
  for (int k = 0; k < self->effects && !failed; k++) {
    const size_t bytes = predictions_of(self, k);
    if (bytes) failed = !(self->predicted[k] = flesh_calloc(1, bytes));
  }
  if (!failed) return FLESH_OK;
  flesh_proximity_clear(self);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the forces of %zu bytes of contact", all);
}

int flesh_proximity_create(const flesh_system *system, flesh_threads *threads, flesh_proximity *self)
{
  *self = (flesh_proximity){.system = system, .effects = system->entry_count};
  int status = remember_predictions(self);
  if (!flesh_system_has_proximity(system)) return status;
  if (!status) self->near = flesh_calloc((size_t)self->effects + 1, sizeof *self->near);
  if (!status && !self->near) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for %d effects", self->effects);
  for (int k = 0; k < self->effects && !status; k++) {
    const flesh_effect *effect = system->entries[k].effect;
    const flesh_effect_barrier *can = flesh_effect_as_barrier(effect);
    if (can->remember) status = can->remember(effect, threads, &self->near[k]);
  }
  if (status) flesh_proximity_clear(self);
  return status;
}

void flesh_proximity_clear(flesh_proximity *self)
{
  for (int k = 0; self->near && k < self->effects; k++)
    if (self->near[k]) flesh_effect_as_barrier(self->system->entries[k].effect)->forget(self->near[k]);
  for (int k = 0; self->predicted && k < self->effects; k++) flesh_free(self->predicted[k]);
  flesh_free(self->near);
  flesh_free(self->predicted);
  flesh_layout_clear(&self->layout);
  *self = (flesh_proximity){0};
}

int flesh_proximity_follow(const flesh_proximity *self, int accepted, double t, const double *x, int *changed)
{
  int status = FLESH_OK, one = 0;
  *changed = 0;
  for (int k = 0; self->near && k < self->effects && !status; k++) {
    const flesh_effect_barrier *can = flesh_effect_as_barrier(self->system->entries[k].effect);
    if (!self->near[k] || !can->follow) continue;
    status = can->follow(self->near[k], accepted, t, x, &one);
    *changed |= one;
  }
  double any = *changed != 0;
  if (self->near) status = flesh_team_sum_agreed(self->system->team, status, 1, &any);
  *changed = any > 0;
  return status;
}

/* Archives the effects' caches. */
static int archive_effects(const flesh_proximity *self, flesh_archive *archive)
{
  int status = FLESH_OK;
  for (int k = 0; k < self->effects && !status && !archive->wrong; k++) {
    const flesh_effect_private *can = flesh_effect_private_of(self->system->entries[k].effect);
    if (self->near[k] && can->archive) status = can->archive(self->near[k], archive);
  }
  return status;
}

/* Returns the view of a point for the effects. */
static flesh_effect_view view_of(const flesh_proximity *self, const flesh_point *point)
{
  flesh_effect_view view = flesh_effect_view_of(self->system, point);
  view.environment.proximity = self;
  return view;
}

void flesh_proximity_begin(flesh_proximity *self) { self->updates++; }

void flesh_proximity_predict(flesh_proximity *self, const flesh_point *point)
{
  if (!self->near && !self->predicted) return;
  flesh_effect_view view = view_of(self, point);
  view.environment.update = ++self->updates;
  for (int k = 0; k < self->effects; k++) {
    const flesh_effect *effect = self->system->entries[k].effect;
    const flesh_effect_private *can = flesh_effect_private_of(effect);
    const int remembers = flesh_proximity_of(self, k) || (self->predicted && self->predicted[k]);
    if (remembers && can->predict && !flesh_clearance_holds(view.environment.clearance, k))
      can->predict(effect, flesh_effect_view_turn(&view, k));
  }
}

/* Whether the matrix has all pairs that the effects couple at the point. */
static int covers(const flesh_proximity *self, const flesh_point *point, const flesh_block_matrix *K)
{
  flesh_effect_view view = view_of(self, point);
  int all = 1;
  for (int k = 0; k < self->effects && all; k++) {
    const flesh_effect *effect = self->system->entries[k].effect;
    const flesh_effect_barrier *can = flesh_effect_as_barrier(effect);
    const flesh_cells *lacking = NULL;
    if (self->near[k] && can->coupled && !flesh_clearance_holds(view.environment.clearance, k))
      all = !can->coupled(effect, flesh_effect_view_turn(&view, k), K, &lacking) && !lacking;
  }
  return all;
}

/* Makes the system's pattern with these cells, and room for a matrix of that pattern; free both also after a failure. */
static int make_layout(const flesh_proximity *self, int count, const flesh_cells *const *cells, flesh_layout *layout,
                       double **values)
{
  *layout = (flesh_layout){0};
  *values = NULL;
  const int status = flesh_layout_create(self->system, count, cells, layout);
  if (status) return status;
  const size_t blocks = (size_t)layout->pattern.row_start[layout->pattern.rows];
  *values = flesh_huge_pages_calloc((blocks * 9 + 1) * sizeof **values);
  return *values ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a matrix of %zu blocks", blocks);
}

/* Makes the layout with the cells of all effects. */
static int lay_out(const flesh_proximity *self, const flesh_point *point, flesh_layout *layout, double **values)
{
  flesh_effect_view view = view_of(self, point);
  const flesh_cells **cells = flesh_malloc(((size_t)self->effects + 1) * sizeof *cells);
  int status = cells ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d effects", self->effects), count = 0;
  for (int k = 0; k < self->effects && !status; k++) {
    const flesh_effect *effect = self->system->entries[k].effect;
    const flesh_effect_barrier *can = flesh_effect_as_barrier(effect);
    if (!self->near[k] || !can->coupled) continue;
    status = can->coupled(effect, flesh_effect_view_turn(&view, k), NULL, &cells[count]);
    count++;
  }
  if (!status) status = make_layout(self, count, cells, layout, values);
  flesh_free(cells);
  return status;
}

/* Gives K the layout's pattern, with values of 0. Takes ownership of layout and values; frees them where `status` is not
 * FLESH_OK, and leaves K unchanged. */
static int take_layout(flesh_proximity *self, int status, flesh_layout *layout, double *values, flesh_block_matrix *K)
{
  if (status) {
    flesh_layout_clear(layout);
    flesh_free(values);
    return status;
  }
  flesh_free(K->values);
  flesh_layout_clear(&self->layout);
  self->layout = *layout;
  *K = flesh_pattern_matrix(&self->layout.pattern, values);
  K->layout = &self->layout;
  K->own = self->layout.own;
  return FLESH_OK;
}

int flesh_proximity_cover(flesh_proximity *self, const flesh_point *point, flesh_block_matrix *K, int *grown)
{
  flesh_layout layout = {0};
  *grown = 0;
  if (!self->near) return FLESH_OK;
  const flesh_team *team = self->system->team;
  /* If one rank needs a new pattern, all ranks rebuild theirs, as caches that depend on it are shared. */
  if (!flesh_team_any(team, !covers(self, point, K))) return FLESH_OK;
  double *values = NULL;
  const int status = flesh_team_agree(team, lay_out(self, point, &layout, &values));
  *grown = !status;
  return take_layout(self, status, &layout, values, K);
}

/* Lists the blocks [2*count] that K has beside the system's, as rows and columns. */
static int list_grown(const flesh_proximity *self, const flesh_block_matrix *K, int *blocks)
{
  const flesh_block_matrix own = flesh_pattern_matrix(&self->system->pattern, NULL);
  int count = 0;
  for (int i = 0; i < K->rows && K->layout; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++) {
      if (flesh_block_find(&own, i, K->column[k]) >= 0) continue;
      if (blocks) blocks[2 * count] = i, blocks[2 * count + 1] = K->column[k];
      count++;
    }
  return count;
}

/* Grows K by these blocks; a foreign file may name any. */
static int grow_by(flesh_proximity *self, int count, const int *blocks, flesh_block_matrix *K, flesh_archive *archive)
{
  const flesh_cells cells = {.count = count, .nodes_per_cell = 2, .nodes = blocks}, *all = &cells;
  flesh_layout layout;
  if (flesh_pattern_check("contact", self->system->nodes, &cells)) {
    archive->wrong = 1;
    return FLESH_OK;
  }
  double *values;
  const int status = make_layout(self, 1, &all, &layout, &values);
  return take_layout(self, status, &layout, values, K);
}

int flesh_proximity_archive(flesh_proximity *self, flesh_block_matrix *K, int *grown, flesh_archive *archive)
{
  *grown = 0;
  if (!self->near) return FLESH_OK;
  int status = archive_effects(self, archive);
  if (status) return status;
  int count = archive->mode == FLESH_ARCHIVE_LOAD ? 0 : list_grown(self, K, NULL);
  flesh_archive_int(archive, &count, 0, INT_MAX / 18);
  const int loads = archive->mode == FLESH_ARCHIVE_LOAD;
  if ((!count && !(loads && K->layout)) || archive->wrong) return FLESH_OK;
  int *blocks = flesh_malloc((2 * (size_t)count + 1) * sizeof *blocks);
  if (!blocks) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d blocks of a matrix", count);
  if (!loads) list_grown(self, K, blocks);
  if (count) flesh_archive_bytes(archive, blocks, 2 * (size_t)count * sizeof *blocks);
  if (loads && !archive->wrong) {
    status = grow_by(self, count, blocks, K, archive);
    *grown = !status && !archive->wrong;
  }
  flesh_free(blocks);
  return status;
}
