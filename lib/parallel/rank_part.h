/* rank_part.h: the part of a body that a rank computes: a mesh of its tets, whose nodes it owns or has as ghosts
 * (team.h), and the messages that keep ghosts and owners together.
 *
 * Every tet is of one rank. A node of several ranks is owned by the first of them. So whatever is a sum over tets, or
 * over their faces, is the sum of what the ranks have: a rank's system is an ordinary one on its mesh, and an effect
 * need not know of ranks. Interface tets are computed once; forces on ghosts go to their owners. */
#ifndef FLESH_PARALLEL_RANK_PART_H
#define FLESH_PARALLEL_RANK_PART_H

#include "base/team.h"
#include "parallel/communicator.h"

/* Borrowed: what rooms that add up over nodes know of it. flesh_rank_part_nodes goes on with the nodes beyond. */
const flesh_team *flesh_rank_part_team(const flesh_rank_part *rank_part);

#endif
