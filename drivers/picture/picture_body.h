/* picture_body.h: a panel's body and obstacles as surfaces to render, and its colours. */
#ifndef FLESH_PICTURE_PICTURE_BODY_H
#define FLESH_PICTURE_PICTURE_BODY_H

#include <stdint.h>

#include "flesh/mesh.h"
#include "picture/picture_panel.h"
#include "scene/arena.h"

/* The boundary of a body of ten-node tets in small triangles, so that its curved faces and edges are seen as such. */

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

/* Makes the surface of a mesh of order 2, in the arena. FLESH_ERR_MEMORY. */
int flesh_curved_surface_make(const flesh_mesh *mesh, flesh_arena *arena, flesh_curved_surface *surface);

/* Values at the vertices [components*vertices] from those at the nodes [components*nodes], by the faces' quadratic
 * shape functions; 0 where there is no vertex. */
void flesh_curved_surface_apply(const flesh_curved_surface *surface, int components, const double *nodal, double *values);

/* The values of the field at the nodes: averages over the tets around, weighted by volume; tets
 * without a value (J <= 0 in a field that needs it) are left out. New [nodes]; NULL for
 * FLESH_PICTURE_PLAIN. `extremes` (may be NULL): of the values before they are averaged, NaN without. */
int flesh_picture_values(const flesh_picture_panel *panel, flesh_picture_field field,
                         double **values, double extremes[2]);

/* The mean of J in all tets, then its least value at the points of quadrature of all tets: J [2*tets]. */
void flesh_picture_jacobians(const flesh_mesh *mesh, const double *x, double *J);

/* Whether a tet has J <= 0 at a point of quadrature. */
int flesh_picture_is_inverted(const flesh_picture_panel *panel);

/* An obstacle in triangles at a panel's time. */
typedef struct flesh_picture_obstacle {
  int vertices, triangles;
  double *x;    /* [3*vertices], m */
  int *corners; /* [3*triangles] */
  int is_plane; /* a square that reaches beyond the view, in small triangles */
} flesh_picture_obstacle;

/* The surfaces that a panel shows. */
typedef struct flesh_picture_scene {
  int count; /* of surfaces: the body, then its obstacles */
  flesh_render_surface *surfaces;
  flesh_arena arena; /* of them and of their arrays; to be freed */
} flesh_picture_scene;

/* Makes the surfaces; low, high: of the colours. */
int flesh_picture_scene_make(const flesh_picture_panel *panel, const flesh_picture_options *options,
                             const flesh_picture_frame *frame, flesh_picture_scene *scene);

/* The obstacles of the panel's system. */
int flesh_picture_obstacle_count(const flesh_picture_panel *panel);
/* Makes obstacle k, in the arena; a plane has no vertices where `view` is NULL. FLESH_ERR_MEMORY. */
int flesh_picture_obstacle_make(const flesh_picture_panel *panel, int k, const flesh_view *view, flesh_arena *arena,
                                flesh_picture_obstacle *obstacle);
/* Half the side of a plane's square. */
double flesh_picture_plane_extent(const flesh_view *view);

/* Turns the corners of an obstacle's triangles [3*triangles] so that neighbours agree, and those that hang together
 * face the panel's body: the sides of a mesh are alike to contact, and only what is seen from behind is transparent.
 * Nodes at one place must be one node. */
int flesh_picture_face_body(const flesh_picture_panel *panel, const double *positions, int triangles, int *corners);

/* The colour of a value, sRGB in [0, 1]; part in [0, 1] of the way from low to high. */
void flesh_picture_colour(flesh_picture_field field, double part, double rgb[3]);

#endif
