/* contact.h: the effect that keeps a body out of an obstacle.
 * Functions that return no status cannot fail. */
#ifndef FLESH_CONTACT_H
#define FLESH_CONTACT_H

#include "flesh/effects.h"
#include "flesh/obstacle.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Normal force and friction of the contact. */
typedef struct flesh_contact_options {
  double stiffness;  /* Pa; NaN: three times the body's largest shear modulus mu */
  double thickness;  /* m, distance at which the force begins; NaN: 1/20 of the mean surface edge */
  double friction;   /* Coulomb's coefficient, >= 0 */
  double slip_speed; /* m/s, below which friction is viscous, so that it is smooth; > 0 */
  int separates;     /* 1: surfaces that go through each other at the start are let apart; not of obstacles */
  int adaptive;      /* 1: the stiffness follows the pressures; not of obstacles */
} flesh_contact_options;
/* NaN, NaN, 0, 1e-3 m/s, 0, 0. */
FLESH_API void flesh_contact_options_default(flesh_contact_options *options);

/* Keeps the body's nodes out of the obstacle, and its faces out of a core of spheres and capsules
 * with half their radius, so that these cannot slip between nodes. (Corners of a triangle mesh, and
 * parts of it that are smaller than the body's faces, may enter a face.) Takes *obstacle (sets it to
 * NULL), also when it fails; borrows `body`'s arrays.
 *
 * V = sum over nodes of A k w B(d/w), with the node's share A of the rest surface [m^2] (within the
 * body, (V/4 of its tets)^(2/3): those nodes meet the obstacle when the body is crushed), the
 * distance d to the obstacle, stiffness k and thickness w; B(s) = (1-s)^3/s for s < 1, else 0:
 * zero beyond w, a cubic penalty where it begins, unbounded as d goes to 0, undefined for d <= 0. It
 * is a barrier as in Li et al. 2020, "Incremental Potential Contact", whose logarithm is too weak
 * to stop a fast node when time steps resolve the impact. On triangle meshes V is summed over
 * triangles, less that of the edges they share, plus that of the vertices (Li et al. 2023,
 * "Convergent Incremental Potential Contact"), so that it has no kinks in inner corners and does
 * not depend on how a flat face is cut into triangles.
 *
 * Friction: r = mu N f(|u|) u/|u| with the relative tangential velocity u, f(y) = 2 y/e - (y/e)^2
 * below the slip speed e, 1 above; normal force N and direction from the lagged state, in statics
 * of the equilibrium itself. There is friction with moving obstacles only then. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_obstacle_contact(const flesh_body *body, const flesh_contact_options *options,
                                            flesh_obstacle **obstacle, flesh_effect **effect);

/* Keeps surfaces of the body out of each other: those of its parts (flesh_body.parts; a body without parts is one)
 * that `pairs` [2*pair_count] names by their numbers, twice the same for a part that touches itself; NULL: all of
 * them, themselves included. Ten-node faces count as four flat triangles. Borrows `body`'s arrays.
 *
 * V = sum over the surfaces' nodes of A/2 k w B(d/w) with their distance d to what they may touch and B and A as
 * above, half as both surfaces have nodes; sums over triangles, less edges, plus nodes, so that it does not depend
 * on how a face is cut (Li et al. 2023). Edges that come as near each other as w/4 have a barrier, too. What is nearer
 * than w at rest in one connected piece of a part does not touch; pieces that nothing connects do, also in a body
 * without parts. Friction as above, with the slip of one surface on the other.
 *
 * With options->adaptive 1 the stiffness is that given at first and follows the pressures: at the end of a step or an
 * equilibrium where their mean, weighed by the nodes' forces, is not within a quarter and four times that at half of the
 * thickness (2 k), k becomes half of it, but changes by a factor of four at most and stays within 1e-6 and 1e3 times the
 * first. ln of k over the first is the effect's internal variable, part of the state.
 *
 * No step of a solve passes one surface through another: every step ends before they meet (additive continuous
 * collision detection, Li et al. 2021). So they must be apart at the start: flesh_system_check says where they are
 * not. With options->separates 1 they need not be: what goes through each other where a run begins (at its first step,
 * or at one that begins elsewhere than the last has ended) does not touch, while all else does, until a step ends
 * where nothing of it meets, is inside the other's body or nearer than the thickness. Nothing pushes it apart.
 * flesh_integrator_separation tells how far it is. Without a run (flesh_system_energies, ...) what goes through each
 * other at lagged.x does not touch.
 *
 * The Jacobian's pattern grows where surfaces come near each other: for methods of fixed steps and statics, whose
 * matrix grows with it. Nothing is untangled (FLESH_TECHNIQUE_UNTANGLE) where there is this effect. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_surface_contact(const flesh_body *body, const flesh_contact_options *options,
                                           int pair_count, const int *pairs, flesh_effect **effect);

/* How far surfaces that went through each other at the start are apart by now (flesh_contact_options.separates). A pair
 * is of two patches of surfaces that do not touch each other until they are. */
typedef struct flesh_separation {
  int begun, ignored; /* pairs where the run began; and now */
  double t_apart;     /* s, the end of the step since which all touch; NaN: not yet, or nothing went through anything */
} flesh_separation;
#ifdef __cplusplus
}
#endif
#endif
