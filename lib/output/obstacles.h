/* obstacles.h: the obstacles of a run as surfaces, for pictures. */
#ifndef FLESH_OUTPUT_OBSTACLES_H
#define FLESH_OUTPUT_OBSTACLES_H

#include "flesh/observer.h"

/* Writes the k-th obstacle, from 1, into the directory: a still one as obstacle_<k>.obj with the first step's record, a
 * moving one as obstacle_<k>_<step>.obj with every record. `box`: flesh_body_rest_box, around which planes are drawn.
 * FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_obstacles_write(const char *directory, const flesh_step_record *record, const double box[6]);

#endif
