/* rest_box.h: the box around a body at rest, of which a rank may have a part alone. */
#ifndef FLESH_OUTPUT_REST_BOX_H
#define FLESH_OUTPUT_REST_BOX_H

#include "base/team.h"
#include "flesh/mesh.h"

/* Its low corner, then its high one, m; `team`: of the parts, every rank of which calls it; NULL: the mesh is the
 * whole. */
void flesh_rest_box(const flesh_mesh *mesh, const flesh_team *team, double box[6]);

#endif
