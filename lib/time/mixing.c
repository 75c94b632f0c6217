/* mixing.c: Anderson's mixing, for a fixed point of a function. */
#include "time/mixing.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/parallel_vector.h"
#include "math/eig_small.h"

enum { DEPTH = FLESH_MIXING_DEPTH, ARRAYS = 3 + 2 * DEPTH };

static const double negligible = 1e-12; /* smallest eigenvalue of products that counts, over the largest */

int flesh_mixing_create(int n, flesh_threads *threads, flesh_mixing *self)
{
  *self = (flesh_mixing){.threads = threads, .n = n};
  if (n < 1) return FLESH_OK;
  double *next = self->x = calloc((size_t)n * ARRAYS, sizeof *next);
  if (!next) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a fixed point of %d numbers", n);
  self->value = next += n;
  self->change = next += n;
  for (int k = 0; k < DEPTH; k++) {
    self->values[k] = next += n;
    self->changes[k] = next += n;
  }
  return FLESH_OK;
}

void flesh_mixing_clear(flesh_mixing *self) { free(self->x); }

void flesh_mixing_begin(flesh_mixing *self, const double *x)
{
  self->count = 0;
  memcpy(self->x, x, (size_t)self->n * sizeof *x);
}

/* Takes in a value, and its difference from the last one. */
static void take(flesh_mixing *self, const double *value)
{
  const int k = self->count++ % DEPTH;
  for (int d = 0; d < self->n; d++) {
    const double change = value[d] - self->x[d];
    self->values[k][d] = value[d] - self->value[d];
    self->changes[k][d] = change - self->change[d];
    self->value[d] = value[d];
    self->change[d] = change;
  }
}

void flesh_mixing_go_on(flesh_mixing *self, const double *value)
{
  take(self, value);
  memcpy(self->x, value, (size_t)self->n * sizeof *value);
  if (self->count < 3) return;
  /* The first value has no difference. */
  const int count = self->count - 1 < DEPTH ? self->count - 1 : DEPTH;
  double A[DEPTH * DEPTH], Q[DEPTH * DEPTH], w[DEPTH], b[DEPTH], largest = 0;
  const double *changes[DEPTH], *values[DEPTH];
  for (int j = 0; j < count; j++) {
    const int k = (self->count - 1 - j) % DEPTH;
    changes[j] = self->changes[k];
    values[j] = self->values[k];
  }
  for (int j = 0; j < count; j++) {
    b[j] = flesh_dot(self->threads, self->n, changes[j], self->change);
    for (int k = 0; k <= j; k++) A[j * count + k] = A[k * count + j] = flesh_dot(self->threads, self->n, changes[j], changes[k]);
  }
  flesh_eigh_small(count, A, w, Q);
  for (int k = 0; k < count; k++) largest = w[k] > largest ? w[k] : largest;
  for (int k = 0; k < count; k++) {
    double along = 0;
    if (!(w[k] > negligible * largest)) continue;
    for (int j = 0; j < count; j++) along += Q[j * count + k] * b[j] / w[k];
    for (int j = 0; j < count; j++)
      for (int d = 0; d < self->n; d++) self->x[d] -= along * Q[j * count + k] * values[j][d];
  }
}
