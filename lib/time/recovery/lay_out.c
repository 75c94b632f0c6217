/* lay_out.c: finds parts that have shrunk to a point, and lays them out in front of obstacles. */
#include "time/recovery/lay_out.h"

#include <math.h>
#include <string.h>

#include "system/feasible_step.h"

static const double vanished_size = 0.05; /* of the size at rest */

/* Returns whether a part has become a point; then `move` leads from its place at rest to there. */
static int has_vanished(const flesh_rigid_parts *parts, int part, const double *x, double move[3])
{
  double now[3], rest[3];
  if (!(flesh_rigid_parts_extent(parts, part, x, now) < vanished_size * parts->extent[part])) return 0;
  flesh_rigid_parts_extent(parts, part, flesh_mesh_positions(parts->mesh), rest);
  for (int c = 0; c < 3; c++) move[c] = now[c] - rest[c];
  return 1;
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
    flesh_team_take_farthest(parts->team, farthest, 3, more);
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
