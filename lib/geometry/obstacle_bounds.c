/* obstacle_bounds.c: boxes around nodes, and whether an obstacle is far from all that is in one. */
#include "geometry/obstacle_bounds.h"

#include <math.h>

#include "geometry/obstacle_shape.h"
#include "math/nearest.h"

/* Relative margin for rounding, so that an obstacle exactly at the reach does not count as far. */
static const double slack = 1e-9;

flesh_bounds flesh_bounds_of(int count, const int *nodes, const double *x)
{
  const double *first = x + 3 * (size_t)nodes[0];
  flesh_bounds b = {{first[0], first[1], first[2]}, {first[0], first[1], first[2]}};
  double sound = 0; /* becomes NaN if a position is not finite */
  for (int k = 0; k < count; k++) {
    const double *p = x + 3 * (size_t)nodes[k];
    for (int c = 0; c < 3; c++) {
      b.low[c] = p[c] < b.low[c] ? p[c] : b.low[c];
      b.high[c] = p[c] > b.high[c] ? p[c] : b.high[c];
      sound += 0 * p[c];
    }
  }
  for (int c = 0; c < 3; c++) b.low[c] += sound, b.high[c] += sound;
  return b;
}

flesh_bounds flesh_bounds_enter(const flesh_frame *frame, const flesh_bounds *bounds)
{
  if (!frame->moved) return *bounds;
  double centre[3], half[3], y[3];
  for (int c = 0; c < 3; c++) {
    centre[c] = (bounds->low[c] + bounds->high[c]) / 2;
    half[c] = (bounds->high[c] - bounds->low[c]) / 2;
  }
  flesh_frame_enter(frame, centre, y);
  flesh_bounds b;
  for (int c = 0; c < 3; c++) {
    double reach = 0;
    for (int k = 0; k < 3; k++) reach += fabs(frame->R[3 * k + c]) * half[k];
    b.low[c] = y[c] - reach;
    b.high[c] = y[c] + reach;
  }
  return b;
}

flesh_bounds flesh_bounds_join(const flesh_bounds *a, const flesh_bounds *b)
{
  flesh_bounds joined;
  for (int c = 0; c < 3; c++) { /* a NaN in either stays */
    joined.low[c] = b->low[c] >= a->low[c] ? a->low[c] : b->low[c] + 0 * a->low[c];
    joined.high[c] = b->high[c] <= a->high[c] ? a->high[c] : b->high[c] + 0 * a->high[c];
  }
  return joined;
}

/* Returns the distance of the box from p; NaN if the box has NaN. */
static double distance_of(const flesh_bounds *b, const double p[3])
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    const double below = b->low[c] - p[c], above = p[c] - b->high[c];
    const double d = below > above ? below : above;
    square += d > 0 ? d * d : 0 * d;
  }
  return sqrt(square);
}

int flesh_bounds_are_far(const flesh_bounds *bounds, const double p[3], double reach)
{
  return distance_of(bounds, p) > reach * (1 + slack);
}

/* Computes the sphere around a box; its radius is half of the box's diagonal. */
static void sphere_around(const flesh_bounds *b, double centre[3], double *radius)
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    const double half = (b->high[c] - b->low[c]) / 2;
    centre[c] = b->low[c] + half;
    square += half * half;
  }
  *radius = sqrt(square);
}

/* Returns the least of n.(y - a) over the box, minus a margin for rounding. */
static double above_plane(const flesh_obstacle *o, const flesh_bounds *b)
{
  double least = 0, size = 0;
  for (int c = 0; c < 3; c++) {
    const double y = o->b[c] > 0 ? b->low[c] : b->high[c];
    least += o->b[c] * (y - o->a[c]);
    size += fabs(b->low[c]) + fabs(b->high[c]) + fabs(o->a[c]);
  }
  return least - slack * size;
}

/* Returns a lower bound of the distance of the capsule's axis from the box, with a margin for rounding. */
static double from_axis(const flesh_obstacle *o, const flesh_bounds *bounds)
{
  double centre[3], radius, weights[2], square = 0;
  sphere_around(bounds, centre, &radius);
  flesh_nearest_on_segment(o->a, o->b, centre, weights);
  for (int c = 0; c < 3; c++) {
    const double d = centre[c] - weights[0] * o->a[c] - weights[1] * o->b[c];
    square += d * d;
  }
  return sqrt(square) * (1 - slack) - radius;
}

/* Returns a lower bound of the obstacle's distance from the box; INFINITY may stand for more than `reach`. NaN if the
 * box has NaN. */
static double clearance_within(const flesh_obstacle *o, const flesh_bounds *b, double reach)
{
  switch (o->shape) {
  case FLESH_OBSTACLE_PLANE: return above_plane(o, b);
  case FLESH_OBSTACLE_SPHERE: return distance_of(b, o->a) * (1 - slack) - o->radius;
  case FLESH_OBSTACLE_MESH: return flesh_obstacle_tree_clearance(o->tree, b->low, b->high, reach * (1 + slack)) * (1 - slack);
  case FLESH_OBSTACLE_CAPSULE: break;
  }
  return from_axis(o, b) - o->radius;
}

double flesh_obstacle_clearance(const flesh_obstacle *o, const flesh_bounds *bounds)
{
  const double least = clearance_within(o, bounds, INFINITY);
  return least > 0 ? least : 0;
}

int flesh_obstacle_is_far(const flesh_obstacle *o, const flesh_bounds *bounds, double reach)
{
  return clearance_within(o, bounds, reach) > reach;
}
