/* pair_matrix.c: the operations of SUNMatrix on matrices of y = (x, v). */
#include "sundials/pair_matrix.h"

#include <string.h>

#include "base/error.h"
#include "linear/block_matrix.h"
#include "sundials/sunmatrix.h"

static const flesh_ida_problem *motion_of(const flesh_pair_matrix *A) { return A->ida ? A->ida : A->rhs->motion; }

static int dofs(const flesh_pair_matrix *A) { return motion_of(A)->evaluation.n; }

static const uint8_t *fixed_of(const flesh_pair_matrix *A) { return motion_of(A)->constraints.fixed; }

/* Returns the matrix of a view, with K split from D. */
static flesh_pair_matrix *open_matrix(SUNMatrix matrix)
{
  flesh_pair_matrix *A = matrix->content;
  if (!A->view) return A;
  flesh_ida_separate(A->ida);
  A->rows = A->ida->jacobian.rows;
  return A;
}

/* Passes changes of a view on to its problem. */
static int close_matrix(flesh_pair_matrix *A)
{
  if (!A->view) return FLESH_OK;
  A->ida->jacobian.rows = A->rows;
  A->ida->jacobian.D_is_diagonal = flesh_block_is_diagonal(A->D);
  return FLESH_OK;
}

static int matrix_zero(SUNMatrix matrix)
{
  flesh_pair_matrix *A = matrix->content;
  if (A->view) { /* the Jacobian overwrites every entry: no need to clear them now */
    A->ida->jacobian.content = FLESH_IDA_NOTHING;
    return FLESH_OK;
  }
  flesh_block_combine(0, A->K, NULL);
  flesh_block_combine(0, A->D, NULL);
  A->rows.from_x = A->rows.from_v = A->rows.identity = 0;
  return FLESH_OK;
}

/* Whether B can be added to A or copied into it. */
static int are_alike(SUNMatrix A, SUNMatrix B)
{
  const flesh_pair_matrix *a = flesh_pair_matrix_of(A), *b = flesh_pair_matrix_of(B);
  if (a && b && a->ida == b->ida && a->rhs == b->rhs) return 1;
  flesh_fail(FLESH_ERR_ARGUMENT, "the two matrices are not of one problem");
  return 0;
}

/* Computes A = c A + B. */
static int matrix_scale_add(sunrealtype c, SUNMatrix A, SUNMatrix B)
{
  if (!are_alike(A, B)) return FLESH_ERR_ARGUMENT;
  flesh_pair_matrix *a = open_matrix(A), *b = open_matrix(B);
  flesh_block_combine(c, a->K, b->K);
  flesh_block_combine(c, a->D, b->D);
  a->rows.from_x = c * a->rows.from_x + b->rows.from_x;
  a->rows.from_v = c * a->rows.from_v + b->rows.from_v;
  a->rows.identity = c * a->rows.identity + b->rows.identity;
  return close_matrix(a);
}

static int matrix_copy(SUNMatrix A, SUNMatrix B)
{
  return A == B ? FLESH_OK : matrix_scale_add(0, B, A);
}

/* Computes A = c A + I. */
static int matrix_scale_add_identity(sunrealtype c, SUNMatrix matrix)
{
  flesh_pair_matrix *A = open_matrix(matrix);
  flesh_block_combine(c, A->K, NULL);
  flesh_block_combine(c, A->D, A->rhs ? A->rhs->motion->jacobian.D : NULL); /* division by the mass makes it 1 */
  if (A->ida) /* the owner of a node that several ranks have adds it */
    for (int i = 0; i < A->ida->evaluation.own / 3; i++)
      for (int k = 0; k < 3; k++) A->D->values[9 * (size_t)A->D->row_start[i] + 4 * k] += 1;
  flesh_block_fix(A->D, fixed_of(A), 0, NULL);
  A->rows.from_x = c * A->rows.from_x + 1;
  A->rows.from_v *= c;
  A->rows.identity = c * A->rows.identity + 1;
  return close_matrix(A);
}

