/* block_sunmatrix.c: the block matrix of KINSOL's problems as a SUNMatrix: a view of the problem's K, and clones with
 * memory of their own. */
#include "base/error.h"
#include "linear/block_matrix.h"
#include "sundials/problem.h"
#include "sundials/sunmatrix.h"
#include "sundials/vector.h"

typedef struct content {
  flesh_problem *problem;
  flesh_block_matrix *own; /* memory of a clone; NULL: a view of the problem's K */
} content;

static int is_view(const content *A) { return !A->own; }

static flesh_block_matrix *matrix_of(const content *A) { return A->own ? A->own : A->problem->newton.equations.K; }

/* Returns the matrix for a change of its entries. A view that SUNDIALS has set to 0 is cleared only now. */
static flesh_block_matrix *open_matrix(SUNMatrix matrix)
{
  content *A = matrix->content;
  if (is_view(A)) A->problem->newton.direction.matrix++;
  if (is_view(A) && A->problem->zeroed) {
    flesh_block_combine(0, matrix_of(A), NULL);
    A->problem->zeroed = 0;
  }
  return matrix_of(A);
}

static int matrix_zero(SUNMatrix matrix)
{
  content *A = matrix->content;
  /* The Jacobian overwrites every entry: no need to clear them now. */
  if (is_view(A)) A->problem->zeroed = 1;
  else flesh_block_combine(0, A->own, NULL);
  return FLESH_OK;
}

/* Computes A = c A + B. */
static int matrix_scale_add(sunrealtype c, SUNMatrix A, SUNMatrix B)
{
  if (A->ops->copy != B->ops->copy || ((content *)A->content)->problem != ((content *)B->content)->problem)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the two matrices are not of one problem");
  flesh_block_combine(c, open_matrix(A), open_matrix(B));
  return FLESH_OK;
}

static int matrix_copy(SUNMatrix A, SUNMatrix B) { return A == B ? FLESH_OK : matrix_scale_add(0, B, A); }

/* Computes A = c A + I. */
static int matrix_scale_add_identity(sunrealtype c, SUNMatrix matrix)
{
  flesh_block_matrix *K = open_matrix(matrix);
  flesh_block_combine(c, K, NULL);
  /* The owner of a node that several ranks have adds the identity. */
  for (int i = 0; i < ((content *)matrix->content)->problem->newton.equations.evaluation.own / 3; i++)
    for (int k = 0; k < 3; k++) K->values[9 * (size_t)K->row_start[i] + 4 * k] += 1;
  return FLESH_OK;
}

static int matrix_times(SUNMatrix matrix, N_Vector x, N_Vector y)
{
  const content *A = matrix->content;
  const double *values = flesh_problem_read(A->problem, x, 0, 0);
  double *product = values ? flesh_problem_open(A->problem, y, 1) : NULL;
  if (!product) return FLESH_ERR_ARGUMENT;
  if (is_view(A) && A->problem->zeroed) {
    N_VConst(0, y);
    return FLESH_OK;
  }
  flesh_block_multiply_of_team(A->problem->newton.equations.team, matrix_of(A), values, product);
  flesh_problem_close(A->problem, y, product);
  return FLESH_OK;
}

static int matrix_space(SUNMatrix matrix, long *reals, long *integers)
{
  const flesh_block_matrix *K = matrix_of(matrix->content);
  *reals = 9 * (long)K->row_start[K->rows];
  *integers = K->row_start[K->rows] + K->rows + 1; /* the pattern, which is the system's */
  return FLESH_OK;
}

static void matrix_destroy(SUNMatrix matrix)
{
  content *A = matrix->content;
  if (A) flesh_block_matrix_destroy(&A->own);
  flesh_sunmatrix_discard(&matrix);
}

static SUNMatrix matrix_clone(SUNMatrix matrix);

static const flesh_sunmatrix_operations operations = {
    .getid = flesh_sunmatrix_id, .clone = matrix_clone, .destroy = matrix_destroy, .zero = matrix_zero,
    .copy = matrix_copy, .scaleadd = matrix_scale_add, .scaleaddi = matrix_scale_add_identity,
    .matvec = matrix_times, .space = matrix_space};

static int make(flesh_problem *problem, int view, SUNContext context, SUNMatrix *matrix)
{
  int status = flesh_sunmatrix_make(&operations, sizeof(content), context, matrix);
  if (status) return status;
  content *A = (*matrix)->content;
  *A = (content){problem, NULL};
  if (!view) status = flesh_system_matrix_create(problem->newton.equations.system, &A->own);
  if (status) flesh_sunmatrix_discard(matrix);
  return status;
}

static SUNMatrix matrix_clone(SUNMatrix matrix)
{
  SUNMatrix made = NULL;
  make(((content *)matrix->content)->problem, 0, matrix->sunctx, &made);
  return made;
}

int flesh_sunmatrix_create(flesh_problem *problem, SUNContext context, SUNMatrix *matrix)
{
  FLESH_NEED({problem, "problem"}, {context, "context"}, {matrix, "matrix"});
  return make(problem, 1, context, matrix);
}

int flesh_problem_owns_matrix(const flesh_problem *problem, SUNMatrix J)
{
  const content *A = J->content;
  return J->ops->destroy == matrix_destroy && is_view(A) && A->problem == problem;
}
