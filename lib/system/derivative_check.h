/* derivative_check.h: the shifts that flesh_effect_check_derivatives (flesh/derivative_check.h) tries, for those who report on
 * them. */
#ifndef FLESH_SYSTEM_DERIVATIVE_CHECK_H
#define FLESH_SYSTEM_DERIVATIVE_CHECK_H

#include "flesh/derivative_check.h"

extern const flesh_shift flesh_check_shifts[FLESH_CHECK_SHIFTS];

#endif
