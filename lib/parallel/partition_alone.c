/* partition_alone.c: the one part of a rank by itself, where flesh is built without METIS. */
#include <string.h>

#include "base/error.h"
#include "parallel/partition.h"

int flesh_partition_tets(const flesh_mesh *mesh, int ranks, int *part)
{
  memset(part, 0, (size_t)flesh_mesh_tet_count(mesh) * sizeof *part);
  return ranks == 1 ? FLESH_OK
                    : flesh_fail(FLESH_ERR_ARGUMENT, "flesh is built without METIS: there are no parts for %d ranks", ranks);
}
