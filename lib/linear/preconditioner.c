/* preconditioner.c: makes block Jacobi, incomplete block Cholesky with the shift that it needs, and a coarse level. */
#include "linear/preconditioner.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/huge_pages.h"
#include "base/memory.h"
#include "linear/block_matrix.h"
#include "linear/diagonal_blocks.h"
#include "linear/preconditioner_data.h"

/* Makes the factor of the overlap, which has an order of its own. `own`: nodes per vertex of the rank's own level, 0: there
 * is none. `positions` NULL: there is no coarse level at all. */
static int create_wide(flesh_preconditioner_data *self, const double *positions, double own)
{
  const flesh_block_matrix *A = &self->overlap.matrix;
  const size_t rows = (size_t)A->rows;
  flesh_bisection bisection = {0};
  int status = flesh_bisection_create(A, self->overlap.team->numbers, &bisection);
  self->overlap_order = flesh_malloc((rows + 1) * sizeof *self->overlap_order);
  self->wide = flesh_calloc(4 * rows + 1, sizeof *self->wide);
  if (!status && (!self->overlap_order || !self->wide))
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the preconditioner of %d nodes", A->rows);
  if (!status) memcpy(self->overlap_order, bisection.order, rows * sizeof *self->overlap_order);
  if (!status) status = flesh_overlap_set_orders(&self->overlap, self->order, self->overlap_order);
  if (!status) status = flesh_cholesky_create(A, &bisection, !positions, self->threads, &self->cholesky);
  if (!status && positions && own > 0)
    status = flesh_local_level_create(&self->overlap, (int)((double)rows / own), &bisection, self->threads, &self->local);
  flesh_bisection_clear(&bisection);
  return status;
}

static size_t room_for(const flesh_preconditioner_data *self)
{
  return FLESH_PRECONDITIONER_SUMS + 3 * (self->coarse ? (size_t)flesh_coarse_unknowns(self->coarse) : 0);
}

static int allocate_room(flesh_preconditioner_data *self)
{
  self->room = flesh_calloc(room_for(self), sizeof *self->room);
  return self->room ? FLESH_OK
                    : flesh_fail(FLESH_ERR_MEMORY, "no memory for the preconditioner of %d nodes", self->rows);
}

int flesh_preconditioner_create(flesh_preconditioner kind, const flesh_block_matrix *A,
                                const double *positions, int order, flesh_threads *threads,
                                flesh_preconditioner_data **preconditioner)
{
  kind = flesh_preconditioner_choose(kind, flesh_team_all(flesh_threads_team(threads), A->rows), order);
  return flesh_preconditioner_create_levels(kind, A, positions, NULL, threads, preconditioner);
}

/* Makes the rank's own parts, and the team for solves with A, on all ranks or none. */
static int create_here(flesh_preconditioner kind, const flesh_block_matrix *A, flesh_threads *threads,
                       flesh_bisection *bisection, flesh_preconditioner_data **preconditioner)
{
  const flesh_team *team = flesh_threads_team(threads);
  const size_t rows = (size_t)A->rows;
  flesh_preconditioner_data *self = *preconditioner = flesh_calloc(1, sizeof *self);
  uint8_t *needed = flesh_calloc(rows + 1, sizeof *needed);
  int status = flesh_bisection_create(A, NULL, bisection), failed = !self || !needed;
  if (self) {
    self->kind = kind;
    self->rows = A->rows;
    self->threads = threads;
    self->scale = 1;
    self->less = 0.5;
    failed |= !(self->order = flesh_malloc((rows + 1) * sizeof *self->order));
    failed |= !(self->r = flesh_huge_pages_calloc((4 * rows + 1) * sizeof *self->r));
    failed |= !(self->z = flesh_huge_pages_calloc((4 * rows + 1) * sizeof *self->z));
    if (kind != FLESH_PRECONDITIONER_NONE)
      failed |= !(self->inverse = flesh_calloc(9 * rows + 1, sizeof *self->inverse));
  }
  if (failed) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the preconditioner of %d nodes", A->rows);
  if (!status) memcpy(self->order, bisection->order, rows * sizeof *self->order);
  const flesh_team *narrow;
  status = flesh_overlap_narrow(A, team, status, needed, &narrow);
  if (self) self->team = self->overlap.team = status ? NULL : narrow;
  flesh_free(needed);
  return status;
}

