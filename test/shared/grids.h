/* grids.h: bodies that are displaced grids of boxes, several in one mesh, for tests of contact between them. */
#ifndef FLESH_TEST_GRIDS_H
#define FLESH_TEST_GRIDS_H

#include "body.h"
#include "test.h"

/* Makes a box from 0 to 1 of this many cells, each node of which `place` moves (preserving orientation). */
static inline flesh_mesh *grid_of(int nx, int ny, int nz, void (*place)(const void *data, double x[3]), const void *data)
{
  flesh_mesh *box = test_box(nx, ny, nz, 1, 1, 1), *mesh = NULL;
  const int n = 3 * flesh_mesh_node_count(box);
  double *x = malloc((size_t)n * sizeof *x);
  memcpy(x, flesh_mesh_positions(box), (size_t)n * sizeof *x);
  for (int d = 0; d < n; d += 3) place(data, x + d);
  CHECK_OK(flesh_mesh_create(n / 3, x, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  flesh_mesh_destroy(&box);
  free(x);
  return mesh;
}

/* Makes one mesh of two, which it destroys; nodes and tets of the first come first. Fills in their parts. */
static inline flesh_mesh *grids_join(flesh_mesh *first, flesh_mesh *second, flesh_body_part parts[2])
{
  flesh_mesh *both = NULL, *of[2] = {first, second};
  int nodes = 0, tets = 0;
  for (int k = 0; k < 2; k++) {
    parts[k] = (flesh_body_part){k ? "second" : "first", tets, flesh_mesh_tet_count(of[k])};
    nodes += flesh_mesh_node_count(of[k]);
    tets += flesh_mesh_tet_count(of[k]);
  }
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  int *corners = malloc(4 * (size_t)tets * sizeof *corners);
  for (int k = 0, node = 0; k < 2; k++) {
    const int count = flesh_mesh_node_count(of[k]);
    memcpy(x + 3 * node, flesh_mesh_positions(of[k]), 3 * (size_t)count * sizeof *x);
    for (int e = 0; e < 4 * parts[k].tets; e++)
      corners[4 * parts[k].first_tet + e] = node + flesh_mesh_tets(of[k])[e];
    node += count;
    flesh_mesh_destroy(&of[k]);
  }
  CHECK_OK(flesh_mesh_create(nodes, x, tets, corners, NULL, &both));
  free(x);
  free(corners);
  return both;
}

#endif
