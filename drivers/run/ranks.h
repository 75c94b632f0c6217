/* ranks.h: the ranks that mpirun starts, which run one scene together. NULL stands for a process without ranks. */
#ifndef FLESH_RUN_RANKS_H
#define FLESH_RUN_RANKS_H

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

#include "flesh/ranks.h"
#include "parallel/gather.h"
#include "scene/ranks.h"
#include "cli/options.h"

typedef struct flesh_ranks {
  flesh_communicator *communicator; /* all ranks */
  flesh_communicator *working;      /* ranks with a part of the scene; NULL if this one has none */
  int rank, count, all; /* count: number of ranks with a part; all: number of all */
  int neighbours_here; /* number of ranks on this machine, including this one */
  flesh_scene_share *share; /* this and the next member are set once a scene is shared out */
  flesh_gather *gather, *tets; /* of nodes; of tets; NULL if the mesh is split: no rank has the whole */
  flesh_mesh_info whole;       /* counts of nodes, tets and surface triangles, and volume, of a split mesh */
  int takes_volumes_out;       /* stiff volume terms are taken out of the solves of the system that they share */
} flesh_ranks;

/* Joins the ranks if a launcher of MPI has started two or more (as its environment variables say); else *ranks is NULL.
 * Returns a status. */
int flesh_ranks_open(flesh_ranks **ranks);
/* Detaches a process that a rank has forked: it has no ranks, and flesh_ranks_open gives it NULL from now on. */
void flesh_ranks_forget(void);
/* Flushes everything that was printed, then leaves the ranks. NULL-safe; sets *ranks to NULL. */
void flesh_ranks_close(flesh_ranks **ranks);

/* Returns whether this rank is the one that prints and writes files. */
int flesh_ranks_first(const flesh_ranks *ranks);
/* Returns the worst status of all ranks, with its sentence. All ranks call the functions up to flesh_ranks_share; the
 * ranks that work call those after it, and from then on also _agree and _largest. */
int flesh_ranks_agree(const flesh_ranks *ranks, int status);
/* Checks that all ranks have the first one's number. FLESH_ERR_ARGUMENT on all ranks if not; the sentence says of a
 * rank that it has `what`, as "another scene". */
int flesh_ranks_same(const flesh_ranks *ranks, uint64_t number, const char *what);
/* Returns the exit code of a failure on all ranks; the first rank prints the sentence. */
int flesh_ranks_fail(const flesh_ranks *ranks, const char *name, int status);
/* Refuses ranks for a command that they cannot share: returns 0 if one process is started, else an exit code; one rank
 * prints why. */
int flesh_ranks_refuse(const char *name);
/* Reads the command line with flesh_options_read; the first rank reads it before the others, so that only one prints
 * what is wrong with it. Then check(data, count) (NULL: none) returns FLESH_OPTIONS_GO_ON or an exit code. */
int flesh_ranks_read_options(const flesh_ranks *ranks, const flesh_usage *usage, int argc, char **argv, int *count,
                             int (*check)(void *data, int count), void *data);
/* Returns the first rank's number on all ranks that work. */
int flesh_ranks_broadcast(const flesh_ranks *ranks, int number);

/* Returns the largest number of all ranks. */
int flesh_ranks_largest(const flesh_ranks *ranks, int number);

/* Shares out the scene's body and returns a status. If there are more ranks than tets, the last ranks have nothing to
 * do: their `working` is NULL. */
int flesh_ranks_share(flesh_ranks *ranks, const flesh_scene *scene);
/* The system that this process steps, and the number of threads that it uses. */
const flesh_system *flesh_ranks_system(const flesh_ranks *ranks, const flesh_scene *scene);
int flesh_ranks_threads(const flesh_ranks *ranks, const flesh_scene *scene);

/* Returns the name of the preconditioner of the solves; NULL: a direct solver. Not collective. */
const char *flesh_ranks_preconditioner(const flesh_ranks *ranks, const flesh_scene *scene);

/* Gives the bytes of each rank, whose number is a multiple of 8, to `take` on the first rank, by rising rank. Returns
 * the worst status of all ranks, on each. */
int flesh_ranks_gather_bytes(const flesh_ranks *ranks, size_t size, const uint8_t *bytes,
                          int (*take)(void *data, size_t size, const uint8_t *bytes), void *data);

/* Returns the ranks' figures for result.json: a new object on the first rank, NULL on the others. Every rank calls
 * it. */
json_t *flesh_ranks_json(const flesh_ranks *ranks);

/* The functions below begin and end MPI and exchange messages, with MPI (ranks_mpi.c) or without (ranks_alone.c). */
/* Joins all ranks that the launcher has started; *here is their number on this machine. Returns a status. */
int flesh_ranks_join(flesh_communicator **communicator, int *here);
/* Makes the communicator of the ranks that take part; NULL on a rank that does not. All ranks call it. Returns a
 * status. */
int flesh_ranks_split(int takes_part, flesh_communicator **communicator);
/* Sends bytes from one rank to another, numbered among all; does not wait until they are received. */
void flesh_ranks_send(int to, size_t size, const void *bytes);
/* Returns whether a message has arrived, from which rank, and its size; flesh_ranks_receive then receives it. */
int flesh_ranks_probe(int *from, size_t *size);
void flesh_ranks_receive(int from, size_t size, void *bytes);
/* Ends MPI if it has begun. NULL-safe member; sets it to NULL. */
void flesh_ranks_leave(flesh_communicator **communicator);

#endif
