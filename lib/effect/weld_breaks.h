/* weld_breaks.h: segments of a weld that break by themselves: their tractions, and what a run remembers of them.
 *
 * A segment is the common part of two triangles. The weld pulls at the first surface there with the traction
 * t = -k (x_A - x_B), the mean over the segment, per area at rest. With n, the normal of its triangle as it lies now,
 * outwards, t_n = t.n > 0 is tension and t_s the rest of t. What counts is sqrt(<t_n>^2 + t_s^2), <t_n> = t_n in
 * tension and 0 in compression (the effective traction of Ortiz & Pandolfi 1999 with equal weights). */
#ifndef FLESH_EFFECT_WELD_BREAKS_H
#define FLESH_EFFECT_WELD_BREAKS_H

#include "effect/ties.h"

typedef struct flesh_weld_part {
  int triangle[3];  /* of the first surface */
  int begin;        /* of its nodes */
  double area;      /* m^2, at rest */
  double middle[3]; /* m, at rest */
} flesh_weld_part;

typedef struct flesh_weld_breaks {
  double limit, stiffness; /* Pa, of the traction; Pa/m */
  double area;             /* m^2, of all */
  int count, room, failed;
  flesh_weld_part *parts; /* [count + 1] */
  int entries, entry_room;
  int *nodes;      /* [entries] */
  double *weights; /* [entries] of x_A - x_B, the mean over its part */
} flesh_weld_breaks;

/* A part begins, is made of places, each with weights of nodes and its share of the area, m^2, and ends. What lacks
 * memory fails in _finish. */
void flesh_weld_breaks_begin(flesh_weld_breaks *breaks, const int triangle[3]);
void flesh_weld_breaks_add(flesh_weld_breaks *breaks, int count, const int *nodes, const double *weights, double area,
                           const double place[3]);
void flesh_weld_breaks_end(flesh_weld_breaks *breaks);
/* Restricts the parts to a rank's part, which has all nodes, in its numbers. FLESH_ERR_MEMORY. To be cleared also when
 * it fails. */
int flesh_weld_breaks_restrict(const flesh_weld_breaks *whole, const flesh_rank_part *part, flesh_weld_breaks *breaks);
/* FLESH_ERR_MEMORY. */
int flesh_weld_breaks_finish(const flesh_weld_breaks *breaks);
void flesh_weld_breaks_clear(flesh_weld_breaks *breaks);
size_t flesh_weld_breaks_memory(const flesh_weld_breaks *breaks);

/* Internal variables: of each part 0, and 1 once it is broken; then the energy that was released, J, the time, s, and
 * the place, m, at rest, of the first break. */
int flesh_weld_breaks_variables(const flesh_weld_breaks *breaks);
/* Breaks what is beyond the limit at x [3*n] and t; of the ties group k is part k. Returns how many. */
int flesh_weld_breaks_update(const flesh_weld_breaks *breaks, const flesh_ties *ties, double t, const double *x,
                             double *internal);
/* The broken part of the area; J released; the largest traction that counts of what holds, Pa. `internal` may be NULL. */
void flesh_weld_breaks_report(const flesh_weld_breaks *breaks, const double *x, const double *internal,
                              double values[3]);
/* "" where nothing is broken. */
void flesh_weld_breaks_tell(const flesh_weld_breaks *breaks, const double *internal, size_t size, char *text);

#endif
