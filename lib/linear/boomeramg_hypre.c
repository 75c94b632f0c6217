/* boomeramg_hypre.c: the matrix as hypre takes it, with rows of x, y and z of every node that the rank owns, and cycles.
 * HYPRE.h brings mpi.h. */
#include <HYPRE.h>
#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_ls.h>
#include <limits.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "linear/boomeramg.h"

/* The options that took the least time of all that were tried (README.md). */
const flesh_boomeramg_options flesh_boomeramg_defaults = {
    .strength = 0.5, .coarsening = 10, .interpolation = 6, .longest = 4, .smoother = 13, .aggressive = 1};

struct flesh_boomeramg {
  flesh_boomeramg_options options;
  const flesh_team *team;
  MPI_Comm comm;
  int rows, own;
  HYPRE_BigInt first;   /* of the rank's unknowns */
  HYPRE_BigInt *number; /* [rows] of a node, in the body, by ranks */
  HYPRE_BigInt *index;  /* [3*own] of the rank's unknowns */
  double *vector;       /* [3*rows] */
  HYPRE_IJMatrix A;
  HYPRE_IJVector r, z, rotations[3];
  HYPRE_ParVector modes[3]; /* of the rotations; hypre keeps the address */
  HYPRE_Solver solver;
  double entries; /* of A */
};

/* Blocks (i, j) of a node's row in the whole matrix; those below the diagonal are transposed ones of the triangle. */
typedef struct full_rows {
  int *start, *column, *block; /* [rows+1], [blocks] each; ~block: transposed */
} full_rows;

static void clear_full(full_rows *full)
{
  flesh_free(full->start);
  flesh_free(full->column);
  flesh_free(full->block);
}

static int make_full(const flesh_block_matrix *A, full_rows *full)
{
  const size_t rows = (size_t)A->rows, blocks = (size_t)A->row_start[A->rows];
  full->start = flesh_calloc(rows + 2, sizeof *full->start);
  full->column = flesh_malloc((2 * blocks + 1) * sizeof *full->column);
  full->block = flesh_malloc((2 * blocks + 1) * sizeof *full->block);
  if (!full->start || !full->column || !full->block) return FLESH_ERR_MEMORY;
  int *next = full->start + 1; /* begins as where a row begins, ends as where it ends */
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      if (i + 1 < A->rows) next[i + 1]++;
      if (A->column[k] != i && A->column[k] + 1 < A->rows) next[A->column[k] + 1]++;
    }
  for (int i = 1; i < A->rows; i++) next[i] += next[i - 1];
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_end[i]; k++) {
      const int j = A->column[k];
      full->column[next[i]] = j;
      full->block[next[i]++] = k;
      if (j == i) continue;
      full->column[next[j]] = i;
      full->block[next[j]++] = ~k;
    }
  return FLESH_OK;
}

/* Adds the three rows of a node, of room for `most` blocks. */
static void add_rows(flesh_boomeramg *self, const flesh_block_matrix *A, double scale, const full_rows *full, int node,
                     HYPRE_BigInt *columns, double *values)
{
  const int count = full->start[node + 1] - full->start[node];
  HYPRE_Int sizes[3] = {3 * count, 3 * count, 3 * count};
  HYPRE_BigInt rows[3];
  for (int r = 0; r < 3; r++) {
    rows[r] = 3 * self->number[node] + r;
    for (int k = 0; k < count; k++) {
      const int at = full->start[node] + k, block = full->block[at], flipped = block < 0;
      const double *entries = A->values + 9 * (size_t)(flipped ? ~block : block);
      for (int c = 0; c < 3; c++) {
        const size_t to = (size_t)(3 * count * r + 3 * k + c);
        columns[to] = 3 * self->number[full->column[at]] + c;
        values[to] = scale * entries[flipped ? 3 * c + r : 3 * r + c];
      }
    }
  }
  HYPRE_IJMatrixAddToValues(self->A, 3, sizes, rows, columns, values);
}

static int fill(flesh_boomeramg *self, const flesh_block_matrix *A, double scale)
{
  full_rows full = {0};
  int status = make_full(A, &full), most = 0;
  for (int i = 0; !status && i < A->rows; i++)
    if (full.start[i + 1] - full.start[i] > most) most = full.start[i + 1] - full.start[i];
  HYPRE_BigInt *columns = flesh_malloc((9 * (size_t)most + 1) * sizeof *columns);
  double *values = flesh_malloc((9 * (size_t)most + 1) * sizeof *values);
  HYPRE_Int *sizes = flesh_malloc((3 * (size_t)self->own + 1) * sizeof *sizes);
  if (!columns || !values || !sizes) status = FLESH_ERR_MEMORY;
  status = flesh_team_agree(self->team, status);
  if (!status) {
    HYPRE_IJMatrixCreate(self->comm, self->first, self->first + 3 * self->own - 1, self->first,
                         self->first + 3 * self->own - 1, &self->A);
    HYPRE_IJMatrixSetObjectType(self->A, HYPRE_PARCSR);
    for (int d = 0; d < 3 * self->own; d++) sizes[d] = 3 * (full.start[d / 3 + 1] - full.start[d / 3]);
    HYPRE_IJMatrixSetRowSizes(self->A, sizes);
    HYPRE_IJMatrixInitialize(self->A);
    for (int i = 0; i < A->rows; i++) add_rows(self, A, scale, &full, i, columns, values);
    HYPRE_IJMatrixAssemble(self->A);
    self->entries = 9. * full.start[A->rows];
  }
  clear_full(&full);
  flesh_free(columns);
  flesh_free(values);
  flesh_free(sizes);
  return status;
}

