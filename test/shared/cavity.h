/* cavity.h: an effect for tests: a pressure on whole faces of three or six nodes, exact for their present shape.
 *
 * W = integral of x . n/3 over the faces is the volume of the cone from the origin to them, and the potential is p W.
 * If the rim's edges stay in planes (of symmetry) through the origin, its gradient is the pressure. With the shape
 * functions N, W = sum over a, b, c of s_abc x_a . (x_b x x_c), s the antisymmetric part of the integral of N_a
 * dN_b/dxi dN_c/deta/3; dW/dx_a = 3 sum s_abc x_b x x_c, and d2W/dx_a dx_b y = 6 sum_c s_abc y x x_c. */
#ifndef FLESH_TEST_CAVITY_H
#define FLESH_TEST_CAVITY_H

#include <stdlib.h>
#include <string.h>

#include "flesh/effect.h"
#include "tet_integrals.h"

typedef struct cavity {
  int faces, m; /* of m nodes */
  int *nodes;   /* [m*faces] nodes, ascending in each face as cells require */
  int *place;   /* [m*faces] index of each of these nodes within its face */
  flesh_cells cells;
  double pressure, s[6][6][6];
} cavity;

static inline double cavity_triple(const double *a, const double *b, const double *c)
{
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

static inline void cavity_weights(cavity *self)
{
  double t[6][6][6] = {{{0}}};
  for (int q = 0; q < TEST_FACE_POINTS; q++) {
    double L[4], N[10], up[10], down[10], by[2][6];
    const double w = test_face_point(q, 3, L) / 6, h = 0.25;
    const int order[6] = {0, 1, 2, 4, 5, 6}; /* edges 01, 12, 02 of a ten-node tet */
    const int count = self->m == 6 ? 10 : 4;
    test_shape(count, L, N);
    for (int c = 0; c < 2; c++) { /* central differences of quadratic functions are exact */
      double M[4] = {L[0] - h, L[1] + (c == 0) * h, L[2] + (c == 1) * h, 0};
      test_shape(count, M, up);
      for (int k = 0; k < 3; k++) M[k] = 2 * L[k] - M[k];
      test_shape(count, M, down);
      for (int a = 0; a < self->m; a++) by[c][a] = (up[order[a]] - down[order[a]]) / (2 * h);
    }
    for (int a = 0; a < self->m; a++)
      for (int b = 0; b < self->m; b++)
        for (int c = 0; c < self->m; c++) t[a][b][c] += w * N[order[a]] * by[0][b] * by[1][c];
  }
  for (int a = 0; a < self->m; a++)
    for (int b = 0; b < self->m; b++)
      for (int c = 0; c < self->m; c++)
        self->s[a][b][c] = (t[a][b][c] + t[b][c][a] + t[c][a][b] - t[b][a][c] - t[a][c][b] - t[c][b][a]) / 6;
}

/* Copies the positions at x of the nodes of face k, in the face's order: y [m][3]. */
static inline void cavity_gather(const cavity *self, int k, const double *x, double y[6][3])
{
  for (int a = 0; a < self->m; a++)
    memcpy(y[self->place[self->m * k + a]], x + 3 * self->nodes[self->m * k + a], sizeof y[0]);
}

static inline int cavity_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const cavity *self = effect->data;
  for (int k = 0; k < self->faces; k++) {
    double y[6][3];
    cavity_gather(self, k, point->x, y);
    for (int n = 0; n < self->m; n++) {
      const int a = self->place[self->m * k + n];
      double *at = r + 3 * self->nodes[self->m * k + n];
      for (int b = 0; b < self->m; b++)
        for (int c = 0; c < self->m; c++)
          for (int i = 0; i < 3; i++)
            at[i] += 3 * point->load * self->pressure * self->s[a][b][c] *
                     (y[b][(i + 1) % 3] * y[c][(i + 2) % 3] - y[b][(i + 2) % 3] * y[c][(i + 1) % 3]);
    }
  }
  return FLESH_OK;
}

