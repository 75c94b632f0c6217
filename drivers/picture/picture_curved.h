/* picture_curved.h: the boundary of a body of ten-node tets in small triangles, so that its curved faces and edges are
 * seen as such. */
#ifndef FLESH_PICTURE_PICTURE_CURVED_H
#define FLESH_PICTURE_PICTURE_CURVED_H

#include <stdint.h>

#include "flesh/mesh.h"

/* A vertex by the six nodes of a face that it lies on: x = sum eighths_a / 8 x_a. A node is itself, eight times. */
typedef struct flesh_curved_vertex {
  int nodes[6];
  int eighths[6];
} flesh_curved_vertex;

/* Sixteen triangles a face; one where a tet of four nodes is behind it. Vertices: the mesh's nodes, then two for each
 * node (on the halves of the edge it is the middle of), then three for each face. */
typedef struct flesh_curved_surface {
  int vertices, triangles;
  flesh_curved_vertex *rows; /* [vertices]; 0 where there is no vertex. The next arrays are behind it */
  int *corners;              /* [3*triangles] */
  int *tets;                 /* [triangles] the tet behind each */
  uint8_t *hidden;           /* [triangles] bit k: the side opposite to corner k is no edge of the mesh */
} flesh_curved_surface;

/* Makes the surface of a mesh of order 2, whose `rows` are to be freed. FLESH_ERR_MEMORY. */
int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_curved_surface *surface);

/* Values at the vertices [components*vertices] from those at the nodes [components*nodes], by the faces' quadratic
 * shape functions; 0 where there is no vertex. */
void flesh_curved_surface_apply(const flesh_curved_surface *surface, int components, const double *nodal, double *values);

#endif
