/* displacement_box.h: the box around places, or around displacements, of nodes. */
#ifndef FLESH_GEOMETRY_DISPLACEMENT_BOX_H
#define FLESH_GEOMETRY_DISPLACEMENT_BOX_H

#include <math.h>
#include <stddef.h>

/* Begins as FLESH_NO_DISPLACEMENT. */
typedef struct flesh_displacement_box {
  double low[3], high[3]; /* m */
  double sound;           /* 0; NaN where a number is not finite */
} flesh_displacement_box;

#define FLESH_NO_DISPLACEMENT {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0}

/* Adds x - from, both [3*count] (from NULL: x). */
void flesh_displacement_box_add(flesh_displacement_box *box, int count, const double *from, const double *x);

static inline void flesh_displacement_box_unite(flesh_displacement_box *box, const flesh_displacement_box *other)
{
  for (int c = 0; c < 3; c++) {
    box->low[c] = other->low[c] < box->low[c] ? other->low[c] : box->low[c];
    box->high[c] = other->high[c] > box->high[c] ? other->high[c] : box->high[c];
  }
  box->sound += other->sound;
}

/* The diagonal, or a little more; 0 of a box that nothing was added to. */
static inline double flesh_displacement_box_diagonal(const flesh_displacement_box *box)
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    const double side = box->high[c] - box->low[c];
    square += side > 0 ? side * side : 0;
  }
  return (1 + 1e-12) * sqrt(square);
}

/* The distance of two boxes along the axis where it is largest. */
double flesh_displacement_box_gap(const flesh_displacement_box *a, const flesh_displacement_box *b);

#endif
