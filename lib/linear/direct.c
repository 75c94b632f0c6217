/* direct.c: KLU and, where built in, CHOLMOD on the full scalar matrix. */
#include "linear/direct.h"

#include <klu.h>
#include <string.h>
#ifdef FLESH_HAVE_CHOLMOD
#include <cholmod.h>
#endif

#include "base/error.h"
#include "base/memory.h"
#include "linear/scalar_view.h"

struct flesh_direct {
  flesh_linear_solver kind;
  flesh_scalar_view view;
  double *values; /* [entries] factored last */
  int factored;   /* 1: `values` have been factored */
  double *first;  /* [entries], KLU: the values for which the present pivots were chosen */
  int refactored; /* 1: `values` were factored with these pivots since */
  klu_l_common klu;
  klu_l_symbolic *symbolic;
  klu_l_numeric *numeric;
#ifdef FLESH_HAVE_CHOLMOD
  cholmod_common cholmod;
  cholmod_factor *factor;
#endif
};

#ifdef FLESH_HAVE_CHOLMOD
/* Views the full matrix as its upper triangle for CHOLMOD. */
static cholmod_sparse cholmod_view(flesh_direct *self)
{
  return (cholmod_sparse){.nrow = (size_t)self->view.n, .ncol = (size_t)self->view.n,
                          .nzmax = (size_t)self->view.entries, .p = self->view.starts,
                          .i = self->view.indices, .x = self->values, .stype = 1,
                          .itype = CHOLMOD_LONG, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE,
                          .sorted = 1, .packed = 1};
}
#endif

int flesh_direct_create(flesh_linear_solver kind, const flesh_block_matrix *A, flesh_direct **direct)
{
  *direct = NULL;
#ifndef FLESH_HAVE_CHOLMOD
  if (kind == FLESH_LINEAR_CHOLMOD)
    return flesh_fail(
        FLESH_ERR_ARGUMENT,
        "linear_solver is cholmod, which this build lacks; use pcg or klu, or build with "
        "-Dcholmod=enabled");
#endif
  flesh_direct *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a direct solver");
  self->kind = kind;
  klu_l_defaults(&self->klu);
#ifdef FLESH_HAVE_CHOLMOD
  cholmod_l_start(&self->cholmod);
  self->cholmod.print = 0;
#endif
  int status = flesh_scalar_view_create(A, &self->view);
  if (!status) {
    self->values = flesh_malloc((size_t)self->view.entries * sizeof *self->values);
    if (kind == FLESH_LINEAR_KLU) self->first = flesh_malloc((size_t)self->view.entries * sizeof *self->first);
    if (!self->values || (kind == FLESH_LINEAR_KLU && !self->first)) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a direct solver");
  }
  if (!status && kind == FLESH_LINEAR_KLU) {
    self->symbolic = klu_l_analyze(self->view.n, self->view.starts, self->view.indices, &self->klu);
    if (!self->symbolic) status = flesh_fail(FLESH_ERR_MEMORY, "KLU could not analyse the matrix");
  }
#ifdef FLESH_HAVE_CHOLMOD
  if (!status && kind == FLESH_LINEAR_CHOLMOD) {
    cholmod_sparse view = cholmod_view(self);
    self->factor = cholmod_l_analyze(&view, &self->cholmod);
    if (!self->factor)
      status = flesh_fail(FLESH_ERR_MEMORY, "CHOLMOD could not analyse the matrix");
  }
#endif
  if (status) {
    flesh_direct_destroy(&self);
    return status;
  }
  *direct = self;
  return FLESH_OK;
}

void flesh_direct_destroy(flesh_direct **direct)
{
  if (!direct || !*direct) return;
  flesh_direct *self = *direct;
  if (self->numeric) klu_l_free_numeric(&self->numeric, &self->klu);
  if (self->symbolic) klu_l_free_symbolic(&self->symbolic, &self->klu);
#ifdef FLESH_HAVE_CHOLMOD
  if (self->factor) cholmod_l_free_factor(&self->factor, &self->cholmod);
  cholmod_l_finish(&self->cholmod);
#endif
  flesh_scalar_view_clear(&self->view);
  flesh_free(self->values);
  flesh_free(self->first);
  flesh_free(self);
  *direct = NULL;
}

double flesh_direct_operations(const flesh_direct *direct)
{
  return direct->symbolic->est_flops;
}

/* Factors the values with the pivots of the present factor; returns 0 where that is not possible. */
static int refactor(flesh_direct *self)
{
  return self->refactored = klu_l_refactor(self->view.starts, self->view.indices, self->values, self->symbolic,
                                           self->numeric, &self->klu);
}

/* Factors the values with new pivots. */
static void factor_anew(flesh_direct *self)
{
  if (self->numeric) klu_l_free_numeric(&self->numeric, &self->klu);
  self->refactored = 0;
  memcpy(self->first, self->values, (size_t)self->view.entries * sizeof *self->first);
  self->numeric = klu_l_factor(self->view.starts, self->view.indices, self->values, self->symbolic, &self->klu);
}

