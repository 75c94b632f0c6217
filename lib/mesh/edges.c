/* edges.c: finds the edges of a mesh by two counting sorts. */
#include "mesh/edges.h"

#include <string.h>

#include "base/memory.h"

/* Returns the lower or higher end node of edge k; tet k / 6 has the edges from 6 (k / 6). */
static int end_of(const int *tet_nodes, size_t k, int higher)
{
  const int *n = tet_nodes + 4 * (k / 6), *c = flesh_edge_corners[k % 6];
  int a = n[c[0]], b = n[c[1]];
  return (a < b) == (higher != 0) ? b : a;
}

/* Sorts the `count` edges in `from` by one end into `to`; those with the same end keep their order. `first` [nodes+1]
 * is work space. */
static void sort_by_end(int nodes, size_t count, const int *tet_nodes, int higher, const unsigned *from,
                        unsigned *to, unsigned *first)
{
  memset(first, 0, ((size_t)nodes + 1) * sizeof *first);
  for (size_t k = 0; k < count; k++) first[end_of(tet_nodes, from[k], higher) + 1]++;
  for (int n = 0; n < nodes; n++) first[n + 1] += first[n];
  for (size_t k = 0; k < count; k++) to[first[end_of(tet_nodes, from[k], higher)]++] = from[k];
}

int flesh_mesh_edges_find(int nodes, int tets, const int *tet_nodes, flesh_mesh_edges *edges)
{
  size_t count = 6 * (size_t)tets;
  unsigned *sorted = flesh_malloc(count * sizeof *sorted), *other = flesh_calloc(count, sizeof *other);
  unsigned *first = flesh_malloc(((size_t)nodes + 1) * sizeof *first);
  *edges = (flesh_mesh_edges){.tet_edges = flesh_malloc(count * sizeof *edges->tet_edges)};
  int enough = sorted && other && first && edges->tet_edges;
  if (!enough) goto done;
  for (size_t k = 0; k < count; k++) other[k] = (unsigned)k;
  sort_by_end(nodes, count, tet_nodes, 1, other, sorted, first);
  sort_by_end(nodes, count, tet_nodes, 0, sorted, other, first);
  int low = -1, high = -1;
  for (size_t k = 0; k < count; k++) {
    int a = end_of(tet_nodes, other[k], 0), b = end_of(tet_nodes, other[k], 1);
    edges->count += a != low || b != high;
    edges->tet_edges[other[k]] = edges->count - 1;
    low = a, high = b;
  }
  edges->ends = flesh_malloc(2 * (size_t)edges->count * sizeof *edges->ends);
  enough = edges->ends != NULL;
  for (size_t k = 0; k < count && enough; k++) {
    int *ends = edges->ends + 2 * (size_t)edges->tet_edges[k];
    ends[0] = end_of(tet_nodes, k, 0), ends[1] = end_of(tet_nodes, k, 1);
  }
done:
  flesh_free(sorted);
  flesh_free(other);
  flesh_free(first);
  if (!enough) flesh_mesh_edges_clear(edges);
  return enough;
}

void flesh_mesh_edges_clear(flesh_mesh_edges *edges)
{
  flesh_free(edges->ends);
  flesh_free(edges->tet_edges);
  *edges = (flesh_mesh_edges){0};
}
