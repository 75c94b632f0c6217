/* near_patches.c: looks up pairs of patches. */
#include "geometry/near_patches.h"

int flesh_contact_patches_find(const flesh_contact_patches *self, int a, int b)
{
  const int first = a < b ? a : b, second = a < b ? b : a;
  int low = 0, high = self->pair_count;
  while (low < high) {
    const int middle = low + (high - low) / 2, *at = self->pairs[middle].patches;
    if (at[0] < first || (at[0] == first && at[1] < second)) low = middle + 1;
    else high = middle;
  }
  if (low == self->pair_count || self->pairs[low].patches[0] != first || self->pairs[low].patches[1] != second) return -1;
  return low;
}
