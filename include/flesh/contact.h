/* contact.h: the effect that keeps a body out of an obstacle.
 * What returns no status cannot fail. */
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
} flesh_contact_options;
/* NaN, NaN, 0, 1e-3 m/s. */
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
 * below the slip speed e, 1 above; normal force N and direction from the lagged state. In statics
 * there is friction with moving obstacles only. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_contact(const flesh_body *body, const flesh_contact_options *options,
                                   flesh_obstacle **obstacle, flesh_effect **effect);

/* The obstacle of a contact effect, borrowed; NULL for every other effect. */
FLESH_API const flesh_obstacle *flesh_effect_obstacle(const flesh_effect *effect);

#ifdef __cplusplus
}
#endif
#endif
