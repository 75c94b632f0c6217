/* system.h: the sum of a scene's effects, its constraints, and the pattern of its Jacobian.
 *
 * Built by create, add..., finish; const from then on, so that several runs and threads can share
 * it. All nodes are unknowns in the mesh's numbering; constrained ones are handled by the solvers
 * as identity rows. Functions that return no status cannot fail. */
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

/* Borrows `mesh`. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_create(const flesh_mesh *mesh, flesh_system **system);
/* NULL-safe; destroys its effects; sets *system to NULL. */
FLESH_API void flesh_system_destroy(flesh_system **system);

/* Takes *effect (sets it to NULL), also when it fails: FLESH_ERR_ARGUMENT when the system is
 * finished, or the effect was made for a mesh with another count of nodes or tets. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_effect(flesh_system *system, flesh_effect **effect);

/* Constrains `axes` of `nodes` [count] to their rest positions while from <= t < until; of several
 * pins and prescribed motions of a component at a time, the one added last counts. Copies.
 * FLESH_ERR_ARGUMENT for no node, no axis, a node out of range, or an end that is not after the
 * begin. */
FLESH_API int flesh_system_add_pin(flesh_system *system, int count, const int *nodes, unsigned axes,
                                   double from, double until);

/* Constrains `axes` of `nodes` [count] to x(t) = centre + R(t)(X - centre) + translation(t) while from <= t < until.
 * Copies. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_add_prescribed_motion(flesh_system *system, int count, const int *nodes,
                                      unsigned axes, const flesh_motion *motion, double from,
                                      double until);

/* The mesh is that of a part of a body (flesh/ranks.h; borrowed): residuals, potentials and energies are then those of
 * the body, each residual with the owners of its nodes and 0 at ghosts, and calls are collective, as is this one.
 * Jacobians are those of the part's tets. A rank without a node that is to be constrained constrains none (a count of
 * 0), or leaves the call out.
 * FLESH_ERR_ARGUMENT where it is another mesh. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_set_part(flesh_system *system, const flesh_rank_part *rank_part);

/* Builds the pattern. Nothing can be added afterwards. Of a part, all ranks call it.
 * Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_finalize(flesh_system *system);

/* Borrowed, as it was given. */
FLESH_API const flesh_mesh *flesh_system_mesh(const flesh_system *system);
/* 3 * nodes, and the number of effects. Cannot fail. */
FLESH_API int flesh_system_unknowns(const flesh_system *system);
FLESH_API int flesh_system_effect_count(const flesh_system *system);
FLESH_API const flesh_effect *flesh_system_effect(const flesh_system *system, int index);
/* The instructions of its effects that are computed tet by tet (the lowest set where they differ), or the
 * best of this machine where there are no such effects; linear solvers use the same. Never AUTO. */
FLESH_API flesh_instructions flesh_system_instructions(const flesh_system *system);
/* Whether an effect of that role is present. Cannot fail. */
FLESH_API int flesh_system_has_role(const flesh_system *system, flesh_role role);
/* Whether prescribed positions or effects change with time: then a scene without inertia is a
 * sequence of equilibria instead of one. Cannot fail. */
FLESH_API int flesh_system_moves(const flesh_system *system);
/* How many multipliers enforce constraints of its effects (flesh_point.multipliers): one for each
 * tet of the mesh if the body has incompressible tets, else 0. Cannot fail. */
FLESH_API int flesh_system_multiplier_count(const flesh_system *system);
/* How many internal variables its effects have together (flesh_effect_internal). Cannot fail. */
FLESH_API int flesh_system_internal_count(const flesh_system *system);
/* Updates the internal variables [internal_count] at the end of a step, `point`, with which point->internal has their
 * values in the step (NULL: 0). *changed is 1 where forces or energies become others by it, else 0.
 * FLESH_ERR_NONFINITE where they have no value there. Further errors: FLESH_ERR_ARGUMENT, what an effect returns. */
FLESH_API int flesh_system_update_internal(const flesh_system *system, const flesh_point *point,
                                           double *internal, int *changed);
/* First time after t at which a constraint or effect stops being smooth; INFINITY if none. */
FLESH_API double flesh_system_next_event(const flesh_system *system, double t);

/* r = sum of the residuals [3*n], constraints not applied.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_residual(const flesh_system *system, const flesh_point *point,
                                    double *r);
/* The residual of the effects of FLESH_ROLE_LOAD alone: minus the applied load. Errors: FLESH_UNDEFINED,
 * FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_load(const flesh_system *system, const flesh_point *point, double *r);
/* K = sum of the Jacobians, constraints not applied. K must be of this system's pattern.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_jacobian(const flesh_system *system, const flesh_point *point,
                                    const flesh_shift *shift, flesh_block_matrix *K);
/* phi = sum of the potentials, J, and in *magnitude that of the absolute values of their terms.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_potential(const flesh_system *system, const flesh_point *point,
                                     const flesh_shift *shift, double *phi, double *magnitude);
/* Physical energy of every effect [effect_count], J.
 * Errors: FLESH_UNDEFINED, FLESH_NONFINITE, FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_system_energies(const flesh_system *system, const flesh_point *point,
                                    double *energies);

/* FLESH_ERR_ARGUMENT, with the place, where the body at x [3*n] is within an obstacle, or surfaces that touch each other
 * (flesh_effect_surface_contact) go through each other. */
FLESH_API int flesh_system_check(const flesh_system *system, double t, const double *x);

/* Makes a zero matrix of the system's pattern, which it shares (the system must outlive it).
 * Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_system_matrix_create(const flesh_system *system, flesh_block_matrix **matrix);
FLESH_API void flesh_block_matrix_destroy(flesh_block_matrix **matrix);

/* fixed[d] = 1 for the dofs constrained at time t (and those of nodes no tet uses), else 0; [3*n].
 * Returns the number fixed. Cannot fail. */
FLESH_API int flesh_system_fixed(const flesh_system *system, double t, uint8_t *fixed);
/* Writes the prescribed positions at time t into the constrained components of x [3*n]. */
FLESH_API void flesh_system_prescribe(const flesh_system *system, double t, double *x);
/* Writes the prescribed velocities and accelerations likewise (analytic; at a keyframe those that follow it). */
FLESH_API void flesh_system_prescribe_velocity(const flesh_system *system, double t, double *v,
                                               double *a);

#ifdef __cplusplus
}
#endif
#endif
