/* disjoint_sets.h: a union-find structure over the numbers 0, 1, ...; the smallest member represents its set.
 *
 * parent[i] is i if i represents its set, else another member of it. Paths are halved as they are followed (Tarjan &
 * van Leeuwen 1984). */
#ifndef FLESH_BASE_DISJOINT_SETS_H
#define FLESH_BASE_DISJOINT_SETS_H

/* Returns the representative of i's set. */
static inline int flesh_set_of(int *parent, int i)
{
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

static inline void flesh_sets_join(int *parent, int a, int b)
{
  a = flesh_set_of(parent, a);
  b = flesh_set_of(parent, b);
  parent[a > b ? a : b] = a < b ? a : b;
}

#endif
