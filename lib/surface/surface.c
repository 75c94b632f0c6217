/* surface.c: makes a surface from arrays, cuts its faces into triangles, and gives access to it. */
#include "surface/surface.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

static int check(int vertices, const double *positions, int faces, const int *starts,
                 const int *corners)
{
  if (vertices < 1) return flesh_fail(FLESH_ERR_FILE, "the surface has no vertex");
  if (faces < 1) return flesh_fail(FLESH_ERR_FILE, "the surface has no face");
  if (starts[0]) return flesh_fail(FLESH_ERR_FILE, "starts[0] is %d; it must be 0", starts[0]);
  for (int d = 0; d < 3 * vertices; d++)
    if (!isfinite(positions[d]))
      return flesh_fail(FLESH_ERR_FILE, "vertex %d has a coordinate that is not finite", d / 3);
  for (int f = 0; f < faces; f++) {
    int count = starts[f + 1] - starts[f];
    if (count < 3 || count > FLESH_SURFACE_MAX_CORNERS)
      return flesh_fail(FLESH_ERR_FILE, "face %d has %d corners; it must have 3 to %d", f, count,
                        FLESH_SURFACE_MAX_CORNERS);
    for (int k = starts[f]; k < starts[f + 1]; k++)
      if (corners[k] < 0 || corners[k] >= vertices)
        return flesh_fail(FLESH_ERR_FILE, "face %d uses vertex %d; the vertices are 0 to %d", f,
                          corners[k], vertices - 1);
  }
  return FLESH_OK;
}

/* Cuts all faces into triangles; drops degenerate triangles. */
static int make_triangles(flesh_surface *s)
{
  int largest = 3;
  for (int f = 0; f < s->faces; f++)
    if (s->starts[f + 1] - s->starts[f] > largest) largest = s->starts[f + 1] - s->starts[f];
  size_t most = (size_t)s->starts[s->faces] - 2 * (size_t)s->faces;
  int *room = malloc(sizeof *room * 7 * (size_t)largest); /* rings, then the triangles of one face */
  s->triangles = malloc(sizeof *s->triangles * (3 * most + 1));
  if (!room || !s->triangles) {
    free(room);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of %d faces", s->faces);
  }
  int *cut = room + 4 * (size_t)largest;
  for (int f = 0; f < s->faces; f++) {
    const int *corners = s->corners + s->starts[f];
    int count = s->starts[f + 1] - s->starts[f];
    flesh_surface_cut(count, corners, s->positions, room, cut);
    for (int t = 0; t < count - 2; t++) {
      int a = corners[cut[3 * t]], b = corners[cut[3 * t + 1]], c = corners[cut[3 * t + 2]];
      if (a == b || b == c || c == a) continue;
      int *triangle = s->triangles + 3 * (size_t)s->triangle_count++;
      triangle[0] = a, triangle[1] = b, triangle[2] = c;
    }
  }
  free(room);
  return FLESH_OK;
}

static void *copy(const void *data, size_t size)
{
  void *made = malloc(size);
  return made ? memcpy(made, data, size) : NULL;
}

int flesh_surface_create(int vertices, const double *positions, int faces, const int *starts,
                         const int *corners, flesh_surface **surface)
{
  FLESH_NEED({surface, "surface"});
  *surface = NULL;
  FLESH_NEED({positions, "positions"}, {starts, "starts"}, {corners, "corners"});
  int status = check(vertices, positions, faces, starts, corners);
  if (status) return status;
  flesh_surface *s = calloc(1, sizeof *s);
  if (!s) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface");
  s->vertices = vertices;
  s->faces = faces;
  s->positions = copy(positions, sizeof *positions * 3 * (size_t)vertices);
  s->starts = copy(starts, sizeof *starts * ((size_t)faces + 1));
  s->corners = copy(corners, sizeof *corners * (size_t)starts[faces]);
  status = s->positions && s->starts && s->corners
               ? make_triangles(s)
               : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of %d faces", faces);
  if (status) flesh_surface_destroy(&s);
  *surface = s;
  return status;
}

int flesh_surface_of_mesh(const flesh_mesh *mesh, flesh_surface **surface)
{
  FLESH_NEED({surface, "surface"});
  *surface = NULL;
  FLESH_NEED({mesh, "mesh"});
  int nodes = flesh_mesh_node_count(mesh), count, used = 0;
  const int *triangles = flesh_mesh_surface(mesh, &count);
  const double *x = flesh_mesh_positions(mesh);
  int *number = malloc(sizeof *number * (size_t)nodes);
  int *corners = malloc(sizeof *corners * 3 * (size_t)count);
  int *starts = malloc(sizeof *starts * ((size_t)count + 1));
  double *positions = malloc(sizeof *positions * 3 * (size_t)nodes);
  int status = FLESH_OK;
  if (!number || !corners || !starts || !positions) {
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of %d triangles", count);
    goto done;
  }
  for (int i = 0; i < nodes; i++) number[i] = -1;
  for (int k = 0; k < 3 * count; k++) number[triangles[k]] = 0;
  for (int i = 0; i < nodes; i++) {
    if (number[i] < 0) continue;
    memcpy(positions + 3 * (size_t)used, x + 3 * (size_t)i, 3 * sizeof *x);
    number[i] = used++;
  }
  for (int k = 0; k < 3 * count; k++) corners[k] = number[triangles[k]];
  for (int f = 0; f <= count; f++) starts[f] = 3 * f;
  status = flesh_surface_create(used, positions, count, starts, corners, surface);
done:
  free(number);
  free(corners);
  free(starts);
  free(positions);
  return status;
}

void flesh_surface_destroy(flesh_surface **surface)
{
  if (!surface || !*surface) return;
  free((*surface)->positions);
  free((*surface)->starts);
  free((*surface)->corners);
  free((*surface)->triangles);
  free((*surface)->texture);
  free((*surface)->texture_corners);
  free(*surface);
  *surface = NULL;
}

int flesh_surface_vertex_count(const flesh_surface *surface) { return surface->vertices; }
int flesh_surface_face_count(const flesh_surface *surface) { return surface->faces; }
const double *flesh_surface_positions(const flesh_surface *surface) { return surface->positions; }
const int *flesh_surface_starts(const flesh_surface *surface) { return surface->starts; }
const int *flesh_surface_corners(const flesh_surface *surface) { return surface->corners; }

const int *flesh_surface_triangles(const flesh_surface *surface, int *count)
{
  *count = surface->triangle_count;
  return surface->triangles;
}
