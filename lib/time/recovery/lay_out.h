/* lay_out.h: parts of a body that have shrunk to a point, from where no force shows a way out, are laid out at rest. */
#ifndef FLESH_TIME_RECOVERY_LAY_OUT_H
#define FLESH_TIME_RECOVERY_LAY_OUT_H

#include <stdint.h>

#include "flesh/system.h"
#include "time/rigid_guess.h"

/* Lays out at rest, around where they are in x [n], all parts that are a point there; dofs in `fixed` [n] stay. Obstacles
 * push a part out as a whole, back to where x_from [n] can get to at time t. Returns whether there are such parts. `work` [n]
 * is room. Collective. */
int flesh_lay_out(const flesh_system *system, const flesh_rigid_parts *parts, const uint8_t *fixed, double t,
                  const double *x_from, double *work, double *x);

#endif
