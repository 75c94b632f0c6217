/* gradients.h: derivatives of results of scenes by their keys, for tests of sensitivities: by complete solves of scenes
 * with varied keys, and by parameters made of such scenes. */
#ifndef FLESH_TEST_GRADIENTS_H
#define FLESH_TEST_GRADIENTS_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/flesh.h"
#include "test.h"

/* A key of a scene, its value, and the variations for differences of complete solves and of residuals. */
typedef struct gradient_key {
  const char *key;
  double value, step, difference;
} gradient_key;

/* Reads the scene with `key` at another value; its paths are relative to data/scenes. NULL: unchanged. */
static inline flesh_scene *gradient_scene(const char *text, const char *key, double value)
{
  char set[256];
  const char *const sets[] = {set};
  flesh_scene *scene = NULL;
  snprintf(set, sizeof set, "%s=%.17g", key ? key : "", value);
  CHECK_OK(flesh_scene_read_text(text, "../data/scenes/gradients.yaml", key != NULL, sets, &scene));
  if (!scene) exit(1);
  return scene;
}

/* The scenes of a parameter at its four values. */
typedef struct gradient_parameter {
  flesh_scene *scenes[4];
  flesh_parameter parameter;
} gradient_parameter;

static const double gradient_at[] = {-2, -1, 1, 2}, gradient_weights[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};

static inline gradient_parameter gradient_parameter_of(const char *text, gradient_key key)
{
  gradient_parameter p = {.parameter = {.difference = key.difference}};
  for (int k = 0; k < 4; k++) {
    p.scenes[k] = gradient_scene(text, key.key, key.value + gradient_at[k] * key.difference);
    p.parameter.systems[k] = flesh_scene_system(p.scenes[k]);
  }
  return p;
}

static inline void gradient_parameter_clear(gradient_parameter *p)
{
  for (int k = 0; k < 4; k++) flesh_scene_destroy(&p->scenes[k]);
}

/* Returns the first node of the mesh within 1e-6 of a rest position. */
static inline int gradient_node(const flesh_mesh *mesh, double x, double y, double z)
{
  const double *X = flesh_mesh_positions(mesh);
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    if (fabs(X[3 * i] - x) + fabs(X[3 * i + 1] - y) + fabs(X[3 * i + 2] - z) < 1e-6) return i;
  CHECK(!"there is a node");
  return 0;
}

#endif
