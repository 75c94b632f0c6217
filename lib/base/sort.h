/* sort.h: sorts without asking the system for memory, as qsort may. */
#ifndef FLESH_BASE_SORT_H
#define FLESH_BASE_SORT_H

#include <stddef.h>

/* Sorts `count` things of `size` bytes by `compare`, as qsort; what is equal stays in its order. Takes as much again of
 * flesh_malloc; does without, slowly, where there is none. */
void flesh_sort(void *things, size_t count, size_t size, int (*compare)(const void *a, const void *b));

/* For flesh_sort and qsort: ascending numbers. */
int flesh_compare_int(const void *a, const void *b);
int flesh_compare_long(const void *a, const void *b);
int flesh_compare_double(const void *a, const void *b);
/* Ascending things that begin with so many ints: by the first, then the second, and so on. */
int flesh_compare_two_ints(const void *a, const void *b);
int flesh_compare_three_ints(const void *a, const void *b);

#endif
