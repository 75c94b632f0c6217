/* disjoint_sets.h: numbers in sets that are joined one after the other; the least of a set stands for it.
 *
 * parent[i] is i where i stands for its set, else another of the same set. Paths are halved as they are followed
 * (Tarjan & van Leeuwen 1984). */
#ifndef FLESH_BASE_DISJOINT_SETS_H
#define FLESH_BASE_DISJOINT_SETS_H

/* Which stands for i's set. */
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
