/* displacement_box.h: a box that bounds positions or displacements of nodes. */
#ifndef FLESH_GEOMETRY_DISPLACEMENT_BOX_H
#define FLESH_GEOMETRY_DISPLACEMENT_BOX_H

#include <math.h>

/* Initialise with FLESH_NO_DISPLACEMENT. */
typedef struct flesh_displacement_box {
  double low[3], high[3]; /* m */
  double sound;           /* 0; NaN if a value is not finite */
} flesh_displacement_box;

#define FLESH_NO_DISPLACEMENT {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0}

/* Extends the box to x - from, both [3*count]; to x if `from` is NULL. */
void flesh_displacement_box_add(flesh_displacement_box *box, int count, const double *from, const double *x);

static inline void flesh_displacement_box_unite(flesh_displacement_box *box, const flesh_displacement_box *other)
{
  for (int c = 0; c < 3; c++) {
    box->low[c] = other->low[c] < box->low[c] ? other->low[c] : box->low[c];
    box->high[c] = other->high[c] > box->high[c] ? other->high[c] : box->high[c];
  }
  box->sound += other->sound;
}

/* Returns the diagonal, rounded up; 0 for an empty box. */
static inline double flesh_displacement_box_diagonal(const flesh_displacement_box *box)
{
  double square = 0;
  for (int c = 0; c < 3; c++) {
    const double side = box->high[c] - box->low[c];
    square += side > 0 ? side * side : 0;
  }
  return (1 + 1e-12) * sqrt(square);
}

/* Returns the largest gap of two boxes along any axis; negative if they overlap. */
double flesh_displacement_box_gap(const flesh_displacement_box *a, const flesh_displacement_box *b);

#endif
