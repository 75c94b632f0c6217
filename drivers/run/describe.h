/* describe.h: what is printed about a scene before it runs. */
#ifndef FLESH_RUN_DESCRIBE_H
#define FLESH_RUN_DESCRIBE_H

#include <stdio.h>

#include "flesh/scene.h"

/* Warns in one line if a body of four-node tets has a Poisson's ratio of 0.47 or more: by how much it bends too little,
 * and what to set. Prints nothing for other bodies. */
void flesh_warn_of_locking(const flesh_scene *scene, FILE *stream);

/* Prints whether several bodies touch or pass through each other; which surfaces intersect at the start, where, and
 * that they are let apart; and which are too near each other at rest and therefore excluded from contact. */
void flesh_describe_touching(const flesh_scene *scene, FILE *stream);

/* Returns the name of an effect (of role load, such as a spring) that acts only on the nodes of one tet, at all times
 * and in every state; NULL if there is none. In the limit of fine meshes such a load digs a hole, so that nothing
 * converges. */
const char *flesh_point_load(const flesh_scene *scene);

/* Counts the steps before the time `until` [s] in which loads or motions have several events, such as a load's begin
 * and end, that are not at the end of a step; *first [s] is the first such event. Returns 0 except for backward Euler
 * with fixed steps, which evaluates loads only at the end of a step. */
int flesh_steps_over(const flesh_scene *scene, double until, double *first);

#endif
