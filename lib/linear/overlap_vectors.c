/* overlap_vectors.c: sends vectors to the ranks whose overlap has a node, and sums up what ranks have at it. */
#include "linear/overlap_vectors.h"

#include <string.h>

void flesh_overlap_widen(const flesh_overlap *self, const int *overlap_order, float *wide)
{
  for (size_t p = 0; p < (size_t)self->team->overlap; p++)
    for (size_t c = 0; c < 3; c++)
      wide[4 * p + c] = self->weight[overlap_order[p]] * (float)self->vector[3 * (size_t)overlap_order[p] + c];
}

/* Copies the values at the nodes of a rank's tets into the order of their numbers. */
static void unwind(const flesh_overlap *self, const int *nodes, const float *from, double *to)
{
  for (size_t p = 0; p < (size_t)self->team->nodes; p++)
    for (size_t c = 0; c < 3; c++) to[3 * (size_t)nodes[p] + c] = from[4 * p + c];
}

void flesh_overlap_fetch(const flesh_overlap *self, const int *nodes, const float *r)
{
  unwind(self, nodes, r, self->vector);
  flesh_overlap_update_vector(self);
}

void flesh_overlap_restrict(const flesh_overlap *self, const int *nodes, const float *r, const int *overlap_order,
                            float *wide)
{
  flesh_overlap_fetch(self, nodes, r);
  flesh_overlap_widen(self, overlap_order, wide);
}

void flesh_overlap_fetch_kept(const flesh_overlap *self, const int *nodes, const float *r, double scale)
{
  const flesh_team *team = self->team;
  unwind(self, nodes, r, self->vector);
  for (size_t d = 3 * (size_t)team->own, k = 0; d < 3 * (size_t)team->overlap; d++, k++)
    self->vector[d] = scale * self->r[k];
}

void flesh_overlap_restrict_kept(const flesh_overlap *self, const float *r, double scale, float *wide)
{
  const int own = self->team->own;
  for (size_t p = 0; p < (size_t)self->team->overlap; p++)
    memcpy(wide + 4 * p, r + 4 * (size_t)self->here[p], 4 * sizeof *wide);
  for (int k = 0; k < self->shared_count; k++) {
    const int node = self->shared[k];
    float *to = wide + 4 * (size_t)self->there[node];
    for (size_t c = 0; c < 3; c++)
      to[c] = self->weight[node] * (node < own ? r[4 * (size_t)self->place[node] + c]
                                               : (float)(scale * self->r[3 * (size_t)(node - own) + c]));
  }
}

/* Sends `found` at the nodes that are given to neighbours, or taken from them. */
static void send(const flesh_overlap *self, int taken)
{
  const flesh_team_neighbours *neighbours = &self->team->neighbours;
  const int *first[2] = {neighbours->first_given, neighbours->first_taken};
  const int *nodes = taken ? neighbours->taken : neighbours->given;
  for (int k = 0; k < first[taken][neighbours->count]; k++)
    memcpy(self->sent + 3 * (size_t)k, self->found + 3 * (size_t)nodes[k], 3 * sizeof *self->found);
  flesh_exchange_begin(self->team, &(flesh_exchange){3, first[taken], first[!taken], self->sent, self->received});
}

static void add_received(const flesh_overlap *self, int rank, const int *first, const int *nodes)
{
  for (int k = first[rank]; k < first[rank + 1]; k++)
    for (size_t c = 0; c < 3; c++) self->vector[3 * (size_t)nodes[k] + c] += self->received[3 * (size_t)k + c];
}

/* Sums up `found` and what was received, at nodes that are given, or taken, into `vector` where ranks share nodes. Adds by
 * rising rank, so that the sum has the same bits on all ranks. */
static void add_up(const flesh_overlap *self, int taken)
{
  const flesh_team *team = self->team;
  const int *first = taken ? team->neighbours.first_taken : team->neighbours.first_given;
  const int *nodes = taken ? team->neighbours.taken : team->neighbours.given;
  const size_t bytes = 3 * sizeof *self->vector;
  flesh_exchange_end(team);
  for (int k = 0; k < self->shared_count; k++) memset(self->vector + 3 * (size_t)self->shared[k], 0, bytes);
  for (int r = 0; r < team->neighbours.before; r++) add_received(self, r, first, nodes);
  for (int k = 0; k < self->shared_count; k++)
    for (size_t c = 0; c < 3; c++)
      self->vector[3 * (size_t)self->shared[k] + c] += self->found[3 * (size_t)self->shared[k] + c];
  for (int r = team->neighbours.before; r < team->neighbours.count; r++) add_received(self, r, first, nodes);
}

