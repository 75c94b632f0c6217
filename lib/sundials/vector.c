/* vector.c: which vectors and which user_data the callbacks take. */
#include "sundials/vector.h"

#include "base/error.h"

static const char *kind_of(N_Vector_ID id)
{
  switch (id) {
  case SUNDIALS_NVEC_PARALLEL: return "MPI-parallel";
  case SUNDIALS_NVEC_PARHYP: return "ParHyp";
  case SUNDIALS_NVEC_PETSC: return "PETSc";
  case SUNDIALS_NVEC_CUDA: return "CUDA";
  case SUNDIALS_NVEC_HIP: return "HIP";
  case SUNDIALS_NVEC_SYCL: return "SYCL";
  case SUNDIALS_NVEC_RAJA: return "RAJA";
  case SUNDIALS_NVEC_OPENMPDEV: return "OpenMPDEV";
  case SUNDIALS_NVEC_TRILINOS: return "Trilinos";
  case SUNDIALS_NVEC_MANYVECTOR: return "ManyVector";
  case SUNDIALS_NVEC_MPIMANYVECTOR: return "MPIManyVector";
  case SUNDIALS_NVEC_MPIPLUSX: return "MPIPlusX";
  default: return "custom";
  }
}

double *flesh_vector_data(N_Vector v, sunindextype n)
{
  if (!v) {
    flesh_fail(FLESH_ERR_ARGUMENT, "the N_Vector is NULL; it must be a serial, OpenMP or Pthreads one of length %lld",
               (long long)n);
    return NULL;
  }
  N_Vector_ID id = N_VGetVectorID(v);
  if (id != SUNDIALS_NVEC_SERIAL && id != SUNDIALS_NVEC_OPENMP && id != SUNDIALS_NVEC_PTHREADS) {
    flesh_fail(FLESH_ERR_ARGUMENT,
               "the N_Vector is of the %s kind; serial, OpenMP and Pthreads vectors serve (of a ManyVector, hand on "
               "the subvector)",
               kind_of(id));
    return NULL;
  }
  if (N_VGetLength(v) != n) {
    flesh_fail(FLESH_ERR_ARGUMENT, "the N_Vector has length %lld; it must have %lld", (long long)N_VGetLength(v),
               (long long)n);
    return NULL;
  }
  return N_VGetArrayPointer(v);
}

int flesh_fail_user_data(const char *type)
{
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "the callback's user_data is neither a %s nor a struct whose first member points to one", type);
}
