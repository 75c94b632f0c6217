/* softened.h: a second system, of materials that resist changes of volume less. Mesh, constraints, pattern and all effects
 * but elasticity are those of the first. */
#ifndef FLESH_SYSTEM_SOFTENED_H
#define FLESH_SYSTEM_SOFTENED_H

#include "flesh/system.h"

/* lambda/mu of the system's stiffest material, on any rank; 0: there is none. Collective. */
double flesh_system_stiffness_ratio(const flesh_system *system);

/* Returns new, in *softened, what the finished system is with materials S of the same shear modulus and a lambda/mu of no
 * more than `ratio`. Borrows what it shares, but asks nothing of it when it is destroyed, by flesh_softened_destroy.
 * FLESH_ERR_MEMORY. */
int flesh_system_soften(const flesh_system *system, double ratio, flesh_system **softened);
void flesh_softened_destroy(flesh_system **softened);

#endif
