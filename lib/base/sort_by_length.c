/* sort_by_length.c: one pass for each different length. */
#include "base/sort_by_length.h"

void flesh_sort_by_length(int begin, int end, const int *length, int *order)
{
  int longest = 0, next = begin;
  for (int k = begin; k < end; k++)
    if (length[k] > longest) longest = length[k];
  for (int now = longest, shorter; next < end; now = shorter) {
    shorter = 0;
    for (int k = begin; k < end; k++) {
      if (length[k] == now) order[next++] = k;
      else if (length[k] < now && length[k] > shorter) shorter = length[k];
    }
  }
}
