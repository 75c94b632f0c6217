/* vector.c: which vectors and which user_data the callbacks take. */
#include "sundials/vector.h"

#include <math.h>

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

static void linear_sum(sunrealtype a, N_Vector x, sunrealtype b, N_Vector y, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x), *q = N_VGetArrayPointer(y);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = a * p[k] + b * q[k];
}

static void product(N_Vector x, N_Vector y, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x), *q = N_VGetArrayPointer(y);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = p[k] * q[k];
}

static void scale(sunrealtype c, N_Vector x, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = c * p[k];
}

static void quotient(N_Vector x, N_Vector y, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x), *q = N_VGetArrayPointer(y);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = p[k] / q[k];
}

static void inverse(N_Vector x, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = 1 / p[k];
}

static void absolute(N_Vector x, N_Vector z)
{
  const double *p = N_VGetArrayPointer(x);
  double *r = N_VGetArrayPointer(z);
  const sunindextype n = N_VGetLength(z);
  for (sunindextype k = 0; k < n; k++) r[k] = fabs(p[k]);
}

/* Eight sums: the compiler may not reorder one, and a single chain waits for every addition. */
static double fold(const double s[8])
{
  return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
}

static sunrealtype dot(N_Vector x, N_Vector y)
{
  const double *p = N_VGetArrayPointer(x), *q = N_VGetArrayPointer(y);
  const sunindextype n = N_VGetLength(x);
  double s[8] = {0};
  sunindextype k = 0;
  for (; k + 8 <= n; k += 8)
    for (int l = 0; l < 8; l++) s[l] += p[k + l] * q[k + l];
  for (; k < n; k++) s[0] += p[k] * q[k];
  return fold(s);
}

static sunrealtype weighted_two_norm(N_Vector x, N_Vector w)
{
  const double *p = N_VGetArrayPointer(x), *q = N_VGetArrayPointer(w);
  const sunindextype n = N_VGetLength(x);
  double s[8] = {0};
  sunindextype k = 0;
  for (; k + 8 <= n; k += 8)
    for (int l = 0; l < 8; l++) s[l] += (p[k + l] * q[k + l]) * (p[k + l] * q[k + l]);
  for (; k < n; k++) s[0] += (p[k] * q[k]) * (p[k] * q[k]);
  return sqrt(fold(s));
}

static sunrealtype minimum(N_Vector x)
{
  const double *p = N_VGetArrayPointer(x);
  const sunindextype n = N_VGetLength(x);
  double m[8];
  for (int l = 0; l < 8; l++) m[l] = INFINITY;
  sunindextype k = 0;
  for (; k + 8 <= n; k += 8)
    for (int l = 0; l < 8; l++) m[l] = p[k + l] < m[l] ? p[k + l] : m[l];
  for (; k < n; k++) m[0] = fmin(m[0], p[k]);
  for (int l = 1; l < 8; l++) m[0] = fmin(m[0], m[l]);
  return m[0];
}

void flesh_vector_quicken(N_Vector v)
{
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvprod = product;
  v->ops->nvdiv = quotient;
  v->ops->nvinv = inverse;
  v->ops->nvabs = absolute;
  v->ops->nvscale = scale;
  v->ops->nvdotprod = dot;
  v->ops->nvmin = minimum;
  v->ops->nvwl2norm = weighted_two_norm;
}
