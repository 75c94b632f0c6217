/* part_weights.h: how often errors of each connected part of a body count. */
#ifndef FLESH_TIME_PART_WEIGHTS_H
#define FLESH_TIME_PART_WEIGHTS_H

#include "base/archive.h"
#include "time/rigid_guess.h"

typedef struct flesh_part_weight {
  double length, period; /* m, its longest side at rest; s over 2 pi, of its bending */
  double lasts;          /* s, of velocities: the period, or where it is tied to others the body's */
  double held;           /* 1: along each axis something holds it or what is tied to it, 0 */
  double fastest;        /* m/s, by root mean square, so far */
  double lately;         /* m/s, likewise, along its load where there is one, and not long ago */
  double push[4];        /* N, of contact on this rank's nodes, summed over the last step's stages; the sum of the sizes */
  double times;          /* that its errors count */
  double flies;          /* s, for which a stiff part flies on; 0: it is not stiff, or flights do not count */
} flesh_part_weight;

typedef struct flesh_part_weights {
  const flesh_rigid_parts *parts; /* borrowed */
  int count;                      /* of them */
  int *tied;                      /* [count] the first part that effects other than contact tie each to */
  flesh_part_weight *of;          /* [count] */
  double *sums;                   /* room for sums over each */
  int meets;                      /* its parts may meet each other alone, and nothing holds one */
  double forget;                  /* s since `lately` was found */
  double stages;                  /* of the last step tried, in which something touches */
  double flies;                   /* s, the longest of the parts' */
} flesh_part_weights;

/* FLESH_ERR_MEMORY. */
int flesh_part_weights_create(const flesh_rigid_parts *parts, flesh_part_weights *weights);
void flesh_part_weights_clear(flesh_part_weights *weights);
void flesh_part_weights_archive(flesh_part_weights *weights, flesh_archive *archive);

/* Measures the parts at rest. `length` and `period` are the body's, which serve where it is one part or a part has none.
 * room [3*nodes] each. Collective, as are the next two. */
void flesh_part_weights_measure(flesh_part_weights *weights, const flesh_system *system, double length, double period,
                                double *const room[3]);
/* Finds what is held at t. */
void flesh_part_weights_hold(flesh_part_weights *weights, const flesh_system *system, double t);
/* Finds how often errors count of a step from the state, which lasts h s where it is the first one, else 0, and may err by
 * `allowed`, m; the largest of all. `flights`: 1: those of stiff parts last where nothing may touch them, too. load [3*nodes]:
 * room. */
double flesh_part_weights_aim(flesh_part_weights *weights, const flesh_system *system, const flesh_state *state, double h,
                              double allowed, int flights, double *load);
/* A step begins, in which nothing pushes so far; forces of contact [3*nodes], N, of one of its stages. */
void flesh_part_weights_clear_contact(flesh_part_weights *weights);
void flesh_part_weights_touch(flesh_part_weights *weights, const double *forces);
/* weighted [3*nodes] = errors e as often as they count: of positions, m, or, `velocities`, m/s, each for its part's period. */
void flesh_part_weights_count(const flesh_part_weights *weights, const double *e, int velocities, double *weighted);
/* For how long, s, residuals of stages by g, s, lead a part astray at least, and where there are several, in of [3*nodes] how
 * many times that those of each do. They count up to `most` times as often as errors; 0: errors are not counted more often. */
double flesh_part_weights_of_residuals(const flesh_part_weights *weights, double g, double most, double *of);

#endif
