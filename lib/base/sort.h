/* sort.h: stable sorting without memory from the system, which qsort may ask for. */
#ifndef FLESH_BASE_SORT_H
#define FLESH_BASE_SORT_H

#include <stddef.h>

/* Sorts `count` items of `size` bytes by `compare`, as qsort does; equal items stay in their order. Takes memory for
 * half of them by flesh_malloc, and is slower if there is none. */
void flesh_sort(void *things, size_t count, size_t size, int (*compare)(const void *a, const void *b));

/* Compare two numbers for ascending order, for flesh_sort and qsort. */
int flesh_compare_int(const void *a, const void *b);
int flesh_compare_long(const void *a, const void *b);
int flesh_compare_double(const void *a, const void *b);
/* Compare two items that begin with two or three ints for ascending order: by the first int, then the second, and so
 * on. */
int flesh_compare_two_ints(const void *a, const void *b);
int flesh_compare_three_ints(const void *a, const void *b);

#endif
