/* edge_force.h: resistance of a body's materials to strain, as a force on a node. */
#ifndef FLESH_SYSTEM_EDGE_FORCE_H
#define FLESH_SYSTEM_EDGE_FORCE_H

#include "system/evaluation.h"

typedef struct flesh_edge_force {
  double edge;    /* the mesh's mean edge, m */
  double mean;    /* N, mean of a force component over all nodes */
  double softest; /* N, of a node: the harmonic mean, which is near that of the softest node */
  int stressed;   /* 1: there are forces without displacement, or they have no value */
} flesh_edge_force;

/* Finds the force that strains an edge by its own length: displaces nodes at random by a millionth of an edge from `rest`,
 * a point at the mesh's own positions, and extrapolates the change of the forces of effects of those roles. 0 if none has a
 * value. Overwrites `work` [4*n]. Collective. A negative status of an effect. */
int flesh_system_edge_force(const flesh_evaluation *evaluation, unsigned roles, const flesh_point *rest, double *work,
                            flesh_edge_force *force);

#endif
