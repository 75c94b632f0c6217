/* error_control.c: how large local errors are, and which steps they refuse.
 *
 * The error e of positions that a step estimates is filtered through the last stage,
 *   || (M + g^2 K)^-1 M e ||_M / (local L),   || e ||_M^2 = e.M e / m,
 * the position part of (I - g J)^-1 e (Hairer & Wanner 1996, IV.8): it saturates for motions that steps do not resolve,
 * where e itself grows with the square of their frequency. L is the body's longest side and m its mass.
 *
 * An error adds up in the phase of the motion that it is of: while the body goes through a period, a motion of angular
 * frequency w goes through w times as many radians. The shorter steps are, the faster motions they resolve, and errors would
 * fall by less than the tolerance. So an error counts hypot(W, sqrt(W) lasting w' P) times, P being the body's period over
 * 2 pi and w' = w/(1 + g^2 w^2), w the frequency of the filtered error: what a step does not resolve is damped before it
 * adds up. W is 1, or where nothing holds a part what part_weights.c says, as errors become momentum. Bounces feel fast
 * vibrations less: W w' P takes more steps for no less error, but with w' P a cube that bounces errs by 9 tolerances at 1e-5,
 * so by 4. Where something touches, w' counts as 0, as what contact turns around has no such frequency.
 *
 * local = share tolerance^((q + 1)/p): the estimate falls with h^(q+1), q = min(p, 2), and what the errors of a method of
 * order p add up to with h^p, so that this is in proportion to the tolerance. `share` is measured (README.md).
 *
 * Contact turns a node around within its own period, which the filter takes for a motion that need not be resolved. But
 * what the node's momentum is off by stays in the body. So the error e of nodes that touch something counts once more,
 * unfiltered, as the velocity e/h, by which the part goes astray for its own period, or if it is free for as long as
 * part_weights.c says. Such errors have no higher order to fall with: they add up to tolerance with tolerance^((q + 1)/q),
 * down to `local`, where the residuals of the stages show. As errors of what is held do not count more often, its impulses
 * count further down, by a quarter of what lies between the two: with `local` a cantilever that falls onto a plane errs by 24
 * tolerances at 1e-4, so by 10.
 *
 * A method of order 1 errs by h^2 a/2 in positions even if the acceleration a is constant and its velocities are exact: only
 * the error of its velocities, times h, counts W times, and as an impulse.
 *
 * Where internal variables change at the end of a step, as those of a weld that breaks, forces may have been others for all
 * of it. Their impulse counts like that of contact. */
#include "time/error_control.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "system/softened.h"
#include "system/system.h"
#include "system/velocity_scale.h"

static const double share = 0.1, share_of_second = 0.2; /* error of a step over the tolerance, at tolerance 1; order 2 */
static const double depth = 0.5;             /* of the error allowed, the share of residuals (history.md) */
/* A residual changes the momentum of a free body for good, which its vibrations do not show. The residual is at most
 * this many tolerances of the load, whose effect on such a body then changes by that share. */
static const double of_load = 5;
static const double deeper = 0.1;            /* factor of residuals after each refusal by energy, which they may have put in */
/* Share of the error allowed for changes of volume. The next step closes them. If a method remembers the acceleration
 * of that, it recurs in all steps to come: in fewer than fill the body's period. Parts in contact do not feel it
 * (`judge`). */
static const double gap_depth = 0.1;
static const double lasting = 0.7;           /* share of the body's periods through which errors add up */
static const double negligible = 1e-3;       /* an unfiltered error below this needs no filter */
static const double of_held = 0.25;          /* of the way, in logarithms, that impulses of held bodies are smaller */
/* Constrained dofs are where they are prescribed to be, whatever the step. Their error, multiplied by this factor,
 * shows whether the step resolves their motion, and so the work of that. */
static const double of_prescribed = 12;
enum { DEEPEST = 3 };                        /* highest power of `deeper` */
/* An unfiltered error that is larger than allowed, and than the filtered one, by these factors is of accelerations that
 * swing. Their part that turns with the body changes its momentum. */
