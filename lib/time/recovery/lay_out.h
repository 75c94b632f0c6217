/* lay_out.h: lays out at rest the parts of a body that have shrunk to a point, where no force shows a way out. */
#ifndef FLESH_TIME_RECOVERY_LAY_OUT_H
#define FLESH_TIME_RECOVERY_LAY_OUT_H

#include <stdint.h>

#include "flesh/system.h"
#include "time/rigid_guess.h"

/* Lays out at rest all parts that are a point in x [n], around where they are; dofs in `fixed` [n] stay. Obstacles push
 * a part out as a whole, to where x_from [n] can get at time t. Returns whether there are such parts. `work` [n] is
 * room. Collective. */
int flesh_lay_out(const flesh_system *system, const flesh_rigid_parts *parts, const uint8_t *fixed, double t,
                  const double *x_from, double *work, double *x);

#endif
