/* contact_secant.h: predicts for each node the gap at which a solve will end, and uses the barrier's secant to there.
 *
 * Near the edge of the barrier its force grows with the square of the depth. From an iterate n times as deep as the
 * solution, Newton's iteration takes log2 n steps, each of which halves the depth, however accurate everything else is:
 * it extrapolates linearly from a large force to a small one. The secant from the present gap to the gap of the
 * expected force has no such error. It is the step that inverts the law exactly if the force is an unknown of its own,
 * f = B'(s) (for the same reason primal-dual methods, Nocedal & Wright 2006, section 19.3, linearise s f(s) = const).
 *
 * The expected force is the prediction of the last iteration's linear model for the present gap; before the first
 * iteration it is the force at the state where the step begins. The solver says when to predict: once for each of its
 * matrices. If a node is where it was expected the secant is the tangent, so the iteration converges to the same
 * solution as Newton's and as fast. */
#ifndef FLESH_GEOMETRY_CONTACT_SECANT_H
#define FLESH_GEOMETRY_CONTACT_SECANT_H

#include "geometry/contact_set.h"

/* One node: its least gap, over the thickness, at the last prediction; the pressure -B' there; the slope with which the
 * pressure was taken to fall with the gap; the gap expected at the solution. */
typedef struct flesh_contact_secant_node {
  double gap, pressure, slope, expected;
  int known; /* number of the update for which these are valid; 0: none */
} flesh_contact_secant_node;

/* Whether the node's force was predicted at the previous update. */
int flesh_contact_secant_expects(const flesh_contact_secant_node *node, int update);
/* Predicts a node's force at `gap`, over the thickness: from the previous update or, if there was none, from the gap
 * `gap_lag` of the lagged state. */
void flesh_contact_secant_expect(flesh_contact_secant_node *node, int update, double gap, double gap_lag);

typedef struct flesh_contact_secant {
  flesh_contact_secant_node *nodes; /* [node_count of the surface] */
  int updates;
} flesh_contact_secant;

int flesh_contact_secant_create(const flesh_contact_surface *surface, flesh_contact_secant *secant);
void flesh_contact_secant_clear(flesh_contact_secant *secant);

/* Forgets all predictions, because the next solve starts from another state. */
void flesh_contact_secant_forget(flesh_contact_secant *secant);

/* Predicts the forces of the set's pairs at its present positions: from the previous predictions, or from x_lag [3*n],
 * where the solve begins. */
void flesh_contact_secant_predict(flesh_contact_secant *secant, const flesh_contact_set *set, const double *x_lag);

/* Sets `expected` of the set's pairs, at the positions of the last prediction; to 0 (tangents) if `secant` is NULL. */
void flesh_contact_secant_apply(const flesh_contact_secant *secant, flesh_contact_set *set);

#endif
