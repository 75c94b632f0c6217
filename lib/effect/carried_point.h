/* carried_point.h: points that groups of nodes carry along, which joints hold and springs pull.
 *
 * A group carries a point p of the rest shape by the weights of least squares, w_a = s_a (1 + (p - c).S^-1 (X_a - c))
 * with the shares s_a >= 0, of sum 1, and by them the mean c and the second moment S of its nodes: sum of w_a = 1 and sum
 * of w_a X_a = p, so that every affine motion of the nodes moves p with them. In small motions p is where the group's
 * best affine fit takes it. */
#ifndef FLESH_EFFECT_CARRIED_POINT_H
#define FLESH_EFFECT_CARRIED_POINT_H

#include "effect/private.h"
#include "flesh/effects.h"

/* The groups of a joint that holds its surfaces together, where their points are one: those of its bond. */
typedef struct flesh_carried_groups {
  int count[2], *nodes; /* [count[0] + count[1]]; NULL: it holds none together */
} flesh_carried_groups;

/* A copy. FLESH_ERR_MEMORY. */
int flesh_carried_groups_copy(flesh_nodes first, flesh_nodes second, flesh_carried_groups *groups);
size_t flesh_carried_groups_memory(const flesh_carried_groups *groups);
/* Their bond, which never breaks. */
void flesh_carried_groups_bond(const flesh_carried_groups *groups, flesh_bond *bond);

/* The weights [count] by which nodes [count] carry p, times `sign`. `shares` [count], of sum 1; NULL: all are equal.
 * FLESH_ERR_ARGUMENT where p is not in what the nodes span. */
int flesh_carried_weights(const flesh_mesh *mesh, int count, const int *nodes, const double *shares, const double p[3],
                          double sign, double *weights);
/* FLESH_ERR_ARGUMENT for empty or large groups and nodes that the mesh has not. */
int flesh_carried_check_groups(const flesh_body *body, flesh_nodes first, flesh_nodes second);
/* FLESH_ERR_ARGUMENT for a point, called `name`, or a stiffness that cannot be. */
int flesh_carried_check(const char *name, const double point[3], double stiffness);

#endif
