/* archive.c: archives which matrices are kept from stage to stage, and how well they have served. */
#include <math.h>
#include <string.h>

#include "newton/newton.h"

/* Whether K is used once more before it is assembled again. */
static int serves_again(const flesh_newton *self) { return self->policy.age >= 0 && self->direction.assembled; }

static void forget_direction(flesh_direction *self)
{
  flesh_direction_overwritten(self);
  self->filter = FLESH_FILTER_NONE;
  self->assembled = self->prepared = self->single = 0;
  self->iterations_per_decade[0] = self->iterations_per_decade[1] = self->excess_iterations = 0;
  self->fallback_state = FLESH_FALLBACK_UNUSED;
  self->linear->exact->destroy(&self->fallback);
  if (self->direct) flesh_direct_forget(self->direct);
  if (self->factored) memset(self->factored, 0, (size_t)self->equations->K->rows * sizeof *self->factored);
}

void flesh_newton_forget(flesh_newton *self)
{
  flesh_matrix_policy *policy = &self->policy;
  flesh_evaluation *evaluation = &self->equations.evaluation;
  *policy = (flesh_matrix_policy){.equations = policy->equations, .direction = policy->direction, .inertia = policy->inertia};
  forget_direction(&self->direction);
  flesh_clearance_forget(&evaluation->clearance);
  flesh_evaluation_forces_changed(evaluation);
  memset(&self->stats, 0, sizeof self->stats);
  self->negative_curvature = self->tangent.refreshes = 0;
  self->edge_force = NAN;
}

/* Archives the matrices, but only if one has been made. */
static int archive_direction(flesh_direction *self, flesh_archive *archive)
{
  const size_t stiff = 3 * (size_t)self->rows.count * (size_t)self->rows.nodes_per_row;
  int fallback = self->fallback_state;
  FLESH_ARCHIVE(archive, self->filter);
  FLESH_ARCHIVE(archive, self->prepared);
  const int made = self->prepared || self->assembled;
  FLESH_ARCHIVE(archive, self->single);
  FLESH_ARCHIVE(archive, self->iterations_per_decade);
  FLESH_ARCHIVE(archive, self->excess_iterations);
  if (self->factored && made)
    flesh_archive_bytes(archive, self->factored, (size_t)self->equations->K->rows * sizeof *self->factored);
  if (stiff && made) {
    FLESH_ARCHIVE(archive, self->rows.projection_disabled);
    flesh_archive_bytes(archive, self->rows.values, stiff * sizeof *self->rows.values);
  }
  if (archive->mode == FLESH_ARCHIVE_LOAD) self->matrix++; /* PCG rounds it anew */
  if (self->preconditioner && made)
    self->linear->preconditioner_archive(self->preconditioner, archive);
  flesh_archive_int(archive, &fallback, FLESH_FALLBACK_TOO_EXPENSIVE, FLESH_FALLBACK_IN_USE);
  self->fallback_state = fallback; /* its factors are made anew in each solve */
  return self->direct ? flesh_direct_archive(self->direct, archive) : FLESH_OK;
}

static void archive_policy(flesh_matrix_policy *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->prepared_for);
  FLESH_ARCHIVE(archive, self->kept);
  FLESH_ARCHIVE(archive, self->age);
  FLESH_ARCHIVE(archive, self->drift);
  FLESH_ARCHIVE(archive, self->curvature);
  FLESH_ARCHIVE(archive, self->safety_factor);
  FLESH_ARCHIVE(archive, self->predicted_error);
  FLESH_ARCHIVE(archive, self->round_off);
}

int flesh_newton_archive(flesh_newton *self, flesh_archive *archive)
{
  if (archive->mode == FLESH_ARCHIVE_LOAD) flesh_newton_forget(self);
  archive_policy(&self->policy, archive);
  flesh_archive_int(archive, &self->direction.assembled, 0, 1);
  if (archive->wrong) return FLESH_OK;
  int status = flesh_equations_archive(&self->equations, serves_again(self), archive);
  if (!status) status = flesh_direction_follow_pattern(&self->direction);
  if (status || archive->wrong) return status;
  FLESH_ARCHIVE(archive, self->stats);
  FLESH_ARCHIVE(archive, self->negative_curvature);
  FLESH_ARCHIVE(archive, self->edge_force);
  return archive_direction(&self->direction, archive);
}
