/* rank_share.h: which nodes and faces that an effect acts on are for a rank to compute (flesh_effect_ranks). */
#ifndef FLESH_EFFECT_RANK_SHARE_H
#define FLESH_EFFECT_RANK_SHARE_H

#include "flesh/mesh.h"
#include "flesh/ranks.h"

/* The number in the rank's part of a node of the whole that the rank owns; -1: it does not. */
int flesh_rank_share_node(const flesh_rank_part *part, int node);

/* Finds the nodes among `nodes` [count] of the whole that the rank owns: their indices into kept [count], their numbers
 * in its part into local [count]. Returns how many. */
int flesh_rank_share_nodes(const flesh_rank_part *part, int count, const int *nodes, int *kept, int *local);

/* The number in the rank's part of a tet of the whole; -1: another rank has it. */
int flesh_rank_share_tet(const flesh_rank_part *part, int tet);

/* Finds the triangles of the rank's tets among triangles [3*count] of the whole's surface, with their corners in the
 * same order: their indices into `kept`, their corners in its part into `local`. `kept` [*found], `local` [3 * *found]
 * are new, freed with flesh_free. FLESH_ERR_MEMORY. */
int flesh_rank_share_faces(const flesh_rank_part *part, int count, const int *triangles, int *found, int **kept,
                           int **local);

#endif
