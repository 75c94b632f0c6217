/* partition_metis_none.c: stands for METIS in builds without it, and does nothing. */
#include "flesh/status.h"
#include "parallel/partition_kinds.h"

int flesh_partition_metis(const flesh_mesh *mesh, int ranks, int *part, int *made)
{
  (void)mesh;
  (void)ranks;
  (void)part;
  *made = 0;
  return FLESH_OK;
}
