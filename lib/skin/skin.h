/* skin.h: the members of a skin. */
#ifndef FLESH_SKIN_SKIN_H
#define FLESH_SKIN_SKIN_H

#include <stdint.h>

#include "flesh/skin.h"

/* The mesh and surface that a binding belongs to. */
typedef struct flesh_skin_identity {
  int nodes, tets, vertices, faces;
  uint64_t mesh_hash, surface_hash;
} flesh_skin_identity;

struct flesh_skin {
  flesh_skin_identity identity;
  double inside;     /* distances up to this count as zero, m */
  int *tets;         /* [vertices] tet of each vertex */
  int size;          /* nodes of a tet, 4 or 10 */
  int *nodes;        /* [size*vertices] the tets' nodes */
  double *weights;   /* [4*vertices] barycentric coordinates */
  double *shapes;    /* [10*vertices] if size is 10: the nodes' weights; else NULL */
  double *distances; /* [vertices] m */
};

/* Makes an empty skin for this mesh and surface. Returns new. FLESH_ERR_MEMORY. */
int flesh_skin_open(const flesh_mesh *mesh, const flesh_surface *surface, flesh_skin **skin);
/* Binds vertex `v` to a tet. */
void flesh_skin_set(flesh_skin *skin, const flesh_mesh *mesh, int v, int tet,
                    const double weights[4], double distance);

#endif
