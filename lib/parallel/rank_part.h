/* rank_part.h: the part of a body that a rank computes: a mesh of its tets, whose nodes it owns or has as ghosts
 * (team.h), and the messages that keep ghosts and owners together.
 *
 * Every tet is of one rank. A node of several ranks is owned by the first of them. So whatever is a sum over tets, or
 * over their faces, is the sum of what the ranks have: a rank's system is an ordinary one on its mesh, and an effect
 * need not know of ranks. Interface tets are computed once; forces on ghosts go to their owners. Effects that tie nodes
 * of several ranks together get those that are missing as ghosts, too, of which no tet of the rank is.
 *
 * Where the mesh that it is made of is a part of a split one (mesh/split.h), of as many ranks, that part's own tets are the
 * rank's; flesh_rank_part_nodes, _tets and _find are then about that mesh, and the numbers of the whole are the team's. */
#ifndef FLESH_PARALLEL_RANK_PART_H
#define FLESH_PARALLEL_RANK_PART_H

#include "base/team.h"
#include "parallel/communicator.h"

/* Cells of nodes that an effect ties together, which no tet has to have all of (flesh_effect_ranks.cells). */
typedef struct flesh_rank_tie {
  int count, nodes_per_cell;
  const int *nodes; /* [count*nodes_per_cell] */
  int everywhere;   /* 1: every rank gets all of their nodes; 0: of each cell the rank that owns its first node */
} flesh_rank_tie;

/* Like flesh_rank_part_create; nodes of ties [count] that the rank's tets lack become ghosts. */
int flesh_rank_part_create_tied(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks, int count,
                                const flesh_rank_tie *ties, flesh_rank_part **rank_part);

/* Borrowed: what rooms that add up over nodes know of it. flesh_rank_part_nodes goes on with the nodes beyond. */
const flesh_team *flesh_rank_part_team(const flesh_rank_part *rank_part);
/* Like flesh_rank_part_find, by the number in the whole even for a part of a split mesh. */
int flesh_rank_part_find_number(const flesh_rank_part *rank_part, int number);

/* With how many other ranks it exchanges nodes. Cannot fail. */
int flesh_rank_part_neighbours(const flesh_rank_part *rank_part);

#endif
