/* split_check.c: compares the parts of a split mesh, tet by tet. */
#include "parallel/split_check.h"

#include <stdint.h>
#include <string.h>

#include "base/archive.h"
#include "base/error.h"
#include "base/memory.h"
#include "mesh/mesh.h"
#include "mesh/split_part.h"
#include "parallel/communicator.h"

enum { AT_A_TIME = 1 << 18, NUMBERS = 2 }; /* per tet: how many ranks own it, and its digest there */

/* Returns a number of 52 bits, which sums of doubles keep exact, for all that the part says about a tet. */
static double digest(const flesh_mesh *mesh, int t)
{
  const flesh_split_part *split = mesh->split;
  const int *edges = flesh_mesh_tet_edges(mesh), order = flesh_mesh_order(mesh);
  const int head[3] = {split->tets[t], split->owners[t], flesh_mesh_regions(mesh)[t]};
  uint64_t sum = flesh_archive_sum(0, head, sizeof head);
  for (int a = 0; a < (order == 2 ? 10 : 4); a++) {
    const int node = a < 4 ? flesh_mesh_tets(mesh)[4 * (size_t)t + (size_t)a] : edges[6 * (size_t)t + (size_t)a - 4];
    const int number = node < 0 ? -1 : split->nodes[node];
    sum = flesh_archive_sum(sum, &number, sizeof number);
    if (node >= 0) sum = flesh_archive_sum(sum, flesh_mesh_positions(mesh) + 3 * (size_t)node, 3 * sizeof(double));
  }
  return (double)(sum >> 12);
}

static int refuse(const flesh_mesh *mesh, int t, double owners)
{
  const flesh_split_part *split = mesh->split;
  return flesh_fail(FLESH_ERR_FILE,
                    "the parts of the split mesh contradict each other: tet %d of the whole is owned by %.0f parts, and part "
                    "%d has it as part %d's%s; split the mesh again",
                    split->tets[t], owners, split->part, split->owners[t], owners == 1 ? ", with other data than its own" : "");
}

int flesh_split_check_parts(flesh_communicator *communicator, const flesh_mesh *mesh)
{
  const flesh_split_part *split = mesh->split;
  const int tets = flesh_mesh_tet_count(mesh), room = split->whole_tets < AT_A_TIME ? split->whole_tets : AT_A_TIME;
  double *sums = flesh_malloc((size_t)room * NUMBERS * sizeof *sums);
  int status = flesh_communicator_agree(communicator, sums ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for parts"));
  for (int from = 0, first = 0, last; from < split->whole_tets && !status; from += room, first = last) {
    const int count = split->whole_tets - from < room ? split->whole_tets - from : room;
    memset(sums, 0, (size_t)count * NUMBERS * sizeof *sums);
    for (last = first; last < tets && split->tets[last] < from + count; last++) {
      double *of_tet = sums + (size_t)(split->tets[last] - from) * NUMBERS;
      if (split->owners[last] != split->part) continue;
      of_tet[0] = 1;
      of_tet[1] = digest(mesh, last);
    }
    flesh_communicator_sum(communicator, count * NUMBERS, sums);
    for (int t = first; t < last && !status; t++) {
      const double *of_tet = sums + (size_t)(split->tets[t] - from) * NUMBERS;
      if (of_tet[0] != 1 || of_tet[1] != digest(mesh, t)) status = refuse(mesh, t, of_tet[0]);
    }
    status = flesh_communicator_agree(communicator, status);
  }
  flesh_free(sums);
  return status;
}
