/* edges.h: the edges of a mesh, each once, in an order that depends on the nodes alone. */
#ifndef FLESH_MESH_EDGES_H
#define FLESH_MESH_EDGES_H

/* Corners of a tet's edges in VTK's order, which ten-node arrays use, too. */
static const int flesh_edge_corners[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

/* Number of the edge between two corners of a tet. */
static const int flesh_edge_between[4][4] = {{-1, 0, 2, 3}, {0, -1, 1, 4}, {2, 1, -1, 5}, {3, 4, 5, -1}};

typedef struct flesh_mesh_edges {
  int count;
  int *ends;      /* [2*count] nodes, the lower first; sorted by the lower, then by the higher node */
  int *tet_edges; /* [6*tets] */
} flesh_mesh_edges;

/* Finds the edges of `tets` [4*tets], whose nodes are in 0 <= n < nodes. Returns 0 when out of memory, else 1. */
int flesh_mesh_edges_find(int nodes, int tets, const int *tet_nodes, flesh_mesh_edges *edges);
void flesh_mesh_edges_clear(flesh_mesh_edges *edges);

#endif
