/* distance.c: how far a deformed body is from its rest shape, wherever it has moved to. */
#include <math.h>

#include "flesh/mesh.h"
#include "math/mat3.h"
#include "math/svd3.h"

double flesh_mesh_distance_from_rest(const flesh_mesh *mesh, const double *x)
{
  const double *X = flesh_mesh_positions(mesh);
  const uint8_t *used = flesh_mesh_node_used(mesh);
  int nodes = flesh_mesh_node_count(mesh), count = 0;
  double centre[3] = {0}, moved[3] = {0}, low[3], high[3], H[9] = {0}, R[9], U[9], sigma[3], V[9];
  for (int c = 0; c < 3; c++) low[c] = INFINITY, high[c] = -INFINITY;
  for (int i = 0; i < nodes; i++) {
    if (!used[i]) continue;
    count++;
    for (int c = 0; c < 3; c++) {
      centre[c] += X[3 * i + c];
      moved[c] += x[3 * i + c];
      low[c] = fmin(low[c], X[3 * i + c]);
      high[c] = fmax(high[c], X[3 * i + c]);
    }
  }
  for (int c = 0; c < 3; c++) centre[c] /= count, moved[c] /= count;
  for (int i = 0; i < nodes; i++) {
    if (!used[i]) continue;
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++)
        H[3 * r + c] += (X[3 * i + r] - centre[r]) * (x[3 * i + c] - moved[c]);
  }
  flesh_svd3(H, U, sigma, V);
  flesh_mat3_multiply_transposed(V, U, R);
  double worst = 0, length = fmax(fmax(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
  for (int i = 0; i < nodes; i++) {
    if (!used[i]) continue;
    double d[3], y[3], square = 0;
    for (int c = 0; c < 3; c++) d[c] = X[3 * i + c] - centre[c];
    flesh_mat3_times(R, d, y);
    for (int c = 0; c < 3; c++) {
      double e = x[3 * i + c] - moved[c] - y[c];
      square += e * e;
    }
    /* A non-finite position must not hide behind a comparison. */
    if (!(square <= worst)) worst = square;
  }
  return sqrt(worst) / length;
}