/* Computes z = A x where K is split from D; x is consistent, and z is set at own nodes (base/team.h). */
static int multiply(const flesh_pair_matrix *A, const double *x, double *z)
{
  const int n = dofs(A);
  const uint8_t *fixed = fixed_of(A);
  const double *v = x + n;
  double *movable = A->ida ? A->ida->solver.work : A->rhs->room, *part = A->ida ? movable + 2 * n : A->rhs->rate + n;
  double *sum = A->ida ? A->ida->solver.right : A->rhs->rate;
  for (int d = 0; d < 2 * n; d++) movable[d] = fixed[d % n] ? 0 : x[d];
  const flesh_block_term terms[] = {{1, A->K, movable}, {1, A->D, movable + n}};
  flesh_block_sum_of_team(motion_of(A)->evaluation.team, 2, terms, part, sum);
  for (int d = 0; d < n; d++)
    if (fixed[d]) sum[d] = 0;
  int status = FLESH_OK;
  if (A->rhs) {
    status = flesh_ode_divide_by_mass(A->rhs, sum, part);
    sum = part;
  }
  for (int d = 0; d < n; d++) {
    const double position = x[d], velocity = v[d];
    z[d] = fixed[d] ? A->rows.identity * position : A->rows.from_x * position + A->rows.from_v * velocity;
    z[n + d] = fixed[d] ? A->rows.identity * velocity : sum[d];
  }
  return status;
}

static int matrix_times(SUNMatrix matrix, N_Vector x, N_Vector z)
{
  flesh_pair_matrix *A = matrix->content;
  const flesh_ida_problem *motion = motion_of(A);
  const double *values = flesh_ida_read(motion, x, 0, 0);
  double *product = values ? flesh_ida_open(motion, z, 1) : NULL;
  int status = FLESH_OK;
  if (!product) return FLESH_ERR_ARGUMENT;
  if (!A->view || A->ida->jacobian.content == FLESH_IDA_APART) status = multiply(open_matrix(matrix), values, product);
  else if (A->ida->jacobian.content == FLESH_IDA_CONDENSED) flesh_ida_multiply(A->ida, values, product);
  else memset(product, 0, 2 * (size_t)dofs(A) * sizeof *product);
  flesh_ida_close(motion, z, product);
  return status;
}

static int matrix_space(SUNMatrix matrix, long *reals, long *integers)
{
  const flesh_pair_matrix *A = matrix->content;
  *reals = 2 * 9 * (long)A->K->row_start[A->K->rows] + 3;
  *integers = A->K->row_start[A->K->rows] + A->K->rows + 1; /* the pattern, which is the system's */
  return FLESH_OK;
}

static void matrix_destroy(SUNMatrix matrix)
{
  flesh_pair_matrix *A = matrix->content;
  if (A && !A->view) {
    flesh_block_matrix_destroy(&A->K);
    flesh_block_matrix_destroy(&A->D);
  }
  flesh_sunmatrix_discard(&matrix);
}

static SUNMatrix matrix_clone(SUNMatrix matrix);

static const flesh_sunmatrix_operations operations = {
    .getid = flesh_sunmatrix_id, .clone = matrix_clone, .destroy = matrix_destroy, .zero = matrix_zero,
    .copy = matrix_copy, .scaleadd = matrix_scale_add, .scaleaddi = matrix_scale_add_identity,
    .matvec = matrix_times, .space = matrix_space};

static int make(flesh_ida_problem *ida, flesh_ode_problem *rhs, int view, SUNContext context, SUNMatrix *matrix)
{
  int status = flesh_sunmatrix_make(&operations, sizeof(flesh_pair_matrix), context, matrix);
  if (status) return status;
  const flesh_system *system = (ida ? ida : rhs->motion)->evaluation.system;
  flesh_pair_matrix *A = (*matrix)->content;
  *A = (flesh_pair_matrix){.ida = ida, .rhs = rhs, .view = view};
  if (view) {
    A->K = ida->jacobian.K, A->D = ida->jacobian.D;
    return FLESH_OK;
  }
  status = flesh_system_matrix_create(system, &A->K);
  if (!status) status = flesh_system_matrix_create(system, &A->D);
  if (status) {
    matrix_destroy(*matrix);
    *matrix = NULL;
  }
  return status;
}

static SUNMatrix matrix_clone(SUNMatrix matrix)
{
  const flesh_pair_matrix *A = matrix->content;
  SUNMatrix made = NULL;
  make(A->ida, A->rhs, 0, matrix->sunctx, &made);
  return made;
}

int flesh_pair_matrix_create(flesh_ida_problem *ida, flesh_ode_problem *rhs, SUNContext context, SUNMatrix *matrix)
{
  return make(ida, rhs, ida != NULL, context, matrix);
}

flesh_pair_matrix *flesh_pair_matrix_of(SUNMatrix A)
{
  return A && A->ops->destroy == matrix_destroy ? A->content : NULL;
}
