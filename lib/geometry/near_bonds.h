/* near_bonds.h: features of surfaces that something else holds together (a weld, a joint), and that do not touch until
 * that is broken and they have come apart. Bonded features are points, each with the faces that it is held to, and edges,
 * each with later edges. A point is HELD, then SEATED on a face of the piece that it was held to, and touches nothing of
 * that piece, then APART and touches all; an edge is HELD, then APART, and touches nothing of a piece that a node of
 * either edge is SEATED on. */
#ifndef FLESH_GEOMETRY_NEAR_BONDS_H
#define FLESH_GEOMETRY_NEAR_BONDS_H

#include <stddef.h>

/* Lists of numbers: that of i is second[start[i]] to before second[start[i + 1]]. */
typedef struct flesh_near_rows {
  int *start, *second;
} flesh_near_rows;

enum { FLESH_HELD, FLESH_SEATED, FLESH_APART };

typedef struct flesh_near_bonds {
  int count[2];              /* bonded points, bonded edges */
  int *row[2];               /* [nodes of the surface], [edges] number of the bonded feature; -1: it is free */
  int *first[2];             /* [count] the place of its node, its edge */
  int *seat;                 /* [count[0]] the nearest of its faces at rest that is a bond's; -1: none is */
  flesh_near_rows others[2]; /* [count] faces or edges that it is held to, ascending */
  flesh_near_rows bonds[2];  /* [count] internal variables of its bonds, in flesh_environment.all_internal; none: held for good */
  int *state[2];             /* [count] its first internal variable, among the contact's; -1: held for good */
  int variables;             /* of these, in all */
  flesh_near_rows around;    /* [nodes of the surface] their faces; NULL where all is held for good */
} flesh_near_bonds;

/* NULL-safe. */
void flesh_near_bonds_destroy(flesh_near_bonds *bonds);
size_t flesh_near_bonds_memory(const flesh_near_bonds *bonds, int nodes, int edges);

/* Whether row `first` of the rows lists `second`. */
int flesh_near_rows_have(const flesh_near_rows *rows, int first, int second);

#endif
