/* curve.c: the surfaces that a body's boundary approximates, as given in a scene. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/surface.h"
#include "math/area.h"
#include "math/mat3.h"
#include "math/nearest.h"
#include "mesh/curve.h"
#include "scene/scene.h"

#define AT(member) .offset = offsetof(flesh_scene_curved, member)
#define INSIDE(object, member) .offset = offsetof(flesh_scene_curved, member) - offsetof(flesh_scene_curved, object)
static const flesh_key sphere_keys[] = {
    {.name = "centre", .type = FLESH_KEY_VECTOR, INSIDE(sphere, sphere.centre), .unit = "m",
     .default_value = "[0, 0, 0]", .doc = "centre of the sphere"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, INSIDE(sphere, sphere.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "radius of the sphere"},
    {0}};
static const flesh_key cylinder_keys[] = {
    {.name = "from", .type = FLESH_KEY_VECTOR, INSIDE(cylinder, cylinder.from), .unit = "m",
     .doc = "one end of its axis"},
    {.name = "to", .type = FLESH_KEY_VECTOR, INSIDE(cylinder, cylinder.to), .unit = "m",
     .doc = "other end of its axis"},
    {.name = "radius", .type = FLESH_KEY_NUMBER, INSIDE(cylinder, cylinder.radius), .range = FLESH_RANGE_POSITIVE,
     .unit = "m", .doc = "radius of the cylinder"},
    {0}};
const flesh_key flesh_curved_table[] = {
    {.name = "sphere", .type = FLESH_KEY_OBJECT, AT(sphere), .default_value = "", .children = sphere_keys,
     .doc = "a sphere, in the mesh's coordinates"},
    {.name = "cylinder", .type = FLESH_KEY_OBJECT, AT(cylinder), .default_value = "", .children = cylinder_keys,
     .doc = "the side of a cylinder, without its ends"},
    {.name = "surface", .type = FLESH_KEY_PATH, AT(surface), .default_value = "",
     .doc = "file of a surface (.obj, .ply or .stl) much finer than the mesh"},
    {0}};
#undef INSIDE
#undef AT

/* Computes the unit vector along d; returns the length of d. */
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

/* Triangles, each with a ball around it by which most are skipped. */
typedef struct triangles {
  int count;
  const int *corners;
  const double *X;
  double (*ball)[4]; /* [count] centre and radius */
  flesh_surface *surface;
} triangles;

static void nearest_on_triangles(const void *data, const double p[3], double at[3], double normal[3])
{
  const triangles *s = data;
  double best = INFINITY;
  int found = 0;
  for (int k = 0; k < s->count; k++) {
    const double *x[3];
    double w[3];
    if (flesh_distance(p, s->ball[k]) - s->ball[k][3] >= best) continue;
    for (int a = 0; a < 3; a++) x[a] = s->X + 3 * (size_t)s->corners[3 * (size_t)k + (size_t)a];
    const double square = flesh_nearest_on_triangle(x, p, w);
    if (!(sqrt(square) < best)) continue;
    best = sqrt(square);
    found = k;
    for (int c = 0; c < 3; c++) at[c] = w[0] * x[0][c] + w[1] * x[1][c] + w[2] * x[2][c];
  }
  double n[3];
  flesh_area_vector_at(s->X, s->corners + 3 * (size_t)found, n);
  normalise(n, normal);
}

static int open_file(const char *path, triangles *t)
{
  int status = flesh_surface_read(path, &t->surface);
  if (status) return status;
  t->corners = flesh_surface_triangles(t->surface, &t->count);
  t->X = flesh_surface_positions(t->surface);
  if (!t->count) return flesh_fail(FLESH_ERR_FILE, "%s: the surface has no triangle with an area", path);
  t->ball = malloc((size_t)t->count * sizeof *t->ball);
  if (!t->ball) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a surface of %d triangles", t->count);
  for (size_t k = 0; k < (size_t)t->count; k++) {
    for (int c = 0; c < 3; c++) {
      t->ball[k][c] = 0;
      for (int a = 0; a < 3; a++) t->ball[k][c] += t->X[3 * (size_t)t->corners[3 * k + (size_t)a] + (size_t)c] / 3;
    }
    t->ball[k][3] = 0;
    for (size_t a = 0; a < 3; a++)
      t->ball[k][3] = fmax(t->ball[k][3], flesh_distance(t->ball[k], t->X + 3 * (size_t)t->corners[3 * k + a]));
  }
  return FLESH_OK;
}

/* The surfaces of a body while its mesh is put on them. */
typedef struct surfaces {
  int count;
  flesh_nearest_surface *nearest; /* [count] */
  triangles *files;               /* [count], empty where no file is named */
  int *found, *left;              /* [count] faces on each surface, and faces near it but not on it */
} surfaces;

