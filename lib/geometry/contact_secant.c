/* contact_secant.c: predicts the gaps at which a solve will end. */
#include "geometry/contact_secant.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/barrier.h"

int flesh_contact_secant_create(const flesh_contact_surface *surface, flesh_contact_secant *secant)
{
  secant->updates = 1;
  secant->nodes = flesh_calloc((size_t)surface->node_count + 1, sizeof *secant->nodes);
  return secant->nodes ? FLESH_OK
                       : flesh_fail(FLESH_ERR_MEMORY, "no memory for the contact of %d nodes", surface->node_count);
}

void flesh_contact_secant_clear(flesh_contact_secant *secant)
{
  flesh_free(secant->nodes);
  *secant = (flesh_contact_secant){0};
}

void flesh_contact_secant_forget(flesh_contact_secant *secant) { secant->updates += 2; }

static double pressure_at(double s)
{
  double value, first, second;
  if (s >= 1) return 0;
  flesh_barrier_law(s, &value, &first, &second);
  return -first;
}

/* Returns the gap over the thickness with the given pressure, by Newton's iteration on the square root of the pressure.
 * That root is convex and too large at the start, so the iteration increases the gap monotonically and ends when
 * rounding stops it. A pressure that pulls has the gap 1. Such a node still pulls on its neighbours, so that a contact
 * opens by about a row of nodes an iteration. Gaps beyond the barrier would let too many nodes go: two slabs that swing
 * (contact_cost.sh) take 5.5 to 5.7 iterations a step with 1.03 to 2, 5.2 with 1. */
static double gap_at(double pressure)
{
  const double root = sqrt(pressure);
  if (!(pressure > 0)) return 1;
  if (!(root < INFINITY)) return 0;
  for (double s = 1 / (1 + root);;) {
    const double along = sqrt(1 + 2 * s), here = (1 - s) / s * along;
    const double next = s + (here - root) * s * s * along / (1 + s + s * s); /* the root's derivative is -(1 + s +
                                                                              * s^2)/(s^2 sqrt(1 + 2 s)) */
    if (!(next > s)) return s;
    s = next;
  }
}

static double gap_of(const flesh_contact_set *set, int k) { return set->closest[k].distance / set->pairs[k].thickness; }

/* Returns the number of pairs of the same node from the k-th on; 0 if pair k is of two edges. */
static int count_pairs(const flesh_contact_set *set, int k)
{
  int count = 0;
  while (set->pairs[k].owner >= 0 && k + count < set->count && set->pairs[k + count].owner == set->pairs[k].owner) count++;
  return count;
}

int flesh_contact_secant_expects(const flesh_contact_secant_node *node, int update) { return node->known == update - 1; }

void flesh_contact_secant_expect(flesh_contact_secant_node *node, int update, double gap, double gap_lag)
{
  node->expected = gap_at(flesh_contact_secant_expects(node, update) ? node->pressure - node->slope * (gap - node->gap)
                                                                     : pressure_at(gap_lag));
  node->gap = gap;
  node->pressure = pressure_at(gap);
  node->known = update;
  node->slope = flesh_barrier_secant(gap, node->expected);
}

/* Predicts for the pairs of one node, from the k-th on, by the pair with the least gap. */
static void predict(flesh_contact_secant *secant, int count, const flesh_contact_set *set, int k, const double *x_lag)
{
  flesh_contact_secant_node *node = &secant->nodes[set->pairs[k].owner];
  int nearest = k;
  for (int j = k; j < k + count; j++)
    if (gap_of(set, j) < gap_of(set, nearest)) nearest = j;
  const flesh_contact_pair *pair = &set->pairs[nearest];
  flesh_contact_closest lag = {.distance = pair->thickness};
  if (!flesh_contact_secant_expects(node, secant->updates))
    flesh_contact_find_closest(pair->kind, pair->within, pair->nodes, x_lag, &lag);
  flesh_contact_secant_expect(node, secant->updates, fmin(1, gap_of(set, nearest)), lag.distance / pair->thickness);
}

void flesh_contact_secant_predict(flesh_contact_secant *secant, const flesh_contact_set *set, const double *x_lag)
{
  secant->updates++;
  for (int k = 0, count; k < set->count && (count = count_pairs(set, k)); k += count)
    predict(secant, count, set, k, x_lag);
}

void flesh_contact_secant_apply(const flesh_contact_secant *secant, flesh_contact_set *set)
{
  for (int k = 0, count; k < set->count && (count = count_pairs(set, k)); k += count) {
    const flesh_contact_secant_node *node = secant ? &secant->nodes[set->pairs[k].owner] : NULL;
    const int known = node && node->known == secant->updates;
    for (int j = k; j < k + count; j++)
      set->pairs[j].expected = known ? gap_of(set, j) + node->expected - node->gap : 0;
  }
}
