/* vector.h: the arrays in the vectors, and the problem in the user_data, that SUNDIALS passes to callbacks. */
#ifndef FLESH_SUNDIALS_VECTOR_H
#define FLESH_SUNDIALS_VECTOR_H

#include <stdint.h>
#include <sundials/sundials_nvector.h>

#include "base/team.h"
#include "flesh/threads.h"

/* Returns the n numbers of a rank's nodes in a vector that a callback reads. For a serial, OpenMP or Pthreads vector these
 * are its own array. With a `team` (NULL: none) and a vector of N_VNew_Parallel, which has 3 numbers for each own node and
 * none for ghosts, they are copied to `room` [n], and ghosts get their owners' numbers, or 0 where the vector is `partial`,
 * as sums over ranks are; collective then. A vector of y = (x, v) has twice as many, those of x first. NULL, with the
 * reason in flesh_error_text(), for another kind or length, on all ranks or none; with several ranks, also for a serial
 * vector that is not vectorised, as its norms would be those of each rank. */
const double *flesh_vector_read(N_Vector v, const flesh_team *team, sunindextype n, int partial, double *room);
/* Returns the array into which a callback must write the numbers: the vector's, or `room`, from which flesh_vector_close
 * copies them. */
double *flesh_vector_open(N_Vector v, const flesh_team *team, sunindextype n, double *room);
void flesh_vector_close(N_Vector v, const flesh_team *team, sunindextype n, const double *written);

/* Converts a count to an index of SUNDIALS; -1 where 32-bit indices cannot hold it. */
static inline sunindextype flesh_sunindex(int64_t count)
{
  return (int64_t)(sunindextype)count == count ? (sunindextype)count : -1;
}

/* Gives a serial vector, and its clones, operations that use the machine's vector units, without which SUNDIALS is often
 * built, and `threads` (borrowed; NULL: the caller's). FLESH_OK or FLESH_ERR_MEMORY. */
int flesh_vector_vectorise(N_Vector v, flesh_threads *threads);
/* Returns the largest |x| of a vectorised vector, over all ranks. */
sunrealtype flesh_vector_largest(N_Vector x);
/* Clones a vector; NULL without memory, which SUNDIALS' own N_VClone would dereference. */
N_Vector flesh_vector_clone(N_Vector v);
/* Makes `count` clones of a vectorised vector in advance, for the SUNDIALS function that this thread calls next, because
 * such functions crash when memory is lacking: it gets them when it clones the vector or its clones. Drops clones left over
 * from before. FLESH_OK or FLESH_ERR_MEMORY. */
int flesh_vector_prepare(N_Vector v, int count);
void flesh_vector_drop(void);
/* Writes the clones that were taken to `taken`, before they are dropped; returns their number, -1: more than `most`. */
int flesh_vector_taken(N_Vector *taken, int most);
/* Makes a vectorised vector use the n numbers at `values`, which is borrowed. */
void flesh_vector_attach(N_Vector v, int n, double *values);
/* Sets the weighted norm of a vectorised vector and its clones to `norm`, which gets `data` (borrowed), the vector and its
 * weights. FLESH_ERR_ARGUMENT for another vector. */
int flesh_vector_set_norm(N_Vector v, double (*norm)(void *data, N_Vector x, N_Vector w), void *data);
/* Returns the threads of a vectorised vector. */
flesh_threads *flesh_vector_threads(N_Vector v);

/* First member of a problem. It points to the problem, as the first member of a user's own struct does, so that either
 * leads to the problem. */
typedef struct flesh_user_data {
  const void *problem;
  const char *type; /* "flesh_problem", and so on */
} flesh_user_data;
/* Returns the problem of that type to which user_data leads; NULL, with a sentence, where there is none. */
void *flesh_user_data_problem(const void *user_data, const char *type);

#endif
