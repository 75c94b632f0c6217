/* rank_share.c: finds a rank's nodes and faces. */
#include "effect/rank_share.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/rising.h"
#include "base/sort.h"

int flesh_rank_share_node(const flesh_rank_part *part, int node)
{
  const int local = flesh_rank_part_find(part, node);
  return local < flesh_rank_part_own(part) ? local : -1;
}

int flesh_rank_share_nodes(const flesh_rank_part *part, int count, const int *nodes, int *kept, int *local)
{
  int found = 0;
  for (int k = 0; k < count; k++) {
    const int node = flesh_rank_share_node(part, nodes[k]);
    if (node < 0) continue;
    kept[found] = k;
    local[found++] = node;
  }
  return found;
}

int flesh_rank_share_tet(const flesh_rank_part *part, int tet)
{
  return flesh_rising_find(flesh_rank_part_tets(part), 0, flesh_mesh_tet_count(flesh_rank_part_mesh(part)), tet);
}

/* The corners of a face, ascending. */
typedef struct face {
  int node[3];
} face;

static face face_of(const int n[3])
{
  const int low = n[0] < n[1] ? (n[0] < n[2] ? n[0] : n[2]) : (n[1] < n[2] ? n[1] : n[2]);
  const int high = n[0] > n[1] ? (n[0] > n[2] ? n[0] : n[2]) : (n[1] > n[2] ? n[1] : n[2]);
  return (face){{low, n[0] + n[1] + n[2] - low - high, high}};
}

static int is_there(int count, const face *faces, const face *wanted)
{
  int low = 0, high = count;
  while (low < high) {
    const int middle = low + (high - low) / 2, order = flesh_compare_three_ints(&faces[middle], wanted);
    if (order == 0) return 1;
    if (order < 0) low = middle + 1;
    else high = middle;
  }
  return 0;
}

/* Compares with the surface of the part, which consists of the whole surface's faces of its tets, and of faces between
 * ranks, which are not on the whole surface. */
int flesh_rank_share_faces(const flesh_rank_part *part, int count, const int *triangles, int *found, int **kept,
                           int **local)
{
  int all;
  const int *surface = flesh_mesh_surface(flesh_rank_part_mesh(part), &all);
  face *own = flesh_malloc(((size_t)all + 1) * sizeof *own);
  *kept = flesh_malloc(((size_t)count + 1) * sizeof **kept);
  *local = flesh_malloc((3 * (size_t)count + 1) * sizeof **local);
  *found = 0;
  if (!own || !*kept || !*local) {
    flesh_free(own);
    flesh_free(*kept);
    flesh_free(*local);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for a rank's share of %d triangles", count);
  }
  for (int k = 0; k < all; k++) own[k] = face_of(surface + 3 * (size_t)k);
  flesh_sort(own, (size_t)all, sizeof *own, flesh_compare_three_ints);
  for (int k = 0; k < count; k++) {
    int n[3];
    for (int a = 0; a < 3; a++) n[a] = flesh_rank_part_find(part, triangles[3 * (size_t)k + (size_t)a]);
    if (n[0] < 0 || n[1] < 0 || n[2] < 0) continue;
    const face wanted = face_of(n);
    if (!is_there(all, own, &wanted)) continue;
    (*kept)[*found] = k;
    memcpy(*local + 3 * (size_t)(*found)++, n, sizeof n);
  }
  flesh_free(own);
  return FLESH_OK;
}
