/* rank_share.h: which of the nodes and faces that an effect acts on are computed by a rank (flesh_effect_ranks). */
#ifndef FLESH_EFFECT_RANK_SHARE_H
#define FLESH_EFFECT_RANK_SHARE_H

#include "flesh/mesh.h"
#include "flesh/ranks.h"

/* Returns the number, in the rank's part, of a node of the whole mesh that the rank owns; -1 if it does not own the
 * node. */
int flesh_rank_share_node(const flesh_rank_part *part, int node);

/* Finds those of `nodes` [count] of the whole mesh that the rank owns: their indices in kept [count], their numbers in
 * its part in local [count]. Returns how many there are. */
int flesh_rank_share_nodes(const flesh_rank_part *part, int count, const int *nodes, int *kept, int *local);

/* Returns the number, in the rank's part, of a tet of the whole mesh; -1 if another rank has it. */
int flesh_rank_share_tet(const flesh_rank_part *part, int tet);

/* Finds those of the triangles [3*count] of the whole surface that belong to the rank's tets: their indices in `kept`
 * [*found] and their corners, in the same order, numbered as in its part in `local` [3 * *found]. Both arrays are freed
 * by the caller with flesh_free. FLESH_ERR_MEMORY. */
int flesh_rank_share_faces(const flesh_rank_part *part, int count, const int *triangles, int *found, int **kept,
                           int **local);

#endif