static int factor_by_klu(flesh_direct *self)
{
  /* Pivots of the last factorisation are kept as long as they are usable. */
  if (self->numeric && refactor(self) && klu_l_rcond(self->symbolic, self->numeric, &self->klu) && self->klu.rcond > 1e-14)
    return FLESH_OK;
  factor_anew(self);
  if (!self->numeric)
    return self->klu.status == KLU_SINGULAR
               ? FLESH_NOT_POSITIVE
               : flesh_fail(FLESH_ERR_MEMORY, "KLU ran out of memory on %lld unknowns",
                            (long long)self->view.n);
  return FLESH_OK;
}

int flesh_direct_factor(flesh_direct *self, const flesh_block_matrix *A)
{
  flesh_scalar_view_fill(&self->view, A, self->values);
  self->factored = 1;
  if (self->kind == FLESH_LINEAR_KLU) return factor_by_klu(self);
#ifdef FLESH_HAVE_CHOLMOD
  cholmod_sparse view = cholmod_view(self);
  if (!cholmod_l_factorize(&view, self->factor, &self->cholmod))
    return flesh_fail(FLESH_ERR_MEMORY, "CHOLMOD ran out of memory on %lld unknowns",
                      (long long)self->view.n);
  if (self->cholmod.status == CHOLMOD_NOT_POSDEF) return FLESH_NOT_POSITIVE;
#endif
  return FLESH_OK;
}

int flesh_direct_solve(flesh_direct *self, const double *b, double *x)
{
  if (self->kind == FLESH_LINEAR_KLU) {
    memcpy(x, b, (size_t)self->view.n * sizeof *x);
    return klu_l_solve(self->symbolic, self->numeric, self->view.n, 1, x, &self->klu)
               ? FLESH_OK
               : flesh_fail(FLESH_ERR_MEMORY, "KLU could not solve");
  }
#ifdef FLESH_HAVE_CHOLMOD
  cholmod_dense right = {.nrow = (size_t)self->view.n, .ncol = 1, .nzmax = (size_t)self->view.n,
                         .d = (size_t)self->view.n, .x = (void *)b, .xtype = CHOLMOD_REAL,
                         .dtype = CHOLMOD_DOUBLE};
  cholmod_dense *solution = cholmod_l_solve(CHOLMOD_A, self->factor, &right, &self->cholmod);
  if (!solution) return flesh_fail(FLESH_ERR_MEMORY, "CHOLMOD could not solve");
  memcpy(x, solution->x, (size_t)self->view.n * sizeof *x);
  cholmod_l_free_dense(&solution, &self->cholmod);
#endif
  return FLESH_OK;
}

/* Factors the loaded values: the first matrix with new pivots, then the last one with these. */
static int factor_loaded(flesh_direct *self, double *last)
{
#ifdef FLESH_HAVE_CHOLMOD
  cholmod_sparse view = cholmod_view(self);
  if (self->kind == FLESH_LINEAR_CHOLMOD)
    return cholmod_l_factorize(&view, self->factor, &self->cholmod)
               ? FLESH_OK
               : flesh_fail(FLESH_ERR_MEMORY, "CHOLMOD ran out of memory on %lld unknowns", (long long)self->view.n);
#endif
  const size_t bytes = (size_t)self->view.entries * sizeof *last;
  const int again = self->refactored;
  memcpy(last, self->values, bytes);
  memcpy(self->values, self->first, bytes);
  factor_anew(self);
  memcpy(self->values, last, bytes);
  if (self->numeric && again) refactor(self);
  return self->numeric || self->klu.status == KLU_SINGULAR
             ? FLESH_OK
             : flesh_fail(FLESH_ERR_MEMORY, "KLU ran out of memory on %lld unknowns", (long long)self->view.n);
}

void flesh_direct_forget(flesh_direct *self)
{
  self->factored = self->refactored = 0;
  if (self->numeric) klu_l_free_numeric(&self->numeric, &self->klu);
}

int flesh_direct_archive(flesh_direct *self, flesh_archive *archive)
{
  const size_t bytes = (size_t)self->view.entries * sizeof *self->values;
  const int by_klu = self->kind == FLESH_LINEAR_KLU;
  int has_factor = by_klu ? self->numeric != NULL : self->factored;
  flesh_archive_int(archive, &has_factor, 0, 1);
  flesh_archive_int(archive, &self->refactored, 0, 1);
  if (has_factor) flesh_archive_bytes(archive, self->values, bytes);
  if (has_factor && by_klu) flesh_archive_bytes(archive, self->first, bytes);
  if (archive->mode != FLESH_ARCHIVE_LOAD || archive->wrong) return FLESH_OK;
  self->factored = has_factor;
  if (self->numeric) klu_l_free_numeric(&self->numeric, &self->klu);
  if (!has_factor) return FLESH_OK;
  double *last = flesh_malloc(bytes);
  int status = last ? factor_loaded(self, last) : flesh_fail(FLESH_ERR_MEMORY, "no memory for a direct solver");
  flesh_free(last);
  return status;
}
