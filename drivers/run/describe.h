/* describe.h: what is told of a scene before it runs. */
#ifndef FLESH_RUN_DESCRIBE_H
#define FLESH_RUN_DESCRIBE_H

#include <stdio.h>

#include "flesh/scene.h"

/* Says in one line, where a body of four-node tets has a Poisson's ratio of 0.47 or more, by how much it bends too little
 * and what to set; nothing for other bodies. */
void flesh_warn_of_locking(const flesh_scene *scene, FILE *stream);

/* Says whether several bodies touch or pass through each other; which surfaces begin crossed and are let apart, and
 * where; and which are too near at rest and therefore left out of contact. */
void flesh_describe_touching(const flesh_scene *scene, FILE *stream);

/* The name of an effect (of role load, such as a spring) that acts on the nodes of one tet alone, whatever the time and
 * the state; NULL: there is none. In the limit of fine meshes such a load digs a hole, so that nothing converges. */
const char *flesh_point_load(const flesh_scene *scene);

/* In how many steps of backward Euler before a time, which evaluate their ends alone, what acts has several events, such as
 * the begin and the end of a load, that no step ends at; *first [s]: the first of these. */
int flesh_steps_over(const flesh_scene *scene, double until, double *first);

#endif
