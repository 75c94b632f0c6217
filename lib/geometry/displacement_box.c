/* displacement_box.c: boxes by vectors of two numbers, three of which are two nodes. */
#include "geometry/displacement_box.h"

#define FLESH_LANES 2
#include "math/lanes.h"

typedef double two_at __attribute__((vector_size(16), aligned(8), may_alias));

static inline void add(flesh_displacement_box *box, int count, int moved, const double *from, const double *x)
{
  two_at *low = (two_at *)box->low, *high = (two_at *)box->high, *sum = (two_at *)box->sum;
  flesh_real l[3] = {low[0], low[1], low[2]}, h[3] = {high[0], high[1], high[2]}, s[3] = {sum[0], sum[1], sum[2]};
  const size_t end = 3 * (size_t)count;
  size_t d = 0;
  for (; d + 6 <= end; d += 6)
    FLESH_UNROLL(3)
    for (int k = 0; k < 3; k++) {
      flesh_real at = *(const two_at *)(x + d + 2 * k);
      if (moved) at -= *(const two_at *)(from + d + 2 * k);
      l[k] = flesh_min(l[k], at);
      h[k] = flesh_max(h[k], at);
      s[k] += at;
    }
  for (int k = 0; k < 3; k++) low[k] = l[k], high[k] = h[k], sum[k] = s[k];
  for (; d < end; d++) {
    const double at = moved ? x[d] - from[d] : x[d];
    box->low[d % 6] = at < box->low[d % 6] ? at : box->low[d % 6];
    box->high[d % 6] = at > box->high[d % 6] ? at : box->high[d % 6];
    box->sum[d % 6] += at;
  }
}

void flesh_displacement_box_add(flesh_displacement_box *box, int count, const double *from, const double *x)
{
  if (from) add(box, count, 1, from, x);
  else add(box, count, 0, x, x);
}

double flesh_displacement_box_close(flesh_displacement_box *box)
{
  double sound = 0;
  for (int k = 0; k < 6; k++) sound += 0 * box->sum[k];
  for (int c = 0; c < 3; c++) {
    box->low[c] = fmin(box->low[c], box->low[c + 3]);
    box->high[c] = fmax(box->high[c], box->high[c + 3]);
  }
  return sound;
}

double flesh_displacement_box_diagonal(const flesh_displacement_box *box)
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    const double side = fmax(box->high[c] - box->low[c], 0);
    square += side * side;
  }
  return (1 + 1e-12) * sqrt(square);
}

double flesh_displacement_box_gap(const flesh_displacement_box *a, const flesh_displacement_box *b)
{
  double gap = -INFINITY;
  for (int c = 0; c < 3; c++) gap = fmax(gap, fmax(a->low[c] - b->high[c], b->low[c] - a->high[c]));
  return gap;
}
