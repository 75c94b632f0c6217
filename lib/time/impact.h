/* impact.h: gives back to the motion what Newmark's trapezoidal rule takes from it where nodes meet within a step.
 *
 * The rule's work along a step's displacement u is that of the mean of the forces at both ends. Of a barrier that is met
 * or left within the step that is many times what the barrier stores: a node that meets a wall loses most of its energy
 * in one step and leaves with another share in the next, up to three times its speed. What contact has put in so is known,
 *   owed = V_1 - V_0 - u.(g_0 + g_1)/2, summed over steps, V the barriers' energy and g its gradient.
 * Once that counts, the velocities at the step's end are changed so that the kinetic energy gives it back, by the energy
 * method of projection (Hairer, Lubich & Wanner 2006, IV.4): along the impulses of contact, M^-1 g_0 and M^-1 g_1, which
 * keep linear momentum, the part s of the velocities in their span is scaled. That is the least change, by mass, that
 * gives back the energy, and it can give back all that s has; the rest is owed on. Positions, forces and the potential
 * that a step minimises do not change. */
#ifndef FLESH_TIME_IMPACT_H
#define FLESH_TIME_IMPACT_H

#include "time/energy_watch.h"
#include "time/method.h"

typedef struct flesh_impact {
  double *impulse[2];      /* [n] forces at both ends, N, then what they do to velocities; NULL: the method needs none */
  double *mass, *by;       /* [n] kg; room */
  int on;                  /* the step under way counts */
  double stored;           /* J, in barriers where it began */
  double owed, owes;       /* J, before it and after it */
  int turned;              /* impulse[0] is what the velocities change by at its end, m/s */
} flesh_impact;

/* A part of a step by `row` begins at the state, which the watch knows; NULL: nothing is to be given back. Collective, as
 * below. */
int flesh_impact_begin(flesh_impact *impact, const flesh_energy_watch *watch, const flesh_method_row *row,
                       const flesh_method_memory *memory, const flesh_state *state);

/* It has led to `end`, which the watch knows; turns v, its velocities [n], and the watch's energies where enough is owed, but
 * for those that are `fixed` [n]. */
int flesh_impact_end(flesh_impact *impact, flesh_energy_watch *watch, const uint8_t *fixed, const flesh_state *state,
                     const flesh_state *end, double *v);

/* It is accepted: adds to v [n] what flesh_impact_end has turned it by. */
void flesh_impact_accept(flesh_impact *impact, int n, double *v);

#endif
