/* touching.h: what `flesh run` says of bodies that touch, before it runs a scene. */
#ifndef FLESH_RUN_TOUCHING_H
#define FLESH_RUN_TOUCHING_H

#include <stdio.h>

#include "flesh/scene.h"

/* Says whether several bodies touch or pass through each other; which surfaces begin crossed and are let apart, and
 * where; and which are too near at rest and therefore left out of contact. */
void flesh_describe_touching(const flesh_scene *scene, FILE *stream);

#endif
