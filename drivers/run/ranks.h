/* ranks.h: the ranks that mpirun starts, to run one scene together. NULL stands for a process by itself. */
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
  flesh_communicator *communicator; /* all of them */
  flesh_communicator *working;      /* those with a part of the scene; NULL: this one has none */
  int rank, count, all; /* count: those with a part, of all */
  int neighbours_here; /* ranks on this machine, this one included */
  flesh_scene_share *share; /* with the next, once a scene is shared out */
  flesh_gather *gather, *tets; /* of nodes; of tets; NULL where the mesh is split, and no rank has the whole */
  flesh_mesh_info whole;       /* of a split mesh's: counts of nodes, tets, surface triangles, and the volume */
  int takes_volumes_out;       /* flesh_takes_volumes_out of what they share */
} flesh_ranks;

/* Joins the ranks where a launcher of MPI has started two or more (its environment says so); *ranks is NULL else. Returns
 * a status. */
int flesh_ranks_open(flesh_ranks **ranks);
/* In a process that a rank has forked: it is by itself, and what it opens from now on is NULL. */
void flesh_ranks_forget(void);
/* Everything that was printed is out before. NULL-safe; sets *ranks to NULL. */
void flesh_ranks_close(flesh_ranks **ranks);

/* Whether this one prints and writes. */
int flesh_ranks_first(const flesh_ranks *ranks);
/* The worst status of all, with its sentence. The functions up to flesh_ranks_share are for all ranks to call, those
 * behind it, and _agree and _largest from then on, for those that work. */
int flesh_ranks_agree(const flesh_ranks *ranks, int status);
/* Whether all ranks have the first one's number for what they were given; FLESH_ERR_ARGUMENT on all ranks, with `what` is
 * another, where not. */
int flesh_ranks_same(const flesh_ranks *ranks, uint64_t number, const char *what);
/* The exit code of what has failed on all ranks; the first says it. */
int flesh_ranks_fail(const flesh_ranks *ranks, const char *name, int status);
/* For a command that ranks do not share out: 0 where one process is started, else an exit code; one rank says why. */
int flesh_ranks_refuse(const char *name);
/* The command line; the first rank reads it before the others, so that one tells of what is wrong with it. As
 * flesh_options_read; then check(data, count) (NULL: none) returns FLESH_OPTIONS_GO_ON or an exit code. */
int flesh_ranks_read_options(const flesh_ranks *ranks, const flesh_usage *usage, int argc, char **argv, int *count,
                             int (*check)(void *data, int count), void *data);
/* The first one's number on all that work. */
int flesh_ranks_follow(const flesh_ranks *ranks, int number);

/* The largest number of all. */
int flesh_ranks_largest(const flesh_ranks *ranks, int number);

/* Shares out the scene's body. Where there are more ranks than tets, the last have nothing to do: flesh_ranks_works says
 * so. Status. */
int flesh_ranks_works(const flesh_ranks *ranks);
int flesh_ranks_share(flesh_ranks *ranks, const flesh_scene *scene);
/* Whether each rank has a part of the scene's mesh alone. */
int flesh_ranks_mesh_is_split(const flesh_scene *scene);
/* The system that this process steps, and the threads that it takes for it. */
const flesh_system *flesh_ranks_system(const flesh_ranks *ranks, const flesh_scene *scene);
int flesh_ranks_threads(const flesh_ranks *ranks, const flesh_scene *scene);

/* flesh_takes_volumes_out of the system that is stepped; not collective. */
int flesh_ranks_take_volumes_out(const flesh_ranks *ranks, const flesh_scene *scene);

/* Counts and volume of the scene's whole mesh. */
void flesh_ranks_inspect(const flesh_ranks *ranks, const flesh_scene *scene, flesh_mesh_info *info);

/* The first one takes the bytes of each rank, whose number is a multiple of 8, by rising rank. What it returns is the status
 * of all. */
int flesh_ranks_hand_over(const flesh_ranks *ranks, size_t size, const uint8_t *bytes,
                          int (*take)(void *data, size_t size, const uint8_t *bytes), void *data);

/* The ranks' figures for result.json, on the first rank; NULL on the others. Every rank calls it. New. */
json_t *flesh_ranks_json(const flesh_ranks *ranks);

/* MPI's begin and end, with MPI (ranks_mpi.c) or without (ranks_alone.c). */
/* All ranks that the launcher has started, and how many of them are on this machine. Status. */
int flesh_ranks_join(flesh_communicator **communicator, int *here);
/* The communicator of the ranks that take part, which all ranks call for; NULL on one that does not. Status. */
int flesh_ranks_split(int takes_part, flesh_communicator **communicator);
/* Bytes from one of all ranks to another; does not wait until they are received. */
void flesh_ranks_send(int to, size_t size, const void *bytes);
/* Whether a message is there, from whom, and its size; then receives it. */
int flesh_ranks_probe(int *from, size_t *size);
void flesh_ranks_receive(int from, size_t size, void *bytes);
/* Ends MPI where it has begun. NULL-safe member; sets it to NULL. */
void flesh_ranks_leave(flesh_communicator **communicator);

#endif
