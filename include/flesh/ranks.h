/* ranks.h: one body on several ranks of MPI.
 *
 * Every rank makes the whole mesh and a part of it, builds an ordinary system on the part's mesh with the effects that
 * the body has, and says by flesh_system_set_part that it is one. Steps and equilibria (flesh/integrator.h) are then
 * those of the body: every rank makes the same calls in the same order, with x and v of the nodes that its part has, and
 * gets the same status. The callbacks of flesh/kinsol.h, flesh/ida.h and flesh/ode.h take vectors of N_VNew_Parallel.
 * lib/parallel/README.md has what is shared out so far.
 *
 * Where flesh is built without MPI or METIS there is one rank. MPI's errors go to the error handler of the communicator
 * that was given; MPI's own ends all ranks. Functions that return no status cannot fail. */
#ifndef FLESH_RANKS_H
#define FLESH_RANKS_H

#include "flesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_communicator flesh_communicator;
typedef struct flesh_rank_part flesh_rank_part;
struct flesh_system;

/* `mpi_comm` points to an MPI_Comm, of which a duplicate is made: collective, after MPI_Init and before MPI_Finalize, as
 * is its end. NULL: one rank without MPI. MPI_THREAD_FUNNELED serves, as only the calling thread calls MPI. Returns new.
 * FLESH_ERR_ARGUMENT where it is not NULL and flesh is built without MPI. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_communicator_create(const void *mpi_comm, flesh_communicator **communicator);
/* NULL-safe; sets *communicator to NULL. */
FLESH_API void flesh_communicator_destroy(flesh_communicator **communicator);

/* Which of how many it is, from 0. Cannot fail. */
FLESH_API int flesh_communicator_rank(const flesh_communicator *communicator);
FLESH_API int flesh_communicator_size(const flesh_communicator *communicator);
/* The worst status of all ranks (fatal, then recoverable, then FLESH_OK), of the first rank that has one as bad; a fatal
 * one comes with that rank's sentence in flesh_error_text(). Collective.
 * Errors: FLESH_ERR_ARGUMENT, and any that it is given. */
FLESH_API int flesh_communicator_agree(flesh_communicator *communicator, int status);

/* The part of this rank. `whole` is the same on all ranks and not needed afterwards; `ranks` [tets], likewise, the rank
 * of each tet; NULL: planes across the axes, or METIS where planes cut far more, give all as many tets and few nodes
 * between them (Berger & Bokhari 1987; Karypis & Kumar 1998). Every tet is of one rank; a node is owned by the first of
 * the ranks whose tets have it, and a ghost of the others. Borrows `communicator`. Returns new. Collective, and fails on
 * all ranks or none: FLESH_ERR_ARGUMENT for a rank without a tet. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_rank_part_create(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks,
                                     flesh_rank_part **rank_part);
/* Like flesh_rank_part_create, for the effects of a finished system on the whole, which is the same on all ranks and
 * not needed afterwards: the part also has, as ghosts, nodes that its effects tie to those of the rank, as welds and
 * joints do. Errors: FLESH_ERR_ARGUMENT and FLESH_ERR_MEMORY, as those of flesh_rank_part_create. */
FLESH_API int flesh_rank_part_create_for(flesh_communicator *communicator, const struct flesh_system *whole,
                                         const int *ranks, flesh_rank_part **rank_part);
/* NULL-safe; sets *rank_part to NULL. Not collective. */
FLESH_API void flesh_rank_part_destroy(flesh_rank_part **rank_part);

/* Borrowed. Own nodes come first, then ghosts, both as they are numbered in the whole; so do the tets. Its surface has
 * the faces between the ranks, too. */
FLESH_API const flesh_mesh *flesh_rank_part_mesh(const flesh_rank_part *rank_part);
/* How many of its nodes this rank owns. Cannot fail. */
FLESH_API int flesh_rank_part_own(const flesh_rank_part *rank_part);
/* [nodes], [tets] of its mesh: the numbers in the whole. */
FLESH_API const int *flesh_rank_part_nodes(const flesh_rank_part *rank_part);
FLESH_API const int *flesh_rank_part_tets(const flesh_rank_part *rank_part);
/* This rank's number of a node of the whole; -1: it has none. Cannot fail. */
FLESH_API int flesh_rank_part_find(const flesh_rank_part *rank_part, int node);
/* The whole's vector [3*nodes of the whole] on all ranks, from what each owns of `vector` [3*nodes of its mesh]; nodes
 * that no rank has get 0. Collective. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_rank_part_gather(const flesh_rank_part *rank_part, const double *vector, double *whole);

#ifdef __cplusplus
}
#endif
#endif
