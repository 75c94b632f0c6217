/* picture_body.h: makes surfaces to render from a panel's body and obstacles, and their colours. */
#ifndef FLESH_PICTURE_PICTURE_BODY_H
#define FLESH_PICTURE_PICTURE_BODY_H

#include <stdint.h>

#include "flesh/mesh.h"
#include "picture/picture_panel.h"
#include "scene/arena.h"

/* The boundary of a body of ten-node tets in small triangles, so that its curved faces and edges are drawn curved. */

/* A vertex, given by the six nodes of a face that it is on: x = sum eighths_a / 8 x_a. A node's own
 * vertex has that node with 8 eighths. */
typedef struct flesh_curved_vertex {
  int nodes[6];
  int eighths[6];
} flesh_curved_vertex;

/* Sixteen triangles per face; one for a face of a tet of four nodes. Vertices: the mesh's nodes, then two for each node
 * (on the halves of the edge whose middle it is), then three for each face. */
typedef struct flesh_curved_surface {
  int vertices, triangles;
  flesh_curved_vertex *rows; /* [vertices]; zeros if there is no such vertex. The next arrays are in the same memory */
  int *corners;              /* [3*triangles] */
  int *tets;                 /* [triangles] the tet behind each triangle */
  uint8_t *hidden;           /* [triangles] bit k: the side opposite to corner k is not an edge of the mesh */
} flesh_curved_surface;

/* Makes the surface of a mesh of order 2, in the arena. FLESH_ERR_MEMORY. */
int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *surface);

/* Computes values at the vertices [components*vertices] from those at the nodes [components*nodes], by the faces'
 * quadratic shape functions; 0 where there is no vertex. */
void flesh_curved_surface_apply(const flesh_curved_surface *surface, int components, const double *nodal, double *values);

/* Computes the field at the nodes: averages over the tets around them, weighted by volume; tets where the field is
 * undefined (J <= 0 for some) are left out. *values is new [nodes]; NULL for FLESH_PICTURE_PLAIN. `extremes` (may be
 * NULL): extremes of the values before averaging; NaN if there are none. */
int flesh_picture_values(const flesh_picture_panel *panel, flesh_picture_field field,
                         double **values, double extremes[2]);

/* Computes the mean of J in each tet, then its least value at each tet's points of quadrature: J [2*tets]. */
void flesh_picture_jacobians(const flesh_mesh *mesh, const double *x, double *J);

/* Returns whether any tet has J <= 0 at a point of quadrature. */
int flesh_picture_is_inverted(const flesh_picture_panel *panel);

/* The surfaces that a panel shows. */
typedef struct flesh_picture_scene {
  int count; /* number of surfaces: the body, then its obstacles */
  flesh_render_surface *surfaces;
  flesh_arena arena; /* memory of the surfaces and their arrays, to be freed */
} flesh_picture_scene;

/* Makes the surfaces; of the frame it uses the view and the range of colours. */
int flesh_picture_scene_make(const flesh_picture_panel *panel, const flesh_picture_options *options,
                             const flesh_picture_frame *frame, flesh_picture_scene *scene);

/* Makes the obstacles of the panel's system at its time, after an empty surface in place of the body. A plane is a square
 * that extends beyond the view; it has no vertices if `view` is NULL. Whatever is returned, the caller frees the
 * scene's arena. FLESH_ERR_MEMORY. */
int flesh_picture_obstacles(const flesh_picture_panel *panel, const flesh_view *view, flesh_picture_scene *scene);

/* Orients an obstacle's triangles [3*triangles] so that neighbours agree and each connected component faces the panel's
 * body: contact does not distinguish the sides of a mesh, but pictures do, which draw triangles seen from behind
 * transparent. Nodes at the same place must be one node. FLESH_ERR_MEMORY. */
int flesh_picture_turn_to_body(const flesh_picture_panel *panel, const double *positions, int triangles, int *corners);

/* Computes the colour of a value, sRGB in [0, 1]; `part` is its place between low and high, in [0, 1]. */
void flesh_picture_colour(flesh_picture_field field, double part, double rgb[3]);

#endif