static const double swung = 5, swung_ratio = 10;
static const double still = 1e-12;           /* motion within the body's period, over its length: rounding */

static void clear_vectors(flesh_error_control *self)
{
  free(self->e);
  free(self->touching);
  flesh_part_weights_clear(&self->weights);
  flesh_momenta_clear(&self->momenta);
  self->e = self->force = self->filtered = NULL;
  self->touching = NULL;
}

/* Returns twice the kinetic energy for velocities e [n]: e.M e. */
static double mass_square(const flesh_error_control *self, const double *e)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  const flesh_point point = flesh_point_at(0, X, e, e);
  double energy = 0;
  return flesh_system_kinetic_energies(self->system, &point, NULL, &energy) ? NAN : 2 * energy;
}

/* Returns the scale of the body's velocities (system/velocity_scale.h), m/s. */
static double velocity_scale(flesh_newton *newton)
{
  flesh_equations *equations = &newton->equations;
  flesh_evaluation *e = &equations->evaluation;
  double *const room[FLESH_VELOCITY_SCALE_ROOM] = {e->x, equations->scratch, e->v, e->a,
                                                   equations->scratch + equations->n};
  flesh_newton_overwritten(newton);
  flesh_evaluation_forget(e);
  double mass;
  return flesh_system_velocity_scale(e->system, equations->K, room, &mass);
}

static int has_role(const flesh_effect *effect, int role) { return (int)effect->operations->role == role; }

double flesh_error_control_elastic(const flesh_error_control *self, const double *x)
{
  const flesh_evaluation *evaluation = &self->nonlinear->newton->equations.evaluation;
  const flesh_point point = flesh_evaluation_point(evaluation, 0, x, self->e, self->e); /* for any velocities */
  double energy = 0;
  const int status = flesh_system_some_energies(self->system, has_role, FLESH_ROLE_ELASTICITY, &point, NULL, &energy);
  return status ? NAN : energy - self->rest;
}

void flesh_error_control_measure(flesh_error_control *self)
{
  const flesh_team *team = flesh_system_team(self->system);
  if (!self->on) return;
  self->length = flesh_system_length_scale(self->system);
  self->period = self->length / (6.283185307179586 * velocity_scale(self->nonlinear->newton));
  for (int d = 0; d < self->n; d++) self->e[d] = d % 3 == 0;
  self->mass = mass_square(self, self->e);
  self->nodes = team ? team->all : self->n / 3;
  self->rest = 0;
  self->rest = flesh_error_control_elastic(self, flesh_mesh_positions(flesh_system_mesh(self->system)));
  self->stiffness = fmax(1, flesh_system_stiffness_ratio(self->system));
  flesh_part_weights_measure(&self->weights, self->system, self->length, self->period,
                             (double *[]){self->e, self->force, self->filtered});
  self->nonlinear->newton->goal = (flesh_newton_goal){
      .of_first = 1, .of_load = of_load * self->options.tolerance, .node_mass = self->mass / self->nodes};
}

int flesh_error_control_set(const flesh_adaptive_options *options, const flesh_system *system,
                            const flesh_rigid_parts *parts, flesh_nonlinear *nonlinear, flesh_error_control *self)
{
  const size_t n = (size_t)flesh_system_unknowns(system);
  clear_vectors(self);
  *self = (flesh_error_control){.on = options->control, .options = *options, .system = system, .nonlinear = nonlinear,
                                .n = (int)n, .before = 1, .times = 1, .first = 1, .error = NAN};
  if (!self->on) return FLESH_OK;
  self->e = calloc(3 * n + 1, sizeof *self->e);
  self->touching = calloc(n / 3 + 1, 1);
  if (!self->e || !self->touching) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the errors of %zu unknowns", n);
  self->force = self->e + n;
  self->filtered = self->force + n;
  const int status = flesh_part_weights_create(parts, &self->weights);
  return status ? status : flesh_momenta_create(&self->weights, system, self->force, &self->momenta);
}

void flesh_error_control_clear(flesh_error_control *self)
{
  clear_vectors(self);
  *self = (flesh_error_control){0};
}

