/* vector.h: the arrays in the vectors and the problem in the user_data that SUNDIALS hands to callbacks. */
#ifndef FLESH_SUNDIALS_VECTOR_H
#define FLESH_SUNDIALS_VECTOR_H

#include <string.h>
#include <sundials/sundials_nvector.h>

#include "flesh/threads.h"

/* The n numbers of a serial, OpenMP or Pthreads vector. NULL, with the reason in flesh_error_text(), for another kind
 * or length. */
double *flesh_vector_data(N_Vector v, sunindextype n);

/* Gives a serial vector, and those cloned from it, operations that use the machine's vector units, which SUNDIALS' own
 * are often built without, and `threads` (borrowed; NULL: the caller's). FLESH_OK or FLESH_ERR_MEMORY. */
int flesh_vector_quicken(N_Vector v, flesh_threads *threads);
/* Those of a quickened vector. */
flesh_threads *flesh_vector_threads(N_Vector v);

/* A problem's first member points to itself, and that of a user's own struct to the problem: so either tells where the
 * problem is. */
static inline void *flesh_first_member(const void *user_data)
{
  void *first = NULL;
  if (user_data) memcpy(&first, user_data, sizeof first);
  return first;
}
/* FLESH_ERR_ARGUMENT, with words: user_data is neither. */
int flesh_fail_user_data(const char *type);

#endif
