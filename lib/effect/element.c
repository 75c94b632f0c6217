/* element.c: linear tets: shape gradients and where their blocks go. */
#include "effect/element.h"

#include <math.h>
#include <stdlib.h>

#include "base/error.h"

double flesh_element_shape(const double *X, const int node[4], double gradient[9])
{
  double D[9];
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++)
      D[3 * i + a] = X[3 * (size_t)node[a + 1] + i] - X[3 * (size_t)node[0] + i];
  /* D's columns are the edges; the rows of its inverse are the gradients, whichever way round the
   * ascending nodes wind. */
  return fabs(flesh_mat3_inverse(D, gradient)) / 6;
}

int flesh_elements_create(const flesh_body *body, const flesh_cells *cells, flesh_element **elements)
{
  const double *X = flesh_mesh_positions(body->mesh);
  flesh_element *made = malloc(((size_t)cells->count + 1) * sizeof *made);
  if (!made) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d elements", cells->count);
  for (int k = 0; k < cells->count; k++) {
    flesh_element *e = &made[k];
    for (int a = 0; a < 4; a++) e->node[a] = cells->nodes[4 * (size_t)k + a];
    e->volume = flesh_element_shape(X, e->node, e->gradient);
    e->material = body->tet_material ? body->tet_material[k] : 0;
  }
  *elements = made;
  return FLESH_OK;
}

void flesh_element_add_blocks(const double pair[6][9], const int slot[10], double *values)
{
  double *k[10];
  for (int p = 0; p < 10; p++) k[p] = values + 9 * (size_t)slot[p];
  for (int p = 0; p < 6; p++)
    for (int c = 0; c < 9; c++) k[4 + p][c] += pair[p][c];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int c = 3 * i + j, t = 3 * j + i;
      double k01 = -(pair[0][c] + pair[1][t] + pair[2][t]);
      double k02 = -(pair[1][c] + pair[3][c] + pair[4][t]);
      double k03 = -(pair[2][c] + pair[4][c] + pair[5][c]);
      k[1][c] += k01;
      k[2][c] += k02;
      k[3][c] += k03;
      k[0][c] -= 0.5 * (k01 + k02 + k03);
      k[0][t] -= 0.5 * (k01 + k02 + k03);
    }
}