void flesh_error_control_archive(flesh_error_control *self, flesh_archive *archive)
{
  FLESH_ARCHIVE(archive, self->h);
  FLESH_ARCHIVE(archive, self->before);
  FLESH_ARCHIVE(archive, self->times);
  flesh_part_weights_archive(&self->weights, archive);
  FLESH_ARCHIVE(archive, self->first);
  FLESH_ARCHIVE(archive, self->rejected);
  FLESH_ARCHIVE(archive, self->failed);
  FLESH_ARCHIVE(archive, self->stands_in);
  FLESH_ARCHIVE(archive, self->gains);
  FLESH_ARCHIVE(archive, self->refused_h);
  FLESH_ARCHIVE(archive, self->refused_error);
}

double flesh_error_control_least_energy(const flesh_error_control *self, int swings)
{
  const double slow = self->local * self->length / fmax(self->largest * self->period, swings ? self->weights.flies : 0);
  return self->mass * slow * slow / 2;
}

/* Returns the root mean square of e [n], by mass. */
static double size_of(const flesh_error_control *self, const double *e) { return sqrt(mass_square(self, e) / self->mass); }

void flesh_error_control_start(flesh_error_control *self, const flesh_state *state, const double *a)
{
  const double allowed = share * self->options.tolerance, speed = size_of(self, state->v);
  const double force = a ? size_of(self, a) : 0;
  flesh_part_weights_hold(&self->weights, self->system, state->t);
  /* The step moves the body by no more than the cube root of the error allowed, which falls with h^3. A body
   * at rest while forces grow from 0 begins with a brief step: one longer than the vibrations that they excite does not
   * see these. */
  const double moving = fmin(sqrt(2 * pow(allowed, 2. / 3) * self->length / force), cbrt(allowed) * self->length / speed);
  const int rests = (force * self->period + speed) * self->period < still * self->length;
  const double h = rests ? flesh_error_control_brief(self, moving) : moving;
  self->h = self->h > 0 ? fmin(self->h, h) : h;
  self->before = 1;
  self->first = 1;
  self->stands_in = 0;
}

/* Returns how much the impulses of a step may be off by, so that all add up to the tolerance. */
static double impulses_of(const flesh_error_control *self)
{
  return pow(self->options.tolerance, self->falls / (self->falls - 1));
}

int flesh_error_control_flies(const flesh_error_control *self) { return self->weights.flies > 0 && !(self->weights.stages > 0); }

void flesh_error_control_aim(flesh_error_control *self, int order, const flesh_state *state, double h)
{
  self->falls = order < 2 ? order + 1 : 3;
  self->local = (order == 2 ? share_of_second : share) * pow(self->options.tolerance, self->falls / order);
  self->largest = flesh_part_weights_aim(&self->weights, self->system, state, self->first ? h : 0,
                                         self->local * self->length, order > 2, self->force);
  const double least = impulses_of(self), lower = self->largest > 1 ? 1 : pow(least / self->local, of_held);
  self->impulses = fmax(least, lower * self->local);
}

void flesh_error_control_set_target(flesh_error_control *self, const flesh_shift *shift)
{
  /* Outputs or energies may ask for shorter steps than the error does, and so for more of them: by the cube root of the
   * ratio. Residuals of many steps add up like errors, but less coherently: two thirds of the power. In free flight
   * they add up like impulses. */
  const double g = 1 / sqrt(shift->a), fewer = cbrt(fmin(self->before, 1) / (self->times * self->times));
  const double part = fewer * pow(deeper, fmin(self->gains / FLESH_GAINS_OF_REFUSAL, DEEPEST)) * depth;
  const double most = self->largest > 1 ? self->impulses / impulses_of(self) : 0;
  const double last = flesh_part_weights_of_residuals(&self->weights, g, most, self->force);
  if (self->weights.count > 1) flesh_nonlinear_set_weights(self->nonlinear, self->force);
  self->nonlinear->newton->goal.target = part * self->local * self->length * self->mass / (sqrt(self->nodes) * g * last);
}

