/* halo.h: nodes that a rank shares with others, and the messages between their owners and those that have them as
 * ghosts. */
#ifndef FLESH_PARALLEL_HALO_H
#define FLESH_PARALLEL_HALO_H

#include "base/team.h"
#include "parallel/communicator.h"

/* A node that this rank and another have, one of them as its owner. */
typedef struct flesh_shared_node {
  int rank;  /* the other */
  int ghost; /* 1: the other is the owner */
  int node;  /* in the whole: messages go by it, on both sides */
  int local; /* this rank's number */
} flesh_shared_node;

typedef struct flesh_shared_nodes {
  int count, room, failed;
  flesh_shared_node *nodes;
} flesh_shared_nodes;

/* Zeros are an empty list. The same may be added again. Without memory `failed`, which flesh_halo_create tells. */
void flesh_shared_nodes_add(flesh_shared_nodes *shared, int rank, int ghost, int node, int local);
void flesh_shared_nodes_clear(flesh_shared_nodes *shared);

typedef struct flesh_halo {
  int count;        /* neighbours, by rising rank */
  int *first_own;   /* [count+1] where the nodes begin that each neighbour has as ghosts, and this rank owns */
  int *first_ghost; /* [count+1] where those begin that it owns, and this rank has as ghosts */
  int *own, *ghosts; /* this rank's numbers, in the order of the whole's within a neighbour */
  double *of_own, *of_ghosts; /* [FLESH_HALO_WIDTH] of each: what is sent and received */
  int *ranks;                 /* [count] the neighbours */
} flesh_halo;

enum { FLESH_HALO_WIDTH = 9 /* numbers of a node, at most */ };

/* Sorts `shared`. FLESH_ERR_MEMORY. To be cleared also when it fails. */
int flesh_halo_create(flesh_communicator *communicator, flesh_shared_nodes *shared, flesh_halo *halo);
void flesh_halo_clear(flesh_halo *halo);

/* See team.h. */
void flesh_halo_update_ghosts(const flesh_halo *halo, flesh_communicator *communicator,
                              const flesh_team_vector *vector);
void flesh_halo_add_ghosts(const flesh_halo *halo, flesh_communicator *communicator, const flesh_team_vector *vector);
/* Owners get what all ghosts of theirs have, in the order of halo->own, into halo->of_own; nothing is added. */
void flesh_halo_tell(const flesh_halo *halo, flesh_communicator *communicator, const flesh_team_vector *vector);

#endif
