/* soups.h: surfaces to search in: sheets that can be folded, and random triangles. */
#ifndef FLESH_TEST_SOUPS_H
#define FLESH_TEST_SOUPS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "geometry/contact_surface.h"
#include "test.h"

typedef struct soup {
  int nodes, triangles, *corners, *body;
  double *X;
  flesh_contact_surface surface;
} soup;

static inline soup soup_create(int nodes, int triangles)
{
  soup s = {.nodes = nodes, .triangles = triangles};
  s.corners = malloc(3 * (size_t)triangles * sizeof *s.corners);
  s.body = calloc((size_t)nodes, sizeof *s.body);
  s.X = malloc(3 * (size_t)nodes * sizeof *s.X);
  return s;
}

static inline void soup_clear(soup *s)
{
  free(s->corners);
  free(s->body);
  free(s->X);
  flesh_contact_surface_clear(&s->surface);
}

/* Makes `bodies` square sheets of side 1 with n x n cells of two triangles each, a distance `gap` above each other. */
static inline soup soup_of_sheets(int bodies, int n, double gap)
{
  const int row = n + 1, each = row * row;
  soup s = soup_create(bodies * each, bodies * 2 * n * n);
  int *corner = s.corners;
  for (int b = 0; b < bodies; b++) {
    for (int i = 0; i < each; i++) {
      double *x = s.X + 3 * (b * each + i);
      x[0] = (double)(i % row) / n, x[1] = (double)(i / row) / n, x[2] = b * gap;
      s.body[b * each + i] = b;
    }
    for (int c = 0; c < n * n; c++) {
      const int a = b * each + c / n * row + c % n, cell[6] = {a, a + 1, a + row + 1, a, a + row + 1, a + row};
      memcpy(corner, cell, sizeof cell);
      corner += 6;
    }
  }
  CHECK_OK(flesh_contact_surface_of_triangles(s.nodes, s.X, s.triangles, s.corners, s.body, &s.surface));
  return s;
}

/* Makes random triangles of about the given size in the unit cube; every fourth node belongs to several. The nodes of
 * each body lie in one half of the cube. */
static inline soup soup_at_random(int triangles, double size, unsigned long long *state)
{
  soup s = soup_create(3 * triangles, triangles);
  for (int t = 0; t < triangles; t++) {
    double centre[3];
    for (int c = 0; c < 3; c++) centre[c] = test_uniform(state);
    for (int k = 0; k < 3; k++) {
      const int node = 3 * t + k;
      s.corners[node] = k == 0 && t % 4 && t > 0 ? s.corners[node - 2] : node;
      s.body[node] = t % 40 / 4 % 3;
      for (int c = 0; c < 3; c++) s.X[3 * node + c] = centre[c] + size * (test_uniform(state) - 0.5);
    }
  }
  CHECK_OK(flesh_contact_surface_of_triangles(s.nodes, s.X, s.triangles, s.corners, s.body, &s.surface));
  return s;
}

#endif