static int open_surface(flesh_scene *scene, flesh_scene_curved *to, flesh_nearest_surface *nearest, triangles *file)
{
  const int sphere = !isnan(to->sphere.radius), cylinder = !isnan(to->cylinder.radius), path = to->surface != NULL;
  if (sphere + cylinder + path != 1)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%d surfaces are given; one of sphere, cylinder or surface is needed",
                      sphere + cylinder + path);
  *nearest = (flesh_nearest_surface){to, sphere ? nearest_on_sphere : nearest_on_cylinder};
  if (cylinder && flesh_distance(to->cylinder.from, to->cylinder.to) == 0)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "cylinder.from and cylinder.to are the same point; they must be its two ends");
  if (!path) return FLESH_OK;
  *nearest = (flesh_nearest_surface){file, nearest_on_triangles};
  int status = flesh_scene_make_absolute(scene, &to->surface);
  return status ? status : open_file(to->surface, file);
}

static void close_surfaces(surfaces *s)
{
  for (int k = 0; s->files && k < s->count; k++) {
    free(s->files[k].ball);
    flesh_surface_destroy(&s->files[k].surface);
  }
  free(s->nearest);
  free(s->files);
  free(s->found);
  free(s->left);
}

static int open_surfaces(flesh_scene *scene, const flesh_objects *curved, surfaces *s)
{
  const size_t count = (size_t)curved->count;
  *s = (surfaces){curved->count, calloc(count, sizeof *s->nearest), calloc(count, sizeof *s->files),
                  calloc(count, sizeof *s->found), calloc(count, sizeof *s->left)};
  if (!s->nearest || !s->files || !s->found || !s->left) return flesh_no_memory();
  for (int k = 0; k < s->count; k++) {
    const int status = open_surface(scene, (flesh_scene_curved *)curved->values + k, &s->nearest[k], &s->files[k]);
    if (status) return flesh_fail_within(status, "curved[%d]: ", k);
  }
  return FLESH_OK;
}

/* Finds the faces on the surfaces, into on [4*tets]; the scene's warning lists faces that are near a surface but not on
 * it. */
static int find_faces(flesh_scene *scene, const char *body, const flesh_mesh *mesh, const surfaces *s, int *on)
{
  int status = flesh_mesh_find_curved_faces(mesh, s->count, s->nearest, on, s->found, s->left);
  for (int k = 0; !status && k < s->count; k++) {
    if (!s->found[k])
      return flesh_fail(FLESH_ERR_ARGUMENT, "curved[%d]: no face of the mesh's boundary lies on it", k);
    if (!s->left[k]) continue;
    const int one = s->left[k] == 1;
    status = flesh_scene_warn(scene, flesh_arena_print(&scene->arena, "%s.curved[%d]: %d face%s of the mesh near it stay%s as %s: "
                                                       "a corner is farther from it than a tenth of the longest edge",
                                                       body, k, s->left[k], one ? "" : "s", one ? "s" : "",
                                                       one ? "it is" : "they are"));
  }
  return status;
}

/* Replaces *mesh by the refined mesh and *on [4*tets] by the marks of its faces. */
static int refine(flesh_mesh **mesh, int **on)
{
  flesh_mesh *refined;
  int status = flesh_mesh_refine(*mesh, &refined);
  if (status) return status;
  int *finer = malloc(4 * (size_t)flesh_mesh_tet_count(refined) * sizeof *finer);
  if (finer) flesh_mesh_refine_curved_faces(*mesh, *on, refined, finer);
  else status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d tets", flesh_mesh_tet_count(refined));
  flesh_mesh_destroy(mesh);
  free(*on);
  *mesh = refined;
  *on = finer;
  return status;
}

/* Finds the faces on the unrefined mesh: its corners are where the file puts them, so that their distance from the
 * surface is known. */
int flesh_scene_curve_mesh(flesh_scene *scene, const char *body, const flesh_objects *curved, flesh_mesh **mesh)
{
  surfaces s = {0};
  if (!curved->count) return FLESH_OK;
  if (flesh_mesh_order(*mesh) != 2)
    return flesh_fail(FLESH_ERR_ARGUMENT, "curved: four-node tets have straight edges; the element must be tet10 or "
                                          "tet10-mean");
  int *on = malloc(4 * (size_t)flesh_mesh_tet_count(*mesh) * sizeof *on);
  int status = on ? open_surfaces(scene, curved, &s) : flesh_no_memory();
  if (!status) status = find_faces(scene, body, *mesh, &s, on);
  for (int refined = 0; !status; refined++) {
    flesh_mesh *next;
    status = flesh_mesh_curve(*mesh, s.nearest, on, &next);
    if (status) status = flesh_fail_within(status, "curved: ");
    else flesh_mesh_destroy(mesh), *mesh = next;
    if (status || refined == scene->keys.body.refine) break;
    status = refine(mesh, &on);
  }
  free(on);
  close_surfaces(&s);
  return status;
}
