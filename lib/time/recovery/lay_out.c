/* lay_out.c: finds parts that are a point, and lays them out before obstacles. */
#include "time/recovery/lay_out.h"

#include <math.h>
#include <string.h>

#include "system/feasible_step.h"

static const double vanished_size = 0.05; /* of that at rest */

/* The middle of the nodes of a part of the mesh, and the mean square of their distance from it. */
static double spread(const flesh_rigid_parts *parts, int part, const double *x, double middle[3])
{
  const int *nodes, own = flesh_rigid_parts_own(parts, part, &nodes);
  double square = 0, count = own;
  flesh_team_sum(parts->team, 1, &count);
  for (int c = 0; c < 3; c++) {
    middle[c] = 0;
    for (int k = 0; k < own; k++) middle[c] += x[3 * nodes[k] + c] / count;
    flesh_team_sum(parts->team, 1, &middle[c]);
    for (int k = 0; k < own; k++) square += pow(x[3 * nodes[k] + c] - middle[c], 2) / count;
  }
  flesh_team_sum(parts->team, 1, &square);
  return square;
}

static int has_vanished(const flesh_rigid_parts *parts, int part, const double *x, double move[3])
{
  const double *X = flesh_mesh_positions(parts->mesh);
  double now[3], rest[3];
  const int vanished =
      spread(parts, part, x, now) < vanished_size * vanished_size * spread(parts, part, X, rest);
  for (int c = 0; c < 3; c++) move[c] = now[c] - rest[c];
  return vanished;
}

/* `more` of the rank on which `farthest` is largest, the first of them. */
static void take_farthest(const flesh_team *team, double farthest, double more[3])
{
  if (!team) return;
  double most = farthest, first;
  flesh_team_largest(team, 1, &most);
  first = farthest < most ? -INFINITY : -team->rank;
  flesh_team_largest(team, 1, &first);
  for (int c = 0; c < 3 && first != -team->rank; c++) more[c] = 0;
  flesh_team_sum(team, 3, more);
}

typedef struct layout {
  const flesh_system *system;
  const flesh_rigid_parts *parts;
  const uint8_t *fixed;
  double t;
  const double *x_from;
  double *pushed, *x;
} layout;

/* Lays out a part as a whole, so that no node of it passes an obstacle. */
static void lay_out(const layout *all, int part, double move[3])
{
  enum { TRIES = 4 };
  const flesh_rigid_parts *parts = all->parts;
  const uint8_t *fixed = all->fixed;
  double *pushed = all->pushed, *x = all->x;
  const double *X = flesh_mesh_positions(parts->mesh);
  const size_t bytes = 3 * (size_t)flesh_mesh_node_count(parts->mesh) * sizeof *x;
  const int *nodes = parts->nodes + parts->first[part], count = parts->first[part + 1] - parts->first[part];
  for (int k = 0; k < TRIES; k++) {
    double farthest = 0, more[3] = {0};
    for (int i = 0; i < 3 * count; i++) {
      const int d = 3 * nodes[i / 3] + i % 3;
      if (!fixed[d]) x[d] = X[d] + move[i % 3];
    }
    memcpy(pushed, x, bytes);
    flesh_system_push_out(all->system, all->t, all->x_from, all->t, pushed);
    for (int i = 0; i < count; i++) {
      const double *out = pushed + 3 * nodes[i], *in = x + 3 * nodes[i];
      const double square = pow(out[0] - in[0], 2) + pow(out[1] - in[1], 2) + pow(out[2] - in[2], 2);
      if (square <= farthest) continue;
      farthest = square;
      for (int c = 0; c < 3; c++) more[c] = out[c] - in[c];
    }
    take_farthest(parts->team, farthest, more);
    for (int c = 0; c < 3; c++) move[c] += more[c];
  }
  memcpy(x, pushed, bytes);
}

int flesh_lay_out(const flesh_system *system, const flesh_rigid_parts *parts, const uint8_t *fixed, double t,
                  const double *x_from, double *work, double *x)
{
  int vanished = 0;
  double move[3];
  for (int part = 0; part < parts->count; part++) {
    if (!has_vanished(parts, part, x, move)) continue;
    vanished = 1;
    lay_out(&(layout){system, parts, fixed, t, x_from, work, x}, part, move);
  }
  return vanished;
}
