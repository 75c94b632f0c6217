/* picture_obstacle.c: the obstacles that a body touches, as triangles. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/contact.h"
#include "picture/picture_body.h"
#include "surface/surface.h"

static const flesh_obstacle *find(const flesh_picture_panel *panel, int wanted, int *count)
{
  const flesh_obstacle *found = NULL;
  *count = 0;
  for (int e = 0; panel->system && e < flesh_system_effect_count(panel->system); e++) {
    const flesh_obstacle *obstacle =
        flesh_effect_obstacle(flesh_system_effect(panel->system, e));
    if (obstacle && (*count)++ == wanted) found = obstacle;
  }
  return found;
}

int flesh_picture_obstacle_count(const flesh_picture_panel *panel)
{
  int count;
  find(panel, -1, &count);
  return count;
}

static int allocate(flesh_picture_obstacle *o, int vertices, int triangles)
{
  *o = (flesh_picture_obstacle){vertices, triangles, malloc((3 * (size_t)vertices + 1) * sizeof *o->x),
                                malloc((3 * (size_t)triangles + 1) * sizeof *o->corners), 0};
  if (o->x && o->corners) return FLESH_OK;
  flesh_picture_obstacle_free(o);
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
}

void flesh_picture_obstacle_free(flesh_picture_obstacle *o)
{
  free(o->x);
  free(o->corners);
  *o = (flesh_picture_obstacle){0};
}

/* A square, corner by corner around it, as a grid: what is behind the eye is left out triangle by triangle. */
static int cut_plane(const double *ring, flesh_picture_obstacle *o)
{
  enum { CELLS = 40 };
  const int status = allocate(o, (CELLS + 1) * (CELLS + 1), 2 * CELLS * CELLS);
  if (status) return status;
  double *x = o->x;
  int *c = o->corners;
  for (int j = 0; j <= CELLS; j++)
    for (int i = 0; i <= CELLS; i++)
      for (int d = 0; d < 3; d++)
        *x++ = ring[d] + i * (ring[3 + d] - ring[d]) / CELLS + j * (ring[6 + d] - ring[3 + d]) / CELLS;
  for (int j = 0; j < CELLS; j++)
    for (int i = 0; i < CELLS; i++) {
      int at = j * (CELLS + 1) + i, cell[6] = {at, at + 1, at + CELLS + 2, at, at + CELLS + 2, at + CELLS + 1};
      for (int k = 0; k < 6; k++) *c++ = cell[k];
    }
  return FLESH_OK;
}

/* Lets corners at one place be one node, so that light runs smoothly over seams. */
static int weld(int nodes, const double *positions, int triangles, int *corners)
{
  int *first = malloc(sizeof *first * ((size_t)nodes + 1));
  const int status = first ? flesh_surface_first_vertices(nodes, positions, first)
                           : flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  for (int c = 0; c < 3 * triangles && !status; c++) corners[c] = first[corners[c]];
  free(first);
  return status;
}

double flesh_picture_plane_extent(const flesh_view *view)
{
  return 2.4 * view->height * fmax(1, (double)view->width_px / view->height_px);
}

static int copy_surface(const flesh_surface *surface, flesh_picture_obstacle *o)
{
  const int status = allocate(o, flesh_surface_vertex_count(surface), flesh_surface_face_count(surface));
  if (status) return status;
  memcpy(o->x, flesh_surface_positions(surface), 3 * (size_t)o->vertices * sizeof *o->x);
  memcpy(o->corners, flesh_surface_corners(surface), 3 * (size_t)o->triangles * sizeof *o->corners);
  return FLESH_OK;
}

int flesh_picture_obstacle_make(const flesh_picture_panel *panel, int k, const flesh_view *view,
                                flesh_picture_obstacle *o)
{
  int count;
  const flesh_obstacle *obstacle = find(panel, k, &count);
  double centre[3] = {0, 0, 0}, extent = view ? flesh_picture_plane_extent(view) : 1;
  for (int d = 0; view && d < 3; d++) centre[d] = view->target[d];
  flesh_surface *surface;
  *o = (flesh_picture_obstacle){0};
  int status = flesh_obstacle_surface(obstacle, panel->t, centre, extent, &surface);
  if (status) return status;
  const int is_plane = flesh_surface_vertex_count(surface) == 4 && flesh_surface_face_count(surface) == 2;
  if (!is_plane) {
    status = copy_surface(surface, o);
    if (!status) status = weld(o->vertices, o->x, o->triangles, o->corners);
    if (!status && view) status = flesh_picture_face_body(panel, o->x, o->triangles, o->corners);
  } else if (view) {
    status = cut_plane(flesh_surface_positions(surface), o);
  }
  flesh_surface_destroy(&surface);
  if (status) flesh_picture_obstacle_free(o);
  o->is_plane = is_plane;
  return status;
}
