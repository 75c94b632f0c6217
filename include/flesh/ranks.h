/* ranks.h: one body on several ranks of MPI.
 *
 * Every rank makes the whole mesh and a part of it, builds an ordinary system on the part's mesh with the body's
 * effects, and declares it a part by flesh_system_set_part. Steps and equilibria (flesh/integrator.h) are then those of
 * the whole body: every rank makes the same calls in the same order, with x and v of its part's nodes, and gets the same
 * status. The callbacks of flesh/kinsol.h, flesh/ida.h and flesh/ode.h take vectors of N_VNew_Parallel.
 * lib/parallel/README.md says which features run on several ranks.
 *
 * If flesh is built without MPI or METIS there is one rank. MPI's errors go to the error handler of the given
 * communicator; MPI's default handler ends all ranks. Functions that return no status cannot fail. */
#ifndef FLESH_RANKS_H
#define FLESH_RANKS_H

#include "flesh/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_communicator flesh_communicator;
typedef struct flesh_rank_part flesh_rank_part;
struct flesh_system;

/* Creates a communicator. `mpi_comm` points to an MPI_Comm, which is duplicated: creating and destroying are
 * collective, after MPI_Init and before MPI_Finalize. NULL: one rank without MPI. MPI_THREAD_FUNNELED is sufficient,
 * as only the calling thread calls MPI. Returns new. FLESH_ERR_ARGUMENT if it is not NULL and flesh is built without
 * MPI. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_communicator_create(const void *mpi_comm, flesh_communicator **communicator);
/* NULL-safe; sets *communicator to NULL. */
FLESH_API void flesh_communicator_destroy(flesh_communicator **communicator);

/* Return this rank's number, from 0, and the number of ranks. Cannot fail. */
FLESH_API int flesh_communicator_rank(const flesh_communicator *communicator);
FLESH_API int flesh_communicator_size(const flesh_communicator *communicator);
/* Returns the worst status of all ranks (fatal, then recoverable, then FLESH_OK), that of the first rank where
 * several are equally bad; for a fatal one flesh_error_text() has that rank's sentence. Collective. Errors:
 * FLESH_ERR_ARGUMENT, and any status that a rank passes. */
FLESH_API int flesh_communicator_agree(flesh_communicator *communicator, int status);

/* Creates the part of this rank. `whole` is the same on all ranks and not needed afterwards; so is `ranks` [tets],
 * the rank of each tet. NULL: tets are distributed evenly, with few nodes shared between ranks, by planes across the
 * axes, or by METIS if planes cut far more (Berger & Bokhari 1987; Karypis & Kumar 1998). Every tet belongs to one
 * rank. A node is owned by the first of the ranks whose tets have it, and is a ghost on the others. Borrows
 * `communicator`. Returns new. Collective, and fails on all ranks or none: FLESH_ERR_ARGUMENT for a rank without a
 * tet. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_rank_part_create(flesh_communicator *communicator, const flesh_mesh *whole, const int *ranks,
                                     flesh_rank_part **rank_part);
/* Like flesh_rank_part_create, for the effects of a finished system on the whole, which is the same on all ranks and
 * not needed afterwards: the part's ghosts then include the nodes that effects such as welds and joints tie to nodes
 * of the rank. Errors: FLESH_ERR_ARGUMENT and FLESH_ERR_MEMORY, as those of flesh_rank_part_create. */
FLESH_API int flesh_rank_part_create_for(flesh_communicator *communicator, const struct flesh_system *whole,
                                         const int *ranks, flesh_rank_part **rank_part);
/* NULL-safe; sets *rank_part to NULL. Not collective. */
FLESH_API void flesh_rank_part_destroy(flesh_rank_part **rank_part);

/* Returns the part's mesh, borrowed. Own nodes come first, then ghosts, both in the order of the whole; so do the
 * tets. The mesh's surface includes the faces between ranks. */
FLESH_API const flesh_mesh *flesh_rank_part_mesh(const flesh_rank_part *rank_part);
/* Returns the number of nodes that this rank owns. Cannot fail. */
FLESH_API int flesh_rank_part_own(const flesh_rank_part *rank_part);
/* Return, for the nodes [nodes] and tets [tets] of the part's mesh, their numbers in the whole. */
FLESH_API const int *flesh_rank_part_nodes(const flesh_rank_part *rank_part);
FLESH_API const int *flesh_rank_part_tets(const flesh_rank_part *rank_part);
/* Returns this rank's number of a node of the whole; -1: the rank does not have it. Cannot fail. */
FLESH_API int flesh_rank_part_find(const flesh_rank_part *rank_part, int node);
/* Gathers the whole's vector [3*nodes of the whole] on all ranks from the entries that each rank owns of `vector`
 * [3*nodes of its mesh]; nodes that no rank has get 0. Collective. Errors: FLESH_ERR_ARGUMENT. */
FLESH_API int flesh_rank_part_gather(const flesh_rank_part *rank_part, const double *vector, double *whole);

#ifdef __cplusplus
}
#endif
#endif
