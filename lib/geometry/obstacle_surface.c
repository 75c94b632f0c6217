/* obstacle_surface.c: triangulates obstacles for pictures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/surface.h"
#include "geometry/obstacle.h"
#include "geometry/obstacle_shape.h"
#include "math/mat3.h"

enum { AROUND = 48, HALF = 12 }; /* sides of a circle; rings of a half-sphere */

typedef struct sheet {
  int nodes, triangles;
  double *positions;
  int *corners;
} sheet;

static int make_room(sheet *s, int nodes, int triangles)
{
  *s = (sheet){nodes, triangles, malloc(3 * (size_t)nodes * sizeof *s->positions),
               malloc(3 * (size_t)triangles * sizeof *s->corners)};
  if (s->positions && s->corners) return FLESH_OK;
  free(s->positions);
  free(s->corners);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the picture of an obstacle");
}

/* Computes unit vectors u, v that form a right-handed frame with the unit vector n. */
static void frame_around(const double n[3], double u[3], double v[3])
{
  int smallest = 0;
  for (int c = 1; c < 3; c++)
    if (fabs(n[c]) < fabs(n[smallest])) smallest = c;
  double length = 0;
  for (int c = 0; c < 3; c++) {
    u[c] = (c == smallest) - n[smallest] * n[c];
    length += u[c] * u[c];
  }
  for (int c = 0; c < 3; c++) u[c] /= sqrt(length);
  flesh_vec3_cross(n, u, v);
}

static int plane_sheet(const flesh_obstacle *o, const double centre[3], double extent, sheet *s)
{
  static const int corners[6] = {0, 1, 2, 0, 2, 3};
  double u[3], v[3], height = 0;
  int status = make_room(s, 4, 2);
  if (status) return status;
  frame_around(o->b, u, v);
  for (int c = 0; c < 3; c++) height += o->b[c] * (centre[c] - o->a[c]);
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++)
      s->positions[3 * k + c] = centre[c] - height * o->b[c] +
                                extent * ((k == 1 || k == 2 ? 1 : -1) * u[c] + (k > 1 ? 1 : -1) * v[c]);
  memcpy(s->corners, corners, sizeof corners);
  return FLESH_OK;
}

/* Triangulates two half-spheres with a capsule's cylinder between them; those of a sphere share their equator. */
static int round_sheet(const flesh_obstacle *o, sheet *s)
{
  double n[3] = {0, 0, 1}, u[3], v[3], length = 0;
  for (int c = 0; c < 3; c++) length += (o->b[c] - o->a[c]) * (o->b[c] - o->a[c]);
  for (int c = 0; c < 3 && length > 0; c++) n[c] = (o->b[c] - o->a[c]) / sqrt(length);
  const int equators = length > 0 ? 2 : 1, last = 2 * HALF + equators - 1; /* `last`: number of the last ring, counting
                                                                            * the poles as rings */
  int status = make_room(s, 2 + (last - 1) * AROUND, 2 * (last - 1) * AROUND), next = 0;
  if (status) return status;
  frame_around(n, u, v);
  const double right = acos(0);
  for (int ring = 0; ring <= last; ring++) {
    int upper = ring > HALF, pole = ring == 0 || ring == last;
    double height = -right + right * (ring - (upper ? equators - 1 : 0)) / HALF;
    double up = pole ? (upper ? 1 : -1) : sin(height);
    for (int k = 0; k < (pole ? 1 : AROUND); k++, next++)
      for (int c = 0; c < 3; c++) {
        double out = pole ? 0 : cos(height), angle = 4 * right * k / AROUND;
        s->positions[3 * next + c] = (upper ? o->b : o->a)[c] +
            o->radius * (up * n[c] + out * (cos(angle) * u[c] + sin(angle) * v[c]));
      }
  }
  int *corner = s->corners;
  for (int ring = 0; ring < last; ring++)
    for (int k = 0; k < AROUND; k++) {
      int low = ring == 0 ? 0 : 1 + (ring - 1) * AROUND, high = 1 + ring * AROUND, on = (k + 1) % AROUND;
      if (ring > 0) *corner++ = low + k, *corner++ = low + on, *corner++ = ring < last - 1 ? high + k : high;
      if (ring < last - 1) *corner++ = high + k, *corner++ = ring == 0 ? 0 : low + on, *corner++ = high + on;
    }
  return FLESH_OK;
}

static int mesh_sheet(const flesh_obstacle *o, sheet *s)
{
  int nodes, triangles;
  const double *positions;
  const int *corners;
  flesh_obstacle_tree_surface(o->tree, &nodes, &positions, &triangles, &corners);
  int status = make_room(s, nodes, triangles);
  if (status) return status;
  memcpy(s->positions, positions, 3 * (size_t)nodes * sizeof *positions);
  memcpy(s->corners, corners, 3 * (size_t)triangles * sizeof *corners);
  return FLESH_OK;
}

/* Copies the triangles into a new surface. */
static int make_surface(const sheet *s, flesh_surface **surface)
{
  int *starts = malloc(((size_t)s->triangles + 1) * sizeof *starts);
  if (!starts) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the surface of an obstacle");
  for (int k = 0; k <= s->triangles; k++) starts[k] = 3 * k;
  const int status = flesh_surface_create(s->nodes, s->positions, s->triangles, starts, s->corners, surface);
  free(starts);
  return status;
}

int flesh_obstacle_surface(const flesh_obstacle *obstacle, double t, const double centre[3], double extent,
                           flesh_surface **surface)
{
  FLESH_NEED({surface, "surface"});
  *surface = NULL;
  FLESH_NEED({obstacle, "obstacle"});
  sheet s;
  int status;
  flesh_frame frame;
  double y[3];
  flesh_obstacle_frame(obstacle, t, &frame);
  if (obstacle->shape == FLESH_OBSTACLE_PLANE) {
    FLESH_NEED({centre, "centre"});
    flesh_frame_enter(&frame, centre, y);
    status = plane_sheet(obstacle, y, extent, &s);
  } else {
    status = obstacle->shape == FLESH_OBSTACLE_MESH ? mesh_sheet(obstacle, &s) : round_sheet(obstacle, &s);
  }
  if (status) return status;
  for (int i = 0; i < s.nodes; i++) {
    memcpy(y, s.positions + 3 * (size_t)i, sizeof y);
    flesh_frame_leave(&frame, y, s.positions + 3 * (size_t)i);
  }
  status = make_surface(&s, surface);
  free(s.positions);
  free(s.corners);
  return status;
}
