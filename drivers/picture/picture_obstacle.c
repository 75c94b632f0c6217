/* picture_obstacle.c: the obstacles that a body touches, as triangles. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "flesh/contact.h"
#include "effect/contact.h"
#include "picture/picture_body.h"

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

/* A parallelogram of four corners as a grid: what is behind the eye is left out triangle by
 * triangle. */
static int cut_plane(const double *corner[3], int *nodes, double **positions, int *triangles,
                     int **corners)
{
  enum { CELLS = 40 };
  double *x = malloc(sizeof *x * 3 * (CELLS + 1) * (CELLS + 1));
  int *c = malloc(sizeof *c * 6 * CELLS * CELLS);
  *nodes = (CELLS + 1) * (CELLS + 1);
  *triangles = 2 * CELLS * CELLS;
  *positions = x;
  *corners = c;
  if (!x || !c) {
    free(x), free(c);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  }
  for (int j = 0; j <= CELLS; j++)
    for (int i = 0; i <= CELLS; i++)
      for (int d = 0; d < 3; d++)
        *x++ = corner[0][d] + i * (corner[1][d] - corner[0][d]) / CELLS +
               j * (corner[2][d] - corner[1][d]) / CELLS;
  for (int j = 0; j < CELLS; j++)
    for (int i = 0; i < CELLS; i++) {
      int at = j * (CELLS + 1) + i, cell[6] = {at, at + 1, at + CELLS + 2, at, at + CELLS + 2, at + CELLS + 1};
      for (int k = 0; k < 6; k++) *c++ = cell[k];
    }
  return FLESH_OK;
}

/* An index per node, and places that compare. */
typedef struct spot {
  const double *x;
  int node;
} spot;

static int compare_spots(const void *a, const void *b)
{
  const spot *p = a, *q = b;
  for (int d = 0; d < 3; d++)
    if (p->x[d] != q->x[d]) return p->x[d] < q->x[d] ? -1 : 1;
  return 0;
}

/* Lets corners at one place be one node, so that light runs smoothly over seams. */
static int weld(int nodes, const double *positions, int triangles, int *corners)
{
  spot *spots = malloc(sizeof *spots * (size_t)(nodes + 1));
  int *first = malloc(sizeof *first * (size_t)(nodes + 1));
  if (!spots || !first) {
    free(spots), free(first);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a picture");
  }
  for (int i = 0; i < nodes; i++) spots[i] = (spot){positions + 3 * (size_t)i, i};
  qsort(spots, (size_t)nodes, sizeof *spots, compare_spots);
  for (int i = 0; i < nodes; i++) {
    int same = i && !compare_spots(&spots[i], &spots[i - 1]);
    first[spots[i].node] = same ? first[spots[i - 1].node] : spots[i].node;
  }
  for (int c = 0; c < 3 * triangles; c++) corners[c] = first[corners[c]];
  free(spots);
  free(first);
  return FLESH_OK;
}

double flesh_picture_plane_extent(const flesh_view *view)
{
  return 2.4 * view->height * fmax(1, (double)view->width_px / view->height_px);
}

static int copy_surface(const flesh_surface *surface, int *nodes, double **positions, int *triangles, int **corners)
{
  *nodes = flesh_surface_vertex_count(surface);
  *triangles = flesh_surface_face_count(surface);
  const size_t places = 3 * (size_t)*nodes * sizeof **positions, ends = 3 * (size_t)*triangles * sizeof **corners;
  *positions = malloc(places);
  *corners = malloc(ends);
  if (!*positions || !*corners) {
    free(*positions);
    free(*corners);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  }
  memcpy(*positions, flesh_surface_positions(surface), places);
  memcpy(*corners, flesh_surface_corners(surface), ends);
  return FLESH_OK;
}

int flesh_picture_obstacle(const flesh_picture_panel *panel, int k, const flesh_view *view,
                           int *nodes, double **positions, int *triangles, int **corners)
{
  int count;
  const flesh_obstacle *obstacle = find(panel, k, &count);
  double centre[3] = {0, 0, 0}, extent = 1;
  for (int d = 0; view && d < 3; d++) centre[d] = view->target[d];
  if (view) extent = flesh_picture_plane_extent(view);
  flesh_surface *surface;
  int status = flesh_obstacle_surface(obstacle, panel->t, centre, extent, &surface);
  if (status) return status;
  status = copy_surface(surface, nodes, positions, triangles, corners);
  flesh_surface_destroy(&surface);
  if (status) return status;
  if (*nodes != 4 || *triangles != 2) {
    status = weld(*nodes, *positions, *triangles, *corners);
    if (!status && view) status = flesh_picture_face_body(panel, *positions, *triangles, *corners);
    if (status) free(*positions), free(*corners);
    return status;
  }
  double *x = *positions; /* a plane's square, corner by corner around it */
  int *c = *corners;
  const double *ring[3] = {x, x + 3, x + 6};
  if (view) {
    status = cut_plane(ring, nodes, positions, triangles, corners);
  } else {
    *nodes = *triangles = 0;
    *positions = NULL;
    *corners = NULL;
  }
  free(x);
  free(c);
  return status;
}

int flesh_picture_is_plane(const flesh_picture_panel *panel, int k)
{
  int nodes = 1, triangles, *corners;
  double *x;
  if (flesh_picture_obstacle(panel, k, NULL, &nodes, &x, &triangles, &corners)) return 0;
  free(x);
  free(corners);
  return !nodes;
}
