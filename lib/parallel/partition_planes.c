/* partition_planes.c: partitions by planes across the axes, which leave flat faces between ranks. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "parallel/partition_kinds.h"

typedef struct partition {
  const int *corners; /* of all tets */
  const double *positions;
  uint64_t *keys; /* [tets] position along the axis, then the tet's number */
  int *marks;     /* [nodes] number of the cut at which a node was last seen */
  int stamp;
  int *part;
} partition;

enum { BITS = 24 }; /* of a position along the axis: more would distinguish rounding errors */

static int tet_of(uint64_t key) { return (int)(uint32_t)key; }

/* Returns four times the centroid's coordinate. */
static double place(const partition *p, int tet, int axis)
{
  double sum = 0;
  for (int c = 0; c < 4; c++) sum += p->positions[3 * (size_t)p->corners[4 * (size_t)tet + c] + axis];
  return sum;
}

static void make_keys(partition *p, int begin, int end, int axis)
{
  double low = INFINITY, high = -INFINITY;
  for (int k = begin; k < end; k++) {
    const double x = place(p, tet_of(p->keys[k]), axis);
    low = fmin(low, x);
    high = fmax(high, x);
  }
  const double scale = high > low ? (double)(1 << BITS) / (high - low) : 0;
  for (int k = begin; k < end; k++) {
    const int tet = tet_of(p->keys[k]);
    p->keys[k] = (uint64_t)((place(p, tet, axis) - low) * scale + .5) << 32 | (uint32_t)tet;
  }
}

/* Orders keys for begin <= k < end so that those before `middle` are the smallest (Hoare 1961). */
static void select_least(uint64_t *keys, int begin, int end, int middle)
{
  while (end - begin > 1) {
    const uint64_t a = keys[begin], b = keys[begin + (end - begin) / 2], c = keys[end - 1];
    const uint64_t pivot = a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
    int i = begin, j = end - 1;
    while (i <= j) {
      while (keys[i] < pivot) i++;
      while (keys[j] > pivot) j--;
      if (i > j) break;
      const uint64_t swapped = keys[i];
      keys[i++] = keys[j];
      keys[j--] = swapped;
    }
    if (middle <= j) end = j + 1;
    else if (middle >= i) begin = i;
    else return;
  }
}

/* Counts the nodes with tets on both sides. */
static int count_cut(partition *p, int begin, int middle, int end)
{
  const int seen = p->stamp + 1, counted = p->stamp + 2;
  int found = 0;
  p->stamp += 2;
  for (int k = begin; k < middle; k++)
    for (int c = 0; c < 4; c++) p->marks[p->corners[4 * (size_t)tet_of(p->keys[k]) + c]] = seen;
  for (int k = middle; k < end; k++)
    for (int c = 0; c < 4; c++) {
      int *mark = &p->marks[p->corners[4 * (size_t)tet_of(p->keys[k]) + c]];
      found += *mark == seen;
      if (*mark == seen) *mark = counted;
    }
  return found;
}

/* Assigns the tets of keys begin <= k < end to `ranks` ranks from `first` on. */
static void bisect(partition *p, int begin, int end, int first, int ranks)
{
  if (ranks == 1) {
    for (int k = begin; k < end; k++) p->part[tet_of(p->keys[k])] = first;
    return;
  }
  const int half = ranks / 2, middle = begin + (int)((int64_t)(end - begin) * half / ranks);
  int least = 0, best = 0;
  for (int axis = 0; axis < 3; axis++) {
    make_keys(p, begin, end, axis);
    select_least(p->keys, begin, end, middle);
    const int nodes = count_cut(p, begin, middle, end);
    if (axis && nodes >= least) continue;
    least = nodes;
    best = axis;
  }
  if (best < 2) {
    make_keys(p, begin, end, best);
    select_least(p->keys, begin, end, middle);
  }
  bisect(p, begin, middle, first, half);
  bisect(p, middle, end, first + half, ranks - half);
}

int flesh_partition_planes(const flesh_mesh *mesh, int ranks, int *part)
{
  const size_t tets = (size_t)flesh_mesh_tet_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  partition p = {.corners = flesh_mesh_tets(mesh), .positions = flesh_mesh_positions(mesh), .part = part};
  p.keys = flesh_malloc(tets * sizeof *p.keys);
  p.marks = flesh_calloc(nodes, sizeof *p.marks);
  const int status = p.keys && p.marks ? FLESH_OK : FLESH_ERR_MEMORY;
  for (size_t t = 0; !status && t < tets; t++) p.keys[t] = t;
  if (!status) bisect(&p, 0, (int)tets, 0, ranks);
  flesh_free(p.keys);
  flesh_free(p.marks);
  return status ? flesh_fail(status, "no memory to part %d tets", (int)tets) : FLESH_OK;
}
