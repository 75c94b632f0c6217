/* element.h: the linear tets of a body, for the effects that go through them. */
#ifndef FLESH_EFFECT_ELEMENT_H
#define FLESH_EFFECT_ELEMENT_H

#include "flesh/effects.h"
#include "math/mat3.h"

typedef struct flesh_element {
  int node[4]; /* ascending */
  int material;
  double volume;
  double gradient[9]; /* rows g_1, g_2, g_3 of the shape functions; g_0 = -(g_1 + g_2 + g_3) */
} flesh_element;

/* The gradients g_1, g_2, g_3 of one tet with these nodes, in the mesh with rest positions X; returns
 * its volume. */
double flesh_element_shape(const double *X, const int node[4], double gradient[9]);

/* Those of all tets, with the nodes of `cells` (flesh_cells_of_tets). Returns new, freed by free(). */
int flesh_elements_create(const flesh_body *body, const flesh_cells *cells, flesh_element **elements);

/* sum over nodes of x_a g_a^T: the deformation gradient of positions, its rate of velocities. */
static inline void flesh_element_gradient(const flesh_element *e, const double *x, double F[9])
{
  const double *x0 = x + 3 * e->node[0];
  double d[3][3];
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++) d[a][i] = x[3 * e->node[a + 1] + i] - x0[i];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      F[3 * i + j] = d[0][i] * e->gradient[j] + d[1][i] * e->gradient[3 + j] + d[2][i] * e->gradient[6 + j];
}

/* Adds f_a to nodes 1, 2, 3 and minus their sum to node 0. */
static inline void flesh_element_add_forces(const flesh_element *e, const double f[3][3], double *r)
{
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++) {
      r[3 * e->node[a + 1] + i] += f[a][i];
      r[3 * e->node[0] + i] -= f[a][i];
    }
}

/* Adds the six blocks K_11 K_12 K_13 K_22 K_23 K_33 and, rows summing to zero, the four of node 0. */
void flesh_element_add_blocks(const double pair[6][9], const int slot[10], double *values);

#endif
