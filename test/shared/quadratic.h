/* quadratic.h: boxes of ten-node tets for tests of meshes. */
#ifndef FLESH_TEST_QUADRATIC_H
#define FLESH_TEST_QUADRATIC_H

#include <stdlib.h>

#include "flesh/mesh.h"
#include "test.h"

/* VTK's order of nodes, written independently of the library. */
static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

/* Makes a box grid with corners moved by a fixed random field, raised to order 2. */
static inline flesh_mesh *raised_box(int n, double amount)
{
  flesh_mesh *grid, *jittered, *mesh;
  CHECK_OK(flesh_mesh_box((int[]){n, n + 1, n}, (double[]){1, 1.5, 1}, (double[]){-0.3, 2, 0.5}, &grid));
  int nodes = flesh_mesh_node_count(grid);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  unsigned long long seed = 11;
  for (int i = 0; i < 3 * nodes; i++)
    x[i] = flesh_mesh_positions(grid)[i] + amount / n * (2 * test_uniform(&seed) - 1);
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(grid), flesh_mesh_tets(grid), NULL, &jittered));
  CHECK_OK(flesh_mesh_raise_order(jittered, &mesh));
  flesh_mesh_destroy(&grid);
  flesh_mesh_destroy(&jittered);
  free(x);
  return mesh;
}

/* Copies the ten nodes of tet t. */
static inline void ten_nodes(const flesh_mesh *mesh, int t, int n[10])
{
  memcpy(n, flesh_mesh_tets(mesh) + 4 * (size_t)t, 4 * sizeof *n);
  memcpy(n + 4, flesh_mesh_tet_edges(mesh) + 6 * (size_t)t, 6 * sizeof *n);
}

#endif
