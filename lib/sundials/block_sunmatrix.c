/* block_sunmatrix.c: the block matrix of KINSOL's problems as a SUNMatrix: a view of the problem's K, and clones with
 * memory of their own. */
#include <stdlib.h>

#include "base/error.h"
#include "sparse/block_matrix.h"
#include "sundials/problem.h"
#include "sundials/vector.h"

typedef struct content {
  flesh_problem *problem;
  flesh_block_matrix *K; /* the problem's, or a clone's own */
} content;

static int is_view(const content *A) { return A->K == A->problem->K; }

static SUNMatrix_ID matrix_id(SUNMatrix A)
{
  (void)A;
  return SUNMATRIX_CUSTOM;
}

/* A view that was set to 0 becomes so when its entries are asked for. */
static content *open_matrix(SUNMatrix matrix)
{
  content *A = matrix->content;
  if (is_view(A) && A->problem->zeroed) {
    flesh_block_combine(0, A->K, NULL);
    A->problem->zeroed = 0;
  }
  return A;
}

static int matrix_zero(SUNMatrix matrix)
{
  content *A = matrix->content;
  /* The Jacobian overwrites every entry: no need to touch them before. */
  if (is_view(A)) A->problem->zeroed = 1;
  else flesh_block_combine(0, A->K, NULL);
  return FLESH_OK;
}

/* A = c A + B. */
static int matrix_scale_add(sunrealtype c, SUNMatrix A, SUNMatrix B)
{
  if (A->ops->copy != B->ops->copy || ((content *)A->content)->problem != ((content *)B->content)->problem)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the two matrices are not of one problem");
  flesh_block_combine(c, open_matrix(A)->K, open_matrix(B)->K);
  return FLESH_OK;
}

static int matrix_copy(SUNMatrix A, SUNMatrix B) { return A == B ? FLESH_OK : matrix_scale_add(0, B, A); }

/* A = c A + I. */
static int matrix_scale_add_identity(sunrealtype c, SUNMatrix matrix)
{
  flesh_block_matrix *K = open_matrix(matrix)->K;
  flesh_block_combine(c, K, NULL);
  for (int i = 0; i < K->rows; i++)
    for (int k = 0; k < 3; k++) K->values[9 * (size_t)K->row_start[i] + 4 * k] += 1;
  return FLESH_OK;
}

static int matrix_times(SUNMatrix matrix, N_Vector x, N_Vector y)
{
  const content *A = matrix->content;
  const double *values = flesh_vector_data(x, A->problem->n);
  double *product = values ? flesh_vector_data(y, A->problem->n) : NULL;
  if (!product) return FLESH_ERR_ARGUMENT;
  if (is_view(A) && A->problem->zeroed) N_VConst(0, y);
  else flesh_block_multiply(A->K, values, product);
  return FLESH_OK;
}

static int matrix_space(SUNMatrix matrix, long *reals, long *integers)
{
  const flesh_block_matrix *K = ((content *)matrix->content)->K;
  *reals = 9 * (long)K->row_start[K->rows];
  *integers = K->row_start[K->rows] + K->rows + 1; /* the pattern, which is the system's */
  return FLESH_OK;
}

static void matrix_destroy(SUNMatrix matrix)
{
  content *A = matrix->content;
  if (A && !is_view(A)) flesh_block_matrix_destroy(&A->K);
  free(A);
  matrix->content = NULL;
  SUNMatFreeEmpty(matrix);
}

static SUNMatrix matrix_clone(SUNMatrix matrix);

/* K NULL: memory of its own. */
static int make(flesh_problem *problem, flesh_block_matrix *K, SUNContext context, SUNMatrix *matrix)
{
  content *A = calloc(1, sizeof *A);
  *matrix = SUNMatNewEmpty(context);
  int status = A && *matrix ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "no memory for a SUNMatrix");
  if (!status) *A = (content){problem, K};
  if (!status && !K) status = flesh_system_matrix_create(problem->system, &A->K);
  if (status) {
    free(A);
    if (*matrix) SUNMatFreeEmpty(*matrix);
    *matrix = NULL;
    return status;
  }
  SUNMatrix_Ops ops = (*matrix)->ops;
  ops->getid = matrix_id;
  ops->clone = matrix_clone;
  ops->destroy = matrix_destroy;
  ops->zero = matrix_zero;
  ops->copy = matrix_copy;
  ops->scaleadd = matrix_scale_add;
  ops->scaleaddi = matrix_scale_add_identity;
  ops->matvec = matrix_times;
  ops->space = matrix_space;
  (*matrix)->content = A;
  return FLESH_OK;
}

static SUNMatrix matrix_clone(SUNMatrix matrix)
{
  SUNMatrix made = NULL;
  make(((content *)matrix->content)->problem, NULL, matrix->sunctx, &made);
  return made;
}

int flesh_sunmatrix_create(flesh_problem *problem, SUNContext context, SUNMatrix *matrix)
{
  return make(problem, problem->K, context, matrix);
}

int flesh_problem_owns_matrix(const flesh_problem *problem, SUNMatrix J)
{
  return J->ops->destroy == matrix_destroy && ((content *)J->content)->K == problem->K;
}
