/* cook.h: Cook's membrane as a slab: 48 mm long, 44 mm high at its clamped end and 16 mm at the end that a dead
 * traction lifts, 10 mm thick, free on all other faces. */
#ifndef FLESH_TEST_COOK_H
#define FLESH_TEST_COOK_H

#include <stdlib.h>

#include "body.h"
#include "test.h"

/* Makes a grid of cells of six tets each: along, across, through. */
static inline flesh_mesh *cook_mesh(const int cells[3], flesh_element element)
{
  flesh_mesh *box = test_box(cells[0], cells[1], cells[2], 1, 1, 1), *mesh = NULL, *raised = NULL;
  const int nodes = flesh_mesh_node_count(box);
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  for (int i = 0; i < nodes; i++) {
    const double *at = flesh_mesh_positions(box) + 3 * i;
    X[3 * i] = 0.048 * at[0];
    X[3 * i + 1] = 0.044 * at[0] + at[1] * (0.044 - 0.028 * at[0]);
    X[3 * i + 2] = 0.01 * at[2];
  }
  CHECK_OK(flesh_mesh_create(nodes, X, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  free(X);
  flesh_mesh_destroy(&box);
  if (element == FLESH_ELEMENT_TET4) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  return raised;
}

/* Makes the slab with elasticity of the element, held at X = 0 under `traction` [Pa] upwards at X = 48 mm. */
static inline void cook_make(const int cells[3], flesh_element element, flesh_material material, double traction,
                             test_body *b)
{
  int all, count = 0;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(cook_mesh(cells, element), material, 1000, FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  const double *X = flesh_mesh_positions(b->mesh);
  const int *surface = flesh_mesh_surface(b->mesh, &all);
  int *end = malloc(3 * (size_t)all * sizeof *end);
  for (int k = 0; k < all; k++) {
    const int *node = surface + 3 * k;
    if (fmin(X[3 * node[0]], fmin(X[3 * node[1]], X[3 * node[2]])) < 0.048 - 1e-9) continue;
    memcpy(end + 3 * count++, node, 3 * sizeof *node);
  }
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_traction(&b->body, count, end, (double[]){0, traction, 0}, NULL, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
  free(end);
}

/* Returns the node with the rest position (x, y, z); -1 if there is none. */
static inline int test_node_at(const flesh_mesh *mesh, double x, double y, double z)
{
  const double *X = flesh_mesh_positions(mesh);
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    if (fabs(X[3 * i] - x) + fabs(X[3 * i + 1] - y) + fabs(X[3 * i + 2] - z) < 1e-9) return i;
  return -1;
}

#endif
