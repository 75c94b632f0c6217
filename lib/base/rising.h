/* rising.h: finds a number in a sorted array. */
#ifndef FLESH_BASE_RISING_H
#define FLESH_BASE_RISING_H

/* Returns the index of `number` in `numbers`, which are in rising order for low <= k < high; -1: it is not there. */
static inline int flesh_rising_find(const int *numbers, int low, int high, int number)
{
  while (low < high) {
    const int middle = low + (high - low) / 2;
    if (numbers[middle] == number) return middle;
    if (numbers[middle] < number) low = middle + 1;
    else high = middle;
  }
  return -1;
}

#endif
