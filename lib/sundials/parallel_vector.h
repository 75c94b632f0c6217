/* parallel_vector.h: vectors of N_VNew_Parallel, which callbacks get from programs of several ranks. */
#ifndef FLESH_SUNDIALS_PARALLEL_VECTOR_H
#define FLESH_SUNDIALS_PARALLEL_VECTOR_H

#include <sundials/sundials_nvector.h>

/* Returns how many of the vector's numbers this rank has; -1: it is of another kind. */
sunindextype flesh_parallel_vector_length(N_Vector v);

#endif
