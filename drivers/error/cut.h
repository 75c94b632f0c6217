/* cut.h: tets that boxes of body.regions cut. A tet has the density and material of the region that its middle is in; finer
 * meshes choose anew, and what lies on the other side of a box becomes less. */
#ifndef FLESH_ERROR_CUT_H
#define FLESH_ERROR_CUT_H

#include "flesh/scene.h"

typedef struct flesh_cut {
  int count;        /* of tets that are cut where densities or materials differ */
  double share;     /* of the body's volume that has those of the wrong side */
  int has_density;  /* whether densities differ there */
  double *shares;   /* [tets] of each tet's volume; NULL: no tet is cut. Owned, as is the next */
  int *materials;   /* [tets] that of the other side; of tets that are not cut their own */
} flesh_cut;

/* FLESH_ERR_MEMORY; cleared then. */
int flesh_cut_find(const flesh_scene *scene, flesh_cut *cut);
void flesh_cut_clear(flesh_cut *cut);

/* Writes "boxes of body.regions cut 12 tets, ..." of a cut that has tets. */
void flesh_cut_say(const flesh_cut *cut, size_t size, char *words);

/* Warns of what the bar of a column by `flesh run --to` leaves out: of positions it counts other materials. FLESH_ERR_MEMORY. */
int flesh_cut_warn(const flesh_scene *scene, const char *column);

#endif
