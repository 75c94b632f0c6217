/* dissection.h: an order of elimination for sparse matrices whose rows are points in space (nested dissection; George
 * 1973): a separator of few rows parts the others into two halves that share no entry, and so on within the halves. */
#ifndef FLESH_LINEAR_DISSECTION_H
#define FLESH_LINEAR_DISSECTION_H

/* Parts are runs of the order: separators, and ranges too small to be dissected. The rows of a part meet only rows of the
 * part itself, of its ancestors, and of earlier parts whose ancestor it is. */
typedef struct flesh_dissection {
  int count;
  int *order;  /* [n] rows in the order of elimination */
  int *first;  /* [count+1] first row of each part in the order */
  int *parent; /* [count] a later part; -1: none */
} flesh_dissection;

/* Orders n rows at points + 3 i, row i with neighbours[starts[i]] ... (symmetric, without i itself). Depends on nothing
 * else. Clear it also after a failure: FLESH_ERR_MEMORY. */
int flesh_dissection_create(int n, const int *starts, const int *neighbours, const double *points,
                            flesh_dissection *dissection);
void flesh_dissection_clear(flesh_dissection *dissection);

#endif
