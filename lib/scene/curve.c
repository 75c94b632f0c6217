/* curve.c: the surfaces that a body's boundary stands for, as a scene names them. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/surface.h"
#include "math/mat3.h"
#include "math/nearest.h"
#include "mesh/curve.h"
#include "scene/scene.h"

#define AT(member) .offset = offsetof(flesh_scene_curved, member)
#define INSIDE(object, member) .offset = offsetof(flesh_scene_curved, member) - offsetof(flesh_scene_curved, object)
static const flesh_key sphere_keys[] = {
    {.name = "centre", .type = FLESH_KEY_VECTOR, INSIDE(sphere, sphere.centre), .unit = "m",
     .default_value = "[0, 0, 0]", .doc = "of the sphere"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, INSIDE(sphere, sphere.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "of the sphere"},
    {0}};
static const flesh_key cylinder_keys[] = {
    {.name = "from", .type = FLESH_KEY_VECTOR, INSIDE(cylinder, cylinder.from), .unit = "m",
     .doc = "one end of its axis"},
    {.name = "to", .type = FLESH_KEY_VECTOR, INSIDE(cylinder, cylinder.to), .unit = "m",
     .doc = "other end of its axis"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, INSIDE(cylinder, cylinder.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "of the cylinder"},
    {0}};
const flesh_key flesh_curved_table[] = {
    {.name = "sphere", .type = FLESH_KEY_OBJECT, AT(sphere), .default_value = "", .children = sphere_keys,
     .doc = "a sphere, in the mesh's coordinates"},
    {.name = "cylinder", .type = FLESH_KEY_OBJECT, AT(cylinder), .default_value = "", .children = cylinder_keys,
     .doc = "a cylinder, without its ends"},
    {.name = "surface", .type = FLESH_KEY_PATH, AT(surface), .default_value = "",
     .doc = "file of a surface (.obj or .ply) much finer than the mesh"},
    {0}};
#undef INSIDE
#undef AT

/* d along its own direction; returns its length. */
static double normalise(const double d[3], double unit[3])
{
  const double length = sqrt(flesh_vec3_dot(d, d));
  for (int c = 0; c < 3; c++) unit[c] = length > 0 ? d[c] / length : c == 0;
  return length;
}

static void nearest_on_sphere(const void *data, const double p[3], double at[3], double normal[3])
{
  const flesh_scene_curved *s = data;
  double d[3];
  for (int c = 0; c < 3; c++) d[c] = p[c] - s->sphere.centre[c];
  normalise(d, normal);
  for (int c = 0; c < 3; c++) at[c] = s->sphere.centre[c] + s->sphere.radius * normal[c];
}

static void nearest_on_cylinder(const void *data, const double p[3], double at[3], double normal[3])
{
  const flesh_scene_curved *s = data;
  double axis[3], along[3], d[3];
  for (int c = 0; c < 3; c++) axis[c] = s->cylinder.to[c] - s->cylinder.from[c], d[c] = p[c] - s->cylinder.from[c];
  const double length = normalise(axis, along), height = flesh_vec3_dot(d, along), foot = fmin(fmax(height, 0), length);
  for (int c = 0; c < 3; c++) d[c] -= height * along[c];
  normalise(d, normal);
  for (int c = 0; c < 3; c++) at[c] = s->cylinder.from[c] + foot * along[c] + s->cylinder.radius * normal[c];
}

/* Triangles with a ball round each, which most need not be looked at beyond. */
typedef struct triangles {
  int count;
  const int *corners;
  const double *X;
  double (*ball)[4]; /* [count] centre and radius */
} triangles;

