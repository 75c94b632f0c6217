/* edge_force.h: how strongly a body's materials resist strain, as a force on a node. */
#ifndef FLESH_SYSTEM_EDGE_FORCE_H
#define FLESH_SYSTEM_EDGE_FORCE_H

#include "system/evaluation.h"

typedef struct flesh_edge_force {
  double edge;    /* the mesh's mean edge, m */
  double mean;    /* N, of a component, over all nodes */
  double softest; /* N, of a node: the harmonic mean, which is near that of the softest */
  int stressed;   /* there is force without displacement, or it has no value */
} flesh_edge_force;

/* The force that strains an edge by its own length: by how far a millionth of that, by which nodes are displaced at random
 * from `rest`, a point at the mesh's own positions, changes what effects of those roles do to them. 0 where none has a
 * value. Overwrites `work` [4*n]. Collective. A negative status of an effect. */
int flesh_system_edge_force(const flesh_evaluation *evaluation, unsigned roles, const flesh_point *rest, double *work,
                            flesh_edge_force *force);

#endif
