/* links.h: exchanges of a rank with others: the lists of nodes behind a team's operations (base/team.h). */
#ifndef FLESH_PARALLEL_LINKS_H
#define FLESH_PARALLEL_LINKS_H

#include "parallel/halo.h"

/* Relations of a rank to a node, as bits: the rank has the node, or has it in its overlap. */
enum { FLESH_LINK_HAS = 1, FLESH_LINK_OVERLAPS = 2 };

typedef struct flesh_links {
  flesh_communicator *communicator; /* borrowed */
  flesh_halo halo;       /* from owners to ghosts */
  flesh_halo overlap;    /* from owners to all ranks that have a node in their overlaps */
  flesh_halo rows;       /* from ranks that have a node to those whose overlap has it; none if the team narrows */
  const uint8_t *always; /* [overlap] if the team narrows: relations by the rank's tets and own cells; borrowed */
} flesh_links;

/* Operations of a team whose `data` is a flesh_links. */
extern const flesh_team_operations flesh_links_operations;

/* Returns links->rows as the neighbours of a rank's team; borrowed. */
flesh_team_neighbours flesh_links_neighbours(const flesh_links *links, int rank);
void flesh_links_clear(flesh_links *links);

/* Operations of team.h. */
int flesh_links_narrow(const flesh_team *team, const uint8_t *needed, const flesh_team **narrow);
void flesh_links_narrow_end(const flesh_team **narrow);

#endif
