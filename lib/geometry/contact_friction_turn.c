/* contact_friction_turn.c: derivative of friction by the lagged positions.
 *
 * A pair with the force N, the slip operator S and u = S v has w = N f(|u|) S^T u/|u|. N and S are differentiated by
 * fourth-order differences on the pair's own nodes, with a step so short that neither the end of the thickness nor a
 * change of the bearing nodes is met. The pairs of a point with positive N have r = mu s sum of w, where s is the sum
 * of all N divided by the sum of the positive ones. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "geometry/contact_friction.h"
#include "geometry/slip.h"

/* A pair on its own nodes, with vectors of all 12 components. */
typedef struct turned {
  const flesh_contact_pair *pair;
  double x[12], v[12];
  double N, by[12]; /* normal force and its derivative by x */
  double w[12], turn[12][12]; /* w and its derivative by x, [row][column] */
} turned;

/* Computes N and S of the pair at its x. */
static double find_slip(const turned *t, flesh_contact_closest *at, double S[2][12])
{
  flesh_friction_pair pair;
  flesh_contact_pair local = *t->pair;
  for (int a = 0; a < 4; a++) local.nodes[a] = a;
  const double N = flesh_contact_pair_force(&local, t->x, at);
  flesh_contact_slip_find(&local, at, t->x, &pair);
  memcpy(S, pair.slip, sizeof pair.slip);
  return N;
}

/* Differentiates N and S by one component of the nodes' positions. FLESH_UNDEFINED if the bearing nodes differ for
 * every step tried. */
static int differentiate(turned *t, int column, const flesh_contact_closest *base, double turn[2][12])
{
  static const double at[] = {-2, -1, 1, 2}, weight[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};
  const double was = t->x[column];
  double step = 1e-3 * fmin(base->distance, t->pair->thickness - base->distance), S[2][12];
  int same = 0;
  for (int finer = 0; finer < 4 && !same; finer++, step /= 10) {
    flesh_contact_closest there;
    same = 1;
    t->by[column] = 0;
    memset(turn, 0, 24 * sizeof(double));
    for (int p = 0; p < 4 && same; p++) {
      t->x[column] = was + at[p] * step;
      t->by[column] += weight[p] / step * find_slip(t, &there, S);
      same = base->count == there.count && !memcmp(base->corner, there.corner, sizeof there.corner);
      for (int k = 0; k < 24; k++) turn[k / 12][k % 12] += weight[p] / step * S[k / 12][k % 12];
    }
  }
  t->x[column] = was;
  return same ? FLESH_OK : FLESH_UNDEFINED;
}

/* Computes w and its derivative for the slip speed e. */
static int find(turned *t, double e)
{
  flesh_contact_closest base;
  double S[2][12], turn[2][12], u[2] = {0, 0};
  int status = FLESH_OK;
  t->N = find_slip(t, &base, S);
  for (int k = 0; k < 24; k++) u[k / 12] += S[k / 12][k % 12] * t->v[k % 12];
  const double y = hypot(u[0], u[1]), ratio = flesh_slip_ratio(y, e), fall = y > 0 ? flesh_slip_fall(y, e) / (y * y) : 0;
  for (int k = 0; k < 12; k++) t->w[k] = t->N * ratio * (S[0][k] * u[0] + S[1][k] * u[1]);
  for (int d = 0; d < 12 && !status && t->N != 0; d++) {
    double change[2] = {0, 0}, g[2];
    status = differentiate(t, d, &base, turn);
    for (int k = 0; k < 24; k++) change[k / 12] += turn[k / 12][k % 12] * t->v[k % 12];
    for (int i = 0; i < 2; i++)
      g[i] = t->by[d] * ratio * u[i] +
             t->N * (ratio * change[i] + fall * u[i] * (u[0] * change[0] + u[1] * change[1]));
    for (int k = 0; k < 12; k++)
      for (int i = 0; i < 2; i++) t->turn[k][d] += S[i][k] * g[i] + t->N * ratio * turn[i][k] * u[i];
  }
  return status;
}

static turned on_own_nodes(const flesh_contact_pair *pair, const double *x, const double *v)
{
  turned t = {.pair = pair};
  for (int d = 0; d < 12; d++) {
    const size_t from = 3 * (size_t)pair->nodes[d / 3] + (size_t)(d % 3);
    t.x[d] = x[from];
    t.v[d] = v[from];
  }
  return t;
}

/* Adds `by` times w of one times the derivative of the other's N and, if both are the same pair, `scale` times the
 * derivative of w. */
static int add_blocks(const turned *one, const turned *other, double scale, double by, flesh_block_add add, void *to)
{
  int status = FLESH_OK;
  for (int a = 0; a < 4; a++)
    for (int b = 0; b < 4 && !status; b++) {
      double block[9];
      for (int k = 0; k < 9; k++) {
        const int row = 3 * a + k / 3, column = 3 * b + k % 3;
        block[k] = (one == other ? scale * one->turn[row][column] : 0) + by * one->w[row] * other->by[column];
      }
      status = add(to, one->pair->nodes[a], other->pair->nodes[b], block);
    }
  return status;
}

int flesh_contact_friction_turn(const flesh_contact_friction *friction, const flesh_contact_set *set, const double *x_lag,
                                const double *v, flesh_block_add add, void *to)
{
  const double mu = friction->coefficient;
  int status = FLESH_OK;
  turned *all = flesh_malloc(((size_t)set->count + 1) * sizeof *all);
  if (!all) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the derivative of the friction of %d pairs", set->count);
  for (int k = 0, next; k < set->count && !status; k = next) {
    const int owner = set->pairs[k].owner;
    double sum = 0, positive = 0;
    for (next = k; next < set->count && !status && (next == k || (owner >= 0 && set->pairs[next].owner == owner)); next++) {
      all[next] = on_own_nodes(set->pairs + next, x_lag, v);
      status = find(all + next, friction->slip_speed);
      sum += all[next].N;
      positive += fmax(all[next].N, 0);
    }
    for (int i = k; i < next && sum > 0; i++)
      for (int j = k; j < next && all[i].N > 0 && !status; j++)
        status = add_blocks(all + i, all + j, mu * sum / positive,
                            mu / positive * (1 - (all[j].N > 0 ? sum / positive : 0)), add, to);
  }
  flesh_free(all);
  return status;
}
