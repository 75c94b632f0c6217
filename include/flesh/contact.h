/* contact.h: obstacles that a body cannot enter, and the effect that keeps it out. */
#ifndef FLESH_CONTACT_H
#define FLESH_CONTACT_H

#include "flesh/effects.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_obstacle flesh_obstacle;

/* Obstacles in their place at rest. Each returns new; FLESH_ERR_ARGUMENT where a number is not
 * finite, a radius not positive, a normal zero. */

/* The half-space below a plane through `point`, whose normal points to where the body is. */
FLESH_API int flesh_obstacle_plane(const double point[3], const double normal[3],
                                   flesh_obstacle **obstacle);
FLESH_API int flesh_obstacle_sphere(const double centre[3], double radius,
                                    flesh_obstacle **obstacle);
/* All points nearer than `radius` to the segment from a to b. */
FLESH_API int flesh_obstacle_capsule(const double a[3], const double b[3], double radius,
                                     flesh_obstacle **obstacle);
/* A surface of triangles [3*triangles] with corners at `positions` [3*nodes], closed or open, any
 * winding: it is met from both sides. Triangles without area are left out. Copies. */
FLESH_API int flesh_obstacle_mesh(int nodes, const double *positions, int triangles,
                                  const int *triangle_nodes, flesh_obstacle **obstacle);

/* The obstacle follows x(t) = centre + R(t)(X - centre) + translation(t). Copies. */
FLESH_API int flesh_obstacle_move(flesh_obstacle *obstacle, const flesh_motion *motion);
/* NULL-safe; sets *obstacle to NULL. */
FLESH_API void flesh_obstacle_destroy(flesh_obstacle **obstacle);

/* Triangles of the obstacle's surface at time t, for pictures: new *positions [3 * *nodes] and
 * *corners [3 * *triangles], outward by the right-hand rule, which the caller frees. A plane is
 * drawn as a square of side 2*extent around the foot of `centre` [3]; both are not read
 * otherwise. */
FLESH_API int flesh_obstacle_surface(const flesh_obstacle *obstacle, double t,
                                     const double centre[3], double extent, int *nodes,
                                     double **positions, int *triangles, int **corners);

/* How the contact pushes and rubs. */
typedef struct flesh_contact_options {
  double stiffness;  /* Pa; NaN: three times the body's largest shear modulus mu */
  double thickness;  /* m, distance at which the push begins; NaN: 1/20 of the mean surface edge */
  double friction;   /* Coulomb's coefficient, >= 0 */
  double slip_speed; /* m/s, below which friction is viscous, so that it is smooth; > 0 */
} flesh_contact_options;
/* NaN, NaN, 0, 1e-3 m/s. */
FLESH_API void flesh_contact_options_default(flesh_contact_options *options);

/* Keeps the body's nodes out of the obstacle, and its faces out of balls of half the radius in the
 * midst of spheres and capsules, so that these cannot slip between nodes. (Of triangle meshes,
 * corners and parts that are smaller than the body's faces may poke into a face.) Takes *obstacle
 * (sets it to NULL), also when it fails; borrows `body`'s arrays.
 *
 * V = sum over nodes of A k w B(d/w), with the node's share A of the rest surface [m^2] (within the
 * body, (V/4 of its tets)^(2/3): those nodes meet the obstacle when the body is crushed), the
 * distance d to the obstacle, stiffness k and thickness w; B(s) = (1-s)^3/s for s < 1, else 0:
 * nothing beyond w, a cubic penalty where it begins, no value at d <= 0, and towards that without
 * bound: a barrier as in Li et al. 2020, "Incremental Potential Contact", whose logarithm is too
 * weak to stop a fast node where time steps resolve its stop. On triangle meshes V is summed over
 * triangles, less that of the edges they share, plus that of the vertices (Li et al. 2023,
 * "Convergent Incremental Potential Contact"), so that it has no kinks in inner corners and does
 * not depend on how a flat face is cut into triangles.
 *
 * Friction: r = mu N f(|u|) u/|u| with the relative tangential velocity u, f(y) = 2 y/e - (y/e)^2
 * below the slip speed e, 1 above; normal force N and direction from the lagged state. In statics
 * only a moving obstacle rubs. */
FLESH_API int flesh_effect_contact(const flesh_body *body, const flesh_contact_options *options,
                                   flesh_obstacle **obstacle, flesh_effect **effect);

/* The obstacle of a contact effect, borrowed; NULL for every other effect. */
FLESH_API const flesh_obstacle *flesh_effect_obstacle(const flesh_effect *effect);

#ifdef __cplusplus
}
#endif
#endif
