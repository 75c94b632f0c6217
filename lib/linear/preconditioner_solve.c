/* preconditioner_solve.c: solves with what preconditioner.c has made, on a single rank or in a team. */
#include "linear/preconditioner_data.h"

#include <string.h>

#include "base/parallel_vector.h"
#include "linear/overlap_vectors.h"
#include "linear/preconditioner.h"

/* Applies the diagonal blocks alone or, for NONE, nothing. */
static double solve_blocks(flesh_preconditioner_data *self, const float *r)
{
  double product = 0;
  for (size_t p = 0; p < (size_t)self->rows; p++) {
    const float *b = self->kind == FLESH_PRECONDITIONER_NONE ? NULL : self->inverse + 9 * (size_t)self->order[p];
    const float *x = r + 4 * p;
    float *z = self->z + 4 * p;
    for (int c = 0; c < 3; c++) {
      z[c] = b ? b[3 * c] * x[0] + b[3 * c + 1] * x[1] + b[3 * c + 2] * x[2] : x[c];
      product += (double)x[c] * (double)z[c];
    }
  }
  return product;
}

static int by_blocks(const flesh_preconditioner_data *self)
{
  return self->by_diagonal || self->kind == FLESH_PRECONDITIONER_NONE;
}

/* Returns r.z for the z in self->z. */
static double product_of(const flesh_preconditioner_data *self, const float *r)
{
  double product = 0;
  for (size_t p = 0; p < (size_t)self->rows; p++)
    for (size_t c = 0; c < 3; c++) product += (double)r[4 * p + c] * (double)self->z[4 * p + c];
  return product;
}

/* Returns the weight of the coarse level's correction. It is larger in a team: each rank's factor ends where the rank does,
 * which leaves more of smooth displacements to the coarse level (lib/parallel/README.md). */
static float share_of(const flesh_team *team) { return team->ranks > 1 ? 1 : FLESH_COARSE_SHARE; }

/* Applies all ranks' factors, each in its rank's overlap, to the residual in `wide`. The coarse level's solve hides the
 * exchange: it is for `scale` times `load`, which the ranks have summed up; with `load` NULL, it comes afterwards and is
 * for r, which it sums up. */
static void solve_in_team(flesh_preconditioner_data *self, const float *r, const double *load, double scale)
{
  flesh_coarse *coarse = self->two_levels ? self->coarse : NULL;
  const flesh_team *team = self->overlap.team;
  flesh_coarse *local = flesh_local_level_coarse(&self->local);
  flesh_cholesky_solve(self->cholesky, local, self->wide);
  flesh_cholesky_result(self->cholesky, NULL, 0, team->overlap, self->wide);
  if (local) flesh_coarse_add(local, 0, team->overlap, share_of(team), self->wide, self->wide);
  flesh_overlap_add_begin(&self->overlap, self->wide);
  if (coarse && load) flesh_coarse_solve_for(coarse, load, scale);
  flesh_overlap_add_end(&self->overlap, self->wide, self->z);
  if (coarse && !load) {
    flesh_coarse_restrict(coarse, 0, 0, self->rows, r);
    flesh_coarse_solve(coarse);
  }
  if (coarse) flesh_coarse_add(coarse, 0, self->rows, share_of(team), self->z, self->z);
}

/* Solves with the matrix, or with that without its stiff terms. */
static double solve_soft(flesh_preconditioner_data *self, const float *r)
{
  if (by_blocks(self)) return solve_blocks(self, r);
  if (!self->overlap.team) return flesh_cholesky_solve(self->cholesky, self->two_levels ? self->coarse : NULL, r);
  flesh_overlap_restrict(&self->overlap, self->order, r, self->overlap_order, self->wide); /* r is zero at ghosts */
  solve_in_team(self, r, NULL, 1);
  return product_of(self, r);
}

/* Solves with a team's projection, for the residual in the overlap's vector. The coarse level's right-hand side is known
 * only after the projection, so that its load needs a sum of its own. */
static void solve_projected(flesh_preconditioner_data *self)
{
  const int own = self->overlap.team->own;
  float *r = flesh_volume_projection_before_in_team(self->projection);
  if (by_blocks(self)) {
    solve_blocks(self, r);
  } else {
    for (int p = 0; p < self->rows; p++)
      if (self->order[p] >= own) memset(r + 4 * (size_t)p, 0, 4 * sizeof *r);
    flesh_overlap_widen(&self->overlap, self->overlap_order, self->wide);
    solve_in_team(self, r, NULL, 1);
  }
  flesh_volume_projection_after_in_team(self->projection, self->z);
}

