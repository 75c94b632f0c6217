/* parallel_vector_alone.c: without MPI there are no vectors of several ranks. */
#include "sundials/parallel_vector.h"

sunindextype flesh_parallel_vector_length(N_Vector v)
{
  (void)v;
  return -1;
}
