/* system.h: functions of a system for the library alone. */
#ifndef FLESH_SYSTEM_SYSTEM_H
#define FLESH_SYSTEM_SYSTEM_H

#include "flesh/system.h"

/* Number of evaluations of an effect, and their CPU time. A call of `evaluate` counts as one residual and one potential, so
 * that counts do not depend on which effects have it. */
typedef struct flesh_effect_cost {
  long residuals, jacobians, potentials, energies; /* calls */
  double cpu_s;                                    /* CPU time of the process, if timed */
} flesh_effect_cost;

/* Costs of evaluations. Owned by whoever evaluates a system (an integrator), not by the effects, which are const. */
typedef struct flesh_costs {
  int timed;                  /* 1: clocks are read around every call */
  flesh_effect_cost *effects; /* costs of the system's effects, in their order */
} flesh_costs;

/* Computes how far the constraints that multipliers enforce are from being met at point->x: gaps [multipliers], for
 * incompressible tets the mean of J minus 1; and, unless NULL, stiffness [multipliers], Pa, the second derivative of the
 * penalty by the gap at point->penalty = 1. The method of multipliers adds gap * stiffness * point->penalty to each
 * multiplier. Errors: FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
int flesh_system_constraint_gaps(const flesh_system *system, const flesh_point *point, double *gaps, double *stiffness);

/* Whether some effect freezes a state (FLESH_FREEZES). Cannot fail. */
int flesh_system_freezes(const flesh_system *system);

/* Whether some effect's lagged state follows the shape (FLESH_IS_FOLLOWER_LOAD).
 * Cannot fail. */
int flesh_system_has_follower_loads(const flesh_system *system);

/* Returns the axes, bits 1, 2 and 4, along which any constraint acts at time t. Cannot fail. */
int flesh_system_holds(const flesh_system *system, double t);

/* Whether another system, on a mesh with the same tets, constrains the same dofs to the same places at all times. */
int flesh_system_prescribes_alike(const flesh_system *system, const flesh_system *other);

/* Returns the bytes that an effect holds (flesh_effect_figures.memory) with its places in the Jacobian; 0 where it does not
 * report them. */
size_t flesh_system_effect_memory(const flesh_system *system, int index);

#endif
