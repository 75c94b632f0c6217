/* nearest.c: nearest points on segments and triangles. */
#include "math/nearest.h"

#include "math/mat3.h"

double flesh_nearest_on_segment(const double A[3], const double B[3], const double p[3],
                                double weights[2])
{
  double e[3], d[3];
  for (int c = 0; c < 3; c++) e[c] = B[c] - A[c], d[c] = p[c] - A[c];
  weights[1] = fmin(fmax(flesh_vec3_dot(d, e) / flesh_vec3_dot(e, e), 0), 1);
  weights[0] = 1 - weights[1];
  for (int c = 0; c < 3; c++) d[c] -= weights[1] * e[c];
  return flesh_vec3_dot(d, d);
}

double flesh_nearest_on_triangle(const double *const X[3], const double p[3], double weights[3])
{
  double e[3], f[3], d[3];
  for (int c = 0; c < 3; c++)
    e[c] = X[1][c] - X[0][c], f[c] = X[2][c] - X[0][c], d[c] = p[c] - X[0][c];
  double ee = flesh_vec3_dot(e, e), ef = flesh_vec3_dot(e, f), ff = flesh_vec3_dot(f, f),
         de = flesh_vec3_dot(d, e), df = flesh_vec3_dot(d, f);
  double determinant = ee * ff - ef * ef, s = (ff * de - ef * df) / determinant,
         t = (ee * df - ef * de) / determinant;
  if (s >= 0 && t >= 0 && s + t <= 1) {
    weights[0] = 1 - s - t, weights[1] = s, weights[2] = t;
    for (int c = 0; c < 3; c++) d[c] -= s * e[c] + t * f[c];
    return flesh_vec3_dot(d, d);
  }
  double best = INFINITY;
  for (int a = 0; a < 3; a++) {
    int b = (a + 1) % 3;
    double w[2], distance = flesh_nearest_on_segment(X[a], X[b], p, w);
    if (!(distance < best)) continue;
    best = distance;
    weights[a] = w[0], weights[b] = w[1], weights[(a + 2) % 3] = 0;
  }
  return best;
}
