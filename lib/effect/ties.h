/* ties.h: linear combinations of nodes that springs hold at zero: what welds and joints are made of.
 *
 * A tie with the weights c_a, of sum 0, and the stiffness k has V = k/2 |sum of c_a x_a|^2. As the weights sum to 0,
 * the sum of all ties is V = 1/2 sum of s_ij |x_i - x_j|^2 over pairs of nodes, s_ij = -sum of k c_i c_j: pairs push
 * and pull along their lines, which keeps momentum and angular momentum to rounding. Single s_ij may be negative, V is
 * not. */
#ifndef FLESH_EFFECT_TIES_H
#define FLESH_EFFECT_TIES_H

#include <stddef.h>

#include "flesh/effect.h"
#include "flesh/ranks.h"

typedef struct flesh_tie_pair {
  int node[2]; /* ascending */
  double stiffness;
} flesh_tie_pair;

typedef struct flesh_ties {
  int count, room, failed;
  flesh_tie_pair *pairs;
  /* Groups that may break: the pairs from group_start[k] to group_start[k + 1] hold while the effect's k-th internal
   * variable is 0. NULL: all hold. */
  int groups, group_room, *group_start;
  flesh_cells cells; /* two nodes each; once finished */
} flesh_ties;

/* Adds a tie of nodes [count], which may repeat, with weights [count]. What lacks memory fails in _finish. */
void flesh_ties_add(flesh_ties *ties, int count, const int *nodes, const double *weights, double stiffness);
/* Begins another group of ties, which may break by itself. */
void flesh_ties_begin_group(flesh_ties *ties);
/* Sums up equal pairs, of groups within each. FLESH_ERR_MEMORY. */
int flesh_ties_finish(flesh_ties *ties);
void flesh_ties_clear(flesh_ties *ties);
/* Finished ties on a rank's part, which has their nodes, in its numbers: of pairs or, where there are groups, of groups
 * those whose first node the rank owns, which it computes; or `all`. The other groups become empty. FLESH_ERR_MEMORY. To
 * be cleared also when it fails. */
int flesh_ties_restrict(const flesh_ties *whole, const flesh_rank_part *part, int all, flesh_ties *ties);
/* The energy of a group's pairs at x, J. */
double flesh_ties_group_energy(const flesh_ties *ties, int group, const double *x);
size_t flesh_ties_memory(const flesh_ties *ties);

/* The operations of an effect whose data begin with its ties. */
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
