/* near_patches.h: patches of surfaces that ignore each other (contact_patches.h makes them). */
#ifndef FLESH_GEOMETRY_NEAR_PATCHES_H
#define FLESH_GEOMETRY_NEAR_PATCHES_H

#include "geometry/contact_surface.h"

/* Two patches that ignore each other. */
typedef struct flesh_patch_pair {
  int patches[2], bodies[2], faces[2]; /* numbers, the lower patch first; their bodies; their numbers of faces */
  double place[3];                     /* m, a point where they intersect */
} flesh_patch_pair;

typedef struct flesh_contact_patches {
  const flesh_contact_surface *surface; /* borrowed */
  int count;                            /* number of patches */
  int *face_patch, *edge_patch, *node_patch; /* [faces], [edges], [nodes] number of the patch; -1: none */
  int pair_count, pair_room;
  flesh_patch_pair *pairs; /* [pair_count] ascending by patch numbers */
} flesh_contact_patches;

/* Returns the index of the pair of patches (a, b); -1: they touch. */
int flesh_contact_patches_find(const flesh_contact_patches *patches, int a, int b);

#endif
