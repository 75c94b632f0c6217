/* contact_friction.h: Coulomb friction between pairs of features, with normal forces and geometry of a lagged state.
 *
 * A pair with the normal force N has r = mu N f(|u|) u/|u| with the velocity u [2] at which its features slip,
 * f(y) = 2 y/e - (y/e)^2 below the slip speed e and 1 above, as contact.h has it: it is a potential in v as long as the
 * lagged state stays.
 *
 * u_i = sum of c_a t_i . v_a + d alpha_ia n . v_a over the nodes, with shares c, tangents t, turns alpha, normal n and
 * distance d of the nearest points (contact_closest.h). The second term takes off the velocity that a rotation of the
 * features gives to the gap, so that rotations of everything slip nowhere and forces have no moment at the lagged
 * places. About an edge or a node that bears the nearest point the surface's rotation is not known, and the term is left
 * out. */
#ifndef FLESH_GEOMETRY_CONTACT_FRICTION_H
#define FLESH_GEOMETRY_CONTACT_FRICTION_H

#include "geometry/contact_set.h"
#include "linear/block_matrix.h"

typedef struct flesh_friction_pair {
  int count, nodes[4];  /* 2 to 4 nodes */
  double force;         /* mu N, N */
  double slip[2][12];   /* [2][3*count] u_i is the sum of slip[i] * v of the nodes */
} flesh_friction_pair;

typedef struct flesh_contact_friction {
  double coefficient, slip_speed; /* mu; m/s, > 0 */
  int count, capacity;
  flesh_friction_pair *pairs; /* [count] */
} flesh_contact_friction;

void flesh_contact_friction_clear(flesh_contact_friction *friction);

/* Finds the friction pairs among the set's own pairs, after `set` has been updated at the lagged places x [3*n]. Signed
 * sums have no negative friction: of the pairs of a point those with positive weights have friction, by forces that add up to
 * the sum of all. FLESH_ERR_MEMORY. */
int flesh_contact_friction_update(flesh_contact_friction *friction, const flesh_contact_set *set, const double *x);

/* A pair's slip, where its nearest points are `at`; and how a field [3*n] slips. */
void flesh_contact_slip_find(const flesh_contact_pair *pair, const flesh_contact_closest *at, flesh_friction_pair *found);
void flesh_contact_slip_of(const flesh_friction_pair *pair, const double *field, double u[2]);

/* Places and velocities [3*n], and by how many times a change of the unknown moves x and v. */
typedef struct flesh_contact_motion {
  const double *x, *x_lag, *v;
  double shift_x, shift_v;
} flesh_contact_motion;

/* Adds to what is not NULL the residual r [3*n], and its potential for changes of the unknown, with the sum of its
 * terms' sizes (effect.h; where shift_v is 0 the force does not change, and x moves from x_lag). */
void flesh_contact_friction_evaluate(const flesh_contact_friction *friction, const flesh_contact_motion *at, double *phi,
                                     double *size, double *r);

/* Gives d r / d x_lag, with velocities v [3*n], of a set that has been updated at x_lag [3*n] as
 * flesh_contact_friction_update has it. FLESH_UNDEFINED where other nodes bear the nearest points of two edges on one side
 * of x_lag than on the other; FLESH_ERR_MEMORY, and what `add` returns. */
int flesh_contact_friction_turn(const flesh_contact_friction *friction, const flesh_contact_set *set, const double *x_lag,
                                const double *v, flesh_block_add add, void *to);

/* scale times d r / d v [144*count] of every pair, in the order of its nodes, 0 behind them; positive semi-definite.
 * `to_rest`: the secants to rest in their place (slip.h). */
void flesh_contact_friction_hessians(const flesh_contact_friction *friction, const double *v, double scale,
                                     int to_rest, double *hessians);

#endif
