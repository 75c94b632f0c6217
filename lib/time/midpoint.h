/* midpoint.h: the step of the implicit midpoint rule, also the first step of methods that need an earlier one. */
#ifndef FLESH_TIME_MIDPOINT_H
#define FLESH_TIME_MIDPOINT_H

#include "time/method.h"

void flesh_midpoint_stage(const flesh_method_memory *memory, const flesh_state *state, double t_end,
                          double h, flesh_stage *stage);
void flesh_midpoint_velocity(const flesh_method_memory *memory, const flesh_state *state, const double *u, double h,
                             double *v);

#endif
