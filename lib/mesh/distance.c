/* distance.c: distance of a deformed body from its rest shape, apart from a rigid motion. */
#include <math.h>

#include "flesh/mesh.h"
#include "mesh/mesh.h"
#include "mesh/rigid_fit.h"

double flesh_mesh_distance_from_rest(const flesh_mesh *mesh, const double *x)
{
  const double *X = flesh_mesh_positions(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  int nodes = flesh_mesh_node_count(mesh);
  double low[3], high[3], worst = 0;
  flesh_rigid_fit fit;
  flesh_rigid_fit_find(nodes, X, x, used, &fit);
  for (int c = 0; c < 3; c++) low[c] = INFINITY, high[c] = -INFINITY;
  for (int i = 0; i < nodes; i++) {
    if (!used[i]) continue;
    double y[3], square = 0;
    flesh_rigid_fit_apply(&fit, X + 3 * i, y);
    for (int c = 0; c < 3; c++) {
      square += (x[3 * i + c] - y[c]) * (x[3 * i + c] - y[c]);
      low[c] = fmin(low[c], X[3 * i + c]);
      high[c] = fmax(high[c], X[3 * i + c]);
    }
    /* The negation lets a NaN become the worst. */
    if (!(square <= worst)) worst = square;
  }
  return sqrt(worst) / fmax(fmax(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
}
