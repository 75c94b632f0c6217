/* local_level.c: a coarse level over a rank's overlap, which gets positions and constraints from the nodes' owners. */
#include "linear/local_level.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_local_level_create(const flesh_overlap *overlap, int vertices, const flesh_bisection *bisection,
                             flesh_threads *threads, flesh_local_level *self)
{
  *self = (flesh_local_level){.fixed = flesh_malloc(3 * (size_t)overlap->team->overlap + 1)};
  if (!self->fixed)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a coarse space of %d nodes", overlap->team->overlap);
  return flesh_coarse_create(&overlap->matrix, overlap->vector, vertices, bisection, threads, NULL, &self->coarse);
}

void flesh_local_level_clear(flesh_local_level *self)
{
  flesh_coarse_destroy(&self->coarse);
  flesh_free(self->fixed);
  *self = (flesh_local_level){0};
}

void flesh_local_level_setup(flesh_local_level *self, const flesh_overlap *overlap, const flesh_block_matrix *all,
                             double scale, int rows, const uint8_t *fixed)
{
  if (!self->coarse) return;
  double *x = overlap->vector;
  for (int d = 0; d < 3 * rows; d++) x[d] = fixed && fixed[d];
  flesh_overlap_update_vector(overlap);
  for (int d = 0; d < 3 * overlap->team->overlap; d++) self->fixed[d] = x[d] > 0;
  self->serves = flesh_coarse_setup(self->coarse, all, scale, self->fixed) == FLESH_OK;
}

flesh_coarse *flesh_local_level_coarse(const flesh_local_level *self) { return self->serves ? self->coarse : NULL; }

void flesh_local_level_archive(flesh_local_level *self, flesh_archive *archive)
{
  if (!self->coarse) return;
  flesh_archive_int(archive, &self->serves, 0, 1);
  flesh_coarse_archive(self->coarse, archive);
}
