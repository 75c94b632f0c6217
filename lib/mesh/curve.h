/* curve.h: moves the boundary of a mesh of order 2 onto the surface that it approximates. */
#ifndef FLESH_MESH_CURVE_H
#define FLESH_MESH_CURVE_H

#include "flesh/mesh.h"

/* A surface: gives its point nearest to p, and its unit normal there, of either sign. */
typedef struct flesh_nearest_surface {
  const void *data;
  void (*nearest)(const void *data, const double p[3], double at[3], double normal[3]);
} flesh_nearest_surface;

/* Finds which boundary faces of `mesh`, of order 2, approximate parts of `surfaces` [count]: all corners of such a face
 * are nearer than a tenth of its longest edge, and its normal is within 60 degrees of the surface's; of several
 * surfaces the nearest is taken. on [4*tets] gets 1 + the number of the surface for the face opposite to a corner, 0
 * for all others; found [count] the number of faces on each surface; left [count] the number of faces nearer to it than
 * half of their longest edge that are still not on it. FLESH_ERR_INTERRUPTED. */
int flesh_mesh_find_curved_faces(const flesh_mesh *mesh, int count, const flesh_nearest_surface *surfaces, int *on,
                                 int *found, int *left);

/* Fills `finer` [4*tets of refined], which marks the parts of the faces `on` [4*tets] in `refined`, the result of
 * flesh_mesh_refine for `mesh`. */
void flesh_mesh_refine_curved_faces(const flesh_mesh *mesh, const int *on, const flesh_mesh *refined, int *finer);

/* Makes the mesh with the faces `on` [4*tets] of flesh_mesh_find_curved_faces on their surfaces: moves the corners and
 * the nodes on their edges to the nearest points, those of several surfaces to where these meet, and those on the edge
 * of another boundary face within its plane; nodes on other edges move along with the edges' ends. Returns new. Fails
 * as flesh_mesh_create_quadratic does if the Jacobian of a tet is then not positive all over it; FLESH_ERR_MEMORY. */
int flesh_mesh_curve(const flesh_mesh *mesh, const flesh_nearest_surface *surfaces, const int *on, flesh_mesh **curved);

#endif
