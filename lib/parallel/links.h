/* links.h: what a rank exchanges with others: the lists of nodes behind a team's operations (base/team.h). */
#ifndef FLESH_PARALLEL_LINKS_H
#define FLESH_PARALLEL_LINKS_H

#include "parallel/halo.h"

/* A rank's relations to a node; or'ed. */
enum { FLESH_LINK_HAS = 1, FLESH_LINK_OVERLAPS = 2 };

typedef struct flesh_links {
  flesh_communicator *communicator; /* borrowed */
  flesh_halo halo;       /* from owners to ghosts */
  flesh_halo overlap;    /* from owners to all whose overlap has a node */
  flesh_halo rows;       /* from all who have a node to all whose overlap has it; of a team that narrows none */
  const uint8_t *always; /* [overlap] of a team that narrows: by the rank's tets, and by cells of its own; borrowed */
} flesh_links;

/* `data` of a team that has these is its flesh_links. */
extern const flesh_team_operations flesh_links_operations;

/* links->rows, for a rank's team; borrowed. */
flesh_team_neighbours flesh_links_neighbours(const flesh_links *links, int rank);
void flesh_links_clear(flesh_links *links);

/* See team.h. */
int flesh_links_narrow(const flesh_team *team, const uint8_t *needed, const flesh_team **narrow);
void flesh_links_narrow_end(const flesh_team **narrow);

#endif
