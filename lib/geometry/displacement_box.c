/* displacement_box.c: bounding boxes, computed with vectors of two numbers, three of which hold two nodes. */
#include "geometry/displacement_box.h"

#define FLESH_LANES 2
#include "math/lanes.h"

typedef double two_at __attribute__((vector_size(16), aligned(8), may_alias));

/* Returns number k of the three vectors, whose components are 0 1, 2 0 and 1 2 of two nodes. */
static inline double at(const flesh_real of[3], int k) { return of[k / 2][k % 2]; }

/* Extends the box by `end` numbers: none, or those of at least two nodes. If the number of nodes is odd, the last two
 * overlap those before them. */
static inline void add(flesh_displacement_box *box, size_t end, int moved, const double *from, const double *x)
{
  const flesh_real far = {INFINITY, INFINITY};
  flesh_real low[3] = {far, far, far}, high[3] = {-far, -far, -far}, sum = {0, 0};
  for (size_t d = 0; d < end; d += 6) {
    if (d > end - 6) d = end - 6;
    FLESH_UNROLL(3)
    for (int k = 0; k < 3; k++) {
      flesh_real value = *(const two_at *)(x + d + 2 * k);
      if (moved) value -= *(const two_at *)(from + d + 2 * k);
      low[k] = flesh_min(low[k], value);
      high[k] = flesh_max(high[k], value);
      sum += value;
    }
  }
  flesh_displacement_box found = {.sound = 0 * (sum[0] + sum[1])};
  for (int c = 0; c < 3; c++) {
    found.low[c] = at(low, c) < at(low, c + 3) ? at(low, c) : at(low, c + 3);
    found.high[c] = at(high, c) > at(high, c + 3) ? at(high, c) : at(high, c + 3);
  }
  flesh_displacement_box_unite(box, &found);
}

void flesh_displacement_box_add(flesh_displacement_box *box, int count, const double *from, const double *x)
{
  double twice[6]; /* a single node is added twice */
  for (int k = 0; k < 6 && count == 1; k++) twice[k] = from ? x[k % 3] - from[k % 3] : x[k % 3];
  if (count == 1) add(box, 6, 0, twice, twice);
  else if (from) add(box, 3 * (size_t)count, 1, from, x);
  else add(box, 3 * (size_t)count, 0, x, x);
}

double flesh_displacement_box_gap(const flesh_displacement_box *a, const flesh_displacement_box *b)
{
  double gap = -INFINITY;
  for (int c = 0; c < 3; c++) gap = fmax(gap, fmax(a->low[c] - b->high[c], b->low[c] - a->high[c]));
  return gap;
}
