/* contact_barrier.c: feasible steps past an obstacle, pushing out, tunnelling, and checks of the start. */
#include <math.h>

#include "base/error.h"
#include "effect/contact.h"
#include "effect/effect.h"
#include "geometry/obstacle.h"
#include "geometry/obstacle_bounds.h"
#include "math/mat3.h"

typedef flesh_contact contact;

int flesh_contact_barrier_at(const contact *self, const flesh_frame *frame, const double *x,
                      flesh_barrier *barrier)
{
  double y[3];
  flesh_frame_enter(frame, x, y);
  flesh_obstacle_barrier(self->obstacle, y, self->thickness, barrier);
  return barrier->distance > 0 ? FLESH_OK : FLESH_UNDEFINED;
}

/* Whether none of nodes k to end-1 can meet the obstacle on straight paths in its frame. */
static int is_out_of_reach(const contact *self, int k, int end, const flesh_frame *from, const double *x_from,
                         const flesh_frame *to, const double *x_to)
{
  const flesh_bounds first = flesh_bounds_of(end - k, self->nodes + k, x_from),
                     last = flesh_bounds_of(end - k, self->nodes + k, x_to);
  const flesh_bounds here = flesh_bounds_enter(from, &first), there = flesh_bounds_enter(to, &last);
  const flesh_bounds both = flesh_bounds_join(&here, &there);
  return flesh_obstacle_is_far(self->obstacle, &both, 0);
}

static double contact_max_feasible_step(const flesh_effect *effect, void *near, const double *internal, double t_from,
                                        const double *x_from, double t_to, const double *x_to)
{
  (void)near, (void)internal;
  const contact *self = effect->data;
  flesh_frame from, to;
  double fraction = 1, y0[3], y1[3];
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0, box = 0; k < self->count; k++) {
    if (k == box && is_out_of_reach(self, k, box = flesh_contact_end_of_box(k, self->count), &from, x_from, &to, x_to)) {
      k = box - 1;
      continue;
    }
    flesh_frame_enter(&from, x_from + 3 * self->nodes[k], y0);
    flesh_frame_enter(&to, x_to + 3 * self->nodes[k], y1);
    fraction = fmin(fraction, flesh_obstacle_max_feasible_step(self->obstacle, y0, y1));
  }
  return fmin(fraction, flesh_contact_core_max_feasible_step(&self->core, &from, x_from, &to, x_to));
}

/* Whether a face has passed through the core, or a node has passed through the obstacle while it was out of reach
 * before and after. Nodes in contact are excluded: they slide around corners, which a straight step cuts. */
static int contact_tunnelled(const flesh_effect *effect, double t_from, const double *x_from,
                          double t_to, const double *x_to)
{
  const contact *self = effect->data;
  flesh_frame from, to;
  double y0[3], y1[3];
  flesh_barrier barrier;
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0, box = 0; k < self->count; k++) {
    if (k == box && is_out_of_reach(self, k, box = flesh_contact_end_of_box(k, self->count), &from, x_from, &to, x_to)) {
      k = box - 1;
      continue;
    }
    const int i = 3 * self->nodes[k];
    flesh_frame_enter(&from, x_from + i, y0);
    flesh_frame_enter(&to, x_to + i, y1);
    if (flesh_obstacle_max_feasible_step(self->obstacle, y0, y1) == 1) continue;
    flesh_contact_barrier_at(self, &from, x_from + i, &barrier);
    if (barrier.distance < INFINITY) continue;
    flesh_contact_barrier_at(self, &to, x_to + i, &barrier);
    if (barrier.distance == INFINITY) return 1;
  }
  return flesh_contact_core_max_feasible_step(&self->core, &from, x_from, &to, x_to) < 1;
}

/* Fraction of its gap that a node may lose; beyond it, its old gap is restored. */
static const double LOST = 0.9;

/* Moves a node from y, outside the obstacle and in its frame, to the gap it had at y0, where the barrier's force is as
 * before, if its gap is far smaller now. Returns whether it was moved. */
