/* background.c: residual, Hessian and potential of a quadratic model. */
#include "newton/background.h"

#include <math.h>

#include "base/error.h"
#include "base/memory.h"

static const flesh_cells *background_cells(const flesh_effect *effect)
{
  const flesh_background *self = effect->data;
  return &self->cells;
}

void flesh_background_ends(const flesh_background *self, int k, int *i, int *j)
{
  const int *pair = self->pair + 2 * (k - self->nodes);
  *i = k < self->nodes ? k : pair[0];
  *j = k < self->nodes ? k : pair[1];
}

static int background_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const flesh_background *self = effect->data;
  const double *x = point->x, *x0 = self->x0;
  for (int d = 0; d < 3 * self->nodes; d++) r[d] += self->g[d];
  for (int k = 0, i, j; k < self->nodes + self->pairs; k++) {
    flesh_background_ends(self, k, &i, &j);
    for (int c = 0; c < 9; c++) {
      const int row = 3 * i + c / 3, column = 3 * j + c % 3;
      const double entry = self->K[9 * (size_t)k + c] / self->shift;
      r[row] += entry * (x[column] - x0[column]);
      if (i != j) r[column] += entry * (x[row] - x0[row]);
    }
  }
  return FLESH_OK;
}

static int background_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                               flesh_block_matrix *K, const int *slots)
{
  (void)point, (void)shift;
  const flesh_background *self = effect->data;
  for (int k = 0; k < self->nodes + self->pairs; k++) {
    const int slot = k < self->nodes ? K->row_start[k] : slots[3 * (k - self->nodes) + 1];
    for (int c = 0; c < 9; c++) K->values[9 * (size_t)slot + c] += self->K[9 * (size_t)k + c];
  }
  return FLESH_OK;
}

static int background_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                double *phi, double *magnitude)
{
  (void)shift;
  const flesh_background *self = effect->data;
  const double *x = point->x, *x0 = self->x0;
  for (int d = 0; d < 3 * self->nodes; d++) {
    const double first = self->g[d] * (x[d] - x0[d]) / self->shift;
    *phi += first;
    *magnitude += fabs(first);
  }
  for (int k = 0, i, j; k < self->nodes + self->pairs; k++) {
    flesh_background_ends(self, k, &i, &j);
    double second = 0;
    for (int c = 0; c < 9; c++) {
      const int row = 3 * i + c / 3, column = 3 * j + c % 3;
      second += self->K[9 * (size_t)k + c] * (x[row] - x0[row]) * (x[column] - x0[column]);
    }
    second *= (i == j ? 0.5 : 1) / (self->shift * self->shift);
    *phi += second;
    *magnitude += fabs(second);
  }
  return FLESH_OK;
}

static void background_destroy(void *data)
{
  flesh_background *self = data;
  flesh_free(self->pair);
  flesh_free(self->g);
  flesh_free(self->K);
  flesh_free(self);
}

static const flesh_effect_operations background_operations = {.name = "background",
                                                              .cells = background_cells,
                                                              .residual = background_residual,
                                                              .jacobian = background_jacobian,
                                                              .potential = background_potential,
                                                              .destroy = background_destroy};

int flesh_background_create(const flesh_mesh *mesh, int pairs, const double *x0, double shift,
                            flesh_background **background, flesh_effect **effect)
{
  const int nodes = flesh_mesh_node_count(mesh);
  *background = NULL;
  flesh_background *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d nodes", nodes);
  *self = (flesh_background){.nodes = nodes,
                             .pairs = pairs,
                             .pair = flesh_malloc((2 * (size_t)pairs + 1) * sizeof(int)),
                             .g = flesh_calloc(3 * (size_t)nodes, sizeof(double)),
                             .K = flesh_calloc(9 * ((size_t)nodes + (size_t)pairs), sizeof(double)),
                             .x0 = x0,
                             .shift = shift};
  if (!self->pair || !self->g || !self->K) {
    background_destroy(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d nodes", nodes);
  }
  self->cells = (flesh_cells){.count = pairs, .nodes_per_cell = 2, .nodes = self->pair};
  *background = self;
  return flesh_effect_create(&background_operations, mesh, self, effect);
}
