/* carried_point.h: points that move with groups of nodes, for joints and springs.
 *
 * A group carries a point p of the rest shape with the least-squares weights w_a = s_a (1 + (p - c).S^-1 (X_a - c)),
 * where the shares s_a >= 0 sum to 1 and c and S are the mean and the second moment of the nodes with these shares.
 * Then the sum of w_a is 1 and that of w_a X_a is p, so every affine motion of the nodes moves p with them. In small
 * motions p is where the group's best affine fit takes it. */
#ifndef FLESH_EFFECT_CARRIED_POINT_H
#define FLESH_EFFECT_CARRIED_POINT_H

#include "effect/private.h"
#include "flesh/effects.h"

/* The two groups of a joint whose points coincide, so that it holds its surfaces together: the nodes of its bond. */
typedef struct flesh_carried_groups {
  int count[2], *nodes; /* [count[0] + count[1]] the first group, then the second; NULL: the joint is no bond */
} flesh_carried_groups;

/* Copies the groups. FLESH_ERR_MEMORY. */
int flesh_carried_groups_copy(flesh_nodes first, flesh_nodes second, flesh_carried_groups *groups);
size_t flesh_carried_groups_memory(const flesh_carried_groups *groups);
/* Describes the groups as a bond, which never breaks. */
void flesh_carried_groups_bond(const flesh_carried_groups *groups, flesh_bond *bond);

/* Computes the weights [count] with which nodes [count] carry p, times `sign`. `shares` [count] sum to 1; NULL: equal
 * shares. FLESH_ERR_ARGUMENT if p is not in the span of the nodes. */
int flesh_carried_weights(const flesh_mesh *mesh, int count, const int *nodes, const double *shares, const double p[3],
                          double sign, double *weights);
/* Checks two groups. FLESH_ERR_ARGUMENT if one is empty, if both are too large, and for nodes not in the mesh. */
int flesh_carried_check_groups(const flesh_body *body, flesh_nodes first, flesh_nodes second);
/* Checks a point, called `name` in messages, and a stiffness. FLESH_ERR_ARGUMENT. */
int flesh_carried_check(const char *name, const double point[3], double stiffness);

#endif