static HYPRE_IJVector make_vector(const flesh_boomeramg *self)
{
  HYPRE_IJVector vector = NULL;
  HYPRE_IJVectorCreate(self->comm, self->first, self->first + 3 * self->own - 1, &vector);
  HYPRE_IJVectorSetObjectType(vector, HYPRE_PARCSR);
  HYPRE_IJVectorInitialize(vector);
  HYPRE_IJVectorAssemble(vector);
  return vector;
}

static void *object(HYPRE_IJVector vector)
{
  void *of = NULL;
  HYPRE_IJVectorGetObject(vector, &of);
  return of;
}

/* Infinitesimal rotations about the axes. */
static void set_rotations(flesh_boomeramg *self, const double *positions)
{
  for (int axis = 0; axis < 3; axis++) {
    const int y = (axis + 1) % 3, z = (axis + 2) % 3;
    for (int i = 0; i < self->own; i++) {
      const double *X = positions + 3 * (size_t)i;
      self->vector[3 * i + axis] = 0;
      self->vector[3 * i + y] = -X[z];
      self->vector[3 * i + z] = X[y];
    }
    self->rotations[axis] = make_vector(self);
    HYPRE_IJVectorSetValues(self->rotations[axis], 3 * self->own, self->index, self->vector);
    self->modes[axis] = object(self->rotations[axis]);
  }
}

/* l1-Gauss-Seidel on the way down, and the other way round on the way up. */
enum { FORWARD = 13, BACKWARD = 14 };

static void configure(flesh_boomeramg *self)
{
  const flesh_boomeramg_options *o = &self->options;
  HYPRE_Solver s = NULL;
  HYPRE_BoomerAMGCreate(&s);
  self->solver = s;
  HYPRE_BoomerAMGSetMaxIter(s, 1);
  HYPRE_BoomerAMGSetTol(s, 0);
  HYPRE_BoomerAMGSetPrintLevel(s, 0);
  HYPRE_BoomerAMGSetNumFunctions(s, 3);
  HYPRE_BoomerAMGSetStrongThreshold(s, o->strength);
  HYPRE_BoomerAMGSetCoarsenType(s, o->coarsening);
  HYPRE_BoomerAMGSetInterpType(s, o->interpolation);
  HYPRE_BoomerAMGSetPMaxElmts(s, o->longest);
  if (o->smoother == FORWARD) {
    HYPRE_BoomerAMGSetCycleRelaxType(s, FORWARD, 1);
    HYPRE_BoomerAMGSetCycleRelaxType(s, BACKWARD, 2);
  } else {
    HYPRE_BoomerAMGSetRelaxType(s, o->smoother);
  }
  HYPRE_BoomerAMGSetRelaxOrder(s, 0);
  HYPRE_BoomerAMGSetAggNumLevels(s, o->aggressive);
  if (o->nodal) HYPRE_BoomerAMGSetNodal(s, o->nodal);
  if (o->nodal) HYPRE_BoomerAMGSetNodalDiag(s, 1);
  if (!o->rotations) return;
  HYPRE_BoomerAMGSetCycleRelaxType(s, o->smoother, 3);
  HYPRE_BoomerAMGSetInterpVecVariant(s, o->rotations);
  HYPRE_BoomerAMGSetInterpVecQMax(s, o->longest_rotation);
  HYPRE_BoomerAMGSetInterpVectors(s, 3, self->modes);
}

