/* near_left_out.h: pairs that a finder excludes for their distance at rest although they could touch. */
#ifndef FLESH_GEOMETRY_NEAR_LEFT_OUT_H
#define FLESH_GEOMETRY_NEAR_LEFT_OUT_H

#include "geometry/near_finder.h"

/* Nodes that face a face across a gap at rest, far from it along the surface, but so near to it that the two are
 * excluded from contact. */
typedef struct flesh_left_out {
  int nodes;      /* number of such nodes */
  int node, face; /* nearest of these pairs: a node of the mesh and a face of the surface */
  double gap;     /* m, their distance at rest */
} flesh_left_out;

/* Finds them for a finder made for X [3*mesh_nodes] and this rest_distance [m]. "Far along the surface" means more than
 * twice the sum of that distance and the longest adjacent edge. FLESH_ERR_MEMORY. */
int flesh_near_finder_left_out(const flesh_near_finder *finder, const double *X, double rest_distance,
                               flesh_left_out *found);

#endif
