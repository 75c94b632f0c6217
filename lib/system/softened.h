/* softened.h: a second system, whose materials resist changes of volume less. Mesh, constraints, pattern and all effects
 * but elasticity are those of the first. */
#ifndef FLESH_SYSTEM_SOFTENED_H
#define FLESH_SYSTEM_SOFTENED_H

#include "flesh/system.h"

/* Returns lambda/mu of the system's stiffest material, on any rank; 0: there is none. Collective. */
double flesh_system_stiffness_ratio(const flesh_system *system);

/* Makes a copy of the finalized system with materials S of the same shear modulus and a lambda/mu of at most `ratio`.
 * Returns new; free it by flesh_softened_destroy. It borrows what it shares with `system`, but does not use it when
 * destroyed. FLESH_ERR_MEMORY. */
int flesh_system_soften(const flesh_system *system, double ratio, flesh_system **softened);
void flesh_softened_destroy(flesh_system **softened);

#endif
