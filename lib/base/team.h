/* team.h: the ranks that share a body, for rooms that sum over its nodes. Each rank has tets of its own and all nodes
 * of these. A node of several ranks is owned by one of them and a ghost on the others.
 *
 * A vector is consistent if ghosts have the values of their owners: positions, velocities, directions. It is partial if
 * the sum over the ranks is the vector of the body: forces, as every rank computes its own tets. add_ghosts collects
 * such a sum at the owners and zeroes the ghosts. Own nodes come first, so that dot products are sums over the first
 * `own` nodes. All functions are collective: every rank calls them, in the same order. */
#ifndef FLESH_BASE_TEAM_H
#define FLESH_BASE_TEAM_H

#include <stdint.h>

#include "flesh/threads.h"

/* Values of nodes: the `width` values of node i begin at values[stride * place[i]], or at values[stride * i] if place
 * is NULL. */
typedef struct flesh_team_vector {
  int width, stride;
  const int *place;
  double *values;
  int overlap; /* 1: of all nodes in the rank's overlap; 0: of the nodes of its tets */
} flesh_team_vector;

/* Numbers to send to other ranks, ordered by rank, and room for those received, `width` for each entry. Both sides know
 * how many entries are sent. */
typedef struct flesh_exchange {
  int width;
  const int *first_sent, *first_received; /* [ranks+1] first entry of each rank; NULL: one entry for each rank */
  const double *sent;
  double *received;
} flesh_exchange;

/* Ranks that have nodes of this rank in their overlap, or the reverse. Both ranks list the nodes between them in the
 * same order. */
typedef struct flesh_team_neighbours {
  int count, before; /* number of other ranks, and how many of them are below this rank */
  const int *ranks;  /* rising */
  const int *first_given, *given; /* [count+1]; this rank's own nodes that the neighbours have, too */
  const int *first_taken, *taken; /* [count+1]; the neighbours' own nodes in this rank's overlap */
} flesh_team_neighbours;

struct flesh_team;

typedef struct flesh_team_operations {
  /* Replace each number by its sum over the ranks, in an order of addition that depends on `count` alone, or by the
   * largest. All ranks get the same bits. NaN stays NaN. */
  void (*sum)(const void *data, int count, double *numbers);
  void (*largest)(const void *data, int count, double *numbers);
  /* Returns the worst status of all ranks (fatal, then recoverable, then FLESH_OK), with the sentence of the first rank
   * that has it. */
  int (*agree)(const void *data, int status);
  /* Gives ghosts the values of their owners, and the nodes beyond, too, if the vector has them. */
  void (*update_ghosts)(const void *data, const flesh_team_vector *vector);
  /* Adds the values of ghosts to their owners, by rising rank; ghosts become zero. */
  void (*add_ghosts)(const void *data, const flesh_team_vector *vector);
  /* Sends to and receives from these ranks; the numbers are there once `exchange_end` returns. No other exchange or sum
   * may take place in between. */
  void (*exchange_begin)(const void *data, int count, const int *ranks, const flesh_exchange *exchange);
  void (*exchange_end)(const void *data);
  /* Operations behind flesh_team_narrow and flesh_team_narrow_end. */
  int (*narrow)(const struct flesh_team *team, const uint8_t *needed, const struct flesh_team **narrow);
  void (*narrow_end)(const struct flesh_team **narrow);
} flesh_team_operations;

typedef struct flesh_team {
  int rank, ranks; /* this rank, and the number of ranks */
  int nodes, own; /* nodes of this rank, and of these its own; the ghosts follow */
  int overlap;    /* nodes of the preconditioner: the rank's, then a layer beyond that only other ranks have */
  double all;     /* nodes of the body, each counted once */
  flesh_team_neighbours neighbours; /* empty if `narrows` */
  int narrows; /* 1: effects that see the whole surface have ghosts of their own, and solvers use a narrow team */
  const uint8_t *left_out; /* [overlap] in a narrow team, 1: nothing is exchanged for this ghost; NULL in other teams */
  const int *tets, *numbers; /* numbers in the body of this rank's tets, and of its nodes */
  const void *comm; /* MPI_Comm of the ranks, for solvers that send messages of their own; NULL without MPI */
  const void *data;
  const flesh_team_operations *operations;
} flesh_team;

/* Sets the team over which parallel_vector.h sums vectors of the team's length. Borrows `team`; NULL: this rank alone,
 * the default. */
