/* locking.h: how far four-node tets lock on the mesh at hand. */
#ifndef FLESH_RUN_LOCKING_H
#define FLESH_RUN_LOCKING_H

#include <stdio.h>

#include "flesh/scene.h"

/* Says in one line, where a body of four-node tets has a Poisson's ratio of 0.47 or more, by how much it bends too little
 * and what to set; nothing for other bodies. */
void flesh_warn_of_locking(const flesh_scene *scene, FILE *stream);

/* How much less the body gives under a small load across it with four-node tets than with tet10-mean on the same mesh:
 * 1 - the ratio of the works of the load. With the scene's pins and small-strain constants. FLESH_ERR_SOLVE where it
 * is held so that it could move as a rigid body, or the solve takes more than `max_linear` iterations. */
int flesh_locking_find(const flesh_scene *scene, int max_linear, double *missing);

#endif
