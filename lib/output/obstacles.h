/* obstacles.h: the obstacles of a run as surfaces, for pictures. */
#ifndef FLESH_OUTPUT_OBSTACLES_H
#define FLESH_OUTPUT_OBSTACLES_H

#include "flesh/observer.h"

/* obstacle_<k>.obj in the directory for the k-th obstacle, from 1: those that stand still with the
 * first step's record; those that move with every one, as obstacle_<k>_<step>.obj. `box`: flesh_body_rest_box, around which
 * planes are drawn. */
int flesh_obstacles_write(const char *directory, const flesh_step_record *record, const double box[6]);

#endif
