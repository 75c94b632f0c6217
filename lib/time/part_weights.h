/* part_weights.h: weights of errors for each connected part of a body. */
#ifndef FLESH_TIME_PART_WEIGHTS_H
#define FLESH_TIME_PART_WEIGHTS_H

#include "base/archive.h"
#include "time/rigid_guess.h"

typedef struct flesh_part_weight {
  double length, period; /* m, longest side at rest; s, period of bending over 2 pi */
  double lasts;          /* s, for errors of velocities: the part's period, or the body's if it is tied to others */
  double held;           /* 1: along each axis something holds the part or one tied to it; 0: not */
  double loose;          /* 1: no dof of the part, or of one tied to it, is constrained; 0 */
  double turns;          /* 1: held, but free to rotate; 0 */
  double fastest;        /* m/s, largest root mean square speed so far */
  double lately;         /* m/s, likewise, along its load if there is one, and of recent steps only */
  double push[5];        /* sums over the last step's stages and this rank's nodes of contact forces, N, of their sizes,
                          * N, and of their squares over masses, N^2/kg, without constrained dofs */
  double touched;        /* 1: contact pushed the part in the last step accepted; 0 */
  double times;          /* weight of the part's errors of positions */
  double drifts;         /* s, time for which an error of its velocity leads the part astray: at least its period */
  double flies;          /* s, time for which a stiff part flies on; 0: it is not stiff, or flights do not count */
} flesh_part_weight;

typedef struct flesh_part_weights {
  const flesh_rigid_parts *parts; /* borrowed */
  int count;                      /* of them */
  int *tied;                      /* [count] the first part that effects other than contact tie each part to */
  flesh_part_weight *of;          /* [count] */
  double *sums;                   /* room for sums over each part */
  int meets;                      /* parts may touch only each other, and nothing holds any */
  double forget;                  /* s since `lately` was found */
  double stages;                  /* stages of the last step tried in which something touches */
  double flies;                   /* s, longest flight of a part */
} flesh_part_weights;

/* Returns the part of a node; -1: none. */
static inline int flesh_part_of(const flesh_part_weights *weights, int node)
{
  return weights->count > 1 ? weights->parts->part[node] : 0;
}

/* FLESH_ERR_MEMORY. */
int flesh_part_weights_create(const flesh_rigid_parts *parts, flesh_part_weights *weights);
void flesh_part_weights_clear(flesh_part_weights *weights);
void flesh_part_weights_archive(flesh_part_weights *weights, flesh_archive *archive);

/* Measures the parts at rest. `length` and `period` are the body's, used if it is one part or a part has none. room
 * [3*nodes] each. Collective, as are the next two. */
void flesh_part_weights_measure(flesh_part_weights *weights, const flesh_system *system, double length, double period,
                                double *const room[3]);
/* Finds the parts that are held at t. */
void flesh_part_weights_hold(flesh_part_weights *weights, const flesh_system *system, double t);
/* Finds the weights of errors of a step from the state, which lasts h s if it is the first one, else 0, and may err by
 * `allowed`, m; returns the largest. `flights` 1: those of stiff parts last if nothing may touch them, too. load
 * [3*nodes]: room. */
double flesh_part_weights_aim(flesh_part_weights *weights, const flesh_system *system, const flesh_state *state, double h,
                              double allowed, int flights, double *load);
/* Begin a step, in which nothing pushes so far; take in forces of contact [3*nodes], N, of one of its stages. */
void flesh_part_weights_clear_contact(flesh_part_weights *weights);
void flesh_part_weights_touch(flesh_part_weights *weights, const double *forces);
/* Takes in that the step was accepted; h is its length, s. Collective. */
void flesh_part_weights_accept(flesh_part_weights *weights, double h);
/* Returns how far, m, by root mean square over the body of that mass, kg, errors of impulses lead held parts astray that
 * contact did not push in the step before this one of h s. Collective. */
double flesh_part_weights_met(const flesh_part_weights *weights, double h, double mass);
/* Computes weighted [3*nodes] = errors e times their weights: of positions, m, or, with `velocities`, m/s, each times
 * the time for which it leads its part astray. */
void flesh_part_weights_count(const flesh_part_weights *weights, const double *e, int velocities, double *weighted);
/* Computes sums [3*nodes] of errors e of positions, m, that add up through so many radians, each times hypot(W, sqrt(W)
 * radians), W being its part's weight; `counted`: e has been multiplied by W. */
void flesh_part_weights_add_up(const flesh_part_weights *weights, const double *e, int counted, double radians,
                               double *sums);
/* Returns the least time, s, for which residuals of stages by g, s, lead a part astray and, if there are several parts,
 * writes into of [3*nodes] the ratio of each part's time to it. Residuals count up to `most` times as often as errors;
 * 0: errors have no weights. */
double flesh_part_weights_of_residuals(const flesh_part_weights *weights, double g, double most, double *of);

#endif
