/* parallel_vector.h: operations on long arrays, in parts that the threads share. The parts depend on the length alone,
 * so that sums have the same bits for any number of threads. If the threads have a team (team.h) and the length is that
 * of its vectors, results are over all ranks, and each number is counted by its owner. */
#ifndef FLESH_BASE_PARALLEL_VECTOR_H
#define FLESH_BASE_PARALLEL_VECTOR_H

#include "flesh/threads.h"

enum { FLESH_PARALLEL_PARTS_MAX = 64 };

/* Calls part(data, k, begin, end) for every part k, the range begin <= i < end. `threads` may be NULL. Returns the
 * number of parts, at most FLESH_PARALLEL_PARTS_MAX. */
int flesh_parallel_parts(flesh_threads *threads, int length, void (*part)(void *data, int k, int begin, int end),
                    void *data);

double flesh_dot(flesh_threads *threads, int n, const double *x, const double *y);
double flesh_norm(flesh_threads *threads, int n, const double *x);
/* Returns the largest |x|; NaN is ignored. */
double flesh_largest(flesh_threads *threads, int n, const double *x);
/* Returns an upper bound of |x - y|, or of |x| if y is NULL: their 8-norm, which is at most n^(1/8) times the largest
 * and faster to compute; INFINITY if one is NaN. */
double flesh_bound_apart(flesh_threads *threads, int n, const double *x, const double *y);
void flesh_copy(flesh_threads *threads, int n, const double *from, double *to);
/* Returns whether x and y have the same bits. */
int flesh_same(flesh_threads *threads, int n, const double *x, const double *y);

/* Returns the sum of x y over begin <= i < end. */
double flesh_dot_of_part(const double *x, const double *y, int begin, int end);
/* Returns the sum of (w x)^2 over begin <= i < end. */
double flesh_weighted_square_of_part(const double *x, const double *w, int begin, int end);

#endif
