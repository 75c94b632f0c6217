/* balance.h: how small a residual must be where a solve ends. */
#ifndef FLESH_NEWTON_BALANCE_H
#define FLESH_NEWTON_BALANCE_H

#include "newton/equations.h"

typedef struct flesh_balance {
  flesh_equations *equations; /* borrowed */
  double edge_force;          /* of the softest (system/edge_force.h), N; NaN: not known yet */
} flesh_balance;

/* Called where the residual at u, of norm `norm`, meets the target that was set at the first iterate, whose residual has
 * the norm `first` and whose load the norm `load`. Lowers *target where that is too much by what solver.h says of
 * newton_tolerance, in place of which stands `tolerance`, and leaves it else. Asks the effects only as far as needed.
 * Overwrites the equations' scratch. */
int flesh_balance_sharpen(flesh_balance *balance, double tolerance, const double *u, double norm, double first,
                          double load, double *target);

#endif
