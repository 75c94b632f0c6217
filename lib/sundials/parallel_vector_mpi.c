/* parallel_vector_mpi.c: SUNDIALS' vectors of several ranks. Only their header is needed, not their library. */
#include <nvector/nvector_parallel.h>

#include "sundials/parallel_vector.h"

sunindextype flesh_parallel_vector_length(N_Vector v)
{
  return N_VGetVectorID(v) == SUNDIALS_NVEC_PARALLEL ? NV_LOCLENGTH_P(v) : -1;
}
