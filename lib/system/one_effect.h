/* one_effect.h: some of a system's effects alone: one, or those of a role. */
#ifndef FLESH_SYSTEM_ONE_EFFECT_H
#define FLESH_SYSTEM_ONE_EFFECT_H

#include "flesh/system.h"

/* Computes r [3*n], the residual of effect `index` alone, 0 if it has none; counted like any other call. */
int flesh_system_effect_residual(const flesh_system *system, int index, const flesh_point *point, double *r);

/* Sets of roles. */
#define FLESH_ROLE_BIT(role) (1u << (role))
#define FLESH_ROLES_ALL (~0u)

/* Computes r [3*n], the sum of the residuals of the effects whose roles are in the set; 0 if there are none. */
int flesh_system_roles_residual(const flesh_system *system, unsigned roles, const flesh_point *point, double *r);
/* Does what flesh_system_roles_residual does, at all nodes of the rank: ghosts have the values of their owners. */
int flesh_system_forces(const flesh_system *system, unsigned roles, const flesh_point *point, double *r);

/* Computes the energies, J, of the effects for which is_one(effect, of) is 1, in their places of energies [effect_count]
 * (may be NULL), and their sum. Effects without an energy have 0. */
int flesh_system_some_energies(const flesh_system *system, int (*is_one)(const flesh_effect *effect, int of), int of,
                               const flesh_point *point, double *energies, double *sum);
/* Computes the kinetic energies, those of the effects with the role INERTIA, and their sum, in the same way. */
int flesh_system_kinetic_energies(const flesh_system *system, const flesh_point *point, double *energies, double *sum);
/* Returns u.f over the body, for a consistent u [3*n] and an f [3*n] that is collected or partial (base/team.h). */
double flesh_system_product(const flesh_system *system, const double *u, const double *f);

/* Returns the sum of energies [effect_count] over the effects of a role, J. */
double flesh_system_role_energy(const flesh_system *system, flesh_role role, const double *energies);

#endif