const flesh_overlap *flesh_preconditioner_overlap(const flesh_preconditioner_data *self)
{
  return self->overlap.team && self->cholesky && !by_blocks(self) ? &self->overlap : NULL;
}

const flesh_team *flesh_preconditioner_team(const flesh_preconditioner_data *self) { return self->team; }

int flesh_preconditioner_unknowns(const flesh_preconditioner_data *self)
{
  const int has_load = flesh_preconditioner_overlap(self) && self->two_levels && !self->projects;
  return has_load ? flesh_coarse_unknowns(self->coarse) : 0;
}

double *flesh_preconditioner_room(flesh_preconditioner_data *self) { return self->room; }

void flesh_preconditioner_load(flesh_preconditioner_data *self, const float *r, double scale, double *load)
{
  if (!flesh_preconditioner_unknowns(self)) return;
  flesh_coarse_restrict(self->coarse, 0, 0, self->rows, r);
  flesh_coarse_take(self->coarse, scale, load);
}

void flesh_preconditioner_solve_for(flesh_preconditioner_data *self, const float *r, const double *load, double scale)
{
  if (self->projects) {
    flesh_overlap_fetch_kept(&self->overlap, self->order, r, scale);
    solve_projected(self);
    return;
  }
  flesh_overlap_restrict_kept(&self->overlap, r, scale, self->wide);
  solve_in_team(self, r, load, scale);
}

static void soft_result(const flesh_preconditioner_data *self, int begin, int end, float *z)
{
  if (!by_blocks(self) && !self->overlap.team)
    flesh_cholesky_result(self->cholesky, self->two_levels ? self->coarse : NULL, begin, end, z);
  else if (z != self->z + 4 * (size_t)begin)
    memcpy(z, self->z + 4 * (size_t)begin, 4 * (size_t)(end - begin) * sizeof *z);
}

double flesh_preconditioner_solve(flesh_preconditioner_data *self, const float *r)
{
  if (!self->projects) return solve_soft(self, r);
  if (self->overlap.team) {
    flesh_overlap_fetch(&self->overlap, self->order, r);
    solve_projected(self);
    return product_of(self, r);
  }
  solve_soft(self, flesh_volume_projection_before(self->projection, r));
  soft_result(self, 0, self->rows, self->z);
  return flesh_volume_projection_after(self->projection, r, self->z);
}

double flesh_preconditioner_scale(const flesh_preconditioner_data *self) { return self->scale; }

void flesh_preconditioner_result(const flesh_preconditioner_data *self, int begin, int end, float *z)
{
  if (self->projects) memcpy(z, self->z + 4 * (size_t)begin, 4 * (size_t)(end - begin) * sizeof *z);
  else soft_result(self, begin, end, z);
}

void flesh_preconditioner_share_left_out(const flesh_preconditioner_data *self, double *vector)
{
  const flesh_team *team = flesh_threads_team(self->threads);
  if (self->team != team) flesh_team_update_ghosts(team, vector);
}

void flesh_preconditioner_apply(flesh_preconditioner_data *self, const double *r, double *z)
{
  const double scale = flesh_power_to_one(flesh_norm(self->threads, 3 * self->rows, r)), back = self->scale / scale;
  for (size_t p = 0; p < (size_t)self->rows; p++)
    for (size_t c = 0; c < 3; c++) self->r[4 * p + c] = (float)(scale * r[3 * (size_t)self->order[p] + c]);
  flesh_preconditioner_solve(self, self->r);
  float *result = self->r; /* no longer needed */
  flesh_preconditioner_result(self, 0, self->rows, result);
  for (size_t p = 0; p < (size_t)self->rows; p++) {
    for (size_t c = 0; c < 3; c++) z[3 * (size_t)self->order[p] + c] = back * (double)result[4 * p + c];
    result[4 * p + 3] = 0;
  }
  flesh_preconditioner_share_left_out(self, z);
}

int flesh_preconditioner_correct_volumes(flesh_preconditioner_data *self, const float *error, double *step)
{
  if (!self->projects) return 0;
  flesh_volume_projection_correct(self->projection, error, step);
  flesh_preconditioner_share_left_out(self, step);
  return 1;
}

double flesh_preconditioner_drift(const flesh_preconditioner_data *self)
{
  return self->projects ? flesh_volume_projection_drift(self->projection) : 0;
}
