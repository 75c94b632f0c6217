/* surface_intersections.h: where bodies' surfaces go through each other or themselves, found without rounding. */
#ifndef FLESH_GEOMETRY_SURFACE_INTERSECTIONS_H
#define FLESH_GEOMETRY_SURFACE_INTERSECTIONS_H

#include "flesh/threads.h"
#include "geometry/near_pairs.h"

/* An edge and a face that have a point in common. */
typedef struct flesh_surface_intersection {
  int edge, face;
  int edge_faces[2];         /* of the edge, -1: none */
  int edge_body, face_body;
  double place[3];           /* m, in the edge, to rounding */
} flesh_surface_intersection;

typedef struct flesh_surface_intersections {
  int count;                         /* ascending by edge, then by face */
  flesh_surface_intersection *items; /* [count] */
  int *pairs, room, item_room;       /* of its own */
} flesh_surface_intersections;

/* All edges and faces without a common node, of bodies that may meet, that have a point in common at x [3*mesh_nodes],
 * those near at rest too, but for what is held together. Exact: signs are those of the coordinates as they are;
 * touching counts. Two triangles without a common node intersect only where an edge of one meets the other; two with
 * one common node, but for such that touch in a plane, likewise. A body that lies in another's inside meets nothing.
 * `found` begins as {0} and keeps its memory. The same for any number of threads. FLESH_UNDEFINED, with none found,
 * where a place is not finite; FLESH_ERR_MEMORY. */
int flesh_surface_intersections_find(flesh_near_finder *finder, const double *x, flesh_threads *threads,
                                     flesh_surface_intersections *found);
void flesh_surface_intersections_clear(flesh_surface_intersections *found);

#endif
