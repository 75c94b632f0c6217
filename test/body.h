/* body.h: bodies and systems for tests, made in one call and freed in one. */
#ifndef FLESH_TEST_BODY_H
#define FLESH_TEST_BODY_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/flesh.h"

typedef struct test_body {
  flesh_mesh *mesh;
  int n; /* unknowns */
  double *density;
  flesh_material material;
  flesh_body body;
  flesh_system *system;
  flesh_state state;
} test_body;

/* Takes the mesh; the material by value. Inertia and elasticity only; add the rest and finish. */
static inline int test_body_create(flesh_mesh *mesh, flesh_material material, double density,
                                   flesh_mass mass, int inertia, test_body *b)
{
  memset(b, 0, sizeof *b);
  int tets = flesh_mesh_tet_count(mesh);
  b->mesh = mesh;
  b->n = 3 * flesh_mesh_node_count(mesh);
  b->material = material;
  b->density = malloc((size_t)tets * sizeof *b->density);
  for (int e = 0; e < tets; e++) b->density[e] = density;
  b->body = (flesh_body){mesh, b->density, &b->material, NULL, mass};
  b->state.x = malloc((size_t)b->n * sizeof *b->state.x);
  b->state.v = calloc((size_t)b->n, sizeof *b->state.v);
  memcpy(b->state.x, flesh_mesh_positions(mesh), (size_t)b->n * sizeof *b->state.x);
  flesh_effect *effect = NULL;
  int status = flesh_system_create(mesh, &b->system);
  if (!status && inertia) {
    status = flesh_effect_inertia(&b->body, &effect);
    if (!status) status = flesh_system_add_effect(b->system, &effect);
  }
  if (!status) status = flesh_effect_elasticity(&b->body, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  return status;
}

static inline int test_body_gravity(test_body *b, double gx, double gy, double gz)
{
  flesh_effect *effect = NULL;
  int status = flesh_effect_gravity(&b->body, (double[]){gx, gy, gz}, &effect);
  return status ? status : flesh_system_add_effect(b->system, &effect);
}

/* Pins the nodes with X <= x. */
static inline int test_body_clamp(test_body *b, double x)
{
  int *nodes = malloc((size_t)b->n * sizeof *nodes), count = 0;
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] <= x) nodes[count++] = i;
  int status = flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY);
  free(nodes);
  return status;
}

static inline void test_body_destroy(test_body *b)
{
  flesh_system_destroy(&b->system);
  free(b->density);
  free(b->state.x);
  free(b->state.v);
  flesh_mesh_destroy(&b->mesh);
}

#endif
