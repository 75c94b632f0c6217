/* curve.h: puts the boundary of a mesh of order 2 on a surface that it stands for. */
#ifndef FLESH_MESH_CURVE_H
#define FLESH_MESH_CURVE_H

#include "flesh/mesh.h"

/* A surface: where it is nearest to p, and its unit normal there, of either sign. */
typedef struct flesh_nearest_surface {
  const void *data;
  void (*nearest)(const void *data, const double p[3], double at[3], double normal[3]);
} flesh_nearest_surface;

/* The mesh, of order 2, whose boundary faces near the surface lie on it: those of which all corners are nearer to it
 * than a tenth of the longest edge, and which are turned from it by less than 60 degrees. Their corners and the nodes on
 * their edges are moved to the nearest points; nodes on other edges go along with the edges' ends. *faces is how many.
 * Fails as flesh_mesh_create_quadratic does where the Jacobian of a tet is then not positive all over it. */
int flesh_mesh_curve(const flesh_mesh *mesh, const flesh_nearest_surface *surface, flesh_mesh **curved, int *faces);

#endif
