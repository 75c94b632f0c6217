/* internal.h: the internal variables of a system's effects, stored effect by effect. */
#ifndef FLESH_SYSTEM_INTERNAL_H
#define FLESH_SYSTEM_INTERNAL_H

#include "system/parts.h"

/* Tells effects that take bonds about the bonds of the other effects, and assigns places to all internal variables: those
 * of effects that take bonds come last. Call it before the system is finalized; repeated calls give the same.
 * FLESH_ERR_MEMORY. */
int flesh_system_settle_internals(flesh_system *system);

/* Computes the energies of the effects that have internal variables, in their places of energies [effect_count], J, and
 * their sum. */
int flesh_system_internal_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum);

#endif