int flesh_preconditioner_create_levels(flesh_preconditioner kind, const flesh_block_matrix *A,
                                       const double *positions, const flesh_levels *asked, flesh_threads *threads,
                                       flesh_preconditioner_data **preconditioner)
{
  const flesh_team *team = flesh_threads_team(threads);
  flesh_bisection bisection = {0};
  int status = create_here(kind, A, threads, &bisection, preconditioner);
  flesh_preconditioner_data *self = *preconditioner;
  if (status) {
    flesh_bisection_clear(&bisection);
    flesh_preconditioner_destroy(preconditioner);
    return status;
  }
  const int coarse = kind == FLESH_PRECONDITIONER_TWO_LEVEL && positions && A->rows > 1;
  flesh_levels levels = {0};
  if (coarse)
    levels = asked ? *asked
                   : flesh_levels_for(flesh_team_all(team, A->rows), flesh_team_total(team, A->row_start[A->rows]),
                                      team ? team->ranks : 1);
  status = flesh_overlap_create(A, self->team, coarse && levels.own > 0 ? positions : NULL, &self->overlap);
  if (!status && (kind == FLESH_PRECONDITIONER_IC || kind == FLESH_PRECONDITIONER_TWO_LEVEL))
    status = team ? create_wide(self, coarse ? positions : NULL, levels.own)
                  : flesh_cholesky_create(A, &bisection, !coarse, threads, &self->cholesky);
  status = flesh_team_agree(team, status);
  if (!status && coarse)
    status = flesh_coarse_create(A, positions, levels.shared, &bisection, threads, team, &self->coarse);
  flesh_bisection_clear(&bisection);
  if (team) status = flesh_team_agree(team, status ? status : allocate_room(self));
  if (status) flesh_preconditioner_destroy(preconditioner);
  return status;
}

int flesh_preconditioner_project(flesh_preconditioner_data *self, const flesh_block_matrix *A,
                                 const flesh_stiff_rows *rows, const double *positions, int polynomial)
{
  self->stiff = rows;
  const int status = flesh_volume_projection_create(A, rows, positions, polynomial, &self->overlap, self->threads,
                                                    &self->projection);
  if (status || !self->overlap.team) return status;
  self->blocks = flesh_malloc((9 * (size_t)self->rows + 1) * sizeof *self->blocks);
  return self->blocks ? FLESH_OK
                      : flesh_fail(FLESH_ERR_MEMORY, "no memory for the volume projection of %d elements", rows->count);
}

void flesh_preconditioner_destroy(flesh_preconditioner_data **preconditioner)
{
  if (!preconditioner || !*preconditioner) return;
  flesh_overlap_clear(&(*preconditioner)->overlap);
  flesh_team_narrow_end(&(*preconditioner)->team);
  flesh_free((*preconditioner)->overlap_order);
  flesh_free((*preconditioner)->wide);
  flesh_free((*preconditioner)->room);
  flesh_free((*preconditioner)->blocks);
  flesh_free((*preconditioner)->inverse);
  flesh_free((*preconditioner)->order);
  flesh_free((*preconditioner)->r);
  flesh_free((*preconditioner)->z);
  flesh_cholesky_destroy(&(*preconditioner)->cholesky);
  flesh_coarse_destroy(&(*preconditioner)->coarse);
  flesh_local_level_clear(&(*preconditioner)->local);
  flesh_volume_projection_destroy(&(*preconditioner)->projection);
  flesh_free(*preconditioner);
  *preconditioner = NULL;
}

double flesh_power_to_one(double x) { return x > 0 && x < INFINITY ? ldexp(1, -ilogb(fmax(x, 1e-300))) : 1; }

static void set_jacobi(flesh_preconditioner_data *self, const flesh_block_matrix *A)
{
  self->by_diagonal = 1;
  flesh_diagonal_invert(A, self->rows, self->scale, self->inverse);
}

