/* coarse_cell.h: trilinear displacements within a cell of the coarse level's grid. Bits 0, 1 and 2 of a corner's number a
 * are its x, y and z. */
#ifndef FLESH_LINEAR_COARSE_CELL_H
#define FLESH_LINEAR_COARSE_CELL_H

#include <string.h>

#include "linear/lanes.h"

enum { FLESH_COARSE_CORNERS = 8 };

/* Returns the weight of each corner in a node's displacement. */
static inline flesh_float8 flesh_coarse_weights(flesh_float4 local)
{
  const flesh_float8 x0 = {1, 0, 1, 0, 1, 0, 1, 0}, x1 = {-1, 1, -1, 1, -1, 1, -1, 1};
  const flesh_float8 y0 = {1, 1, 0, 0, 1, 1, 0, 0}, y1 = {-1, -1, 1, 1, -1, -1, 1, 1};
  const flesh_float8 z0 = {1, 1, 1, 1, 0, 0, 0, 0}, z1 = {-1, -1, -1, -1, 1, 1, 1, 1};
  return (x0 + x1 * local[0]) * (y0 + y1 * local[1]) * (z0 + z1 * local[2]);
}

/* Corners of a pair's second cell are stored side by side, as many as a register holds; the type has room for nine numbers
 * of each. */
typedef float flesh_coarse_floats __attribute__((vector_size(4 * FLESH_ASIDE)));

/* Returns the weights of the corners from `first` on. */
static inline flesh_aside flesh_coarse_some_weights(flesh_float4 local, int first)
{
  const flesh_float8 all = flesh_coarse_weights(local);
  flesh_coarse_floats some;
  memcpy(&some, (const float *)&all + first, sizeof some);
  return __builtin_convertvector(some, flesh_aside);
}

/* Converts displacements of the corners to coefficients of 1, x, y, xy, z, xz, yz, xyz. */
static inline void flesh_coarse_to_products(flesh_float4 u[FLESH_COARSE_CORNERS])
{
  for (int bit = 1; bit < FLESH_COARSE_CORNERS; bit *= 2)
    for (int a = 0; a < FLESH_COARSE_CORNERS; a++)
      if (a & bit) u[a] -= u[a ^ bit];
}

#endif
