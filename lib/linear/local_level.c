/* local_level.c: a coarse level over what a rank reaches: places and constraints come from the nodes' owners. */
#include "linear/local_level.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

/* Three numbers of each node to all who reach it, from its owner. */
static void share(const flesh_overlap *overlap, double *x)
{
  const flesh_team *team = overlap->team;
  team->operations->share(team->data, &(flesh_team_vector){3, 3, NULL, x, 1});
}

int flesh_local_level_create(const flesh_overlap *overlap, int rows, const double *positions, int vertices,
                             const flesh_bisection *bisection, flesh_threads *threads, flesh_local_level *self)
{
  const size_t reached = (size_t)overlap->team->reached;
  double *X = flesh_malloc((3 * reached + 1) * sizeof *X);
  *self = (flesh_local_level){.fixed = flesh_malloc(3 * reached + 1)};
  int status = FLESH_OK;
  if (!X || !self->fixed) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a coarse space of %d nodes", rows);
  status = flesh_team_agree(overlap->team, status);
  if (!status) {
    memcpy(X, positions, 3 * (size_t)rows * sizeof *X);
    share(overlap, X);
    status = flesh_coarse_create(&overlap->matrix, X, vertices, bisection, threads, NULL, &self->coarse);
    status = flesh_team_agree(overlap->team, status);
  }
  flesh_free(X);
  return status;
}

void flesh_local_level_clear(flesh_local_level *self)
{
  flesh_coarse_destroy(&self->coarse);
  flesh_free(self->fixed);
  *self = (flesh_local_level){0};
}

size_t flesh_local_level_memory(const flesh_local_level *self, const flesh_overlap *overlap)
{
  return self->coarse ? 3 * (size_t)overlap->team->reached + flesh_coarse_memory(self->coarse) : 0;
}

void flesh_local_level_setup(flesh_local_level *self, const flesh_overlap *overlap, const flesh_block_matrix *all,
                             double scale, int rows, const uint8_t *fixed)
{
  if (!self->coarse) return;
  double *x = overlap->vector;
  for (int d = 0; d < 3 * rows; d++) x[d] = fixed && fixed[d];
  share(overlap, x);
  for (int d = 0; d < 3 * overlap->team->reached; d++) self->fixed[d] = x[d] > 0;
  self->serves = flesh_coarse_setup(self->coarse, all, scale, self->fixed) == FLESH_OK;
}

flesh_coarse *flesh_local_level_coarse(const flesh_local_level *self) { return self->serves ? self->coarse : NULL; }

void flesh_local_level_archive(flesh_local_level *self, flesh_archive *archive)
{
  if (!self->coarse) return;
  flesh_archive_int(archive, &self->serves, 0, 1);
  flesh_coarse_archive(self->coarse, archive);
}
