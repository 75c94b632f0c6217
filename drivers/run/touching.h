/* touching.h: what `flesh run` says of bodies that touch, before it runs a scene. */
#ifndef FLESH_RUN_TOUCHING_H
#define FLESH_RUN_TOUCHING_H

#include <stdio.h>

#include "flesh/scene.h"

/* Of several bodies, whether they touch or pass through each other; what goes through what at the start and is let apart,
 * and where; what is left out of contact although it could touch, as it is too near at rest. */
void flesh_describe_touching(const flesh_scene *scene, FILE *stream);

#endif
