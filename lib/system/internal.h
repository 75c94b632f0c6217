/* internal.h: the internal variables of a system's effects, which stand one after the other. */
#ifndef FLESH_SYSTEM_INTERNAL_H
#define FLESH_SYSTEM_INTERNAL_H

#include "system/parts.h"

/* Tells the effects that take bonds of those of the others, and says where the internal variables of each are: those of
 * effects that take bonds come last. Before the system is finished; the same again where it is called again.
 * FLESH_ERR_MEMORY. */
int flesh_system_settle_internals(flesh_system *system);

/* The energies of the effects that have internal variables, into their places of energies [effect_count], J, and the
 * sum of these. */
int flesh_system_internal_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum);

#endif
