/* near_left_out.h: what a finder leaves out for its distance at rest although it could touch. */
#ifndef FLESH_GEOMETRY_NEAR_LEFT_OUT_H
#define FLESH_GEOMETRY_NEAR_LEFT_OUT_H

#include "geometry/near_finder.h"

/* Nodes that face a face across a gap at rest, far from it along the surface, and are so near to it that the two never
 * touch. */
typedef struct flesh_left_out {
  int nodes;      /* how many */
  int node, face; /* those nearest to each other: a node of the mesh, a face of the surface */
  double gap;     /* m, between these at rest */
} flesh_left_out;

/* For a finder made for X [3*mesh_nodes] and that rest_distance [m]. Far along the surface is more than twice that
 * distance and the edges around. FLESH_ERR_MEMORY. */
int flesh_near_finder_left_out(const flesh_near_finder *finder, const double *X, double rest_distance,
                               flesh_left_out *found);

#endif
