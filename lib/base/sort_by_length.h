/* sort_by_length.h: the order of things by their lengths, for loops over them whose ends processors are to predict. */
#ifndef FLESH_BASE_SORT_BY_LENGTH_H
#define FLESH_BASE_SORT_BY_LENGTH_H

/* The numbers begin <= k < end from the largest length[k] to the least into order[begin..end), those of one length as
 * they were. Lengths are not negative; of different ones there are few. */
void flesh_sort_by_length(int begin, int end, const int *length, int *order);

#endif
