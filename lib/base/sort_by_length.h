/* sort_by_length.h: orders items by their lengths, so that processors predict where loops over them end. */
#ifndef FLESH_BASE_SORT_BY_LENGTH_H
#define FLESH_BASE_SORT_BY_LENGTH_H

/* Writes the numbers begin <= k < end into order[begin..end) by falling length[k]; those of equal length stay in order.
 * Lengths are not negative; the time is proportional to the number of different lengths. */
void flesh_sort_by_length(int begin, int end, const int *length, int *order);

#endif
