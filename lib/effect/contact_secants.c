/* contact_secants.c: predicts the gaps to an obstacle at which a solve will end (geometry/contact_secant.h), and has the
 * memory for friction's predictions (geometry/slip.h). */
#include <math.h>

#include "effect/contact.h"
#include "effect/environment.h"
#include "geometry/barrier.h"
#include "geometry/contact_secant.h"
#include "geometry/obstacle.h"
#include "geometry/obstacle_bounds.h"

typedef flesh_contact contact;

typedef struct predictions {
  int update; /* number of the last update */
  flesh_contact_secant_node nodes[]; /* [count], then the friction of each node, if there is friction */
} predictions;

size_t flesh_contact_predictions(const flesh_effect *effect)
{
  const contact *self = effect->data;
  const size_t of_node = sizeof(flesh_contact_secant_node) + (self->friction > 0 ? sizeof(flesh_slip_expected) : 0);
  return sizeof(predictions) + (size_t)self->count * of_node;
}

flesh_slip_expected *flesh_contact_slip(const contact *self, void *predicted, int k, int *matrix)
{
  predictions *all = predicted;
  *matrix = all->update;
  return all->update > 0 ? (flesh_slip_expected *)(all->nodes + self->count) + k : NULL;
}

typedef struct job {
  const contact *self;
  const flesh_point *point;
  flesh_frame frame, lagged;
  predictions *predicted;
} job;

static void predict_node(const job *j, int k)
{
  const contact *self = j->self;
  const double *x = j->point->x + 3 * (size_t)self->nodes[k], *x_lag = j->point->lagged.x + 3 * (size_t)self->nodes[k];
  flesh_contact_secant_node *node = &j->predicted->nodes[k];
  const int update = j->predicted->update, expects = flesh_contact_secant_expects(node, update);
  flesh_barrier now, before = {.distance = INFINITY};
  if (flesh_contact_barrier_at(self, &j->frame, x, &now) || !(now.distance < self->thickness)) return;
  const double gap = now.distance / self->thickness;
  if (expects && node->gap == gap) node->known = update; /* another matrix at the same position */
  else if (expects || !flesh_contact_barrier_at(self, &j->lagged, x_lag, &before))
    flesh_contact_secant_expect(node, update, gap, before.distance / self->thickness);
}

static void predict_box(void *data, int task)
{
  const job *j = data;
  const contact *self = j->self;
  const int begin = task * FLESH_CONTACT_NODES_OF_BOX, end = flesh_contact_end_of_box(begin, self->count);
  const flesh_bounds world = flesh_bounds_of(end - begin, self->nodes + begin, j->point->x),
                     own = flesh_bounds_enter(&j->frame, &world);
  if (flesh_obstacle_is_far(self->obstacle, &own, self->thickness)) return;
  for (int k = begin; k < end; k++) predict_node(j, k);
}

void flesh_contact_predict(const flesh_effect *effect, const flesh_point *point)
{
  job j = {.self = effect->data, .point = point, .predicted = flesh_environment_of(point)->predicted};
  j.predicted->update = flesh_environment_of(point)->update;
  flesh_obstacle_frame(j.self->obstacle, point->t, &j.frame);
  flesh_obstacle_frame(j.self->obstacle, point->lagged.t, &j.lagged);
  flesh_threads_run(point->threads, (j.self->count + FLESH_CONTACT_NODES_OF_BOX - 1) / FLESH_CONTACT_NODES_OF_BOX,
                    predict_box, &j);
}

double flesh_contact_softness(const contact *self, const void *predicted, int k, const flesh_barrier *at)
{
  const predictions *all = predicted;
  const flesh_contact_secant_node *node = all ? &all->nodes[k] : NULL;
  const double gap = at->distance / self->thickness;
  if (!node || !node->known || node->known != all->update || node->gap != gap) return 1;
  double value, first, second;
  flesh_barrier_law(gap, &value, &first, &second);
  return fmin(1, node->slope / second); /* nodes that will be pressed deeper keep the tangent (lib/newton/history.md) */
}
