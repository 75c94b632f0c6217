/* box.c: regular grids of boxes, each of six tets around the diagonal from the low to the high corner (Kuhn 1960: one
 * tet for each order of the three axes). */
#include "mesh/box.h"

#include "mesh/mesh.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>

#include "base/error.h"

const int flesh_box_tets[6][4] = {{0, 1, 3, 7}, {0, 1, 7, 5}, {0, 2, 7, 3},
                                  {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 7, 6}};

double flesh_box_place(double origin, double size, int i, int n) { return origin + size * i / n; }

int flesh_box_check(const int cells[3], const double size[3], const double origin[3])
{
  double nodes = 1, tets = 6;
  for (int d = 0; d < 3; d++) {
    if (cells[d] < 1)
      return flesh_fail(FLESH_ERR_ARGUMENT, "cells along %c is %d; it must be at least 1", 'x' + d,
                        cells[d]);
    if (!(size[d] > 0) || !isfinite(size[d]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "size along %c is %g; it must be positive and finite",
                        'x' + d, size[d]);
    if (!isfinite(origin[d]))
      return flesh_fail(FLESH_ERR_ARGUMENT, "origin's %c is %g; it must be finite", 'x' + d,
                        origin[d]);
    nodes *= (double)cells[d] + 1;
    tets *= cells[d];
  }
  if (nodes > INT_MAX / 3 || tets > INT_MAX / 4)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%d x %d x %d cells make %.4g nodes and %.4g tets; at most %d and %d are "
                      "supported",
                      cells[0], cells[1], cells[2], nodes, tets, INT_MAX / 3, INT_MAX / 4);
  return FLESH_OK;
}

int flesh_mesh_box(const int cells[3], const double size[3], const double origin[3],
                   flesh_mesh **mesh)
{
  FLESH_NEED({mesh, "mesh"});
  *mesh = NULL;
  FLESH_NEED({cells, "cells"}, {size, "size"}, {origin, "origin"});
  int status = flesh_box_check(cells, size, origin);
  if (status) return status;
  int nx = cells[0], ny = cells[1], nz = cells[2];
  int nodes = (nx + 1) * (ny + 1) * (nz + 1), tets = 6 * nx * ny * nz;
  double *x = malloc(3 * (size_t)nodes * sizeof *x), *at = x;
  int *list = malloc(4 * (size_t)tets * sizeof *list), *n = list;
  if (!x || !list) {
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a box of %d tets", tets);
    goto done;
  }
  for (int k = 0; k <= nz; k++)
    for (int j = 0; j <= ny; j++)
      for (int i = 0; i <= nx; i++) {
        *at++ = flesh_box_place(origin[0], size[0], i, nx);
        *at++ = flesh_box_place(origin[1], size[1], j, ny);
        *at++ = flesh_box_place(origin[2], size[2], k, nz);
      }
  for (int k = 0; k < nz; k++)
    for (int j = 0; j < ny; j++)
      for (int i = 0; i < nx; i++)
        for (int t = 0; t < 6; t++)
          for (int c = 0; c < 4; c++) {
            int corner = flesh_box_tets[t][c];
            *n++ = ((k + (corner >> 2)) * (ny + 1) + j + (corner >> 1 & 1)) * (nx + 1) + i +
                   (corner & 1);
          }
  status = flesh_mesh_create(nodes, x, tets, list, NULL, mesh);
done:
  free(x);
  free(list);
  return status;
}
