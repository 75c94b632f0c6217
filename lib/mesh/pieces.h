/* pieces.h: a mesh as straight four-node tets, called pieces: each four-node tet is one, and each ten-node tet is eight
 * consecutive ones, four at the corners and four around the line between the middles of the edges 02 and 13. Geometric
 * queries, such as where a point lies, use pieces. */
#ifndef FLESH_MESH_PIECES_H
#define FLESH_MESH_PIECES_H

#include <string.h>

#include "mesh/mesh.h"

static inline int flesh_mesh_piece_count(const flesh_mesh *mesh)
{
  if (mesh->pieces) return mesh->piece_count;
  return mesh->edge_nodes ? 8 * mesh->tets : mesh->tets;
}

/* Returns the tet of which `p` is a piece. */
static inline int flesh_mesh_piece_tet(const flesh_mesh *mesh, int p)
{
  if (mesh->pieces) return mesh->pieces[p] / 8;
  return mesh->edge_nodes ? p / 8 : p;
}

/* Gives the four nodes of piece `p`; if edges are straight at rest, its volume there is positive. */
static inline void flesh_mesh_piece(const flesh_mesh *mesh, int p, int nodes[4])
{
  static const signed char pieces[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                           {6, 8, 4, 5}, {6, 8, 5, 9}, {6, 8, 9, 7}, {6, 8, 7, 4}};
  if (!mesh->edge_nodes) {
    memcpy(nodes, mesh->tet_nodes + 4 * (size_t)p, 4 * sizeof *nodes);
    return;
  }
  const int own = mesh->pieces ? mesh->pieces[p] : p;
  const size_t t = (size_t)own / 8;
  if (!flesh_mesh_is_quadratic(mesh, (int)t)) {
    memcpy(nodes, mesh->tet_nodes + 4 * t, 4 * sizeof *nodes);
    return;
  }
  for (int i = 0; i < 4; i++) {
    const int a = pieces[own % 8][i];
    nodes[i] = a < 4 ? mesh->tet_nodes[4 * t + a] : mesh->edge_nodes[6 * t + a - 4];
  }
}

/* Gives the nodes of tet `t`; returns their number, 4 or 10. */
static inline int flesh_mesh_tet_nodes(const flesh_mesh *mesh, int t, int nodes[10])
{
  memcpy(nodes, mesh->tet_nodes + 4 * (size_t)t, 4 * sizeof *nodes);
  if (!flesh_mesh_is_quadratic(mesh, t)) return 4;
  memcpy(nodes + 4, mesh->edge_nodes + 6 * (size_t)t, 6 * sizeof *nodes);
  return 10;
}

#endif