/* Returns A without its stiff terms, if the projection takes care of them, else A. */
static const flesh_block_matrix *project(flesh_preconditioner_data *self, const flesh_block_matrix *A,
                                         const uint8_t *fixed)
{
  self->projects = 0;
  if (!self->projection || self->stiff->projection_disabled) return A;
  const flesh_block_matrix *soft = flesh_volume_projection_matrix(self->projection, A, fixed);
  if (self->overlap.team) flesh_diagonal_invert_sums(soft, self->overlap.team, self->scale, self->blocks, self->inverse);
  else flesh_diagonal_invert(soft, self->rows, self->scale, self->inverse);
  self->projects = flesh_volume_projection_setup(self->projection, self->scale, self->inverse) == FLESH_OK;
  return self->projects ? soft : A;
}

/* Range of shifts, which are tried one by one, each twice the last. The first is not zero, where zero might do: pivots that
 * are just not negative make a poor preconditioner. */
static const double SMALLEST_SHIFT = 0.004, LARGEST_SHIFT = 1e6;

/* Makes incomplete Cholesky with the shift that it needs; the diagonal blocks if no shift helps. */
static void set_cholesky(flesh_preconditioner_data *self, const flesh_block_matrix *A)
{
  /* The next shift is about the last one. Half of it is tried first, or nine tenths if blocks of nodes that came near each
   * other require new factors again and again, and much less once that has worked. */
  const double first = fmax(self->shift * self->less, SMALLEST_SHIFT);
  double shift = first;
  while (shift <= LARGEST_SHIFT && flesh_cholesky_factor(self->cholesky, A, self->scale, shift))
    shift *= 2;
  self->shift = shift;
  self->less = shift == first ? self->less * self->less : A->own ? 0.9 : 0.5;
  if (shift <= LARGEST_SHIFT) return;
  /* The diagonal is zero or negative somewhere: fall back to the diagonal alone, made positive. */
  self->shift = 0;
  set_jacobi(self, A);
}

/* Uses the coarse level on all ranks or on none; likewise the factor. */
static void choose_levels(flesh_preconditioner_data *self, int coarse)
{
  double without[] = {!coarse, self->by_diagonal};
  flesh_team_largest(self->overlap.team, 2, without);
  self->by_diagonal = without[1] > 0;
  self->two_levels = without[0] + without[1] == 0;
}

int flesh_preconditioner_setup(flesh_preconditioner_data *self, const flesh_block_matrix *A, const uint8_t *fixed)
{
  double largest = flesh_diagonal_largest(A, self->threads);
  flesh_team_largest(self->overlap.team, 1, &largest);
  if (!(largest < INFINITY)) return FLESH_NONFINITE;
  self->by_diagonal = 0;
  self->scale = flesh_power_to_one(largest);
  if (self->kind == FLESH_PRECONDITIONER_NONE) return FLESH_OK;
  A = project(self, A, fixed);
  const int coarse = self->coarse && !flesh_coarse_setup(self->coarse, A, self->scale, fixed);
  const flesh_block_matrix *all = flesh_overlap_update(&self->overlap, A);
  if (self->kind == FLESH_PRECONDITIONER_JACOBI) set_jacobi(self, all);
  else set_cholesky(self, all);
  flesh_local_level_setup(&self->local, &self->overlap, all, self->scale, self->rows, fixed);
  choose_levels(self, coarse);
  if (self->by_diagonal && self->overlap.team) flesh_diagonal_invert(all, self->rows, self->scale, self->inverse);
  return FLESH_OK;
}

void flesh_preconditioner_archive(flesh_preconditioner_data *self, flesh_archive *archive)
{
  if (self->inverse) flesh_archive_bytes(archive, self->inverse, 9 * (size_t)self->rows * sizeof *self->inverse);
  FLESH_ARCHIVE(archive, self->scale);
  FLESH_ARCHIVE(archive, self->shift);
  FLESH_ARCHIVE(archive, self->less);
  FLESH_ARCHIVE(archive, self->by_diagonal);
  flesh_archive_int(archive, &self->two_levels, 0, self->coarse != NULL);
  flesh_archive_int(archive, &self->projects, 0, self->projection != NULL);
  if (self->cholesky) flesh_cholesky_archive(self->cholesky, archive);
  if (self->coarse) flesh_coarse_archive(self->coarse, archive);
  flesh_local_level_archive(&self->local, archive);
  if (self->projection) flesh_volume_projection_archive(self->projection, archive);
}
