/* joint.h: two groups of nodes that turn about a point or an axis. */
#ifndef FLESH_EFFECT_JOINT_H
#define FLESH_EFFECT_JOINT_H

#include "flesh/effects.h"

/* What most nodes of the two groups together may be: each is coupled with every other. */
enum { FLESH_JOINT_NODES = 2000 };

/* Holds together what nodes first [first_count] and second [second_count] have at `point` [3], m, at rest: V =
 * stiffness/2 |p_1 - p_2|^2, p_k = sum of w_a x_a with weights by which affine motions of the group carry p_k along
 * exactly. NULL for `axis` [3]: a ball joint. Otherwise a hinge: half of the stiffness, N/m, at either of point -
 * axis/2 and point + axis/2. Momentum and angular momentum are kept. FLESH_ERR_ARGUMENT for numbers that make no
 * sense, and where a group does not span space and the point is not in what it spans; FLESH_ERR_MEMORY. Returns new. */
int flesh_effect_joint(const flesh_body *body, int first_count, const int *first, int second_count, const int *second,
                       const double point[3], const double axis[3], double stiffness, flesh_effect **effect);

#endif
