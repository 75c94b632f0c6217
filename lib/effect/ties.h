/* ties.h: linear combinations of nodes that springs hold at zero, of which welds and joints are made.
 *
 * A tie with the weights c_a, of sum 0, and the stiffness k has V = k/2 |sum of c_a x_a|^2. As the weights sum to 0,
 * all ties together have V = 1/2 sum of s_ij |x_i - x_j|^2 over pairs of nodes, s_ij = -sum of k c_i c_j. The forces of
 * a pair act along its line, which conserves momentum and angular momentum to rounding. Single s_ij may be negative, V
 * is not. */
#ifndef FLESH_EFFECT_TIES_H
#define FLESH_EFFECT_TIES_H

#include <stddef.h>

#include "flesh/effect.h"
#include "flesh/ranks.h"

typedef struct flesh_tie_pair {
  int node[2]; /* nodes, ascending */
  double stiffness;
} flesh_tie_pair;

typedef struct flesh_ties {
  int count, room, failed;
  flesh_tie_pair *pairs;
  /* Groups that may break: the pairs from group_start[k] to before group_start[k + 1] hold while the effect's k-th
   * internal variable is 0. NULL: all pairs hold. */
  int groups, group_room, *group_start;
  flesh_cells cells; /* the pairs as cells of two nodes; set by flesh_ties_finish */
} flesh_ties;

/* Adds a tie of nodes [count], possibly repeated, with weights [count]. If memory is missing, flesh_ties_finish
 * fails. */
void flesh_ties_add(flesh_ties *ties, int count, const int *nodes, const double *weights, double stiffness);
/* Begins a new group of ties, which may break separately. */
void flesh_ties_begin_group(flesh_ties *ties);
/* Sums up pairs of the same nodes, within each group. FLESH_ERR_MEMORY. */
int flesh_ties_finish(flesh_ties *ties);
void flesh_ties_clear(flesh_ties *ties);
/* Restricts finished ties to a rank's part, which must have all their nodes, in its numbers: to the pairs (with groups:
 * to the groups) whose first node the rank owns, or keeps `all`. The other groups become empty. FLESH_ERR_MEMORY; clear
 * the ties also after an error. */
int flesh_ties_restrict(const flesh_ties *whole, const flesh_rank_part *part, int all, flesh_ties *ties);
/* Returns the energy of a group's pairs at x, J. */
double flesh_ties_group_energy(const flesh_ties *ties, int group, const double *x);
size_t flesh_ties_memory(const flesh_ties *ties);

/* Operations of an effect whose data begin with its ties. */
const flesh_cells *flesh_tied_cells(const flesh_effect *effect);
int flesh_tied_residual(const flesh_effect *effect, const flesh_point *point, double *r);
int flesh_tied_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                        flesh_block_matrix *K, const int *slots);
int flesh_tied_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                         double *magnitude);
int flesh_tied_energy(const flesh_effect *effect, const flesh_point *point, double *energy);
#define FLESH_TIED_OPERATIONS                                                                                         \
  .traits = FLESH_IS_PASSIVE, .cells = flesh_tied_cells, .residual = flesh_tied_residual,                             \
  .jacobian = flesh_tied_jacobian, .potential = flesh_tied_potential, .energy = flesh_tied_energy

#endif
