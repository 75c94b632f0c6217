/* surface_winding.c: winding numbers by casting rays. */
#include "geometry/surface_winding.h"

#include <math.h>

#include "geometry/orient.h"
#include "math/area.h"
#include "math/mat3.h"

/* At most RAYS rays are tried, each a segment that ends outside the surface. */
enum { RAYS = 32, UNKNOWN = 2 };

/* Returns 1 if the ray pq leaves through the triangle, -1 if it enters, 0 if it misses it, and UNKNOWN if it meets its
 * rim. The point p lies on no triangle but its own. */
static int crossing(const double *p, const double *q, const double *a, const double *b, const double *c)
{
  const int from = flesh_orient3d(a, b, c, p), to = flesh_orient3d(a, b, c, q);
  if (from == 0 || from == to) return 0;
  const int sides[3] = {flesh_orient3d(p, q, a, b), flesh_orient3d(p, q, b, c), flesh_orient3d(p, q, c, a)};
  int left = 0, right = 0;
  for (int k = 0; k < 3; k++) left += sides[k] > 0, right += sides[k] < 0;
  if (left && right) return 0;
  return left < 3 && right < 3 ? UNKNOWN : to == 0 ? UNKNOWN : to;
}

/* Computes the end q of ray k, which starts at p in a direction tilted from the normal n and is long enough to leave
 * the surface. */
static void find_end(const double *p, const double n[3], double length, int k, double q[3])
{
  double d[3], size;
  for (int c = 0; c < 3; c++) d[c] = n[c] + (k ? 0.7 : 0.1) * sin(1 + 3.7 * k + 2.1 * c);
  size = sqrt(flesh_vec3_dot(d, d));
  for (int c = 0; c < 3; c++) q[c] = p[c] + length * d[c] / size;
}

/* Returns a length that exceeds every distance within the surface. */
static double extent(const flesh_contact_surface *s, const double *x)
{
  double sum = 0;
  for (int c = 0; c < 3; c++) {
    double low = INFINITY, high = -INFINITY;
    for (int k = 0; k < s->node_count; k++) {
      low = fmin(low, x[3 * (size_t)s->nodes[k] + (size_t)c]);
      high = fmax(high, x[3 * (size_t)s->nodes[k] + (size_t)c]);
    }
    sum += high - low;
  }
  return 2 * sum;
}

int flesh_surface_winding(const flesh_contact_surface *s, const int *face_body, int body, int from, const double *x)
{
  const double *corner[3];
  double p[3], n[3], q[3];
  for (int k = 0; k < 3; k++) corner[k] = x + 3 * (size_t)s->faces[3 * from + k];
  for (int c = 0; c < 3; c++) p[c] = (corner[0][c] + corner[1][c] + corner[2][c]) / 3;
  flesh_area_vector(corner[0], corner[1], corner[2], n);
  const double area = sqrt(flesh_vec3_dot(n, n)), length = extent(s, x);
  if (!(area > 0) || !(length < INFINITY)) return 0;
  for (int c = 0; c < 3; c++) n[c] /= area;
  for (int k = 0; k < RAYS; k++) {
    int sum = 0, known = 1;
    find_end(p, n, length, k, q);
    if (flesh_orient3d(corner[0], corner[1], corner[2], q) <= 0) continue;
    for (int f = 0; f < s->face_count && known; f++) {
      if (f == from || face_body[f] != body) continue;
      const int *g = s->faces + 3 * (size_t)f;
      const int met = crossing(p, q, x + 3 * (size_t)g[0], x + 3 * (size_t)g[1], x + 3 * (size_t)g[2]);
      known = met != UNKNOWN;
      sum += met;
    }
    if (known) return sum;
  }
  return 0;
}
