/* derivative_check.h: the shifts that flesh_effect_check_derivatives (flesh/derivative_check.h) tries, for its reports. */
#ifndef FLESH_SYSTEM_DERIVATIVE_CHECK_H
#define FLESH_SYSTEM_DERIVATIVE_CHECK_H

#include "flesh/derivative_check.h"

extern const flesh_shift flesh_check_shifts[FLESH_CHECK_SHIFTS];

/* Does what flesh_effect_check_derivatives does; *zero: whether the effect has a residual that was 0 wherever it was
 * evaluated, so that errors of 0 prove nothing. */
int flesh_effect_check_derivatives_or_zero(const flesh_effect *effect, const flesh_mesh *mesh, double t,
                                           const double *x, unsigned long long seed,
                                           flesh_derivative_report *report, int *zero);

#endif
