/* partition.c: partitions by planes, unless METIS cuts far fewer nodes. */
#include "parallel/partition.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/partition_kinds.h"

/* Returns the number of nodes that ranks share, each counted once for every rank beyond the first. `begin` [ranks + 1],
 * `tets` [tets] and `last` [nodes] are work space. */
static long shared_nodes(const flesh_mesh *mesh, int ranks, const int *part, int *begin, int *tets, int *last)
{
  const int count = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh), *corners = flesh_mesh_tets(mesh);
  memset(begin, 0, ((size_t)ranks + 1) * sizeof *begin);
  for (int t = 0; t < count; t++) begin[part[t] + 1]++;
  for (int rank = 0; rank < ranks; rank++) begin[rank + 1] += begin[rank];
  for (int t = 0; t < count; t++) tets[begin[part[t]]++] = t;
  for (int i = 0; i < nodes; i++) last[i] = -1;
  long shared = 0;
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 4; c++) {
      int *of = &last[corners[4 * (size_t)tets[k] + c]];
      shared += *of >= 0 && *of != part[tets[k]];
      *of = part[tets[k]];
    }
  return shared;
}

/* Replaces the partition by planes in `part` by METIS' if then ranks share less than two thirds of the nodes. Flat cuts
 * cost incomplete factors less, and ranks have fewer neighbours; but planes cut a bent body where that is
 * unnecessary. */
static int compare(const flesh_mesh *mesh, int ranks, int *part)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  int *other = flesh_malloc((2 * tets + nodes + (size_t)ranks + 1) * sizeof *other);
  if (!other) return flesh_fail(FLESH_ERR_MEMORY, "no memory to part %d tets", (int)tets);
  int *order = other + tets, *last = order + tets, *begin = last + nodes;
  int made, status = flesh_partition_metis(mesh, ranks, other, &made);
  if (!status && made &&
      3 * shared_nodes(mesh, ranks, other, begin, order, last) < 2 * shared_nodes(mesh, ranks, part, begin, order, last))
    memcpy(part, other, tets * sizeof *part);
  flesh_free(other);
  return status;
}

int flesh_partition_tets(const flesh_mesh *mesh, int ranks, int *part)
{
  const int tets = flesh_mesh_tet_count(mesh);
  memset(part, 0, (size_t)tets * sizeof *part);
  if (ranks == 1) return FLESH_OK;
  if (ranks < 1 || ranks > tets)
    return flesh_fail(FLESH_ERR_ARGUMENT, "a mesh of %d tets cannot be divided among %d ranks; it must be 1 to %d "
                                          "ranks", tets, ranks, tets);
  const int status = flesh_partition_planes(mesh, ranks, part);
  return status ? status : compare(mesh, ranks, part);
}