double flesh_error_control_slip(const flesh_error_control *self)
{
  return self->weights.flies > 0 ? 1 : fmax(1, self->impulses / self->local);
}

double flesh_error_control_gap(const flesh_error_control *self, const flesh_shift *shift, int swings)
{
  return gap_depth * self->local / self->largest * (swings ? fmin(1, 1 / (sqrt(shift->a) * self->period)) : 1);
}

/* Computes f = (M + g^2 K)^-1 of the force [n] in self->force, times g^2, into `filtered`; returns whether that
 * succeeded. *product: f.(K + M/g^2) f. */
static int filter(flesh_error_control *self, double *product, flesh_solve_stats *stats)
{
  memset(self->filtered, 0, (size_t)self->n * sizeof *self->filtered);
  flesh_newton *newton = self->nonlinear->newton;
  const int status = flesh_newton_filter_error(newton, self->nonlinear->u, self->force, self->filtered, stats);
  *product = flesh_dot(newton->threads, self->n, self->force, self->filtered);
  return status == FLESH_OK || status == FLESH_NOT_CONVERGED; /* the last iterate will do */
}

/* Computes f = (M + g^2 K)^-1 M e, with 0 on fixed dofs. */
static int filter_error(flesh_error_control *self, const uint8_t *fixed, const flesh_shift *shift, double *product,
                        flesh_solve_stats *stats)
{
  const double *X = flesh_mesh_positions(flesh_system_mesh(self->system));
  memset(self->filtered, 0, (size_t)self->n * sizeof *self->filtered);
  const flesh_point point = flesh_point_at(0, X, self->filtered, self->e);
  const int status = flesh_system_roles_residual(self->system, FLESH_ROLE_BIT(FLESH_ROLE_INERTIA), &point, self->force);
  for (int d = 0; d < self->n; d++) self->force[d] *= fixed && fixed[d] ? 0 : shift->a;
  return !status && filter(self, product, stats);
}

void flesh_error_control_clear_contact(flesh_error_control *self)
{
  if (self->touches) memset(self->touching, 0, (size_t)self->n / 3);
  self->touches = 0;
  flesh_part_weights_clear_contact(&self->weights);
}

void flesh_error_control_touch(flesh_error_control *self, const double *forces)
{
  int pushes = 0;
  for (int d = 0; d < self->n; d++)
    if (forces[d] != 0) pushes = self->touching[d / 3] = 1;
  self->touches |= flesh_team_any(flesh_system_team(self->system), pushes);
  flesh_part_weights_touch(&self->weights, forces);
}

/* Returns the size of e [n] multiplied by the weights of its parts, unless that is `done`; of velocities, times how long they
 * lead these astray. Overwrites `force`. */
static double counted(const flesh_error_control *self, const double *e, int velocities, int done)
{
  if (done || (!velocities && self->largest <= 1)) return size_of(self, e);
  flesh_part_weights_count(&self->weights, e, velocities, self->force);
  return size_of(self, self->force);
}

/* Lets the part of the error that `momentum` [n] is, h times an error of velocities, count as often as its parts do, and the
 * rest once. Overwrites `force`. */
static void count_momentum(flesh_error_control *self, const double *momentum)
{
  flesh_part_weights_count(&self->weights, momentum, 0, self->force);
  for (int d = 0; d < self->n; d++) self->e[d] += self->force[d] - momentum[d];
}

/* Returns how far the velocity error e/h of the nodes that touch something, and are not fixed, leads astray, and what has just
 * been met. Overwrites `filtered`. */
static double drift_by_impulses(flesh_error_control *self, const uint8_t *fixed, double h)
{
  for (int d = 0; d < self->n; d++) self->filtered[d] = self->touching[d / 3] && !(fixed && fixed[d]) ? self->e[d] / h : 0;
  return hypot(counted(self, self->filtered, 1, 0), flesh_part_weights_met(&self->weights, h, self->mass));
}

