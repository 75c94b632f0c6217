/* system.h: the sum of a scene's effects, its constraints, and the pattern of its Jacobian.
 *
 * A system is built by create, add..., finalize, and is const from then on, so that several runs and threads can share
 * it. All nodes are unknowns, in the mesh's numbering; the solvers treat constrained ones as identity rows. Functions
 * that return no status cannot fail. */
#ifndef FLESH_SYSTEM_H
#define FLESH_SYSTEM_H

#include <stdint.h>

#include "flesh/effects.h"
#include "flesh/ranks.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_system flesh_system;

enum { FLESH_AXIS_X = 1, FLESH_AXIS_Y = 2, FLESH_AXIS_Z = 4, FLESH_AXES_ALL = 7 };

/* Makes an empty system on `mesh`, which it borrows. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_create(const flesh_mesh *mesh, flesh_system **system);
/* Destroys the system and its effects, and sets *system to NULL. NULL-safe. */
FLESH_API void flesh_system_destroy(flesh_system **system);

/* Takes ownership of *effect and sets it to NULL, also when it fails: FLESH_ERR_ARGUMENT when the system is
 * finalized, or the effect was made for a mesh with another count of nodes or tets. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_effect(flesh_system *system, flesh_effect **effect);

/* Constrains `axes` of `nodes` [count] to their rest positions while from <= t < until. Where several pins and
 * prescribed motions hold a component at the same time, the one added last counts. Copies its arguments.
 * FLESH_ERR_ARGUMENT for no node, no axis, a node out of range, or an end that is not after the begin. */
FLESH_API int flesh_system_add_pin(flesh_system *system, int count, const int *nodes, unsigned axes,
                                   double from, double until);

/* Constrains `axes` of `nodes` [count] to x(t) = centre + R(t)(X - centre) + translation(t) while from <= t < until.
 * Copies its arguments. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_prescribed_motion(flesh_system *system, int count, const int *nodes,
                                      unsigned axes, const flesh_motion *motion, double from,
                                      double until);

/* Declares that the mesh is that of a part of a body (flesh/ranks.h; borrowed). Residuals, potentials and energies
 * are then those of the body, each residual with the owners of its nodes and 0 at ghosts; calls are collective, this
 * one included. Jacobians are those of the part's tets. A rank without a node to be constrained passes a count of 0
 * or leaves the call out. FLESH_ERR_ARGUMENT if the part has another mesh. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_set_part(flesh_system *system, const flesh_rank_part *rank_part);

/* Builds the pattern; nothing can be added afterwards. Collective where the system has a part of a body. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_finalize(flesh_system *system);

/* Returns the mesh that flesh_system_create was given, borrowed. */
FLESH_API const flesh_mesh *flesh_system_mesh(const flesh_system *system);
/* Returns the number of unknowns, 3 * nodes, and the number of effects. Cannot fail. */
FLESH_API int flesh_system_unknowns(const flesh_system *system);
FLESH_API int flesh_system_effect_count(const flesh_system *system);
FLESH_API const flesh_effect *flesh_system_effect(const flesh_system *system, int index);
/* Returns the instruction set of the effects that are computed tet by tet (the lowest where they differ), or the
 * best of this machine where there are no such effects; linear solvers use the same. Never AUTO. */
FLESH_API flesh_instructions flesh_system_instructions(const flesh_system *system);
/* Returns whether an effect of that role is present. Cannot fail. */
FLESH_API int flesh_system_has_role(const flesh_system *system, flesh_role role);
/* Returns whether prescribed positions or effects change with time: then a scene without inertia is a sequence of
 * equilibria instead of one. Cannot fail. */
FLESH_API int flesh_system_moves(const flesh_system *system);
/* Returns the number of multipliers, which enforce constraints of the effects (flesh_point.multipliers): one for
 * each tet of the mesh if the body has incompressible tets, else 0. Cannot fail. */
FLESH_API int flesh_system_multiplier_count(const flesh_system *system);
/* Returns the number of internal variables of all effects together (flesh_effect_internal). Cannot fail. */
FLESH_API int flesh_system_internal_count(const flesh_system *system);
/* Updates the internal variables [internal_count] at the end of a step, `point`; point->internal has their values
 * during the step (NULL: 0). Sets *changed to 1 if that changes forces or energies, else 0. FLESH_ERR_NONFINITE
 * where they have no value there. Further errors: FLESH_ERR_ARGUMENT, the status of an effect. */
FLESH_API int flesh_system_update_internal(const flesh_system *system, const flesh_point *point,
                                           double *internal, int *changed);
/* Returns the first time after t at which a constraint or effect stops being smooth; INFINITY if none. */
FLESH_API double flesh_system_next_event(const flesh_system *system, double t);

/* Computes r [3*n], the sum of the residuals, without constraints. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_residual(const flesh_system *system, const flesh_point *point,
                                    double *r);
/* Computes the residual r [3*n] of the effects of FLESH_ROLE_LOAD alone, which is minus the applied load. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_load(const flesh_system *system, const flesh_point *point, double *r);
/* Computes K, the sum of the Jacobians, without constraints. K must have this system's pattern. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_jacobian(const flesh_system *system, const flesh_point *point,
                                    const flesh_shift *shift, flesh_block_matrix *K);
/* Computes phi, the sum of the potentials, J, and *magnitude, the sum of the absolute values of their terms. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_potential(const flesh_system *system, const flesh_point *point,
                                     const flesh_shift *shift, double *phi, double *magnitude);
/* Computes the physical energy of every effect [effect_count], J. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_energies(const flesh_system *system, const flesh_point *point,
                                    double *energies);

/* Checks that the body at x [3*n] is outside all obstacles, and that surfaces in contact
 * (flesh_effect_surface_contact) do not intersect. FLESH_ERR_ARGUMENT, with the place, where that is not so. */
FLESH_API int flesh_system_check(const flesh_system *system, double t, const double *x);

/* Makes a zero matrix of the system's pattern, which it shares (the system must outlive it).
 * Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_matrix_create(const flesh_system *system, flesh_block_matrix **matrix);
FLESH_API void flesh_block_matrix_destroy(flesh_block_matrix **matrix);

/* Sets fixed[d] [3*n] to 1 for the dofs constrained at time t (and those of nodes that no tet uses), else to 0.
 * Returns the number of ones. Cannot fail. */
FLESH_API int flesh_system_fixed(const flesh_system *system, double t, uint8_t *fixed);
/* Writes the prescribed positions at time t into the constrained components of x [3*n]. */
FLESH_API void flesh_system_prescribe(const flesh_system *system, double t, double *x);
/* Writes the prescribed velocities and accelerations into the constrained components of v and a [3*n] (analytic; at
 * a keyframe those that follow it). */
FLESH_API void flesh_system_prescribe_velocity(const flesh_system *system, double t, double *v,
                                               double *a);

#ifdef __cplusplus
}
#endif
#endif
