/* pull.h: a cube pulled along x. */
#ifndef FLESH_TEST_PULL_H
#define FLESH_TEST_PULL_H

#include <stdlib.h>

#include "body.h"
#include "test.h"

/* Returns the nominal stress of form S along x at this stretch, with free sides; the stretch of the sides is found by
 * bisection. */
static inline double uniaxial(const flesh_material *m, double stretch, double *side)
{
  const double alpha = 1 + m->mu / m->lambda - m->mu / (4 * m->lambda);
  double low = 0.1, high = 5, mid = 1, length = 3;
  for (int k = 0; k < 200; k++) {
    mid = (low + high) / 2;
    length = stretch * stretch + 2 * mid * mid;
    const double P = m->mu * mid * (1 - 1 / (length + 1)) + m->lambda * (stretch * mid * mid - alpha) * stretch * mid;
    *(P > 0 ? &high : &low) = mid;
  }
  *side = mid;
  return m->mu * stretch * (1 - 1 / (length + 1)) + m->lambda * (stretch * mid * mid - alpha) * mid * mid;
}

/* Adds a traction, Pa, to the face at x = 1. */
static inline void add_pull(test_body *b, double pull)
{
  int count, chosen = 0;
  const int *surface = flesh_mesh_surface(b->mesh, &count);
  int *face = malloc(3 * (size_t)count * sizeof *face);
  for (int k = 0; k < count; k++) {
    double low = INFINITY;
    for (int a = 0; a < 3; a++) low = fmin(low, flesh_mesh_positions(b->mesh)[3 * surface[3 * k + a]]);
    if (low > 1 - 1e-9) memcpy(face + 3 * chosen++, surface + 3 * k, 3 * sizeof *face);
  }
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_traction(&b->body, chosen, face, (double[]){pull, 0, 0}, NULL, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  free(face);
}

#endif
