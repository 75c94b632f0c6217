/* displacement_box.h: the box around places, or around displacements, of nodes. */
#ifndef FLESH_GEOMETRY_DISPLACEMENT_BOX_H
#define FLESH_GEOMETRY_DISPLACEMENT_BOX_H

#include <stddef.h>

/* Begins as FLESH_NO_DISPLACEMENT. */
typedef struct flesh_displacement_box {
  double low[6], high[6]; /* m, of even nodes, then of odd ones, until it is closed: then low[3] and high[3] */
  double sum[6];          /* not finite where a number is not */
} flesh_displacement_box;

#define FLESH_NO_DISPLACEMENT                                                                                           \
  {{INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY},                                                        \
   {-INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY}, {0}}

/* Adds x - from, both [3*count] (from NULL: x). */
void flesh_displacement_box_add(flesh_displacement_box *box, int count, const double *from, const double *x);
/* Closes the box; returns 0, or NaN where a number was not finite. */
double flesh_displacement_box_close(flesh_displacement_box *box);
/* The diagonal of a closed box, or a little more; 0 of one that nothing was added to. */
double flesh_displacement_box_diagonal(const flesh_displacement_box *box);
/* The distance of two closed boxes along the axis where it is largest. */
double flesh_displacement_box_gap(const flesh_displacement_box *a, const flesh_displacement_box *b);

#endif
