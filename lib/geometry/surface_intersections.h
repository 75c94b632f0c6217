/* surface_intersections.h: finds where bodies' surfaces intersect each other or themselves, without rounding errors. */
#ifndef FLESH_GEOMETRY_SURFACE_INTERSECTIONS_H
#define FLESH_GEOMETRY_SURFACE_INTERSECTIONS_H

#include "flesh/threads.h"
#include "geometry/near_pairs.h"

/* An edge and a face that have a point in common. */
typedef struct flesh_surface_intersection {
  int edge, face;
  int edge_faces[2];         /* faces of the edge; -1: none */
  int edge_body, face_body;
  double place[3];           /* m, a point on the edge, up to rounding */
} flesh_surface_intersection;

typedef struct flesh_surface_intersections {
  int count;                         /* number of items, ascending by edge, then by face */
  flesh_surface_intersection *items; /* [count] */
  int *pairs, room, item_room;       /* private */
} flesh_surface_intersections;

/* Finds all pairs of an edge and a face without a common node, of bodies that may touch, that have a point in common at
 * x [3*mesh_nodes]. Pairs near at rest are included, pairs held together are not. Exact for the stored coordinates;
 * touching counts. Two triangles without a common node intersect only if an edge of one meets the other; so do two with
 * one common node, unless they touch within a plane. A body entirely inside another intersects nothing. `found` is
 * initialised with {0} and keeps its memory. The same for any number of threads. FLESH_UNDEFINED, with none found, if a
 * position is not finite; FLESH_ERR_MEMORY. */
int flesh_surface_intersections_find(flesh_near_finder *finder, const double *x, flesh_threads *threads,
                                     flesh_surface_intersections *found);
void flesh_surface_intersections_clear(flesh_surface_intersections *found);

#endif
