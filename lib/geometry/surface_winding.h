/* surface_winding.h: how often a body's surface goes around a place, without rounding. */
#ifndef FLESH_GEOMETRY_SURFACE_WINDING_H
#define FLESH_GEOMETRY_SURFACE_WINDING_H

#include "geometry/contact_surface.h"

/* The winding number of the faces of `body` (face_body [face_count] has each face's) around a place just outside the
 * middle of face `from`, which does not count itself: 0 outside the body, 1 in it, more where it overlaps itself. By
 * the faces that a ray leaves or enters through, with exact signs; rays that meet an edge are replaced by others. 0 where
 * the face has no area or a place is not finite. */
int flesh_surface_winding(const flesh_contact_surface *surface, const int *face_body, int body, int from,
                          const double *x);

#endif
