/* partition_metis.c: partitions by METIS. */
#include <metis.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/partition_kinds.h"

/* Gives each empty part a tet of the largest part: METIS may leave parts empty if there are few tets. */
static void fill_empty(int tets, int ranks, int *part, int *counts)
{
  memset(counts, 0, (size_t)ranks * sizeof *counts);
  for (int t = 0; t < tets; t++) counts[part[t]]++;
  for (int rank = 0; rank < ranks; rank++) {
    int largest = 0, t = 0;
    if (counts[rank]) continue;
    for (int k = 1; k < ranks; k++)
      if (counts[k] > counts[largest]) largest = k;
    while (part[t] != largest) t++;
    part[t] = rank;
    counts[largest]--;
    counts[rank]++;
  }
}

static int run_metis(const flesh_mesh *mesh, int ranks, idx_t *first, idx_t *corners, idx_t *of_tets, idx_t *of_nodes)
{
  idx_t tets = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh), shared = 3, parts = ranks, cut;
  const int *tet = flesh_mesh_tets(mesh);
  for (idx_t t = 0; t <= tets; t++) first[t] = 4 * t;
  for (idx_t k = 0; k < 4 * tets; k++) corners[k] = tet[k];
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_NUMBERING] = 0;
  options[METIS_OPTION_SEED] = 1;
  const int done = METIS_PartMeshDual(&tets, &nodes, first, corners, NULL, NULL, &shared, &parts, NULL, options, &cut,
                                      of_tets, of_nodes);
  return done == METIS_OK ? FLESH_OK
                          : flesh_fail(FLESH_ERR_MEMORY, "METIS could not divide %d tets among %d ranks", (int)tets, ranks);
}

int flesh_partition_metis(const flesh_mesh *mesh, int ranks, int *part, int *made)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  idx_t *room = flesh_malloc((6 * tets + 1 + nodes) * sizeof *room);
  int *counts = flesh_malloc((size_t)ranks * sizeof *counts), status = FLESH_ERR_MEMORY;
  if (room && counts) {
    idx_t *corners = room + tets + 1, *of_tets = corners + 4 * tets;
    status = run_metis(mesh, ranks, room, corners, of_tets, of_tets + tets);
    for (size_t t = 0; !status && t < tets; t++) part[t] = (int)of_tets[t];
    if (!status) fill_empty((int)tets, ranks, part, counts);
  } else {
    flesh_fail(status, "no memory to part %d tets", (int)tets);
  }
  flesh_free(room);
  flesh_free(counts);
  *made = !status;
  return status;
}
