/* boomeramg_none.c: where flesh is built without hypre. */
#include "base/error.h"
#include "linear/boomeramg.h"

const flesh_boomeramg_options flesh_boomeramg_defaults = {0};

int flesh_boomeramg_create(const flesh_boomeramg_options *options, int rows, const double *positions,
                           const flesh_team *team, flesh_boomeramg **boomeramg)
{
  (void)options, (void)rows, (void)positions, (void)team;
  *boomeramg = NULL;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the preconditioner boomeramg needs flesh built with hypre (-Dhypre=enabled)");
}

void flesh_boomeramg_destroy(flesh_boomeramg **boomeramg) { *boomeramg = NULL; }

int flesh_boomeramg_setup(flesh_boomeramg *boomeramg, const flesh_block_matrix *A, double scale)
{
  (void)boomeramg, (void)A, (void)scale;
  return FLESH_ERR_ARGUMENT;
}

void flesh_boomeramg_solve(flesh_boomeramg *boomeramg, const int *order, const float *r, float *z)
{
  (void)boomeramg, (void)order, (void)r, (void)z;
}

size_t flesh_boomeramg_memory(const flesh_boomeramg *boomeramg)
{
  (void)boomeramg;
  return 0;
}
