/* contact_surface.h: the triangles, edges and nodes of bodies' surfaces that can touch each other.
 *
 * Corners are mesh nodes; a node of the surface is also known by its place among `nodes`. Faces are in the mesh's order,
 * edges and nodes ascend, so that one mesh has one surface. */
#ifndef FLESH_GEOMETRY_CONTACT_SURFACE_H
#define FLESH_GEOMETRY_CONTACT_SURFACE_H

#include <stddef.h>

#include "flesh/mesh.h"

typedef struct flesh_contact_surface {
  int mesh_nodes;
  int node_count, *nodes; /* [node_count] mesh nodes on the surface, ascending */
  int *node_place;        /* [mesh_nodes] of a mesh node among `nodes`; -1: it is not on the surface */
  int face_count, *faces; /* [3*face_count] mesh nodes, outward by the right-hand rule */
  int *face_edges;        /* [3*face_count] the edge from corner k to corner k+1 */
  int edge_count, *edges; /* [2*edge_count] mesh nodes, the lower first; edges ascend by it, then by the higher */
  int *edge_faces;        /* [2*edge_count] its first two faces, -1 where there is none */
  int *edge_uses;         /* [edge_count] faces of the edge: 2 but on rims (1) and where bodies meet (4, ...) */
  int *node_edge_uses, *node_faces; /* [node_count] sum of edge_uses of its edges; faces of the node */
  int *node_edges;                  /* [node_count] edges of the node */
  double *node_area, *edge_area; /* [node_count], [edge_count] m^2: a third of the rest area of each of its faces */
  int *node_body;                /* [node_count] number of the node's body */
  int *node_piece;               /* [node_count] one for all nodes that tets (without: triangles) connect */
  int body_count;                /* highest number of a body, plus 1 */
  double area, mean_edge;        /* m^2 and m, at rest */
} flesh_contact_surface;

/* The surface of a mesh's tets; faces of ten-node tets are four flat triangles each, in the mesh's order. tet_body
 * [tets]: the number, >= 0, of each tet's body; NULL: bodies are what is connected by nodes, numbered as their lowest
 * nodes ascend. A node of several bodies has the least number. FLESH_ERR_MEMORY; FLESH_ERR_ARGUMENT for a negative
 * number. */
int flesh_contact_surface_of_mesh(const flesh_mesh *mesh, const int *tet_body, flesh_contact_surface *surface);

/* The surface of any triangles [3*count] between nodes at X [3*nodes]; body [nodes] or NULL as above. FLESH_ERR_MEMORY;
 * FLESH_ERR_ARGUMENT for a corner out of range or twice in a triangle, and for a negative body. */
int flesh_contact_surface_of_triangles(int nodes, const double *X, int count, const int *triangles, const int *body,
                                       flesh_contact_surface *surface);

/* Copies the surface, in the same order, for a mesh of `nodes` nodes, where node nodes[k] is local[k] [node_count].
 * FLESH_ERR_MEMORY. To be cleared also when it fails. */
int flesh_contact_surface_renumber(const flesh_contact_surface *whole, int nodes, const int *local,
                                   flesh_contact_surface *surface);

/* Lists the faces (corners 3) or the edges (corners 2) of each node of the surface: of node n, by its place, they are
 * list[start[n]] to before list[start[n + 1]], ascending. Returns new, to be freed also when it fails: FLESH_ERR_MEMORY. */
int flesh_contact_surface_around(const flesh_contact_surface *surface, int corners, int **start, int **list);

void flesh_contact_surface_clear(flesh_contact_surface *surface);
size_t flesh_contact_surface_memory(const flesh_contact_surface *surface);

#endif
