/* near_bonds.c: keeps the features that are held together. */
#include "geometry/near_bonds.h"

#include <stdlib.h>

void flesh_near_bonds_destroy(flesh_near_bonds *self)
{
  if (!self) return;
  for (int kind = 0; kind < 2; kind++) {
    void *const owned[] = {self->row[kind], self->first[kind], self->others[kind].start, self->others[kind].second,
                           self->bonds[kind].start, self->bonds[kind].second, self->state[kind]};
    for (size_t k = 0; k < sizeof owned / sizeof *owned; k++) free(owned[k]);
  }
  free(self->seat);
  free(self->around.start);
  free(self->around.second);
  free(self);
}

size_t flesh_near_bonds_memory(const flesh_near_bonds *self, int nodes, int edges)
{
  if (!self) return 0;
  size_t ints = (size_t)nodes + (size_t)edges + (size_t)self->count[0];
  for (int kind = 0; kind < 2; kind++) {
    const size_t count = (size_t)self->count[kind];
    ints += 4 * count + (size_t)self->others[kind].start[count] + (size_t)self->bonds[kind].start[count];
  }
  if (self->around.start) ints += (size_t)nodes + (size_t)self->around.start[nodes];
  return sizeof *self + ints * sizeof(int);
}

int flesh_near_rows_have(const flesh_near_rows *rows, int first, int second)
{
  int low = rows->start[first], high = rows->start[first + 1];
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (rows->second[middle] < second) low = middle + 1;
    else high = middle;
  }
  return low < rows->start[first + 1] && rows->second[low] == second;
}
