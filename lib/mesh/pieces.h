/* pieces.h: a mesh as flat tets: its tets at order 1; at order 2 eight in a row for each, four at the
 * corners and four around the line between the middles of the edges 02 and 13. What asks where nodes
 * stand to each other goes over pieces. */
#ifndef FLESH_MESH_PIECES_H
#define FLESH_MESH_PIECES_H

#include <string.h>

#include "mesh/mesh.h"

static inline int flesh_mesh_piece_count(const flesh_mesh *mesh)
{
  return mesh->edge_nodes ? 8 * mesh->tets : mesh->tets;
}

/* The four nodes of piece `p`; in the rest shape with straight edges its volume is positive. */
static inline void flesh_mesh_piece(const flesh_mesh *mesh, int p, int nodes[4])
{
  static const signed char pieces[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                           {6, 8, 4, 5}, {6, 8, 5, 9}, {6, 8, 9, 7}, {6, 8, 7, 4}};
  if (!mesh->edge_nodes) {
    memcpy(nodes, mesh->tet_nodes + 4 * (size_t)p, 4 * sizeof *nodes);
    return;
  }
  const size_t t = (size_t)p / 8;
  for (int i = 0; i < 4; i++) {
    const int a = pieces[p % 8][i];
    nodes[i] = a < 4 ? mesh->tet_nodes[4 * t + a] : mesh->edge_nodes[6 * t + a - 4];
  }
}

/* The nodes of tet `t`, 4 or 10 by the mesh's order; returns their number. */
static inline int flesh_mesh_tet_nodes(const flesh_mesh *mesh, int t, int nodes[10])
{
  memcpy(nodes, mesh->tet_nodes + 4 * (size_t)t, 4 * sizeof *nodes);
  if (!mesh->edge_nodes) return 4;
  memcpy(nodes + 4, mesh->edge_nodes + 6 * (size_t)t, 6 * sizeof *nodes);
  return 10;
}

#endif