static int lift(const contact *self, const double y0[3], double y[3])
{
  flesh_barrier before, now;
  flesh_obstacle_barrier(self->obstacle, y, self->thickness, &now);
  const double push = sqrt(flesh_vec3_dot(now.gradient, now.gradient));
  if (!(now.distance < self->thickness && push > 0 && push < INFINITY)) return 0;
  flesh_obstacle_barrier(self->obstacle, y0, self->thickness, &before);
  const double gap = fmin(before.distance, self->thickness);
  if (!(now.distance < (1 - LOST) * gap)) return 0;
  for (int c = 0; c < 3; c++) y[c] -= (gap - now.distance) / push * now.gradient[c];
  return 1;
}

/* Stops nodes before they meet the obstacle. Paths are straight in the obstacle's frame, so a moving obstacle carries
 * the nodes along. */
static void contact_push_out(const flesh_effect *effect, double t_from, const double *x_from,
                          double t_to, double *x_to)
{
  const contact *self = effect->data;
  flesh_frame from, to;
  double y0[3], y1[3], y[3];
  flesh_barrier barrier;
  flesh_obstacle_frame(self->obstacle, t_from, &from);
  flesh_obstacle_frame(self->obstacle, t_to, &to);
  for (int k = 0; k < self->count; k++) {
    const int i = 3 * self->nodes[k];
    flesh_frame_enter(&from, x_from + i, y0);
    flesh_frame_enter(&to, x_to + i, y1);
    const double fraction = flesh_obstacle_max_feasible_step(self->obstacle, y0, y1);
    const int barred = fraction < 1 || flesh_contact_barrier_at(self, &to, x_to + i, &barrier); /* at fraction 1 the
                                                                                                 * node may still
                                                                                                 * touch */
    for (int c = 0; c < 3; c++)
      y[c] = barred ? y0[c] + flesh_feasible_step_kept * fraction * (y1[c] - y0[c]) : y1[c];
    if (lift(self, y0, y) || barred) flesh_frame_leave(&to, y, x_to + i);
  }
}

static int contact_check(const flesh_effect *effect, const double *internal, double t, const double *x)
{
  (void)internal;
  const contact *self = effect->data;
  flesh_frame frame;
  double y[3], depth, deepest = -1;
  int worst = 0, inside = 0;
  flesh_obstacle_frame(self->obstacle, t, &frame);
  for (int k = 0; k < self->count; k++) {
    flesh_barrier barrier;
    flesh_contact_barrier_at(self, &frame, x + 3 * self->nodes[k], &barrier);
    if (barrier.distance > flesh_contact_least_gap * self->thickness) continue;
    flesh_frame_enter(&frame, x + 3 * self->nodes[k], y);
    depth = barrier.distance > 0 ? 0 : flesh_obstacle_depth(self->obstacle, y);
    if (depth > deepest) deepest = depth, worst = k;
    inside++;
  }
  if (!inside && flesh_contact_core_add(&self->core, &frame, x, NULL, NULL))
    return flesh_fail(FLESH_ERR_ARGUMENT, "a face of the body goes through the middle of a %s; the body must start outside",
                      flesh_obstacle_name(self->obstacle));
  if (!inside) return FLESH_OK;
  const double *place = x + 3 * (size_t)self->nodes[worst];
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%d node%s in the %s that nodes must stay out of; the deepest is node %d at "
                    "(%.6g, %.6g, %.6g), %.3g m below its surface",
                    inside, inside == 1 ? " is" : "s are", flesh_obstacle_name(self->obstacle),
                    (self->names ? self->names : self->nodes)[worst], place[0], place[1], place[2], deepest);
}

const flesh_effect_barrier flesh_contact_barrier = {
    .max_feasible_step = contact_max_feasible_step,
    .push_out = contact_push_out,
    .tunnelled = contact_tunnelled,
    .check = contact_check,
    .clearance = flesh_contact_clearance,
    .approach = flesh_contact_approach,
};
