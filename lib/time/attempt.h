/* attempt.h: one try of a part of a step in time. */
#ifndef FLESH_TIME_ATTEMPT_H
#define FLESH_TIME_ATTEMPT_H

#include <math.h>

#include "time/integrator.h"

/* The last moment before the event. */
static inline double flesh_before(double t, double event) { return t < event ? t : nextafter(event, -INFINITY); }

/* Tries the part cutbacks->part of a piece by `row`, the method's own or backward Euler in its stead, and takes the state
 * to its end. A status > 0 has changed nothing; `blocked` and the control's refusal then say why. */
int flesh_integrator_attempt(flesh_integrator *integrator, const flesh_method_row *row, flesh_state *state,
                             const flesh_piece *piece, const flesh_cutbacks *cutbacks, flesh_solve_stats *stats);

#endif
