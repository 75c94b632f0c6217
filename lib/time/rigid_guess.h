/* rigid_guess.h: predicts where free bodies get to when each goes on moving as a rigid one. */
#ifndef FLESH_TIME_RIGID_GUESS_H
#define FLESH_TIME_RIGID_GUESS_H

#include "base/team.h"
#include "flesh/integrator.h"

/* The connected parts of a mesh, or of the body that ranks share out: all ranks then have all parts, each with its own
 * nodes and ghosts. */
typedef struct flesh_rigid_parts {
  int count;
  int *first; /* [count+1] where each part's nodes begin */
  int *nodes; /* [used nodes] */
  double *mass; /* [n] masses of the nodes, or ones */
  const flesh_mesh *mesh; /* borrowed */
  const flesh_team *team; /* the system's team, whose sums over nodes are those of all ranks; NULL: no ranks */
  int own;                /* number of nodes that count in sums, the first ones */
  int *part; /* [nodes] part of each, where that is used */
  uint8_t *constrained; /* [3*nodes] room for the constrained dofs */
  double *extent; /* [count] m, mean distance from the centre at rest */
} flesh_rigid_parts;

/* Finds the parts. Fails if a rank comes with a `status` other than FLESH_OK from what it has made before;
 * FLESH_ERR_MEMORY. Collective, as is flesh_rigid_guess. */
int flesh_rigid_parts_create(const flesh_system *system, int status, flesh_rigid_parts *parts);
void flesh_rigid_parts_clear(flesh_rigid_parts *parts);
/* Finds the mean distance of a part's nodes from its centre of mass at x, m, which a few nodes far away hardly change;
 * and that centre. Collective. */
double flesh_rigid_parts_extent(const flesh_rigid_parts *parts, int part, const double *x, double centre[3]);

/* Finds the angular velocity, 1/s, of a body with this inertia, kg m^2, and angular momentum, kg m^2/s, about its centre;
 * 0 for points on a line. */
void flesh_rigid_rate(const double inertia[9], const double momentum[3], double rate[3]);

/* Predicts displacements u [3*n] over h; 0 for parts with a dof in `fixed` [3*n] (NULL: none is). Returns how many
 * parts are free. All ranks have `fixed`, or none. The motion is the best fit by mass of the velocities or, if
 * `nearest`, of where they lead along straight lines, which is what backward Euler goes by. A part that is many times
 * as large as at rest shrinks. */
int flesh_rigid_guess(const flesh_rigid_parts *parts, const uint8_t *fixed, const flesh_state *state, double h,
                      int nearest, double *u);

#endif
