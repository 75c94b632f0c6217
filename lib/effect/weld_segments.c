/* weld_segments.c: the common parts of the triangles of two surfaces. */
#include "effect/weld_segments.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "math/mat3.h"

static const double smallest_part = 1e-12; /* fraction of a triangle's area */
static const double facing = -0.5;         /* largest cosine between the normals */

typedef struct corner {
  double p[2]; /* coordinates in A's plane */
} corner;

/* Clips a polygon: keeps the part to the left of the line from `from` to `to` (Sutherland & Hodgman 1974). */
static int clip(const corner *in, int count, const double from[2], const double to[2], corner *out)
{
  int kept = 0;
  for (int k = 0; k < count; k++) {
    const double *p = in[k].p, *q = in[(k + 1) % count].p;
    const double sp = (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
    const double sq = (to[0] - from[0]) * (q[1] - from[1]) - (to[1] - from[1]) * (q[0] - from[0]);
    if (sp >= 0) out[kept++] = in[k];
    if ((sp >= 0) == (sq >= 0)) continue;
    const double s = sp / (sp - sq);
    for (int c = 0; c < 2; c++) out[kept].p[c] = p[c] + s * (q[c] - p[c]);
    kept++;
  }
  return kept;
}

/* Computes an orthonormal frame of a triangle's plane and normal. Returns twice its area, 0 if it has none. */
static double frame_of(const double *const T[3], double axis[3][3])
{
  double d[2][3];
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) d[k][c] = T[k + 1][c] - T[0][c];
  flesh_vec3_cross(d[0], d[1], axis[2]);
  const double along = sqrt(flesh_vec3_dot(d[0], d[0])), area = sqrt(flesh_vec3_dot(axis[2], axis[2]));
  if (!(area > 0)) return 0;
  for (int c = 0; c < 3; c++) axis[0][c] = d[0][c] / along, axis[2][c] /= area;
  flesh_vec3_cross(axis[2], axis[0], axis[1]);
  return area;
}

static double cross2(const double a[2], const double b[2], const double c[2])
{
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

int flesh_weld_segment(const double *const A[3], const double *const B[3], double L[FLESH_SEGMENT_CORNERS][3],
                       double *gap)
{
  double axis[3][3], other[3][3], middle[2] = {0}, area = 0;
  const double twice = frame_of(A, axis);
  corner a[3], polygon[2][FLESH_SEGMENT_CORNERS];
  if (!(twice > 0) || !(frame_of(B, other) > 0) || flesh_vec3_dot(axis[2], other[2]) > facing) return 0;
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 2; c++) {
      double of_a = 0, of_b = 0;
      for (int i = 0; i < 3; i++) {
        of_a += (A[k][i] - A[0][i]) * axis[c][i];
        of_b += (B[k][i] - A[0][i]) * axis[c][i];
      }
      a[k].p[c] = of_a;
      polygon[0][2 - k].p[c] = of_b; /* B is wound the opposite way */
    }
  int count = 3;
  for (int k = 0; k < 3 && count > 2; k++) {
    count = clip(polygon[0], count, a[k].p, a[(k + 1) % 3].p, polygon[1]);
    memcpy(polygon[0], polygon[1], (size_t)count * sizeof *polygon[0]);
  }
  if (count < 3) return 0;
  for (int k = 1; k + 1 < count; k++) area += cross2(polygon[0][0].p, polygon[0][k].p, polygon[0][k + 1].p);
  if (!(area > smallest_part * twice)) return 0;
  for (int k = 0; k < count; k++) {
    for (int i = 0; i < 3; i++) L[k][i] = cross2(polygon[0][k].p, a[(i + 1) % 3].p, a[(i + 2) % 3].p) / twice;
    for (int c = 0; c < 2; c++) middle[c] += polygon[0][k].p[c] / count;
  }
  /* Height of B's plane above the middle. */
  double height = 0;
  for (int i = 0; i < 3; i++)
    height += other[2][i] * (B[0][i] - A[0][i] - middle[0] * axis[0][i] - middle[1] * axis[1][i]);
  *gap = height / flesh_vec3_dot(other[2], axis[2]);
  return count;
}

typedef struct side {
  double low;
  int number;
} side;

static int compare(const void *a, const void *b)
{
  const side *p = a, *q = b;
  return p->low != q->low ? (p->low > q->low) - (p->low < q->low) : p->number - q->number;
}

static int apart(const double p[6], const double q[6])
{
  for (int c = 0; c < 3; c++)
    if (p[3 + c] < q[c] || q[3 + c] < p[c]) return 1;
  return 0;
}

/* Sorts the boxes by their low sides along the longest axis, and compares each with those that begin within it. */
int flesh_weld_pairs(int count_a, int count_b, const double (*boxes)[6], int (*visit)(void *data, int a, int b),
                     void *data)
{
  const int count = count_a + count_b;
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  int axis = 0, status = 0;
  side *sides = malloc(((size_t)count + 1) * sizeof *sides);
  if (!sides) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d boxes", count);
  for (int k = 0; k < count; k++)
    for (int c = 0; c < 3; c++) low[c] = fmin(low[c], boxes[k][c]), high[c] = fmax(high[c], boxes[k][3 + c]);
  for (int c = 1; c < 3; c++)
    if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
  for (int k = 0; k < count; k++) sides[k] = (side){boxes[k][axis], k};
  qsort(sides, (size_t)count, sizeof *sides, compare);
  for (int k = 0; k < count && !status; k++) {
    const int p = sides[k].number;
    for (int l = k + 1; l < count && !status && sides[l].low <= boxes[p][3 + axis]; l++) {
      const int q = sides[l].number;
      if ((p < count_a) == (q < count_a) || apart(boxes[p], boxes[q])) continue;
      status = visit(data, p < q ? p : q, (p < q ? q : p) - count_a);
    }
  }
  free(sides);
  return status;
}
