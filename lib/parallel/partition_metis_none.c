/* partition_metis_none.c: what flesh does for METIS where it is built without: nothing. */
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
