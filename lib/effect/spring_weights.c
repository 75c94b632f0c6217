/* spring_weights.c: integrals of shape functions, with a smooth kernel, over the part of a body within a radius. */
#include "effect/spring_weights.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "math/mat3.h"
#include "math/nearest.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"

static const double default_share = 0.05; /* fraction of the body's longest side */
/* Tets are subdivided until no corner is farther from their middle than this fraction of the radius. */
static const double finest = 0.3;
enum { CUTS = 12 }; /* largest number of subdivisions; only tets near the centre need as many */

double flesh_spring_radius(const flesh_body *body, int tet)
{
  const double *X = flesh_mesh_positions(body->mesh);
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, longest = 0;
  int first = 0, end = flesh_mesh_tet_count(body->mesh);
  for (int k = 0; k < body->part_count; k++) {
    const flesh_body_part *part = &body->parts[k];
    if (tet >= part->first_tet && tet < part->first_tet + part->tets)
      first = part->first_tet, end = part->first_tet + part->tets;
  }
  for (int e = first; e < end; e++) {
    const int *node = flesh_mesh_tets(body->mesh) + 4 * (size_t)e;
    for (int k = 0; k < 12; k++) {
      low[k % 3] = fmin(low[k % 3], X[3 * (size_t)node[k / 3] + k % 3]);
      high[k % 3] = fmax(high[k % 3], X[3 * (size_t)node[k / 3] + k % 3]);
    }
  }
  for (int c = 0; c < 3; c++) longest = fmax(longest, high[c] - low[c]);
  return default_share * longest;
}

/* A tet and the sums over it. */
typedef struct region {
  const double *X;
  int count, node[10]; /* `count` is 4 or 10 */
  const double *centre;
  double radius, whole, sums[10];
} region;

static void shape(const region *self, const double L[4], double N[10])
{
  if (self->count == 4) memcpy(N, L, 4 * sizeof *L);
  else flesh_tet10_shape(L, N);
}

static void place(const region *self, const double L[4], double x[3])
{
  double N[10];
  shape(self, L, N);
  for (int c = 0; c < 3; c++) {
    x[c] = 0;
    for (int a = 0; a < self->count; a++) x[c] += N[a] * self->X[3 * (size_t)self->node[a] + c];
  }
}

/* Integrates over a tet with four points, exact for degree 2. */
static void add_up(region *self, const double L[4][4], double volume)
{
  const double near = .58541019662496845446, far = .13819660112501051518;
  for (int q = 0; q < 4; q++) {
    double at[4] = {0}, x[3], N[10];
    for (int k = 0; k < 4; k++)
      for (int i = 0; i < 4; i++) at[i] += (k == q ? near : far) * L[k][i];
    place(self, at, x);
    const double s = flesh_distance(x, self->centre) / self->radius;
    if (!(s < 1)) continue;
    const double k = volume / 4 * (1 - s * s) * (1 - s * s);
    shape(self, at, N);
    self->whole += k;
    for (int a = 0; a < self->count; a++) self->sums[a] += k * (self->count == 4 ? N[a] : N[a] * N[a]);
  }
}

/* Integrates over the part of the tet whose corners have the barycentric coordinates L, subdividing it if necessary. */
static void integrate(region *self, const double L[4][4], int cuts)
{
  static const signed char parts[8][4] = {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3},
                                          {6, 8, 4, 5}, {6, 8, 5, 9}, {6, 8, 9, 7}, {6, 8, 7, 4}};
  double middle[4] = {0}, x[4][3], m[3], e[3][3], normal[3], extent = 0, all[10][4], part[4][4];
  for (int k = 0; k < 16; k++) middle[k % 4] += L[k / 4][k % 4] / 4;
  place(self, middle, m);
  for (int k = 0; k < 4; k++) {
    place(self, L[k], x[k]);
    extent = fmax(extent, flesh_distance(x[k], m));
  }
  /* A curved part reaches beyond its corners by less than its extent. */
  if (flesh_distance(m, self->centre) > self->radius + (self->count == 4 ? 1 : 2) * extent) return;
  if (extent <= finest * self->radius || cuts == CUTS) {
    for (int k = 0; k < 9; k++) e[k / 3][k % 3] = x[k / 3 + 1][k % 3] - x[0][k % 3];
    flesh_vec3_cross(e[0], e[1], normal);
    add_up(self, L, fabs(flesh_vec3_dot(normal, e[2])) / 6);
    return;
  }
  memcpy(all, L, 4 * sizeof *L);
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < 4; i++)
      all[4 + k][i] = (L[flesh_edge_corners[k][0]][i] + L[flesh_edge_corners[k][1]][i]) / 2;
  for (int p = 0; p < 8; p++) {
    for (int k = 0; k < 4; k++) memcpy(part[k], all[parts[p][k]], sizeof part[k]);
    integrate(self, part, cuts + 1);
  }
}

/* Whether the box around a tet's nodes meets the sphere. */
static int is_near(const region *self)
{
  double squares = 0;
  for (int c = 0; c < 3; c++) {
    double low = INFINITY, high = -INFINITY;
    for (int a = 0; a < self->count; a++) {
      low = fmin(low, self->X[3 * (size_t)self->node[a] + c]);
      high = fmax(high, self->X[3 * (size_t)self->node[a] + c]);
    }
    const double apart = fmax(0, fmax(low - self->centre[c], self->centre[c] - high));
    squares += apart * apart;
  }
  return squares < self->radius * self->radius;
}

/* Marks in `reached` the nodes that are connected with `tet` through tets near the centre. */
static void reach(const flesh_mesh *mesh, region *self, int tet, uint8_t *reached)
{
  self->count = flesh_mesh_tet_nodes(mesh, tet, self->node);
  for (int a = 0; a < 4; a++) reached[self->node[a]] = 1;
  for (int grown = 1; grown;) {
    grown = 0;
    for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
      const int *node = flesh_mesh_tets(mesh) + 4 * (size_t)e;
      const int marks = reached[node[0]] + reached[node[1]] + reached[node[2]] + reached[node[3]];
      if (!marks || marks == 4) continue;
      self->count = flesh_mesh_tet_nodes(mesh, e, self->node);
      if (!is_near(self)) continue;
      for (int a = 0; a < 4; a++) reached[node[a]] = 1;
      grown = 1;
    }
  }
}

int flesh_spring_weights(const flesh_mesh *mesh, int tet, const double centre[3], double radius, double *weights)
{
  static const double corners[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  const int nodes = flesh_mesh_node_count(mesh);
  region self = {.X = flesh_mesh_positions(mesh), .centre = centre, .radius = radius};
  uint8_t *reached = flesh_calloc((size_t)nodes, 1);
  double whole = 0;
  if (!reached) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring");
  reach(mesh, &self, tet, reached);
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
    double sum = 0;
    self.count = flesh_mesh_tet_nodes(mesh, e, self.node);
    if (!reached[self.node[0]] || !reached[self.node[1]] || !reached[self.node[2]] || !reached[self.node[3]]) continue;
    self.whole = 0;
    memset(self.sums, 0, sizeof self.sums);
    if (is_near(&self)) integrate(&self, corners, 0);
    for (int a = 0; a < self.count; a++) sum += self.sums[a];
    for (int a = 0; a < self.count && sum > 0; a++) weights[self.node[a]] += self.whole * (self.sums[a] / sum);
    whole += self.whole;
  }
  flesh_free(reached);
  if (!(whole > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "radius is %g m; it must be 0 or large enough to hold some of the body",
                      radius);
  for (int i = 0; i < nodes; i++) weights[i] /= whole;
  return FLESH_OK;
}
