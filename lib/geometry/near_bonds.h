/* near_bonds.h: features of surfaces that are held together by something else (a weld, a joint), and that do not touch
 * until that is broken and they have come apart.
 *
 * Bonded features are points, each with the faces it is held to, and edges, each with edges of higher number. A point
 * is first HELD; then SEATED on a face of the piece it was held to, touching nothing of that piece; then APART,
 * touching everything. An edge is HELD, then APART; it touches nothing of a piece on which a node of either edge is
 * SEATED. */
#ifndef FLESH_GEOMETRY_NEAR_BONDS_H
#define FLESH_GEOMETRY_NEAR_BONDS_H

#include <stddef.h>

/* Rows of numbers: row i is second[start[i]] to before second[start[i + 1]]. */
typedef struct flesh_near_rows {
  int *start, *second;
} flesh_near_rows;

enum { FLESH_HELD, FLESH_SEATED, FLESH_APART };

typedef struct flesh_near_bonds {
  int count[2];              /* numbers of bonded points and bonded edges */
  int *row[2];               /* [surface nodes], [edges] index of the bonded feature; -1: not bonded */
  int *first[2];             /* [count] index of the point's surface node, or of the edge */
  int *seat;                 /* [count[0]] the nearest face at rest among those of its bonds; -1: none */
  flesh_near_rows others[2]; /* [count] faces or edges it is held to, ascending */
  flesh_near_rows bonds[2];  /* [count] internal variables of its bonds, indexing flesh_environment.all_internal; empty
                              * row: held permanently */
  int *state[2];             /* [count] index of its first variable among the contact's internal variables; -1: held
                              * permanently */
  int variables;             /* total number of these variables */
  flesh_near_rows around;    /* [surface nodes] faces of each node; NULL if all bonds are permanent */
} flesh_near_bonds;

/* NULL-safe. */
void flesh_near_bonds_destroy(flesh_near_bonds *bonds);
size_t flesh_near_bonds_memory(const flesh_near_bonds *bonds, int nodes, int edges);

/* Whether row `first` contains `second`. */
int flesh_near_rows_have(const flesh_near_rows *rows, int first, int second);

#endif