void flesh_threads_set_team(flesh_threads *threads, const flesh_team *team);
/* Returns the team; NULL: none. */
const flesh_team *flesh_threads_team(const flesh_threads *threads);

/* Call the operations; they do nothing if `team` is NULL. Vectors have three numbers per node. */
void flesh_team_sum(const flesh_team *team, int count, double *numbers);
void flesh_team_largest(const flesh_team *team, int count, double *numbers);
int flesh_team_agree(const flesh_team *team, int status);
/* Sums the numbers if `status` is FLESH_OK on all ranks; else returns the status of flesh_team_agree and leaves the
 * numbers unchanged. Needs one sum if all is well. */
int flesh_team_sum_agreed(const flesh_team *team, int status, int count, double *numbers);
/* flesh_team_any returns whether `here` is nonzero on any rank; flesh_team_total and flesh_team_least return the sum
 * and the least of all ranks' numbers. */
int flesh_team_any(const flesh_team *team, int here);
/* Returns the worst status that `ask` returns on any rank, by which the caller ends long work; FLESH_OK if `ask` is
 * NULL. */
int flesh_ask_together(const flesh_team *team, int (*ask)(void *data), void *data);
double flesh_team_total(const flesh_team *team, double number);
double flesh_team_least(const flesh_team *team, double number);
/* Sets *value to the largest of all ranks' values, or to NaN if one is NaN; returns the largest label among the ranks
 * that have it. */
double flesh_team_argmax(const flesh_team *team, double *value, double label);
/* Sets the numbers to those of the first rank that has the largest value. */
void flesh_team_take_farthest(const flesh_team *team, double value, int count, double *numbers);
/* Returns the sum of `here` over the ranks before this one; *all: the sum over all ranks. `room` [ranks] is work
 * space. */
int flesh_team_count_before(const flesh_team *team, int here, double *room, int *all);
/* Sets w [width*nodes] to the number of ranks that have each node. */
void flesh_team_count_ranks(const flesh_team *team, int nodes, int width, double *w);
/* Extends the box from low to high to the box of all ranks. */
void flesh_team_unite_boxes(const flesh_team *team, double low[3], double high[3]);
void flesh_team_update_ghosts(const flesh_team *team, double *vector);
void flesh_team_add_ghosts(const flesh_team *team, double *vector);
/* Gives ghosts the `width` values of their owners. */
void flesh_team_update_ghosts_of(const flesh_team *team, int width, double *values);
/* Gives all nodes of the rank's overlap the `width` values of their owners. */
void flesh_team_update_overlap(const flesh_team *team, int width, double *values);
/* Replace each of the `width` values of a node by its sum over the ranks that have the node, or that have it in their
 * overlap, with the same bits on all of them. */
void flesh_team_sum_nodes(const flesh_team *team, int width, double *values);
void flesh_team_sum_overlap(const flesh_team *team, int width, double *values);
/* Exchange numbers with the neighbours, in their order; `team` is not NULL. No other exchange or sum may take place
 * between begin and end. */
void flesh_exchange_begin(const flesh_team *team, const flesh_exchange *exchange);
void flesh_exchange_end(const flesh_team *team);
void flesh_exchange_now(const flesh_team *team, const flesh_exchange *exchange);
/* Finds first_received [ranks+1] from first_sent [ranks+1] of the other ranks; `counts` [2*ranks] is work space. */
void flesh_exchange_counts(const flesh_team *team, const int *first_sent, double *counts, int *first_received);
/* Makes a team of the same ranks and nodes for solves whose matrices couple only to some of the ghosts that effects
 * see. It exchanges only the ghosts of the rank's tets and those `needed` [nodes] here. Other ghosts stay unchanged; in
 * vectors that begin with zeros they stay zero. If the team is not one that `narrows`, *narrow is the team itself.
 * Borrows `team`. Collective. `status` is the caller's own so far: if it is not FLESH_OK on some rank, all ranks fail
 * with it. Else FLESH_ERR_MEMORY. */
int flesh_team_narrow(const flesh_team *team, int status, const uint8_t *needed, const flesh_team **narrow);
/* Frees a narrow team and sets *narrow to NULL; NULL-safe. Not collective. */
void flesh_team_narrow_end(const flesh_team **narrow);
/* Return how many of `nodes` this rank owns, and how many nodes the body has. */
int flesh_team_own(const flesh_team *team, int nodes);
double flesh_team_all(const flesh_team *team, int nodes);

#endif
