/* probe_patch.h: weights that smooth strain, stress and energy at a point, from the ten-node tets around it. */
#ifndef FLESH_OUTPUT_PROBE_PATCH_H
#define FLESH_OUTPUT_PROBE_PATCH_H

#include "output/tet_stress.h"

/* Finds the patch of a point X at rest in ten-node tet `tet`: new *tets [*count], those of ten nodes and the tet's material
 * that have a corner of it, and new *weights [4*count] of their quadrature points, which add up to 1. The caller frees
 * both in any case. FLESH_ERR_MEMORY. */
int flesh_patch_find(const flesh_tet_stress *stress, int tet, const double X[3], int *count, int **tets, double **weights);

#endif
