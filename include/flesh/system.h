/* system.h: the sum of a scene's effects, its constraints, and the pattern of its Jacobian.
 *
 * A system is built by create, add..., finalize, and const from then on, so that several runs and threads can share
 * it. All nodes are unknowns in the mesh's numbering; the solvers treat constrained dofs as identity rows. Functions
 * that evaluate effects also return an effect's fatal status, such as FLESH_ERR_MEMORY of contact between bodies.
 * Functions that return no status cannot fail. */
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

/* Creates a system on `mesh`, which is borrowed. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_create(const flesh_mesh *mesh, flesh_system **system);
/* Destroys a system and its effects. NULL-safe; sets *system to NULL. */
FLESH_API void flesh_system_destroy(flesh_system **system);

/* Adds *effect and takes ownership of it (sets it to NULL), also when it fails: FLESH_ERR_ARGUMENT when the system is
 * finished, or the effect was made for a mesh with another count of nodes or tets. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_effect(flesh_system *system, flesh_effect **effect);

/* Constrains `axes` of `nodes` [count] to their rest positions while from <= t < until. If several pins and prescribed
 * motions constrain a component at the same time, the one added last counts. Copies its arguments. FLESH_ERR_ARGUMENT
 * for no node, no axis, a node out of range, or an `until` that is not after `from`. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_pin(flesh_system *system, int count, const int *nodes, unsigned axes,
                                   double from, double until);

/* Constrains `axes` of `nodes` [count] to x(t) = centre + R(t)(X - centre) + translation(t) while from <= t < until.
 * Copies its arguments. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_prescribed_motion(flesh_system *system, int count, const int *nodes,
                                      unsigned axes, const flesh_motion *motion, double from,
                                      double until);

/* Declares the mesh to be that of a part of a body (flesh/ranks.h; borrowed): residuals, potentials and energies are
 * then those of the body, each residual on the owners of its nodes and 0 at ghosts, and calls are collective, as is
 * this one. Jacobians are those of the part's tets. A rank without any of the nodes to be constrained constrains none
 * (a count of 0), or omits the call. FLESH_ERR_ARGUMENT if the system has another mesh. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_set_part(flesh_system *system, const flesh_rank_part *rank_part);

/* Builds the pattern. Nothing can be added afterwards. For a part, all ranks call it. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_finalize(flesh_system *system);

/* Returns the mesh with which the system was created. */
FLESH_API const flesh_mesh *flesh_system_mesh(const flesh_system *system);
/* Return the number of unknowns, 3 * nodes, the number of effects, and an effect. Cannot fail. */
FLESH_API int flesh_system_unknowns(const flesh_system *system);
FLESH_API int flesh_system_effect_count(const flesh_system *system);
FLESH_API const flesh_effect *flesh_system_effect(const flesh_system *system, int index);
/* Returns the vector instructions of the effects that are computed tet by tet (the lowest set if they differ), or the
 * best of this machine without such effects; linear solvers use the same. Never AUTO. */
FLESH_API flesh_instructions flesh_system_instructions(const flesh_system *system);
/* Returns whether an effect of that role is present. Cannot fail. */
FLESH_API int flesh_system_has_role(const flesh_system *system, flesh_role role);
/* Returns whether prescribed positions or effects change with time. If so, a scene without inertia is a sequence of
 * equilibria, else it is one equilibrium. Cannot fail. */
FLESH_API int flesh_system_moves(const flesh_system *system);
/* Returns the number of multipliers that enforce constraints of the effects (flesh_point.multipliers): one for each
 * tet of the mesh if the body has incompressible tets, else 0. Cannot fail. */
FLESH_API int flesh_system_multiplier_count(const flesh_system *system);
/* Returns the number of internal variables of all effects together (flesh_effect_internal). Cannot fail. */
FLESH_API int flesh_system_internal_count(const flesh_system *system);
/* Updates the internal variables [internal_count] at the end of a step, `point`, where point->internal has their
 * values in the step (NULL: 0). *changed becomes 1 if forces or energies change, else 0. FLESH_ERR_NONFINITE if they
 * have no value there. Further errors: FLESH_ERR_ARGUMENT, and those of effects. */
FLESH_API int flesh_system_update_internal(const flesh_system *system, const flesh_point *point,
                                           double *internal, int *changed);
/* Returns the first time after t at which a constraint or effect is not smooth; INFINITY if there is none. */
FLESH_API double flesh_system_next_event(const flesh_system *system, double t);

/* Computes r = sum of the residuals [3*n], constraints not applied. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_residual(const flesh_system *system, const flesh_point *point,
                                    double *r);
/* Computes the residual of the effects of FLESH_ROLE_LOAD alone, which is minus the applied load. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_load(const flesh_system *system, const flesh_point *point, double *r);
/* Computes K = sum of the Jacobians, constraints not applied. K must have this system's pattern. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_jacobian(const flesh_system *system, const flesh_point *point,
                                    const flesh_shift *shift, flesh_block_matrix *K);
/* Computes phi = sum of the potentials, J, and *magnitude = sum of the absolute values of their terms. Errors:
 * FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_potential(const flesh_system *system, const flesh_point *point,
                                     const flesh_shift *shift, double *phi, double *magnitude);
/* Computes the physical energy of every effect [effect_count], J. Errors: FLESH_UNDEFINED, FLESH_NONFINITE,
 * FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_energies(const flesh_system *system, const flesh_point *point,
                                    double *energies);

/* Checks the body at x [3*n]: FLESH_ERR_ARGUMENT, with the place, if it is within an obstacle, or if surfaces with
 * contact between them (flesh_effect_surface_contact) intersect. */
FLESH_API int flesh_system_check(const flesh_system *system, double t, const double *x);

/* Makes a zero matrix of the system's pattern, which it shares (the system must outlive it).
 * Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_matrix_create(const flesh_system *system, flesh_block_matrix **matrix);
FLESH_API void flesh_block_matrix_destroy(flesh_block_matrix **matrix);

/* Sets fixed[d] = 1 for the dofs constrained at time t (and those of nodes that no tet uses), else 0; [3*n]. Returns
 * the number of constrained dofs. Cannot fail. */
FLESH_API int flesh_system_fixed(const flesh_system *system, double t, uint8_t *fixed);
/* Writes the prescribed positions at time t into the constrained components of x [3*n]. */
FLESH_API void flesh_system_prescribe(const flesh_system *system, double t, double *x);
/* Writes the prescribed velocities and accelerations likewise (analytic; at a keyframe, those just after it). */
FLESH_API void flesh_system_prescribe_velocity(const flesh_system *system, double t, double *v,
                                               double *a);

#ifdef __cplusplus
}
#endif
#endif