static double distance(const double a[3], const double b[3])
{
  return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void nearest_on_triangles(const void *data, const double p[3], double at[3], double normal[3])
{
  const triangles *s = data;
  double best = INFINITY;
  int found = 0;
  for (int k = 0; k < s->count; k++) {
    const double *x[3];
    double w[3];
    if (distance(p, s->ball[k]) - s->ball[k][3] >= best) continue;
    for (int a = 0; a < 3; a++) x[a] = s->X + 3 * (size_t)s->corners[3 * (size_t)k + (size_t)a];
    const double square = flesh_nearest_on_triangle(x, p, w);
    if (!(sqrt(square) < best)) continue;
    best = sqrt(square);
    found = k;
    for (int c = 0; c < 3; c++) at[c] = w[0] * x[0][c] + w[1] * x[1][c] + w[2] * x[2][c];
  }
  const int *corner = s->corners + 3 * (size_t)found;
  double e[2][3], n[3];
  for (int a = 0; a < 2; a++)
    for (int c = 0; c < 3; c++) e[a][c] = s->X[3 * (size_t)corner[a + 1] + c] - s->X[3 * (size_t)corner[0] + c];
  flesh_vec3_cross(e[0], e[1], n);
  normalise(n, normal);
}

static int curve_to_file(const flesh_mesh *mesh, const char *path, flesh_mesh **curved, int *faces)
{
  flesh_surface *surface = NULL;
  triangles t = {0};
  int status = flesh_surface_read(path, &surface);
  if (status) return status;
  t.corners = flesh_surface_triangles(surface, &t.count);
  t.X = flesh_surface_positions(surface);
  t.ball = malloc(((size_t)t.count + 1) * sizeof *t.ball);
  if (!t.ball) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a surface of %d triangles", t.count);
  else if (!t.count) status = flesh_fail(FLESH_ERR_FILE, "%s: the surface has no triangle with an area", path);
  for (int k = 0; !status && k < t.count; k++) {
    for (int c = 0; c < 3; c++) {
      t.ball[k][c] = 0;
      for (int a = 0; a < 3; a++) t.ball[k][c] += t.X[3 * (size_t)t.corners[3 * k + a] + c] / 3;
    }
    t.ball[k][3] = 0;
    for (int a = 0; a < 3; a++)
      t.ball[k][3] = fmax(t.ball[k][3], distance(t.ball[k], t.X + 3 * (size_t)t.corners[3 * k + a]));
  }
  if (!status) status = flesh_mesh_curve(mesh, &(flesh_nearest_surface){&t, nearest_on_triangles}, curved, faces);
  free(t.ball);
  flesh_surface_destroy(&surface);
  return status;
}

static int curve_to(flesh_scene *scene, flesh_scene_curved *to, const flesh_mesh *mesh, flesh_mesh **curved, int *faces)
{
  const int sphere = !isnan(to->sphere.radius), cylinder = !isnan(to->cylinder.radius), file = to->surface != NULL;
  if (sphere + cylinder + file != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%d surfaces are given; one of sphere, cylinder or surface is needed",
                      sphere + cylinder + file);
  if (sphere) return flesh_mesh_curve(mesh, &(flesh_nearest_surface){to, nearest_on_sphere}, curved, faces);
  if (cylinder && distance(to->cylinder.from, to->cylinder.to) == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "cylinder.from and cylinder.to are the same point; they must be its two ends");
  if (cylinder) return flesh_mesh_curve(mesh, &(flesh_nearest_surface){to, nearest_on_cylinder}, curved, faces);
  int status = flesh_scene_make_absolute(scene, &to->surface);
  return status ? status : curve_to_file(mesh, to->surface, curved, faces);
}

int flesh_scene_curve_mesh(flesh_scene *scene, const flesh_objects *curved, flesh_mesh **mesh)
{
  flesh_scene_curved *entries = curved->values;
  for (int k = 0; k < curved->count; k++) {
    flesh_mesh *next = NULL;
    int faces = 0, status = flesh_mesh_order(*mesh) == 2
                                ? curve_to(scene, &entries[k], *mesh, &next, &faces)
                                : flesh_fail(FLESH_ERR_ARGUMENT,
                                             "four-node tets have straight edges; the element must be tet10 or "
                                             "tet10-mean");
    if (!status && !faces) {
      status = flesh_fail(FLESH_ERR_ARGUMENT, "no face of the mesh's boundary lies on it");
      flesh_mesh_destroy(&next);
    }
    if (status) return flesh_fail_within(status, "curved[%d]: ", k);
    flesh_mesh_destroy(mesh);
    *mesh = next;
  }
  return FLESH_OK;
}
