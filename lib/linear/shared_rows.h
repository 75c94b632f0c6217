/* shared_rows.h: sums over the rows of several ranks at the main nodes that these rows share: the coupling of rows of
 * different ranks (row_coupling.h) acts through these nodes alone. */
#ifndef FLESH_LINEAR_SHARED_ROWS_H
#define FLESH_LINEAR_SHARED_ROWS_H

#include "base/team.h"
#include "linear/row_lists.h"

typedef struct flesh_shared_rows {
  const flesh_team *team; /* NULL: there is none */
  int count;          /* number of main nodes of rows both of this rank and of others */
  int *nodes;         /* [count] places of the nodes in vectors, ascending */
  int ranks;          /* number of other ranks that have any of them */
  int *first, *which; /* [ranks+1] first node of each of these ranks; indices into `nodes` */
  double *own, *others; /* [9*count] this rank's values at each node, `width` numbers; sum of the others' values */
  double *sent, *received; /* [9*first[ranks]] */
} flesh_shared_rows;

enum { FLESH_SHARED_ROWS_WIDTH = 9 };

/* Makes the lists of shared nodes. A node that is main to one rank becomes so in the lists of all. place_of [nodes of the
 * team]: place of each node in vectors. Collective, and fails on all ranks if one passes a `status` other than FLESH_OK
 * from earlier work (its `lists` may be NULL then), or with FLESH_ERR_MEMORY. Clear it also after a failure. */
int flesh_shared_rows_create(const flesh_row_lists *lists, const int *place_of, const flesh_team *team, int status,
                             flesh_shared_rows *shared);
void flesh_shared_rows_clear(flesh_shared_rows *shared);

/* Sums up the others' `own`, `width` numbers a node, into `others`, by rising rank. Between the two calls messages are on
 * their way; do not exchange or add up anything else then. Collective. */
void flesh_shared_rows_begin(const flesh_shared_rows *shared, int width);
void flesh_shared_rows_end(const flesh_shared_rows *shared, int width);

#endif