/* Returns in how many radians a filtered error adds up, or 0, from its frequency w by Rayleigh's quotient, f.(K + M/g^2) f =
 * (w^2 + 1/g^2) f.M f, the left side being `product`. */
static double radians_of(const flesh_error_control *self, double product, const flesh_shift *shift)
{
  const double resolved = shift->a * mass_square(self, self->filtered) / product; /* 1/(1 + g^2 w^2) */
  if (self->touches || !(resolved < 1)) return 0;
  return lasting * sqrt(1 / resolved - 1) * resolved * self->period * sqrt(shift->a);
}

static flesh_refusal refusal_of(const flesh_error_control *self)
{
  return self->error <= 1 ? FLESH_REFUSED_BY_NOTHING : FLESH_REFUSED_BY_ERROR;
}

flesh_refusal flesh_error_control_judge(flesh_error_control *self, const uint8_t *fixed, const double *momentum, double h,
                                        const flesh_shift *shift, flesh_solve_stats *stats)
{
  const double allowed = self->local * self->length;
  flesh_newton *newton = self->nonlinear->newton;
  double product;
  for (int d = 0; d < self->n && fixed; d++)
    if (fixed[d]) self->e[d] *= of_prescribed;
  self->times = 1;
  self->swings = 0;
  if (momentum && self->largest > 1) count_momentum(self, momentum);
  self->error = counted(self, self->e, 0, momentum != NULL) / allowed;
  if (self->error > negligible && filter_error(self, fixed, shift, &product, stats)) {
    const double radians = radians_of(self, product, shift);
    for (int d = 0; d < self->n && fixed; d++)
      if (fixed[d]) self->filtered[d] = self->e[d];
    const double filtered = counted(self, self->filtered, 0, momentum != NULL) / allowed;
    self->swings = !self->touches && self->error > fmax(swung, swung_ratio * filtered);
    self->times = hypot(1, radians);
    if (self->largest > 1 && filtered > 0) {
      flesh_part_weights_add_up(&self->weights, self->filtered, momentum != NULL, radians, self->force);
      self->times = size_of(self, self->force) / (filtered * allowed);
    }
    if (filtered < self->error) self->error = self->times * filtered;
  }
  if (self->touches && momentum) memcpy(self->e, momentum, (size_t)self->n * sizeof *momentum);
  if (self->touches && self->error > 0) flesh_newton_keep_volumes(newton, self->nonlinear->u, self->e, stats);
  if (self->touches)
    self->error = hypot(self->error, drift_by_impulses(self, fixed, h) / (self->impulses * self->length));
  return refusal_of(self);
}

flesh_refusal flesh_error_control_judge_change(flesh_error_control *self, const uint8_t *fixed, const flesh_point *point,
                                               const double *next, double h, const flesh_shift *shift,
                                               flesh_solve_stats *stats)
{
  const unsigned roles = ~(FLESH_ROLE_BIT(FLESH_ROLE_INERTIA) | FLESH_ROLE_BIT(FLESH_ROLE_CONTACT));
  flesh_point changed = *point;
  double product;
  changed.internal = next;
  int status = flesh_system_roles_residual(self->system, roles, point, self->e);
  if (!status) status = flesh_system_roles_residual(self->system, roles, &changed, self->force);
  for (int d = 0; d < self->n; d++)
    self->force[d] = fixed && fixed[d] ? 0 : sqrt(shift->a) * h * (self->force[d] - self->e[d]);
  if (!status && filter(self, &product, stats)) {
    const double drift = sqrt(shift->a) * counted(self, self->filtered, 1, 0);
    self->error = hypot(self->error, drift / (self->impulses * self->length));
  }
  return refusal_of(self);
}

double flesh_error_control_imbalance(flesh_error_control *self, const uint8_t *fixed, const flesh_point *point,
                                     flesh_solve_stats *stats)
{
  double product = NAN;
  const int status = flesh_system_residual(self->system, point, self->force);
  for (int d = 0; d < self->n && fixed; d++)
    if (fixed[d]) self->force[d] = 0;
  return !status && filter(self, &product, stats) ? product / 2 : NAN;
}
