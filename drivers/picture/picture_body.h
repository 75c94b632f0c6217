/* picture_body.h: makes surfaces to render from a panel's body and obstacles, and their colours. */
#ifndef FLESH_PICTURE_PICTURE_BODY_H
#define FLESH_PICTURE_PICTURE_BODY_H

#include <stdint.h>

#include "flesh/mesh.h"
#include "picture/picture_panel.h"
#include "scene/arena.h"

/* The boundary of a body of ten-node tets in small triangles, so that its curved faces and edges are drawn curved. */

/* Sixteen triangles per face; one for a face of a tet of four nodes. The first vertices are the mesh's nodes; the others
 * are given by the six nodes of a face that they are on: x = sum eighths_a / 8 x_a. */
typedef struct flesh_curved_surface {
  int nodes, vertices, triangles;
  int *places;               /* [2*nodes] vertices on the halves of the edge whose middle the node is; 0: none. Owns all */
  int *six, *eighths;        /* [6*(vertices-nodes)] */
  int *corners;              /* [3*triangles] */
  int *tets;                 /* [triangles] the tet behind each triangle */
  uint8_t *hidden;           /* [triangles] bit k: the side opposite to corner k is not an edge of the mesh */
} flesh_curved_surface;

/* Makes the surface of a mesh of order 2, in the arena. FLESH_ERR_MEMORY. */
int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *surface);

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
