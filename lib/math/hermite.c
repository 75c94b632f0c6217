/* hermite.c: interpolates positions and velocities by divided differences; a time counts twice if its velocity is known
 * (Stoer and Bulirsch, Introduction to Numerical Analysis, 2.1.5). */
#include "math/hermite.h"

void flesh_hermite_weights(int count, const double *times, int half, int j, double t, double w[4])
{
  double z[2 * FLESH_HERMITE_TIMES], c[2 * FLESH_HERMITE_TIMES];
  int node[2 * FLESH_HERMITE_TIMES], size = 0;
  for (int k = 0; k < count; k++)
    for (int twice = k == 0 && half; twice < 2; twice++) node[size] = k, z[size++] = times[k];
  for (int what = 0; what < 2; what++) {
    for (int i = 0; i < size; i++) c[i] = !what && node[i] == j;
    for (int level = 1; level < size; level++)
      for (int i = size - 1; i >= level; i--)
        c[i] = node[i] == node[i - level] ? what && node[i] == j : (c[i] - c[i - 1]) / (z[i] - z[i - level]);
    double value = c[size - 1], slope = 0;
    for (int i = size - 2; i >= 0; i--) slope = slope * (t - z[i]) + value, value = value * (t - z[i]) + c[i];
    w[what] = value, w[2 + what] = slope;
  }
}
