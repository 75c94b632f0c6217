/* point_load.h: whether something of a scene pulls at single nodes. */
#ifndef FLESH_RUN_POINT_LOAD_H
#define FLESH_RUN_POINT_LOAD_H

#include "flesh/scene.h"

/* The name of an effect (of role load, such as a spring) that acts on the nodes of one tet alone, whatever the time and
 * the state; NULL: there is none. In the limit of fine meshes such a load digs a hole, so that nothing converges. */
const char *flesh_point_load(const flesh_scene *scene);

#endif
