/* team.h: the ranks that share out a body, as rooms see them that add up over its nodes. Each rank has tets of its own
 * and all of their nodes. A node of several ranks is owned by one of them and a ghost on the others.
 *
 * A vector is consistent where ghosts have the values of their owners: places, velocities, directions. It is partial
 * where the vector of the body is the sum over the ranks: forces, as every rank computes its own tets. Collected, such a
 * sum is with the owners, and ghosts are zero. Own nodes come first, so that products of vectors are sums over the first
 * `own` numbers. All functions are collective: every rank calls them, in the same order. */
#ifndef FLESH_BASE_TEAM_H
#define FLESH_BASE_TEAM_H

#include <stdint.h>

#include "flesh/threads.h"

/* Numbers of nodes: node i's `width` are at values[stride * place[i]], or at values[stride * i] where place is NULL. */
typedef struct flesh_team_vector {
  int width, stride;
  const int *place;
  double *values;
  int overlap; /* 1: of all nodes in the rank's overlap; 0: of those that its tets have */
} flesh_team_vector;

/* Numbers for other ranks, one rank after the other, and room for those that they send: `width` of each entry. Either
 * side knows the other's counts. */
typedef struct flesh_exchange {
  int width;
  const int *first_sent, *first_received; /* [ranks+1] the entries of each rank; NULL: each rank has one */
  const double *sent;
  double *received;
} flesh_exchange;

/* The ranks whose overlaps have nodes of this one, or it of theirs. Both ranks have the nodes between them in the same
 * order. */
typedef struct flesh_team_neighbours {
  int count, before; /* other ranks, and those of them whose numbers are lower than this one's */
  const int *ranks;  /* rising */
  const int *first_given, *given; /* [count+1]; nodes of this rank's */
  const int *first_taken, *taken; /* [count+1]; nodes of theirs in this rank's overlap */
} flesh_team_neighbours;

struct flesh_team;

typedef struct flesh_team_operations {
  /* Each of these numbers becomes its sum over the ranks, added in an order that depends on their count alone; or the
   * largest of them. The same bits on all ranks. What is no number stays none. */
  void (*sum)(const void *data, int count, double *numbers);
  void (*largest)(const void *data, int count, double *numbers);
  /* The worst status of all (fatal, then recoverable, then FLESH_OK), of the first rank that has one as bad, with the
   * sentence of that rank. */
  int (*agree)(const void *data, int status);
  /* Ghosts take the values of their owners; so do nodes beyond, where the vector has them. */
  void (*update_ghosts)(const void *data, const flesh_team_vector *vector);
  /* Owners add the values of their ghosts, by rising rank; ghosts become zero. */
  void (*add_ghosts)(const void *data, const flesh_team_vector *vector);
  /* Sends to and receives from these ranks; the numbers are there once `exchange_end` returns. Nothing else is exchanged
   * or added up in between. */
  void (*exchange_begin)(const void *data, int count, const int *ranks, const flesh_exchange *exchange);
  void (*exchange_end)(const void *data);
  /* The operations behind flesh_team_narrow and flesh_team_narrow_end. */
  int (*narrow)(const struct flesh_team *team, const uint8_t *needed, const struct flesh_team **narrow);
  void (*narrow_end)(const struct flesh_team **narrow);
} flesh_team_operations;

typedef struct flesh_team {
  int rank, ranks; /* which it is, of how many */
  int nodes, own; /* of this rank; those from `own` on are ghosts */
  int overlap;    /* nodes of its preconditioner: those, then a layer beyond that only other ranks have */
  double all;     /* nodes of the body, each counted once */
  flesh_team_neighbours neighbours; /* none where `narrows` */
  int narrows; /* 1: some ghosts are of effects that see the whole surface: solvers take a narrow team */
  const uint8_t *left_out; /* [overlap] of a narrow team 1: a ghost that nothing is exchanged of; of others NULL */
  const int *tets, *numbers; /* of this rank's tets, and of its nodes, the numbers in the body */
  const void *comm; /* the ranks' MPI_Comm, for solvers that have messages of their own; NULL without MPI */
  const void *data;
  const flesh_team_operations *operations;
} flesh_team;

/* From now on the sums of parallel_vector.h over vectors of the team's length are those of all ranks. Borrows `team`;
 * NULL: a rank by itself, as at the start. */
