/* curve.h: puts the boundary of a mesh of order 2 on a surface that it stands for. */
#ifndef FLESH_MESH_CURVE_H
#define FLESH_MESH_CURVE_H

#include "flesh/mesh.h"

/* A surface: where it is nearest to p, and its unit normal there, of either sign. */
typedef struct flesh_nearest_surface {
  const void *data;
  void (*nearest)(const void *data, const double p[3], double at[3], double normal[3]);
} flesh_nearest_surface;

/* Finds which boundary faces of `mesh`, of order 2, stand for parts of `surfaces` [count]: those of which all corners are
 * nearer than a tenth of the longest edge, and which are turned from the surface by less than 60 degrees; of several
 * surfaces the nearest counts. on [4*tets] gets 1 + the surface's number for the face opposite to a corner, 0 for all
 * others; found [count] how many faces of each surface there are, left [count] how many faces are nearer to it than half
 * of their longest edge and still not on it. */
int flesh_mesh_find_curved_faces(const flesh_mesh *mesh, int count, const flesh_nearest_surface *surfaces, int *on,
                                 int *found, int *left);

/* `finer` [4*tets of refined]: the parts that the faces `on` [4*tets] have in `refined`, made of `mesh` by
 * flesh_mesh_refine. */
void flesh_mesh_refine_curved_faces(const flesh_mesh *mesh, const int *on, const flesh_mesh *refined, int *finer);

/* The mesh with the faces `on` [4*tets], as flesh_mesh_find_curved_faces has them, on their surfaces: their corners and
 * the nodes on their edges are moved to the nearest points, of several surfaces to where these meet, and nodes on the
 * edge of another boundary face within its plane; nodes on other edges go along with the edges' ends. Returns new.
 * Fails as flesh_mesh_create_quadratic does where the Jacobian of a tet is then not positive all over it;
 * FLESH_ERR_MEMORY. */
int flesh_mesh_curve(const flesh_mesh *mesh, const flesh_nearest_surface *surfaces, const int *on, flesh_mesh **curved);

#endif
