/* shared_rows.h: sums over the rows of several ranks at the main nodes that these rows share: what couples rows of
 * different ranks (row_coupling.h) goes by such nodes alone. */
#ifndef FLESH_LINEAR_SHARED_ROWS_H
#define FLESH_LINEAR_SHARED_ROWS_H

#include <stddef.h>

#include "base/team.h"
#include "linear/row_lists.h"

typedef struct flesh_shared_rows {
  const flesh_team *team; /* NULL: there is none */
  int count;          /* main nodes of rows of this rank and of others */
  int *nodes;         /* [count] their places in vectors, ascending */
  int ranks;          /* other ranks that have any of them */
  int *first, *which; /* [ranks+1] where those begin that each of these ranks has; which of the nodes they are */
  double *own, *others; /* [9*count] what this rank has at each node, `width` numbers; the sum of what others have */
  double *sent, *received; /* [9*first[ranks]] */
} flesh_shared_rows;

enum { FLESH_SHARED_ROWS_WIDTH = 9 };

/* A node that is main to one rank becomes so in the lists of all. place_of [nodes of the team]: where vectors have each node.
 * Collective, and fails on all ranks if one comes with a `status` other than FLESH_OK, of what it has made before (its
 * `lists` may be NULL then), or FLESH_ERR_MEMORY. To be cleared also when it fails. */
int flesh_shared_rows_create(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, int status,
                             flesh_shared_rows *shared);
void flesh_shared_rows_clear(flesh_shared_rows *shared);

/* `others` from what all have in `own`, so many numbers a node, added by rising rank. What is sent is on its way between
 * the two; nothing else is exchanged or added up then. Collective. */
void flesh_shared_rows_begin(const flesh_shared_rows *shared, int width);
void flesh_shared_rows_end(const flesh_shared_rows *shared, int width);

#endif
