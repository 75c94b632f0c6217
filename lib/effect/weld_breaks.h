/* weld_breaks.h: segments of a weld that break one by one: their tractions, and the state that a run keeps.
 *
 * A segment is the common part of two triangles. There the weld pulls at the first surface with the traction t = -k
 * (x_A - x_B), the mean over the segment, per area at rest. With n, the present outward normal of its triangle, t_n =
 * t.n > 0 is tension and t_s the rest of t. A segment breaks by sqrt(<t_n>^2 + t_s^2), where <t_n> is t_n in tension
 * and 0 in compression (the effective traction of Ortiz & Pandolfi 1999 with equal weights). */
#ifndef FLESH_EFFECT_WELD_BREAKS_H
#define FLESH_EFFECT_WELD_BREAKS_H

#include "effect/ties.h"

typedef struct flesh_weld_part {
  int triangle[3];  /* a triangle of the first surface */
  int begin;        /* index of its first entry in `nodes` */
  double area;      /* m^2, at rest */
  double middle[3]; /* m, at rest */
} flesh_weld_part;

typedef struct flesh_weld_breaks {
  double limit, stiffness; /* limit of the traction, Pa; stiffness of the weld, Pa/m */
  double area;             /* m^2, total */
  int count, room, failed;
  flesh_weld_part *parts; /* [count + 1] */
  int entries, entry_room;
  int *nodes;      /* [entries] */
  double *weights; /* [entries] weights in x_A - x_B, averaged over the part */
} flesh_weld_breaks;

/* Build a part: begin it, add points with the weights of nodes and the point's share of the area, m^2, and end it. If
 * memory is missing, flesh_weld_breaks_finish fails. */
void flesh_weld_breaks_begin(flesh_weld_breaks *breaks, const int triangle[3]);
void flesh_weld_breaks_add(flesh_weld_breaks *breaks, int count, const int *nodes, const double *weights, double area,
                           const double place[3]);
void flesh_weld_breaks_end(flesh_weld_breaks *breaks);
/* Copies the parts in the numbers of a rank's part, which must have all their nodes. FLESH_ERR_MEMORY; clear the copy
 * also after an error. */
int flesh_weld_breaks_restrict(const flesh_weld_breaks *whole, const flesh_rank_part *part, flesh_weld_breaks *breaks);
/* Fails with FLESH_ERR_MEMORY if memory was missing. */
int flesh_weld_breaks_finish(const flesh_weld_breaks *breaks);
void flesh_weld_breaks_clear(flesh_weld_breaks *breaks);
size_t flesh_weld_breaks_memory(const flesh_weld_breaks *breaks);

/* Returns the number of internal variables: one for each part, 0 until it breaks and then 1; then the released energy,
 * J, and the time, s, and rest position, m, of the first break. */
int flesh_weld_breaks_variables(const flesh_weld_breaks *breaks);
/* Breaks the parts beyond the limit at x [3*n] and t; group k of `ties` is part k. Returns their number. */
int flesh_weld_breaks_update(const flesh_weld_breaks *breaks, const flesh_ties *ties, double t, const double *x,
                             double *internal);
/* Computes the broken fraction of the area, the released energy, J, and the largest effective traction of the parts
 * that hold, Pa. `internal` may be NULL. */
void flesh_weld_breaks_report(const flesh_weld_breaks *breaks, const double *x, const double *internal,
                              double values[3]);
/* Describes the breaks in `text`; "" if nothing is broken. */
void flesh_weld_breaks_tell(const flesh_weld_breaks *breaks, const double *internal, size_t size, char *text);

#endif
