/* effect.h: what the built-in effects share in being made. */
#ifndef FLESH_EFFECT_EFFECT_H
#define FLESH_EFFECT_EFFECT_H

#include "flesh/effects.h"

/* The share of a feasible step that is taken: less than all, so that the body stays apart from obstacles. */
static const double flesh_feasible_step_kept = 0.9;

/* Parts of an interval [from, until) as the next event after t. */
double flesh_interval_next_event(double from, double until, double t);

#endif
