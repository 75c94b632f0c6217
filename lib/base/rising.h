/* rising.h: finds a number where numbers rise. */
#ifndef FLESH_BASE_RISING_H
#define FLESH_BASE_RISING_H

/* Returns the place of `number` in `numbers`, which rise from `low` to before `high`; -1: it is not there. */
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
