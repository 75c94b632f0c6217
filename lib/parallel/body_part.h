/* body_part.h: the part of a body that a rank computes: a mesh of its tets, whose nodes it owns or has as ghosts
 * (team.h), and the messages that keep ghosts and owners together.
 *
 * Every tet is of one rank. A node of several ranks is owned by the first of them. So whatever is a sum over tets, or
 * over their faces, is the sum of what the ranks have: a rank's system is an ordinary one on its mesh, and an effect
 * need not know of ranks. Interface tets are computed once; forces on ghosts go to their owners. */
#ifndef FLESH_PARALLEL_BODY_PART_H
#define FLESH_PARALLEL_BODY_PART_H

#include "base/team.h"
#include "flesh/mesh.h"
#include "parallel/communicator.h"

typedef struct flesh_body_part flesh_body_part;

/* The part of this rank; `whole` and `part` [tets], the rank of each tet, are the same on all ranks and not needed
 * afterwards. Borrows `communicator`. Collective, and fails on all ranks or none: FLESH_ERR_ARGUMENT for a rank without
 * a tet, FLESH_ERR_MEMORY. Returns new. */
int flesh_body_part_create(flesh_communicator *communicator, const flesh_mesh *whole, const int *part,
                           flesh_body_part **body_part);
/* NULL-safe; sets *body_part to NULL. Not collective. */
void flesh_body_part_destroy(flesh_body_part **body_part);

/* Borrowed. The mesh's own nodes come first, then its ghosts, both as they are numbered in the whole; so do the tets.
 * Its surface has the faces between the ranks, too: select triangles in the whole. */
const flesh_mesh *flesh_body_part_mesh(const flesh_body_part *body_part);
const flesh_team *flesh_body_part_team(const flesh_body_part *body_part);
/* [nodes], [tets] of its mesh: the numbers in the whole. */
const int *flesh_body_part_nodes(const flesh_body_part *body_part);
const int *flesh_body_part_tets(const flesh_body_part *body_part);
/* This rank's number of a node of the whole; -1: it has none. */
int flesh_body_part_find(const flesh_body_part *body_part, int node);
/* Those nodes of the whole that this rank has, of `nodes` [count], by its numbers into `local` [count]; how many. */
int flesh_body_part_select(const flesh_body_part *body_part, int count, const int *nodes, int *local);
/* The other ranks that it exchanges nodes with, and its ghosts' and their ghosts' number. */
int flesh_body_part_neighbours(const flesh_body_part *body_part);

/* The whole's vector [3*nodes of the whole] on all ranks, from what is owned of each rank's; nodes that no rank has get
 * 0. Collective. */
void flesh_body_part_gather(const flesh_body_part *body_part, const double *vector, double *whole);

#endif
