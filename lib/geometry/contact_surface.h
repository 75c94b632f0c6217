/* contact_surface.h: triangles, edges and nodes of the surfaces of bodies that can touch each other.
 *
 * Corners are mesh nodes; a surface node also has an index in `nodes`. Faces are in the mesh's order, edges and nodes
 * ascend, so a mesh has exactly one surface. */
#ifndef FLESH_GEOMETRY_CONTACT_SURFACE_H
#define FLESH_GEOMETRY_CONTACT_SURFACE_H

#include <stddef.h>

#include "flesh/mesh.h"

typedef struct flesh_contact_surface {
  int mesh_nodes;
  int node_count, *nodes; /* [node_count] mesh nodes on the surface, ascending */
  int *node_place;        /* [mesh_nodes] index of a mesh node in `nodes`; -1: not on the surface */
  int face_count, *faces; /* [3*face_count] mesh nodes, outward by the right-hand rule */
  int *face_edges;        /* [3*face_count] edge from corner k to corner k+1 */
  int edge_count, *edges; /* [2*edge_count] mesh nodes, the lower first; edges ascend by the lower, then by the higher */
  int *edge_faces;        /* [2*edge_count] the first two faces of the edge; -1 if missing */
  int *edge_uses;         /* [edge_count] number of faces of the edge: 2 except on rims (1) and where bodies meet (4, ...) */
  int *node_edge_uses, *node_faces; /* [node_count] sum of edge_uses over the node's edges, and number of its faces */
  int *node_edges;                  /* [node_count] number of edges of the node */
  double *node_area, *edge_area; /* [node_count], [edge_count] m^2: a third of the rest area of each adjacent face */
  int *node_body;                /* [node_count] number of the node's body */
  int *node_piece;               /* [node_count] label shared by all nodes that are connected by tets (without tets, by
                                  * triangles) */
  int body_count;                /* highest body number plus 1 */
  double area, mean_edge;        /* m^2 and m, at rest */
} flesh_contact_surface;

/* Creates the surface of a mesh's tets; a face of a ten-node tet gives four flat triangles, in the mesh's order.
 * tet_body [tets] is the number >= 0 of each tet's body; if NULL, bodies are the connected parts, numbered by their
 * lowest nodes, ascending. A node of several bodies has the least number. FLESH_ERR_MEMORY; FLESH_ERR_ARGUMENT for a
 * negative number. */
int flesh_contact_surface_of_mesh(const flesh_mesh *mesh, const int *tet_body, flesh_contact_surface *surface);

/* Creates the surface of triangles [3*count] between nodes at X [3*nodes]; body [nodes] or NULL as above.
 * FLESH_ERR_MEMORY; FLESH_ERR_ARGUMENT for a corner out of range or repeated in a triangle, and for a negative body. */
int flesh_contact_surface_of_triangles(int nodes, const double *X, int count, const int *triangles, const int *body,
                                       flesh_contact_surface *surface);

/* Copies the surface for a mesh of `nodes` nodes, in which surface node k has the number local[k] [node_count]; the
 * order is kept. FLESH_ERR_MEMORY; clear the copy also after an error. */
int flesh_contact_surface_renumber(const flesh_contact_surface *whole, int nodes, const int *local,
                                   flesh_contact_surface *surface);

/* Lists the faces (corners 3) or the edges (corners 2) of each surface node: those of node n, by its index in `nodes`,
 * are list[start[n]] to before list[start[n + 1]], ascending. Both arrays are the caller's to free, also after an
 * error. FLESH_ERR_MEMORY. */
int flesh_contact_surface_around(const flesh_contact_surface *surface, int corners, int **start, int **list);

void flesh_contact_surface_clear(flesh_contact_surface *surface);
size_t flesh_contact_surface_memory(const flesh_contact_surface *surface);

#endif