void flesh_threads_set_team(flesh_threads *threads, const flesh_team *team);
/* NULL: none. */
const flesh_team *flesh_threads_team(const flesh_threads *threads);

/* Call the operations; nothing happens where `team` is NULL. The vectors have three numbers a node. */
void flesh_team_sum(const flesh_team *team, int count, double *numbers);
void flesh_team_largest(const flesh_team *team, int count, double *numbers);
int flesh_team_agree(const flesh_team *team, int status);
/* The sums, if `status` is FLESH_OK on all ranks; else what agree returns, and the numbers are left. Takes one sum where
 * all is well. */
int flesh_team_sum_agreed(const flesh_team *team, int status, int count, double *numbers);
/* Whether any rank says so; the sum and the least of all ranks' numbers. */
int flesh_team_any(const flesh_team *team, int here);
/* The worst status that `ask` returns on any rank, by which a caller ends what takes long; FLESH_OK where it is NULL. */
int flesh_ask_together(const flesh_team *team, int (*ask)(void *data), void *data);
double flesh_team_total(const flesh_team *team, double number);
double flesh_team_least(const flesh_team *team, double number);
/* *value becomes the largest of all ranks' values, or no number if one is none; returns the largest of the labels of
 * those ranks that have it. */
double flesh_team_argmax(const flesh_team *team, double *value, double label);
/* The numbers become those of the first rank whose value is the largest. */
void flesh_team_take_farthest(const flesh_team *team, double value, int count, double *numbers);
/* How many of something the ranks before this one have, which has `here`; *all: how many all ranks have. `room` [ranks]. */
int flesh_team_count_before(const flesh_team *team, int here, double *room, int *all);
/* How many ranks have each of `nodes`, into w [width*nodes]. */
void flesh_team_count_ranks(const flesh_team *team, int nodes, int width, double *w);
/* The box from low to high becomes that around all ranks' boxes. */
void flesh_team_unite_boxes(const flesh_team *team, double low[3], double high[3]);
void flesh_team_update_ghosts(const flesh_team *team, double *vector);
void flesh_team_add_ghosts(const flesh_team *team, double *vector);
/* Ghosts take `width` numbers each from their owners. */
void flesh_team_update_ghosts_of(const flesh_team *team, int width, double *values);
/* Nodes of the rank's overlap take `width` numbers each from their owners. */
void flesh_team_update_overlap(const flesh_team *team, int width, double *values);
/* Each of `width` numbers a node becomes its sum over the ranks that have the node, or whose overlap does, with the same bits
 * on all of them. */
void flesh_team_sum_nodes(const flesh_team *team, int width, double *values);
void flesh_team_sum_overlap(const flesh_team *team, int width, double *values);
/* Exchanges with the neighbours, in their order; `team` is not NULL. Between the two nothing else is exchanged
 * or added up. */
void flesh_exchange_begin(const flesh_team *team, const flesh_exchange *exchange);
void flesh_exchange_end(const flesh_team *team);
void flesh_exchange_now(const flesh_team *team, const flesh_exchange *exchange);
/* first_received [ranks+1] by what the other ranks have in first_sent [ranks+1]; `counts` [2*ranks] is room. */
void flesh_exchange_counts(const flesh_team *team, const int *first_sent, double *counts, int *first_received);
/* Makes a team of the same ranks and nodes for solves with matrices that couple to few of the ghosts that effects see:
 * it exchanges only ghosts that the rank's tets have, and those `needed` [nodes] here. Other ghosts are left as they
 * are; they are zero in vectors that begin so. Where the team does not narrow, *narrow is the team itself. Borrows
 * `team`. Collective, and fails on all ranks if one comes with a `status` other than FLESH_OK, of what it has made before,
 * or FLESH_ERR_MEMORY. */
int flesh_team_narrow(const flesh_team *team, int status, const uint8_t *needed, const flesh_team **narrow);
/* NULL-safe; sets *narrow to NULL. Not collective. */
void flesh_team_narrow_end(const flesh_team **narrow);
/* How many of `nodes` are this rank's own, and how many there are in the body. */
int flesh_team_own(const flesh_team *team, int nodes);
double flesh_team_all(const flesh_team *team, int nodes);

#endif
