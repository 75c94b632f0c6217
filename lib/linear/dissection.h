/* dissection.h: an order of elimination for sparse matrices whose rows are places in space (nested dissection; George
 * 1973): few rows, a separator, part the others into two halves that share no entry, and so on within the halves. */
#ifndef FLESH_LINEAR_DISSECTION_H
#define FLESH_LINEAR_DISSECTION_H

/* Parts are runs of the order: separators, and what is too small to be dissected. The rows of a part meet only those
 * of its own, of its ancestors, and of parts before it that it is an ancestor of. */
typedef struct flesh_dissection {
  int count;
  int *order;  /* [n] rows in the order of elimination */
  int *first;  /* [count+1] of each part in the order */
  int *parent; /* [count] a later part; -1: none */
} flesh_dissection;

/* Orders n rows, row i with neighbours[starts[i]] ... (symmetric, without i itself) at points + 3 i. Depends on nothing
 * else. To be cleared also when it fails: FLESH_ERR_MEMORY. */
int flesh_dissection_create(int n, const int *starts, const int *neighbours, const double *points,
                            flesh_dissection *dissection);
void flesh_dissection_clear(flesh_dissection *dissection);

#endif
