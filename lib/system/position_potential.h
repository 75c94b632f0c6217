/* position_potential.h: a system's potential where part of it is known from before. */
#ifndef FLESH_SYSTEM_POSITION_POTENTIAL_H
#define FLESH_SYSTEM_POSITION_POTENTIAL_H

#include "flesh/system.h"

/* The sum over the effects whose potentials are of positions alone (FLESH_DEPENDS_ON_POSITION_ONLY),
 * and of the sizes of their terms. */
typedef struct flesh_position_potential {
  int known, far; /* far: effects with a memory of what is near (proximity.h) have none */
  double phi, magnitude;
} flesh_position_potential;

/* flesh_system_potential where `by_position`, if known, is that at the same positions and shift.x: its effects are not
 * asked again. Known afterwards. */
int flesh_system_potential_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                  flesh_position_potential *by_position, double *phi, double *magnitude);
/* flesh_system_energies, where `by_position` is known without the energy of the one effect that it is of. */
int flesh_system_energies_by_position(const flesh_system *system, const flesh_point *point,
                                 const flesh_position_potential *by_position, double *energies);
/* Residual and potential together, in one pass where an effect can: the same bits as by flesh_system_residual and
 * flesh_system_potential. Finds `by_position`. FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
int flesh_system_evaluate_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                 flesh_position_potential *by_position, double *r, double *phi, double *magnitude);

#endif
