/* contact.h: contact of bodies with obstacles, with each other and with themselves.
 * Functions that return no status cannot fail. */
#ifndef FLESH_CONTACT_H
#define FLESH_CONTACT_H

#include "flesh/effects.h"
#include "flesh/obstacle.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Options of contact: normal force and friction. */
typedef struct flesh_contact_options {
  double stiffness;  /* Pa; NaN: three times the body's largest shear modulus mu */
  double thickness;  /* m, distance at which the force begins; NaN: 1/20 of the mean surface edge */
  double friction;   /* Coulomb's coefficient, >= 0 */
  double slip_speed; /* m/s, slip speed below which friction is viscous, so that it is smooth; > 0 */
  int separates;     /* 1: surfaces that overlap at the start are ignored until they are apart; 0 for obstacles */
  int adaptive;      /* 1: the stiffness adapts to the contact pressures; 0 for obstacles */
} flesh_contact_options;
/* Sets the defaults, in the order of the members: NaN, NaN, 0, 1e-3 m/s, 0, 0. */
FLESH_API void flesh_contact_options_default(flesh_contact_options *options);

/* Creates an effect that keeps the body's nodes out of the obstacle, and its faces out of a core of each sphere and
 * capsule with half the radius, so that these cannot slip between nodes. (Corners of a triangle mesh, and parts of it
 * that are smaller than the body's faces, may enter a face.) Takes ownership of *obstacle (sets it to NULL), also when
 * it fails; borrows `body`'s arrays.
 *
 * V = sum over nodes of A k w B(d/w), with the node's share A of the rest surface [m^2] (for nodes within the body,
 * which meet the obstacle when the body is crushed, (V/4 of its tets)^(2/3)), the distance d to the obstacle,
 * stiffness k and thickness w; B(s) = (1-s)^3/s for s < 1, else 0: zero beyond w, a cubic penalty near d = w,
 * unbounded as d goes to 0, undefined for d <= 0. It is a barrier as in Li et al. 2020, "Incremental Potential
 * Contact", whose logarithm is too weak to stop a fast node when time steps resolve the impact. On triangle meshes V
 * is summed over triangles, minus the terms of the edges that they share, plus those of the vertices (Li et al. 2023,
 * "Convergent Incremental Potential Contact"), so that V has no kinks in inner corners and does not depend on how a
 * flat face is cut into triangles.
 *
 * Friction: r = mu N f(|u|) u/|u| with the relative tangential velocity u, f(y) = 2 y/e - (y/e)^2 below the slip
 * speed e, 1 above. The normal force N and its direction are those of the lagged state, in statics of the
 * equilibrium itself; in statics, friction acts only against moving obstacles. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_obstacle_contact(const flesh_body *body, const flesh_contact_options *options,
                                            flesh_obstacle **obstacle, flesh_effect **effect);

/* Creates an effect that keeps surfaces of the body out of each other. `pairs` [2*pair_count] names pairs of parts
 * (flesh_body.parts; a body without parts is one) by their numbers, the same number twice for a part that touches
 * itself; NULL: all pairs, each part with itself included. Ten-node faces count as four flat triangles. Borrows
 * `body`'s arrays.
 *
 * V = sum over the surfaces' nodes of A/2 k w B(d/w), with the distance d from a node to the surfaces that it may
 * touch, and B and A as above; the factor 1/2 is there because both surfaces have nodes. The sum is over triangles,
 * minus edges, plus nodes, so that it does not depend on how a face is cut (Li et al. 2023). Pairs of edges closer
 * than w/4 have a barrier, too. Features closer than w at rest in one connected piece of a part do not touch each
 * other; separate pieces do touch, also in a body without parts. Friction is as above, with the slip of one surface on
 * the other.
 *
 * With options->adaptive 1 the stiffness k begins at the given value and adapts to the pressures. The reference is the
 * pressure at half of the thickness, 2 k. At the end of a step or an equilibrium where the mean pressure, weighted by
 * the nodes' forces, is below a quarter of the reference or above four times it, k becomes half of the mean pressure.
 * It changes by a factor of four at most and stays within 1e-6 and 1e3 times its first value. The logarithm of k over
 * its first value is the effect's internal variable, part of the state.
 *
 * No step of a solve passes one surface through another: every step ends before they meet (additive continuous
 * collision detection, Li et al. 2021). So surfaces must be apart at the start; flesh_system_check says where they are
 * not. With options->separates 1 they may overlap: pairs that overlap where a run begins (at its first step, or at a
 * step that does not begin where the last one ended) are ignored, while all others touch, until a step ends where no
 * part of the pair intersects the other, lies inside the other's body or is closer than the thickness. Nothing pushes
 * them apart. flesh_integrator_separation tells how many are still ignored. Without a run (flesh_system_energies, ...)
 * the pairs that overlap at lagged.x are ignored.
 *
 * The Jacobian's pattern grows where surfaces come near each other: in methods of fixed steps and in statics, whose
 * matrix grows with it. With this effect nothing is untangled (FLESH_TECHNIQUE_UNTANGLE). Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_surface_contact(const flesh_body *body, const flesh_contact_options *options,
                                           int pair_count, const int *pairs, flesh_effect **effect);

/* Progress of the separation of surfaces that overlapped at the start (flesh_contact_options.separates), counted in
 * pairs of surface patches that ignore each other until they are apart. */
typedef struct flesh_separation {
  int begun, ignored; /* number of ignored pairs where the run began; and now */
  /* s, end of the step since which all pairs touch; NaN: some are still ignored, or nothing overlapped at the start */
  double t_apart;
} flesh_separation;
#ifdef __cplusplus
}
#endif
#endif
