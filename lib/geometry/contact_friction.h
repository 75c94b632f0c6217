/* contact_friction.h: Coulomb friction between pairs of features, with normal forces and geometry of a lagged state.
 *
 * A pair with the normal force N and the slip velocity u [2] of its features has the residual r = mu N f(|u|) u/|u|,
 * with f(y) = 2 y/e - (y/e)^2 below the slip speed e and 1 above, as in contact.h. It derives from a potential in v as
 * long as the lagged state stays fixed.
 *
 * u_i is the sum of c_a t_i . v_a over the nodes, less d w . (n x t_i), with shares c, tangents t, normal n and
 * distance d of the nearest points (contact_closest.h). The second term is the velocity that the rotation of the features,
 * at the rate w, gives the gap, so that rigid rotations do not slip and the forces have no moment at the lagged positions.
 * w is that of the two edges that are near each other, or of the triangle, one with the edge or node that a point is
 * near. */
#ifndef FLESH_GEOMETRY_CONTACT_FRICTION_H
#define FLESH_GEOMETRY_CONTACT_FRICTION_H

#include "geometry/contact_set.h"
#include "geometry/slip.h"
#include "linear/block_matrix.h"

typedef struct flesh_friction_pair {
  int nodes[4];
  double force;         /* N, mu times the normal force */
  double slip[2][12];   /* u_i is the sum of slip[i] * v over the nodes' components */
  flesh_slip_expected expected;
} flesh_friction_pair;

typedef struct flesh_contact_friction {
  double coefficient, slip_speed; /* friction coefficient mu, and slip speed in m/s, > 0 */
  int count, capacity;
  flesh_friction_pair *pairs; /* [count] */
} flesh_contact_friction;

void flesh_contact_friction_clear(flesh_contact_friction *friction);

/* Finds the friction pairs among the set's own pairs after `set` has been updated at the lagged positions x [3*n].
 * Pairs with negative weight in a signed sum have no friction: the pairs of a point with positive weight share the
 * friction of the sum of all normal forces. FLESH_ERR_MEMORY. */
int flesh_contact_friction_update(flesh_contact_friction *friction, const flesh_contact_set *set, const double *x);

/* Computes a pair's slip operator for its nearest points `at` at x [3*n]. */
void flesh_contact_slip_find(const flesh_contact_pair *pair, const flesh_contact_closest *at, const double *x,
                             flesh_friction_pair *found);

/* Positions and velocities [3*n], and the factors by which a change of the unknown changes x and v. */
typedef struct flesh_contact_motion {
  const double *x, *x_lag, *v;
  double shift_x, shift_v;
} flesh_contact_motion;

/* Adds to each output that is not NULL: the residual r [3*n], its potential phi with respect to the unknown, and the
 * sum `size` of its terms' magnitudes (effect.h). If shift_v is 0 the force is constant and x moves from x_lag. */
void flesh_contact_friction_evaluate(const flesh_contact_friction *friction, const flesh_contact_motion *at, double *phi,
                                     double *size, double *r);

/* Adds d r / d x_lag by calls of `add`, for velocities v [3*n] and a set updated at x_lag [3*n] as for
 * flesh_contact_friction_update. FLESH_UNDEFINED if different nodes bear the nearest points of two edges on the two
 * sides of x_lag; FLESH_ERR_MEMORY; errors of `add`. */
int flesh_contact_friction_turn(const flesh_contact_friction *friction, const flesh_contact_set *set, const double *x_lag,
                                const double *v, flesh_block_add add, void *to);

/* Computes scale times d r / d v [144*count] of every pair, in the order of its nodes and padded with 0; positive
 * semi-definite. With what the matrix of this number expects (slip.h); 0: the tangents. */
void flesh_contact_friction_hessians(flesh_contact_friction *friction, const double *v, double scale, int matrix,
                                     double *hessians);

#endif
