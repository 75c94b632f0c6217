/* vector.c: reads the vectors and user_data of callbacks, and vectorises serial vectors. */
#include "sundials/vector.h"

#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/parallel_vector.h"
#include "base/team.h"
#include "sundials/parallel_vector.h"

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

static double *data_of(N_Vector v, sunindextype n)
{
  if (!v) {
    flesh_fail(FLESH_ERR_ARGUMENT, "the N_Vector is NULL; it must be a serial, OpenMP or Pthreads one of length %lld",
               (long long)n);
    return NULL;
  }
  N_Vector_ID id = N_VGetVectorID(v);
  if (id != SUNDIALS_NVEC_SERIAL && id != SUNDIALS_NVEC_OPENMP && id != SUNDIALS_NVEC_PTHREADS) {
    flesh_fail(FLESH_ERR_ARGUMENT,
               "the N_Vector is of the %s kind; it must be a serial, OpenMP or Pthreads vector (of a ManyVector, pass "
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

static int is_parallel(N_Vector v, const flesh_team *team)
{
  return team && v && N_VGetVectorID(v) == SUNDIALS_NVEC_PARALLEL;
}

/* Returns the number of parts, each with a number for every dof, in a vector with n numbers of a rank. */
static int parts_of(const flesh_team *team, sunindextype n) { return (int)(n / (3 * (sunindextype)team->nodes)); }

/* Checks, on all ranks, that a parallel vector has the numbers of own nodes. */
static int check_parallel(N_Vector v, const flesh_team *team, int parts)
{
  const sunindextype own = 3 * (sunindextype)parts * team->own, length = flesh_parallel_vector_length(v);
  const double all = 3. * parts * team->all;
  int status = FLESH_OK;
  if (length != own || (double)N_VGetLength(v) != all)
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "the N_Vector has %lld numbers, %lld of them of this rank; it must have %.0f and %lld, of own nodes",
                        (long long)N_VGetLength(v), (long long)length, all, (long long)own);
  return flesh_team_agree(team, status);
}

static int is_vectorised(N_Vector v);

/* Returns the numbers of a vector that is not parallel. */
static double *local_data(N_Vector v, const flesh_team *team, sunindextype n)
{
  if (!team || !v || team->all == team->nodes || is_vectorised(v)) return data_of(v, n);
  flesh_fail(FLESH_ERR_ARGUMENT, "the body is shared out among ranks, and this N_Vector is for a single rank; it must be one of "
                                 "N_VNew_Parallel");
  return NULL;
}

const double *flesh_vector_read(N_Vector v, const flesh_team *team, sunindextype n, int partial, double *room)
{
  if (!is_parallel(v, team)) return local_data(v, team, n);
  const int parts = parts_of(team, n);
  if (check_parallel(v, team, parts)) return NULL;
  const size_t own = 3 * (size_t)team->own, all = 3 * (size_t)team->nodes;
  const double *values = N_VGetArrayPointer(v);
  for (size_t k = 0; k < (size_t)parts; k++) {
    memcpy(room + k * all, values + k * own, own * sizeof *room);
    memset(room + k * all + own, 0, (all - own) * sizeof *room);
    if (!partial) flesh_team_update_ghosts(team, room + k * all);
  }
  return room;
}

double *flesh_vector_open(N_Vector v, const flesh_team *team, sunindextype n, double *room)
{
  if (!is_parallel(v, team)) return local_data(v, team, n);
  return check_parallel(v, team, parts_of(team, n)) ? NULL : room;
}

void flesh_vector_close(N_Vector v, const flesh_team *team, sunindextype n, const double *written)
{
  if (!is_parallel(v, team)) return;
  const size_t own = 3 * (size_t)team->own, all = 3 * (size_t)team->nodes;
  for (size_t k = 0; k < (size_t)parts_of(team, n); k++)
    memcpy(N_VGetArrayPointer(v) + k * own, written + k * all, own * sizeof *written);
}

void *flesh_user_data_problem(const void *user_data, const char *type)
{
  flesh_user_data *head = NULL;
  if (user_data) memcpy(&head, user_data, sizeof head);
  if (head && head->problem == head && !strcmp(head->type, type)) return head;
  flesh_fail(FLESH_ERR_ARGUMENT, "the callback's user_data is neither a %s nor a struct whose first member points to one",
             type);
  return NULL;
}

/* The content of a vectorised vector, which begins with the serial vector's for SUNDIALS. */
typedef struct content {
  struct _N_VectorContent_Serial serial;
  flesh_threads *threads;
  double (*norm)(void *data, N_Vector x, N_Vector w); /* NULL: SUNDIALS' own */
  void *data;                                         /* argument of the norm */
} content;

flesh_threads *flesh_vector_threads(N_Vector v) { return ((content *)v->content)->threads; }

/* An operation: z from x and y, with the numbers a and b; or sums or minima, part by part. */
typedef struct operation {
  const double *x, *y;
  double *z, a, b, results[FLESH_PARALLEL_PARTS_MAX];
} operation;

/* Parts of a vector (on ranks y = (x, v) has two), length of a part, and how many of its numbers are this rank's own. */
typedef struct extent {
  int parts, length, own;
} extent;

static extent extent_of(N_Vector v)
{
  const flesh_team *team = flesh_threads_team(flesh_vector_threads(v));
  const int length = (int)N_VGetLength(v);
  if (!team) return (extent){1, length, length};
  return (extent){parts_of(team, length), 3 * team->nodes, 3 * team->own};
}

/* Adds up, or takes the least of, the results over all parts of x and y; in a team over this rank's own numbers, so that
 * each counts once. */
static double reduce_own(N_Vector v, void (*part)(void *data, int k, int begin, int end), operation *o, int least)
{
  const extent e = extent_of(v);
  double result = least ? INFINITY : 0;
  for (int h = 0; h < e.parts; h++) {
    const int count = flesh_parallel_parts(flesh_vector_threads(v), e.own, part, o);
    for (int k = 0; k < count; k++) result = least ? fmin(result, o->results[k]) : result + o->results[k];
    o->x += e.length;
    if (o->y) o->y += e.length;
  }
  return result;
}

static int run(N_Vector v, void (*part)(void *data, int k, int begin, int end), operation *o)
{
  return flesh_parallel_parts(flesh_vector_threads(v), (int)N_VGetLength(v), part, o);
}

/* Defines an operation that computes z number by number. */
#define PART(name, expression)                                  \
  static void name##_part(void *data, int k, int begin, int end) \
  {                                                             \
    (void)k;                                                    \
    const operation *o = data;                                  \
    const double *x = o->x, *y = o->y, a = o->a, b = o->b;      \
    double *z = o->z;                                           \
    (void)x, (void)y, (void)a, (void)b;                         \
    for (int d = begin; d < end; d++) z[d] = expression;        \
  }

PART(linear_sum, a *x[d] + b * y[d])
PART(product, x[d] * y[d])
PART(scale, a *x[d])
PART(quotient, x[d] / y[d])
PART(inverse, 1 / x[d])
PART(absolute, fabs(x[d]))
PART(constant, a)

static void linear_sum(sunrealtype a, N_Vector x, sunrealtype b, N_Vector y, N_Vector z)
{
  run(z, linear_sum_part, &(operation){.x = N_VGetArrayPointer(x), .y = N_VGetArrayPointer(y), .a = a, .b = b,
                                       .z = N_VGetArrayPointer(z)});
}

static void product(N_Vector x, N_Vector y, N_Vector z)
{
  run(z, product_part,
      &(operation){.x = N_VGetArrayPointer(x), .y = N_VGetArrayPointer(y), .z = N_VGetArrayPointer(z)});
}

static void scale(sunrealtype c, N_Vector x, N_Vector z)
{
  run(z, scale_part, &(operation){.x = N_VGetArrayPointer(x), .a = c, .z = N_VGetArrayPointer(z)});
}

static void quotient(N_Vector x, N_Vector y, N_Vector z)
{
  run(z, quotient_part,
      &(operation){.x = N_VGetArrayPointer(x), .y = N_VGetArrayPointer(y), .z = N_VGetArrayPointer(z)});
}

static void inverse(N_Vector x, N_Vector z)
{
  run(z, inverse_part, &(operation){.x = N_VGetArrayPointer(x), .z = N_VGetArrayPointer(z)});
}

static void absolute(N_Vector x, N_Vector z)
{
  run(z, absolute_part, &(operation){.x = N_VGetArrayPointer(x), .z = N_VGetArrayPointer(z)});
}

static void constant(sunrealtype c, N_Vector z)
{
  run(z, constant_part, &(operation){.a = c, .z = N_VGetArrayPointer(z)});
}

static sunrealtype dot(N_Vector x, N_Vector y)
{
  const extent e = extent_of(x);
  double sum = 0;
  for (int h = 0; h < e.parts; h++)
    sum += flesh_dot(flesh_vector_threads(x), e.length, N_VGetArrayPointer(x) + (size_t)h * (size_t)e.length,
                     N_VGetArrayPointer(y) + (size_t)h * (size_t)e.length);
  return sum;
}

sunrealtype flesh_vector_largest(N_Vector x)
{
  const extent e = extent_of(x);
  double largest = 0;
  for (int h = 0; h < e.parts; h++)
    largest = fmax(largest, flesh_largest(flesh_vector_threads(x), e.length,
                                          N_VGetArrayPointer(x) + (size_t)h * (size_t)e.length));
  return largest;
}

static void weighted_square_part(void *data, int k, int begin, int end)
{
  operation *o = data;
  o->results[k] = flesh_weighted_square_of_part(o->x, o->y, begin, end);
}

static sunrealtype weighted_two_norm(N_Vector x, N_Vector w)
{
  operation o = {.x = N_VGetArrayPointer(x), .y = N_VGetArrayPointer(w)};
  double square = reduce_own(x, weighted_square_part, &o, 0);
  flesh_team_sum(flesh_threads_team(flesh_vector_threads(x)), 1, &square);
  return sqrt(square);
}

static void minimum_part(void *data, int k, int begin, int end)
{
  operation *o = data;
  const double *p = o->x;
  double m[8];
  for (int l = 0; l < 8; l++) m[l] = INFINITY;
  int d = begin;
  for (; d + 8 <= end; d += 8)
    for (int l = 0; l < 8; l++) m[l] = p[d + l] < m[l] ? p[d + l] : m[l];
  for (; d < end; d++) m[0] = fmin(m[0], p[d]);
  for (int l = 1; l < 8; l++) m[0] = fmin(m[0], m[l]);
  o->results[k] = m[0];
}

static sunrealtype minimum(N_Vector x)
{
  operation o = {.x = N_VGetArrayPointer(x)};
  return flesh_team_least(flesh_threads_team(flesh_vector_threads(x)), reduce_own(x, minimum_part, &o, 1));
}

/* Clones of one vector, made in advance. */
static _Thread_local N_Vector *ready;
static _Thread_local int ready_count, made_count; /* number of clones left, and of all, those taken being the last */

static N_Vector clone(N_Vector v)
{
  if (ready_count && ready[0]->sunctx == v->sunctx && N_VGetLength(ready[0]) == N_VGetLength(v))
    return ready[--ready_count];
  N_Vector copy = N_VClone_Serial(v);
  if (copy && !flesh_vector_vectorise(copy, flesh_vector_threads(v))) {
    const content *from = v->content;
    if (from->norm) flesh_vector_set_norm(copy, from->norm, from->data);
    return copy;
  }
  if (!copy) return NULL;
  N_VDestroy_Serial(copy);
  return NULL;
}

static int is_vectorised(N_Vector v) { return v->ops->nvclone == clone; }

N_Vector flesh_vector_clone(N_Vector v)
{
  N_Vector copy = v->ops->nvclone ? v->ops->nvclone(v) : NULL;
  if (copy) copy->sunctx = v->sunctx;
  return copy;
}

int flesh_vector_prepare(N_Vector v, int count)
{
  flesh_vector_drop();
  N_Vector *list = calloc((size_t)count, sizeof *list);
  int made = 0;
  while (list && made < count && (list[made] = clone(v))) made++;
  ready = list;
  ready_count = made_count = made;
  if (made == count) return FLESH_OK;
  flesh_vector_drop();
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d vectors", count);
}

void flesh_vector_drop(void)
{
  while (ready_count) N_VDestroy(ready[--ready_count]);
  free(ready);
  ready = NULL;
}

int flesh_vector_taken(N_Vector *taken, int most)
{
  const int count = made_count - ready_count;
  if (count > most) return -1;
  memcpy(taken, ready + ready_count, (size_t)count * sizeof *taken);
  return count;
}

void flesh_vector_attach(N_Vector v, int n, double *values)
{
  struct _N_VectorContent_Serial *serial = v->content;
  if (serial->own_data) free(serial->data);
  serial->own_data = SUNFALSE;
  serial->length = n;
  serial->data = values;
}

static sunrealtype norm_of_its_own(N_Vector x, N_Vector w)
{
  const content *of = x->content;
  return of->norm(of->data, x, w);
}

int flesh_vector_set_norm(N_Vector v, double (*norm)(void *data, N_Vector x, N_Vector w), void *data)
{
  if (!is_vectorised(v))
    return flesh_fail(FLESH_ERR_ARGUMENT, "the N_Vector is not one of flesh_ida_vector_create or flesh_ode_vector_create");
  content *of = v->content;
  of->norm = norm;
  of->data = data;
  v->ops->nvwrmsnorm = norm_of_its_own;
  return FLESH_OK;
}

int flesh_vector_vectorise(N_Vector v, flesh_threads *threads)
{
  const size_t bytes = (size_t)N_VGetLength(v) * sizeof(double);
  content *grown = realloc(v->content, sizeof *grown);
  if (grown) v->content = grown;
  double *data = grown && grown->serial.own_data ? flesh_huge_pages_calloc(bytes) : NULL;
  if (!grown || (grown->serial.own_data && !data)) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a vector");
  if (data) {
    memcpy(data, grown->serial.data, bytes);
    free(grown->serial.data);
    grown->serial.data = data;
  }
  grown->threads = threads;
  grown->norm = NULL;
  v->ops->nvclone = clone;
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvconst = constant;
  v->ops->nvprod = product;
  v->ops->nvdiv = quotient;
  v->ops->nvinv = inverse;
  v->ops->nvabs = absolute;
  v->ops->nvscale = scale;
  v->ops->nvdotprod = dot;
  v->ops->nvmin = minimum;
  v->ops->nvwl2norm = weighted_two_norm;
  return FLESH_OK;
}
