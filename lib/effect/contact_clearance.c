/* contact_clearance.c: how far a body is from an obstacle that it does not feel, and how far that is carried. */
#include <math.h>

#include "effect/contact.h"
#include "geometry/obstacle_bounds.h"
#include "math/nearest.h"

/* So many nodes have a box. */
enum { NODES_OF_BOX = 64 };

static double clearance_of(const flesh_contact *self, const flesh_frame *frame, int count, const int *nodes,
                           const double *x)
{
  const flesh_bounds world = flesh_bounds_of(count, nodes, x), own = flesh_bounds_enter(frame, &world);
  return flesh_obstacle_clearance(self->obstacle, &own) - self->thickness;
}

/* The faces are within the box of their corners, and what must stay out of them is within the obstacle. */
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

/* A place's ways in the obstacle's frame differ by an affine function of the place, whose size is largest at a corner.
 * The cores are compared in space, where the body's faces go straight. */
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
