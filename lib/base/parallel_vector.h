/* parallel_vector.h: long arrays in parts that threads share out. How they are cut depends on the length alone, so that
 * sums over parts have the same bits however many threads there are. Where the threads have a team (team.h), and the
 * length is that of its vectors, what is found is that of all ranks, each number counted by its owner. */
#ifndef FLESH_BASE_PARALLEL_VECTOR_H
#define FLESH_BASE_PARALLEL_VECTOR_H

#include "flesh/threads.h"

enum { FLESH_PARALLEL_PARTS_MAX = 64 };

/* Calls part(data, k, begin, end) for every part k, which is begin <= i < end. `threads` may be NULL. Returns how many
 * parts there are, FLESH_PARALLEL_PARTS_MAX at most. */
int flesh_parallel_parts(flesh_threads *threads, int length, void (*part)(void *data, int k, int begin, int end),
                    void *data);

double flesh_dot(flesh_threads *threads, int n, const double *x, const double *y);
double flesh_norm(flesh_threads *threads, int n, const double *x);
/* The largest |x|, of what is a number. */
double flesh_largest(flesh_threads *threads, int n, const double *x);
/* No |x - y|, or |x| where y is NULL, is larger than this, their 8-norm, which is n^(1/8) times the largest at most and
 * quicker to find; INFINITY where one is no number. */
double flesh_bound_apart(flesh_threads *threads, int n, const double *x, const double *y);
void flesh_copy(flesh_threads *threads, int n, const double *from, double *to);
/* Whether x and y have the same bits. */
int flesh_same(flesh_threads *threads, int n, const double *x, const double *y);

/* The sum of x y over begin <= i < end. */
double flesh_dot_of_part(const double *x, const double *y, int begin, int end);
/* The sum of the squares of w x, likewise. */
double flesh_weighted_square_of_part(const double *x, const double *w, int begin, int end);

#endif
