/* edge_force.h: how strongly a body's materials resist strain, as a force on a node. */
#ifndef FLESH_SYSTEM_EDGE_FORCE_H
#define FLESH_SYSTEM_EDGE_FORCE_H

#include "flesh/system.h"

typedef struct flesh_edge_force {
  double edge;    /* the mesh's mean edge, m */
  double mean;    /* N, of a component, over all nodes */
  double softest; /* N, of a node: the harmonic mean, which is near that of the softest */
  int stressed;   /* there is force without displacement, or it has no value */
} flesh_edge_force;

/* The force that strains an edge by its own length: by how far a millionth of that, by which nodes are displaced from rest
 * at random, changes what elasticity does to them. 0 without elasticity or where it has no value. Overwrites `work`
 * [4*n]. Collective. */
flesh_edge_force flesh_system_edge_force(const flesh_system *system, double *work);

#endif
