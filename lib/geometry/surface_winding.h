/* surface_winding.h: how often a body's surface winds around a point, without rounding errors. */
#ifndef FLESH_GEOMETRY_SURFACE_WINDING_H
#define FLESH_GEOMETRY_SURFACE_WINDING_H

#include "geometry/contact_surface.h"

/* Returns the winding number of the faces of `body` (face_body [face_count]: each face's body) around a point just
 * outside the middle of face `from`, which itself is not counted: 0 outside the body, 1 inside it, more if it overlaps
 * itself. It is the sum of the faces through which a ray leaves minus those through which it enters, with exact signs;
 * rays that meet an edge are replaced by others. 0 if the face has no area or a position is not finite. */
int flesh_surface_winding(const flesh_contact_surface *surface, const int *face_body, int body, int from,
                          const double *x);

#endif
