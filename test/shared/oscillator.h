/* oscillator.h: a body that moves as one linear oscillator. */
#ifndef FLESH_TEST_OSCILLATOR_H
#define FLESH_TEST_OSCILLATOR_H

#include "body.h"

/* Makes a linear oscillator, x'' = -w^2 x: a tet without elasticity on a spring at its centroid. */
static inline void make_oscillator(double w, test_body *b)
{
  const double X[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const flesh_keyframe still = {0, {0.25, 0.25, 0.25}, {0}};
  flesh_mesh *mesh = NULL;
  flesh_effect *effect = NULL;
  memset(b, 0, sizeof *b);
  CHECK_OK(flesh_mesh_create(4, X, 1, (const int[]){0, 1, 2, 3}, NULL, &mesh));
  *b = (test_body){.mesh = mesh, .n = 12};
  b->density = malloc(sizeof *b->density);
  b->density[0] = 6; /* 1 kg */
  b->body = (flesh_body){.mesh = mesh, .density = b->density};
  b->state.x = malloc(sizeof X);
  b->state.v = calloc(1, sizeof X);
  memcpy(b->state.x, X, sizeof X);
  CHECK_OK(flesh_system_create(mesh, &b->system));
  CHECK_OK(flesh_effect_inertia(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_spring(&b->body, still.translation, w * w, &(flesh_motion){.count = 1, .keyframes = &still},
                               -INFINITY, INFINITY, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
}

#endif