void flesh_overlap_add_begin(const flesh_overlap *self, const float *wide)
{
  for (int k = 0; k < self->shared_count; k++) {
    const int node = self->shared[k];
    for (size_t c = 0; c < 3; c++)
      self->found[3 * (size_t)node + c] = self->weight[node] * wide[4 * (size_t)self->there[node] + c];
  }
  send(self, 1);
}

void flesh_overlap_add_end(const flesh_overlap *self, const float *wide, float *z)
{
  for (size_t p = 0; p < (size_t)self->team->nodes; p++)
    memcpy(z + 4 * p, wide + 4 * (size_t)self->from[p], 4 * sizeof *z);
  add_up(self, 0);
  for (int k = 0; k < self->shared_count; k++) {
    const int node = self->shared[k];
    for (size_t c = 0; c < 3 && node < self->team->nodes; c++)
      z[4 * (size_t)self->place[node] + c] = (float)self->vector[3 * (size_t)node + c];
  }
}

/* Reads a node's three numbers from a vector of four lanes. */
static void read_node(const flesh_overlap *self, int single, const void *vector, int node, double *to)
{
  const size_t at = 4 * (size_t)self->place[node];
  for (size_t c = 0; c < 3; c++)
    to[c] = single ? (double)((const float *)vector)[at + c] : ((const double *)vector)[at + c];
}

void flesh_overlap_keep(const flesh_overlap *self, int single, const void *r)
{
  const flesh_team *team = self->team;
  const size_t own = 3 * (size_t)team->own, others = 3 * (size_t)team->overlap - own;
  for (int i = 0; i < team->own; i++) read_node(self, single, r, i, self->vector + 3 * (size_t)i);
  memset(self->vector + own, 0, others * sizeof *self->vector); /* nodes that are left out, too */
  flesh_overlap_update_vector(self);
  memcpy(self->r, self->vector + own, others * sizeof *self->r);
  memset(self->s, 0, others * sizeof *self->s);
}

void flesh_overlap_sum(const flesh_overlap *self, const int *nodes, const float *y)
{
  const size_t all = 3 * (size_t)self->team->nodes, overlap = 3 * (size_t)self->team->overlap;
  unwind(self, nodes, y, self->found);
  memset(self->found + all, 0, (overlap - all) * sizeof *self->found);
  send(self, 0);
  memcpy(self->vector, self->found, overlap * sizeof *self->vector);
  add_up(self, 1);
}

void flesh_overlap_collect_begin(const flesh_overlap *self, int single, const void *y)
{
  for (int k = 0; k < self->shared_count; k++) {
    double *found = self->found + 3 * (size_t)self->shared[k];
    if (self->shared[k] < self->team->nodes) read_node(self, single, y, self->shared[k], found);
    else memset(found, 0, 3 * sizeof *found);
  }
  send(self, 0);
}

void flesh_overlap_collect_end(const flesh_overlap *self, int single, void *y)
{
  const flesh_team *team = self->team;
  add_up(self, 1);
  for (int k = 0; k < self->shared_count; k++) {
    const int node = self->shared[k];
    double *sum = self->vector + 3 * (size_t)node;
    for (size_t c = 0; c < 3 && single; c++) sum[c] = (float)sum[c];
    for (size_t c = 0; c < 3 && node < team->nodes; c++) {
      const double value = node < team->own ? sum[c] : 0;
      const size_t at = 4 * (size_t)self->place[node] + c;
      if (single) ((float *)y)[at] = (float)value;
      else ((double *)y)[at] = value;
    }
  }
}

void flesh_overlap_advance(const flesh_overlap *self, int single, double alpha, double beta)
{
  const size_t own = 3 * (size_t)self->team->own, others = 3 * (size_t)self->team->overlap - own;
  for (size_t k = 0; k < others; k++) {
    const double s = self->vector[own + k] + beta * self->s[k];
    self->s[k] = single ? (float)s : s;
    const double r = self->r[k] - alpha * self->s[k];
    self->r[k] = single ? (float)r : r;
  }
}
