/* halo.h: nodes that a rank shares with others, and the messages between owners and ghosts. */
#ifndef FLESH_PARALLEL_HALO_H
#define FLESH_PARALLEL_HALO_H

#include "base/team.h"
#include "parallel/communicator.h"

/* A node that this rank and another have, one of them as its owner. */
typedef struct flesh_shared_node {
  int rank;  /* the other rank */
  int ghost; /* 1: the other rank is the owner */
  int node;  /* number in the whole; both sides order their messages by it */
  int local; /* number on this rank */
} flesh_shared_node;

typedef struct flesh_shared_nodes {
  int count, room, failed;
  flesh_shared_node *nodes;
} flesh_shared_nodes;

/* Adds a node to the list, which begins as zeros; repeats are allowed. Without memory sets `failed`, which
 * flesh_halo_create reports. */
void flesh_shared_nodes_add(flesh_shared_nodes *shared, int rank, int ghost, int node, int local);
void flesh_shared_nodes_clear(flesh_shared_nodes *shared);

typedef struct flesh_halo {
  int count;        /* neighbours, by rising rank */
  int *first_own;   /* [count+1] first of the nodes that this rank owns and the neighbour has as ghosts */
  int *first_ghost; /* [count+1] first of the nodes that the neighbour owns and this rank has as ghosts */
  int *own, *ghosts; /* numbers on this rank, for each neighbour in the order of the whole */
  double *of_own, *of_ghosts; /* [FLESH_HALO_WIDTH] for each of them: numbers sent and received */
  int *ranks;                 /* [count] the neighbours */
} flesh_halo;

enum { FLESH_HALO_WIDTH = 9 /* most numbers per node */ };

/* Makes the halo and sorts `shared`. FLESH_ERR_MEMORY. The caller clears the halo, also after an error. */
int flesh_halo_create(flesh_communicator *communicator, flesh_shared_nodes *shared, flesh_halo *halo);
void flesh_halo_clear(flesh_halo *halo);

/* Operations of team.h. */
void flesh_halo_update_ghosts(const flesh_halo *halo, flesh_communicator *communicator,
                              const flesh_team_vector *vector);
void flesh_halo_add_ghosts(const flesh_halo *halo, flesh_communicator *communicator, const flesh_team_vector *vector);
/* Sends the values of ghosts to their owners, into halo->of_own in the order of halo->own, without adding them. */
void flesh_halo_tell(const flesh_halo *halo, flesh_communicator *communicator, const flesh_team_vector *vector);

#endif
