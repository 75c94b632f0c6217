/* momenta.h: keeps the momenta of free parts in steps that errors choose. */
#ifndef FLESH_TIME_MOMENTA_H
#define FLESH_TIME_MOMENTA_H

#include "time/method.h"
#include "time/part_weights.h"

typedef struct flesh_momenta {
  const flesh_part_weights *weights; /* borrowed, as is the system */
  const flesh_system *system;
  double *sums;                      /* sums over each part */
  /* [7*parts] Momenta at the step's end, kg m/s, kg m^2/s, about the centre; size of contact forces at its start, N. */
  double *at_end;
  double *room;                      /* [3*nodes] borrowed */
} flesh_momenta;

/* room [3*nodes] is borrowed, too, and overwritten by flesh_momenta_keep. FLESH_ERR_MEMORY. */
int flesh_momenta_create(const flesh_part_weights *weights, const flesh_system *system, double *room, flesh_momenta *momenta);
void flesh_momenta_clear(flesh_momenta *momenta);

/* Takes in that the stage memory->at of a step of h from the point `start` has been solved at the point `stage`. If it is
 * the last one, adds the velocities that free parts lack to memory->v0. Collective. */
int flesh_momenta_keep(flesh_momenta *momenta, const flesh_method_row *row, const flesh_method_memory *memory,
                       const flesh_point *start, const flesh_point *stage, double h);

#endif