static inline int cavity_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                   double *phi, double *magnitude)
{
  const cavity *self = effect->data;
  for (int k = 0; k < self->faces && shift->x != 0; k++) {
    double y[6][3], W = 0;
    cavity_gather(self, k, point->x, y);
    for (int a = 0; a < self->m; a++)
      for (int b = 0; b < self->m; b++)
        for (int c = 0; c < self->m; c++) W += self->s[a][b][c] * cavity_triple(y[a], y[b], y[c]);
    *phi += point->load * self->pressure * W / shift->x;
    *magnitude += fabs(point->load * self->pressure * W / shift->x);
  }
  return FLESH_OK;
}

static inline const flesh_cells *cavity_cells(const flesh_effect *effect)
{
  return &((const cavity *)effect->data)->cells;
}

/* Does nothing if negative eigenvalues are to be left out: half of the matrix is negative. */
static inline int cavity_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                  flesh_block_matrix *K, const int *slots)
{
  const cavity *self = effect->data;
  const int m = self->m, pairs = m * (m + 1) / 2;
  if (shift->filter != FLESH_FILTER_NONE || shift->x == 0) return FLESH_OK;
  for (int k = 0; k < self->faces; k++) {
    double y[6][3];
    cavity_gather(self, k, point->x, y);
    for (int a = 0, p = 0; a < m; a++)
      for (int b = a; b < m; b++, p++) {
        if (a == b) continue; /* s is antisymmetric */
        double *block = K->values + 9 * (size_t)slots[pairs * k + p], v[3] = {0};
        for (int c = 0; c < m; c++)
          for (int i = 0; i < 3; i++)
            v[i] += 6 * shift->x * point->load * self->pressure *
                    self->s[self->place[m * k + a]][self->place[m * k + b]][c] * y[c][i];
        for (int i = 0; i < 3; i++) { /* adds the matrix of w -> w x v */
          block[3 * i + (i + 1) % 3] += v[(i + 2) % 3];
          block[3 * i + (i + 2) % 3] -= v[(i + 1) % 3];
        }
      }
  }
  return FLESH_OK;
}

static inline void cavity_destroy(void *data)
{
  cavity *self = data;
  if (self) free(self->nodes), free(self->place);
  free(self);
}

static const flesh_effect_operations cavity_operations = {.name = "cavity",
                                                          .role = FLESH_ROLE_LOAD,
                                                          .cells = cavity_cells,
                                                          .residual = cavity_residual,
                                                          .jacobian = cavity_jacobian,
                                                          .potential = cavity_potential,
                                                          .destroy = cavity_destroy};

/* Creates the effect on whole faces: `triangles` [3*count] in the order of flesh_mesh_surface, four per face at order
 * 2. */
static inline int cavity_create(const flesh_mesh *mesh, int count, const int *triangles, double pressure,
                                flesh_effect **effect)
{
  const int four = flesh_mesh_order(mesh) == 2, six[6] = {0, 4, 8, 1, 5, 2};
  cavity *self = calloc(1, sizeof *self);
  self->m = four ? 6 : 3;
  self->faces = four ? count / 4 : count;
  self->pressure = pressure;
  self->nodes = malloc((size_t)(self->m * self->faces) * sizeof *self->nodes);
  self->place = malloc((size_t)(self->m * self->faces) * sizeof *self->place);
  for (int k = 0; k < self->faces; k++)
    for (int a = 0; a < self->m; a++) {
      const int node = triangles[(four ? 12 : 3) * k + (four ? six[a] : a)];
      int at = a; /* insertion sort */
      for (; at > 0 && self->nodes[self->m * k + at - 1] > node; at--) {
        self->nodes[self->m * k + at] = self->nodes[self->m * k + at - 1];
        self->place[self->m * k + at] = self->place[self->m * k + at - 1];
      }
      self->nodes[self->m * k + at] = node;
      self->place[self->m * k + at] = a;
    }
  self->cells = (flesh_cells){.count = self->faces, .nodes_per_cell = self->m, .nodes = self->nodes};
  cavity_weights(self);
  return flesh_effect_create(&cavity_operations, mesh, self, effect);
}

#endif
