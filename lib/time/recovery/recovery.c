/* recovery.c: cutbacks of steps, increments of loads, and sentences about failures. */
#include "time/recovery/recovery.h"

#include <math.h>
#include <stdio.h>

#include "base/error.h"
#include "parallel/body_figures.h"
#include "system/proximity.h"
#include "system/ranks.h"
#include "time/recovery/winding.h"

/* Share of inverted tets above which a body counts as tangled: a crease of few tets is no reason to solve twice. */
static const double worth = 1. / 400;
static const double disorder = 1. / 20; /* coarse meshes that bend sharply invert fewer than one tet in a hundred */

int flesh_recovery_create(const flesh_evaluation *evaluation, const flesh_rigid_parts *parts,
                          const flesh_solver_options *options, flesh_recovery *self)
{
  const flesh_system *system = evaluation->system;
  /* How the first state came about is not known. */
  *self = (flesh_recovery){.mesh = flesh_system_mesh(system), .team = flesh_system_team(system),
                           .max_cutbacks = options->max_cutbacks, .tangled = 1};
  /* Untangling would lead a tangle out through other bodies, so bodies with surface contact are not untangled. */
  const int untangles = options->techniques & FLESH_TECHNIQUE_UNTANGLE && !flesh_system_has_proximity(system);
  return untangles ? flesh_untangler_create(evaluation, parts, &self->untangler) : FLESH_OK;
}

int flesh_recovery_create_collective(flesh_recovery *self)
{
  return self->untangler ? flesh_untangler_create_collective(self->untangler) : FLESH_OK;
}

void flesh_recovery_clear(flesh_recovery *self) { flesh_untangler_destroy(&self->untangler); }

int flesh_recovery_is_inverted(flesh_recovery *self, const double *x)
{
  const double inverted = flesh_body_inverted(self->mesh, self->team, x);
  return (inverted > worth) + (inverted > disorder);
}

int flesh_recovery_is_tangled(flesh_recovery *self, const double *x)
{
  const int left = self->tangled && flesh_body_may_be_tangled(self->mesh, self->team, x);
  self->tangled = flesh_recovery_is_inverted(self, x) || left;
  return self->tangled;
}

int flesh_recovery_softens(flesh_recovery *self, const double *x)
{
  const int tangled = flesh_recovery_is_tangled(self, x), before = tangled ? self->in_vain : 0;
  self->in_vain = tangled ? before + 1 : 0;
  return tangled && (before & (before - 1)) == 0;
}

/* Finds the part at the place, from `begin` on. */
static void find_part(flesh_cutbacks *self, double begin)
{
  const flesh_span *span = &self->span;
  const unsigned long long parts = 1ULL << self->depth, next = self->place + 1;
  const double end = next == parts ? span->end : span->begin + span->h * ((double)next / (double)parts);
  self->part = (flesh_span){begin, end, span->h / (double)parts};
}

flesh_cutbacks flesh_cutbacks_of(flesh_span span) { return (flesh_cutbacks){.span = span, .part = span}; }

int flesh_cutbacks_next(flesh_cutbacks *self, int halvings, int max_cutbacks, int status)
{
  if (status < 0 || (status > 0 && self->depth == max_cutbacks)) return 0;
  if (status > 0) {
    for (; halvings > 0 && self->depth < max_cutbacks; halvings--) self->depth++, self->place *= 2;
    find_part(self, self->part.begin);
    return 1;
  }
  self->place++;
  while (self->depth > 0 && self->place % 2 == 0) self->depth--, self->place /= 2;
  find_part(self, self->part.end);
  return self->depth > 0;
}

/* Returns the increment of 2^-depth from a load on, or the rest if that is less. */
static flesh_load_increment increment_from(double load, int depth)
{
  const double to = fmin(1, load + ldexp(1, -depth));
  return (flesh_load_increment){load, to, (to - load) / (1 - load), depth};
}

flesh_load_increment flesh_load_increment_first(void) { return increment_from(0, 1); }

int flesh_load_increment_next(flesh_load_increment *self, int max_cutbacks, int status)
{
  int depth = self->depth + (status > 0 ? 1 : -1);
  while (status > 0 && ldexp(1, -depth) >= self->to - self->from) depth++; /* the rest has been tried already */
  const double reached = status > 0 ? self->from : self->to;
  if (status < 0 || depth > max_cutbacks || reached >= 1) return 0;
  *self = increment_from(reached, depth);
  return 1;
}

int flesh_recovery_fail(const flesh_recovery *self)
{
  const flesh_failure *f = &self->failure;
  char residual[120] = "there is no residual", tried[40]; /* the first iterate has no energy */
  snprintf(tried, sizeof tried, f->load > 0 ? "load factor %.3g" : "h = %.3g s", f->load > 0 ? f->load : f->h);
  if (f->worst_node >= 0)
    snprintf(residual, sizeof residual, "residual %.3g N, wanted %.3g N", f->residual, f->target);
  if (f->volume_gap > 0)
    snprintf(residual, sizeof residual, "the forces balance, but volumes of incompressible tets are off by up to %.3g",
             f->volume_gap);
  return flesh_fail(f->status == FLESH_NONFINITE ? FLESH_ERR_NONFINITE : FLESH_ERR_SOLVE,
                    "at t = %.9g s with %s: %s; %s; smallest J = %.3g in tet %d at (%.4g, %.4g, %.4g)",
                    f->t, tried, flesh_status_text(f->status), residual, f->worst_J, f->worst_tet,
                    f->worst_position[0], f->worst_position[1], f->worst_position[2]);
}
