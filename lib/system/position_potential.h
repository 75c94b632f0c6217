/* position_potential.h: a system's potential, part of which is already known. */
#ifndef FLESH_SYSTEM_POSITION_POTENTIAL_H
#define FLESH_SYSTEM_POSITION_POTENTIAL_H

#include "flesh/system.h"

/* Sum of the potentials of the effects that depend on positions alone (FLESH_DEPENDS_ON_POSITION_ONLY), and of the sizes of
 * their terms. */
typedef struct flesh_position_potential {
  int known, far; /* far: effects that cache near pairs (proximity.h) have none */
  double phi, magnitude;
} flesh_position_potential;

/* Does what flesh_system_potential does, without evaluating the effects of `by_position` again if that is known, for the
 * same positions and shift.x. It is known afterwards. */
int flesh_system_potential_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                  flesh_position_potential *by_position, double *phi, double *magnitude);
/* Does what flesh_system_energies does; a known `by_position` of a single effect saves the evaluation of its energy. */
int flesh_system_energies_by_position(const flesh_system *system, const flesh_point *point,
                                 const flesh_position_potential *by_position, double *energies);
/* Computes residual and potential together, in one pass where an effect can, with the same bits as flesh_system_residual
 * and flesh_system_potential. Finds `by_position`. FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
int flesh_system_evaluate_by_position(const flesh_system *system, const flesh_point *point, const flesh_shift *shift,
                                 flesh_position_potential *by_position, double *r, double *phi, double *magnitude);

#endif