int flesh_boomeramg_create(const flesh_boomeramg_options *options, int rows, const double *positions,
                           const flesh_team *team, flesh_boomeramg **boomeramg)
{
  int begun = 0, status = FLESH_OK;
  flesh_boomeramg *self = *boomeramg = flesh_calloc(1, sizeof *self);
  MPI_Initialized(&begun);
  if (!begun) {
    flesh_boomeramg_destroy(boomeramg);
    return flesh_fail(FLESH_ERR_ARGUMENT, "the preconditioner boomeramg needs MPI: call MPI_Init before");
  }
  const size_t own = (size_t)flesh_team_own(team, rows);
  const double all = 3 * flesh_team_all(team, rows);
  if (self) {
    *self = (flesh_boomeramg){.options = *options, .team = team, .rows = rows, .own = (int)own,
                              .comm = team && team->comm ? *(const MPI_Comm *)team->comm : MPI_COMM_SELF};
    self->number = flesh_malloc(((size_t)rows + 1) * sizeof *self->number);
    self->index = flesh_malloc((3 * own + 1) * sizeof *self->index);
    self->vector = flesh_calloc(3 * (size_t)rows + 1, sizeof *self->vector);
  }
  if (!self || !self->number || !self->index || !self->vector)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for boomeramg of %d nodes", rows);
  else if (all > INT_MAX)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "boomeramg takes %d unknowns at most, and the body has %.0f", INT_MAX, all);
  status = flesh_team_agree(team, status);
  if (status) {
    flesh_boomeramg_destroy(boomeramg);
    return status;
  }
  HYPRE_Init();
  int before = 0, count = (int)own;
  MPI_Exscan(&count, &before, 1, MPI_INT, MPI_SUM, self->comm);
  self->first = 3 * before;
  for (int i = 0; i < rows; i++) self->vector[i] = before + i;
  flesh_team_share_nodes(team, 1, self->vector);
  for (int i = 0; i < rows; i++) self->number[i] = (HYPRE_BigInt)self->vector[i];
  for (size_t d = 0; d < 3 * own; d++) self->index[d] = self->first + (HYPRE_BigInt)d;
  self->r = make_vector(self);
  self->z = make_vector(self);
  if (options->rotations) set_rotations(self, positions);
  return FLESH_OK;
}

static void forget(flesh_boomeramg *self)
{
  if (self->solver) HYPRE_BoomerAMGDestroy(self->solver);
  if (self->A) HYPRE_IJMatrixDestroy(self->A);
  self->solver = NULL;
  self->A = NULL;
}

void flesh_boomeramg_destroy(flesh_boomeramg **boomeramg)
{
  if (!boomeramg || !*boomeramg) return;
  flesh_boomeramg *self = *boomeramg;
  HYPRE_IJVector vectors[] = {self->r, self->z, self->rotations[0], self->rotations[1], self->rotations[2]};
  forget(self);
  for (int k = 0; k < 5; k++)
    if (vectors[k]) HYPRE_IJVectorDestroy(vectors[k]);
  flesh_free(self->number);
  flesh_free(self->index);
  flesh_free(self->vector);
  flesh_free(self);
  *boomeramg = NULL;
}

/* hypre's word on what failed, on any rank. */
static int status_of(const flesh_boomeramg *self)
{
  char text[256] = "";
  const HYPRE_Int error = HYPRE_GetError();
  if (error) HYPRE_DescribeError(error, text);
  HYPRE_ClearAllErrors();
  return flesh_team_agree(self->team, !error ? FLESH_OK
                                             : flesh_fail(FLESH_ERR_SOLVE, "boomeramg cannot be set up for %d nodes: %s",
                                                          self->own, text));
}

int flesh_boomeramg_setup(flesh_boomeramg *self, const flesh_block_matrix *A, double scale)
{
  void *matrix = NULL;
  forget(self);
  HYPRE_ClearAllErrors();
  const int status = fill(self, A, scale);
  if (status) return flesh_fail(status, "no memory for boomeramg's matrix of %d nodes", self->own);
  configure(self);
  HYPRE_IJMatrixGetObject(self->A, &matrix);
  HYPRE_BoomerAMGSetup(self->solver, matrix, object(self->r), object(self->z));
  return status_of(self);
}

void flesh_boomeramg_solve(flesh_boomeramg *self, const int *order, const float *r, float *z)
{
  void *matrix = NULL;
  double *vector = self->vector;
  for (int p = 0; p < self->rows; p++)
    for (int c = 0; c < 3 && order[p] < self->own; c++) vector[3 * order[p] + c] = r[4 * p + c];
  HYPRE_IJMatrixGetObject(self->A, &matrix);
  HYPRE_IJVectorSetValues(self->r, 3 * self->own, self->index, vector);
  memset(vector, 0, 3 * (size_t)self->rows * sizeof *vector);
  HYPRE_IJVectorSetValues(self->z, 3 * self->own, self->index, vector);
  HYPRE_BoomerAMGSolve(self->solver, matrix, object(self->r), object(self->z));
  HYPRE_ClearAllErrors(); /* that one cycle did not converge */
  HYPRE_IJVectorGetValues(self->z, 3 * self->own, self->index, vector);
  for (int p = 0; p < self->rows; p++)
    for (int c = 0; c < 3; c++) z[4 * p + c] = order[p] < self->own ? (float)vector[3 * order[p] + c] : 0;
}

size_t flesh_boomeramg_memory(const flesh_boomeramg *self)
{
  return sizeof *self + (size_t)self->rows * (sizeof *self->number + 3 * sizeof(double)) +
         (size_t)self->own * 3 * (sizeof *self->index + 2 * sizeof(double)) +
         (size_t)(self->entries * (sizeof(double) + sizeof(HYPRE_Int)));
}
