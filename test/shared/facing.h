/* facing.h: surfaces that face each other, with all candidate pairs, for tests of contact. */
#ifndef FLESH_TEST_FACING_H
#define FLESH_TEST_FACING_H

#include <stdlib.h>

#include "geometry/contact_set.h"
#include "test_matrix.h"

enum { FACING_NODES = 1100, FACING_FACES = 2000 };

typedef struct facing {
  int nodes, faces, body[FACING_NODES], triangles[3 * FACING_FACES];
  double X[3 * FACING_NODES], x[3 * FACING_NODES]; /* positions at rest, and now */
  flesh_contact_surface surface;
  flesh_contact_candidates candidates;
  int *lists[2];
} facing;

/* Adds a square of n*n cells from (x, y) to (x + side, y + side) at height z, facing up or down, with random diagonals
 * and inner nodes moved by up to `jitter` cells within the plane. */
static inline void facing_add_sheet(facing *f, int n, double x, double y, double side, double z, int up, double jitter)
{
  const int first = f->nodes, body = f->nodes ? f->body[first - 1] + 1 : 0;
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++) {
      const int inner = i > 0 && i < n && j > 0 && j < n;
      const double shift[2] = {inner * jitter * uniform(), inner * jitter * uniform()};
      const double place[3] = {x + side * (i + shift[0]) / n, y + side * (j + shift[1]) / n, z};
      memcpy(f->X + 3 * f->nodes, place, sizeof place);
      memcpy(f->x + 3 * f->nodes, place, sizeof place);
      f->body[f->nodes++] = body;
    }
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      const int a = first + j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1, way = uniform() > 0;
      const int both[6] = {a, b, way ? d : c, way ? a : b, d, c};
      for (int t = 0; t < 2; t++, f->faces++)
        for (int k = 0; k < 3; k++) f->triangles[3 * f->faces + k] = both[3 * t + (up ? k : 2 - k)];
    }
}

/* Adds a body of one triangle with one corner at p and the others a height above it, out of reach. */
static inline int facing_add_needle(facing *f, const double p[3], double height)
{
  const int tip = f->nodes, body = f->nodes ? f->body[tip - 1] + 1 : 0;
  for (int k = 0; k < 3; k++) {
    const double place[3] = {p[0] + (k == 1), p[1] + (k == 2), p[2] + (k > 0) * height};
    memcpy(f->X + 3 * f->nodes, place, sizeof place);
    memcpy(f->x + 3 * f->nodes, place, sizeof place);
    f->triangles[3 * f->faces + k] = f->nodes;
    f->body[f->nodes++] = body;
  }
  f->faces++;
  return tip;
}


/* Makes the surface, and all pairs of different bodies as candidates. */
static inline void facing_finish(facing *f)
{
  CHECK_OK(flesh_contact_surface_of_triangles(f->nodes, f->X, f->faces, f->triangles, f->body, &f->surface));
  const flesh_contact_surface *s = &f->surface;
  f->lists[0] = malloc(2 * sizeof(int) * (size_t)s->node_count * (size_t)s->face_count);
  f->lists[1] = malloc(2 * sizeof(int) * (size_t)s->edge_count * (size_t)s->edge_count);
  f->candidates = (flesh_contact_candidates){0, f->lists[0], 0, f->lists[1]};
  for (int p = 0; p < s->node_count; p++)
    for (int t = 0; t < s->face_count; t++) {
      if (f->body[s->nodes[p]] == f->body[s->faces[3 * t]]) continue;
      const int k = f->candidates.point_count++;
      f->lists[0][2 * k] = p, f->lists[0][2 * k + 1] = t;
    }
  for (int a = 0; a < s->edge_count; a++)
    for (int b = a + 1; b < s->edge_count; b++) {
      if (f->body[s->edges[2 * a]] == f->body[s->edges[2 * b]]) continue;
      const int k = f->candidates.edge_count++;
      f->lists[1][2 * k] = a, f->lists[1][2 * k + 1] = b;
    }
}

static inline void facing_clear(facing *f)
{
  flesh_contact_surface_clear(&f->surface);
  free(f->lists[0]);
  free(f->lists[1]);
  *f = (facing){0};
}

/* Returns the energy at x [3*nodes] and computes the residual unless NULL; NaN if it is undefined. */
static inline double facing_energy(facing *f, flesh_contact_set *set, const double *x, double *r)
{
  double energy = 0;
  for (int k = 0; r && k < 3 * f->nodes; k++) r[k] = 0;
  if (flesh_contact_set_update(set, &f->candidates, x, NULL)) return NAN;
  if (flesh_contact_set_evaluate(set, x, NULL, &energy, NULL, r)) return NAN;
  return energy;
}

#endif
