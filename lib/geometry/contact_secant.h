/* contact_secant.h: at which gap a solve is expected to end, node by node, and the barrier's secant to there.
 *
 * Near the edge of the barrier its force grows with the square of what a node is within it. From an iterate that is
 * there n times as deep as the solution, Newton's iteration takes log2 n steps, each of which halves the depth, however
 * well all else is known: it extrapolates by the stiffness here to forces as small as there. The secant from here to
 * where the force is the expected one has no such error: with the force as an unknown of its own, f = B'(s), it is the
 * step that inverts that law exactly (primal-dual methods, Nocedal & Wright 2006, section 19.3, linearise s f(s) =
 * const for the same reason).
 *
 * The expected force is what the last iteration's linear model predicts for where the node is now, and before the first
 * one that at the state the step begins with. A solve says when it is to be predicted, once for each of its matrices.
 * Where the node is as expected the secant is the tangent, so that the iteration converges as Newton's does, to the
 * same place. */
#ifndef FLESH_GEOMETRY_CONTACT_SECANT_H
#define FLESH_GEOMETRY_CONTACT_SECANT_H

#include "geometry/contact_set.h"

/* A node: its least gap where forces were predicted last, over the thickness; how the pressure there, -B', was
 * taken to fall with the gap; the gap at which it was expected. */
typedef struct flesh_contact_secant_node {
  double gap, pressure, slope, expected;
  int known; /* to which update; 0: none */
} flesh_contact_secant_node;

/* Whether a node's force was predicted at the update before this one. */
int flesh_contact_secant_expects(const flesh_contact_secant_node *node, int update);
/* Predicts a node's force at a gap over the thickness: by the last update or, if there was none, by the gap of the lagged
 * state. */
void flesh_contact_secant_expect(flesh_contact_secant_node *node, int update, double gap, double gap_lag);

typedef struct flesh_contact_secant {
  flesh_contact_secant_node *nodes; /* [node_count of the surface] */
  int updates;
} flesh_contact_secant;

int flesh_contact_secant_create(const flesh_contact_surface *surface, flesh_contact_secant *secant);
void flesh_contact_secant_clear(flesh_contact_secant *secant);

/* Forgets what solves have predicted: the next one starts from another state. */
void flesh_contact_secant_forget(flesh_contact_secant *secant);

/* Predicts the forces of the set's pairs where it is: by what was predicted last, or by x_lag [3*n], where the solve
 * begins. */
void flesh_contact_secant_predict(flesh_contact_secant *secant, const flesh_contact_set *set, const double *x_lag);

/* Sets `expected` of the set's pairs, at the place that was predicted for last; 0 (tangents) where `secant` is NULL. */
void flesh_contact_secant_apply(const flesh_contact_secant *secant, flesh_contact_set *set);

#endif
