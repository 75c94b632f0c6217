/* rank_part.h: the part of a body that a rank computes: a mesh of its tets, whose nodes it owns or has as ghosts
 * (team.h), and the messages between ghosts and owners.
 *
 * Every tet belongs to one rank. A node of several ranks is owned by the first of them. Hence a sum over tets, or over
 * their faces, is the sum of the ranks' sums: a rank's system is an ordinary one on its mesh, and an effect need not
 * know about ranks. Each tet is computed once, and forces on ghosts go to their owners. Effects that tie nodes of
 * several ranks together also get the missing ones as ghosts, which belong to no tet of the rank.
 *
 * If the mesh from which it is made is a part of a split one (mesh/split.h), for as many ranks, that part's own tets
 * are the rank's. flesh_rank_part_nodes, _tets and _find then refer to that mesh, and the numbers in the whole are the
 * team's. */
#ifndef FLESH_PARALLEL_RANK_PART_H
#define FLESH_PARALLEL_RANK_PART_H

#include "base/team.h"
#include "parallel/communicator.h"

/* Cells of nodes that an effect ties together and that need not be in one tet (flesh_effect_ranks.cells). */
typedef struct flesh_rank_tie {
  int count, nodes_per_cell;
  const int *nodes; /* [count*nodes_per_cell] */
  int everywhere;   /* 1: every rank gets all nodes of the cells; 0: a cell's go to the owner of its first node */
} flesh_rank_tie;

/* Like flesh_rank_part_create; nodes of ties [count] that the rank's tets lack become ghosts. */
int flesh_rank_part_create_tied(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks, int count,
                                const flesh_rank_tie *ties, flesh_rank_part **rank_part);

/* Returns the team, borrowed, by which other rooms sum over nodes. Beyond the team's nodes flesh_rank_part_nodes has
 * those of the overlap. */
const flesh_team *flesh_rank_part_team(const flesh_rank_part *rank_part);
/* Like flesh_rank_part_find, but by the number in the whole also for a part of a split mesh. */
int flesh_rank_part_find_number(const flesh_rank_part *rank_part, int number);

/* Returns the number of other ranks with which it exchanges nodes. Cannot fail. */
int flesh_rank_part_neighbours(const flesh_rank_part *rank_part);

#endif
