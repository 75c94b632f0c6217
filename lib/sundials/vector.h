/* vector.h: the arrays in the vectors and the problem in the user_data that SUNDIALS hands to callbacks. */
#ifndef FLESH_SUNDIALS_VECTOR_H
#define FLESH_SUNDIALS_VECTOR_H

#include <stdint.h>
#include <sundials/sundials_nvector.h>

#include "base/team.h"
#include "flesh/threads.h"

/* The n numbers of a rank's nodes in a vector that a callback reads: those of a serial, OpenMP or Pthreads vector, or with a `team` (NULL:
 * none) in `room` [n] what its owners have in a vector of N_VNew_Parallel, 3 numbers for each own node and none for
 * ghosts; these get their owners' numbers, or 0 where the vector is `partial`, as sums over ranks are. Collective then.
 * A vector of y = (x, v) has twice as many, those of x first. NULL, with the reason in flesh_error_text(), for another kind or length, on all ranks or none; a serial vector that is
 * not a vectorised one is refused where there are several ranks, as its norms would be those of each. */
const double *flesh_vector_read(N_Vector v, const flesh_team *team, sunindextype n, int partial, double *room);
/* The array into which a callback is to write the numbers: the vector's, or `room`, from which flesh_vector_close
 * copies them. */
double *flesh_vector_open(N_Vector v, const flesh_team *team, sunindextype n, double *room);
void flesh_vector_close(N_Vector v, const flesh_team *team, sunindextype n, const double *written);

/* A count as an index of SUNDIALS; -1 where 32-bit ones cannot hold it. */
static inline sunindextype flesh_sunindex(int64_t count)
{
  return (int64_t)(sunindextype)count == count ? (sunindextype)count : -1;
}

/* Gives a serial vector, and those cloned from it, operations that use the machine's vector units, which SUNDIALS' own
 * are often built without, and `threads` (borrowed; NULL: the caller's). FLESH_OK or FLESH_ERR_MEMORY. */
int flesh_vector_vectorise(N_Vector v, flesh_threads *threads);
/* The largest |x| of a vectorised vector, of all ranks. */
sunrealtype flesh_vector_largest(N_Vector x);
/* A clone, NULL without memory; SUNDIALS' own N_VClone then reads through the NULL. */
N_Vector flesh_vector_clone(N_Vector v);
/* Makes `count` clones of a vectorised vector, which a SUNDIALS function that is called next in this thread gets of it
 * or of its clones, since such functions do not survive a want of memory; and drops those that were not taken. FLESH_OK
 * or FLESH_ERR_MEMORY. */
int flesh_vector_prepare(N_Vector v, int count);
void flesh_vector_drop(void);
/* Before they are dropped: writes those that were taken, their number as the result; -1: they are more than `most`. */
int flesh_vector_taken(N_Vector *taken, int most);
/* A vectorised vector's n numbers are from now on those at `values`, which is borrowed. */
void flesh_vector_attach(N_Vector v, int n, double *values);
/* The weighted norm of a vectorised vector, and of those cloned from it, is from now on that of `norm`, which is given
 * `data` (borrowed), the vector and its weights. FLESH_ERR_ARGUMENT for another vector. */
int flesh_vector_set_norm(N_Vector v, double (*norm)(void *data, N_Vector x, N_Vector w), void *data);
/* The threads of a vectorised vector. */
flesh_threads *flesh_vector_threads(N_Vector v);

/* The first member of a problem. It points to the problem, as the first one of a user's own struct does: so either shows
 * where the problem is. */
typedef struct flesh_user_data {
  const void *problem;
  const char *type; /* "flesh_problem", and so on */
} flesh_user_data;
/* The problem of that type to which user_data leads; NULL, with words, where there is none. */
void *flesh_user_data_problem(const void *user_data, const char *type);

#endif
