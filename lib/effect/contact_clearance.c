/* contact_clearance.c: lower bounds of a body's distance from an obstacle, and how far the obstacle moves towards
 * it. */
#include <math.h>

#include "effect/contact.h"
#include "geometry/obstacle_bounds.h"
#include "math/nearest.h"

/* Number of consecutive nodes that share a bounding box. */
enum { NODES_OF_BOX = 64 };

static double clearance_of(const flesh_contact *self, const flesh_frame *frame, int count, const int *nodes,
                           const double *x)
{
  const flesh_bounds world = flesh_bounds_of(count, nodes, x), own = flesh_bounds_enter(frame, &world);
  return flesh_obstacle_clearance(self->obstacle, &own) - self->thickness;
}

/* Faces lie within the box of their corners, and the core lies within the obstacle, so boxes of nodes suffice. */
double flesh_contact_clearance(const flesh_effect *effect, double t, const double *x)
{
  const flesh_contact *self = effect->data;
  const int core = self->core.points ? self->core.node_count : 0;
  flesh_frame frame;
  flesh_obstacle_frame(self->obstacle, t, &frame);
  double least = core ? clearance_of(self, &frame, core, self->core.nodes, x) : INFINITY;
  for (int k = 0; k < self->count && least > 0; k += NODES_OF_BOX) {
    const int count = self->count - k < NODES_OF_BOX ? self->count - k : NODES_OF_BOX;
    const double found = clearance_of(self, &frame, count, self->nodes + k, x);
    least = found < least ? found : least;
  }
  return least;
}

/* Bounds the obstacle's motion. A point's displacement in the obstacle's frame is an affine function of its position,
 * so its norm is largest at a corner of the box. Cores are compared in space, where the body's faces move straight. */
double flesh_contact_approach(const flesh_effect *effect, double t_from, double t_to, const double low[3],
                              const double high[3])
{
  const flesh_contact *self = effect->data;
  const flesh_contact_core *core = &self->core;
  flesh_frame from, to;
  double largest = 0, a[3], b[3];
  if (t_from == t_to || !flesh_obstacle_moves(self->obstacle)) return 0;
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int corner = 0; corner < 8; corner++) {
    double x[3];
    for (int c = 0; c < 3; c++) x[c] = corner >> c & 1 ? high[c] : low[c];
    flesh_frame_enter(&from, x, a);
    flesh_frame_enter(&to, x, b);
    largest = fmax(largest, flesh_distance(a, b));
  }
  for (int end = 0; end < 2 && core->points; end++) {
    const double *centre = core->centres + (end ? 3 * (core->points - 1) : 0);
    flesh_frame_leave(&from, centre, a);
    flesh_frame_leave(&to, centre, b);
    largest = fmax(largest, flesh_distance(a, b));
  }
  return largest;
}
