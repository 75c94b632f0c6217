/* accelerators.c: asks one accelerator after the other, and takes a proposal that lowers the potential.
 *
 * Arcs extend a step that fell short, where a longer straight step would change volumes.
 *
 * Nonlinear elimination solves for the few nodes that carry the residual alone (Lanzkron, Rose & Wilkes 1996).
 *
 * The watchdog technique (Chamberlain, Powell, Lemarechal & Pedersen 1982) takes longer steps. Stiff parts rotate along
 * arcs: a straight step strains them, and the line search cuts it to almost nothing, repeatedly. The watchdog then takes a
 * multiple of the cut step although the potential rises. The residual there is that of the strained parts, and one or two
 * Newton steps remove it. */
#include <math.h>

#include "newton/mechanisms.h"
#include "newton/newton.h"
#include "system/one_effect.h"

enum { RETURNS = 2, LONGEST_PAUSE = 8 };
static const double tried_below = 0.3; /* the watchdog tries steps that the line search cuts to less than this fraction */
static const double first_length = 8;  /* length of the first try relative to the cut step */
static const double strain_growth = 10; /* growth of the residual from which on stiff parts count as strained */
static const double power = 6;         /* power of the step's length with which the remaining strain grows */

/* Whether dofs on which contact acts carry most of the residual r at u. There the step has not predicted the barrier.
 * Elimination has a quadratic model of contact, which does not predict the barrier either. */
static int contact_carries(flesh_equations *equations, const double *u, const double *r)
{
  if (!flesh_system_has_role(equations->system, FLESH_ROLE_CONTACT)) return 0;
  const flesh_point point = flesh_equations_point(equations, u);
  double *contact = equations->scratch; /* becomes r on the dofs where contact acts, 0 elsewhere */
  const int failed = flesh_system_roles_residual(equations->system, FLESH_ROLE_BIT(FLESH_ROLE_CONTACT), &point, contact);
  for (int d = 0; d < equations->n; d++) contact[d] = failed || contact[d] != 0 ? r[d] : 0;
  return flesh_norm(equations->threads, equations->n, contact) > M_SQRT1_2 * flesh_norm(equations->threads, equations->n, r);
}

/* Proposes a step by nonlinear elimination: solves for the few nodes that carry the residual after the step alone. */
static int propose_elimination(flesh_newton *self, const flesh_step *step)
{
  flesh_equations *equations = &self->equations;
  double *r = equations->evaluation.residual.r;
  if (!self->reserve || !step->unpredicted) return 0;
  flesh_step_to(equations, step->u, 1, step->p, equations->trial);
  if (flesh_equations_residual(equations, equations->trial, r) || !flesh_is_local(equations, r)) return 0;
  if (contact_carries(equations, equations->trial, r)) return 0;
  if (flesh_subdomain_solve(self, equations->trial, r, equations->proposal)) return 0;
  for (int d = 0; d < equations->n; d++) equations->proposal[d] += step->p[d];
  return 1;
}

/* Makes the equations' proposal [n] the step where it is feasible and has a lower potential. Returns whether it did. */
static int take_proposal(flesh_newton *self, flesh_step *step)
{
  flesh_equations *equations = &self->equations;
  double lower, ignored;
  flesh_step_to(equations, step->u, 1, equations->proposal, equations->trial);
  if (flesh_equations_max_feasible_step(equations, step->u, equations->trial) < 1) return 0;
  if (flesh_equations_evaluate(equations, equations->trial, &lower, &ignored) || !(lower < step->value)) return 0;
  step->value = lower;
  step->cut = 1;
  flesh_copy(equations->threads, equations->n, equations->proposal, step->p);
  return 1;
}

/* Takes one or two Newton steps from `to` [n], until the potential is below `enough`. Returns the potential; INFINITY where
 * it has no value. */
static double go_back(flesh_newton *self, double enough, double *to)
{
  flesh_equations *equations = &self->equations;
  const int n = equations->n;
  double *b = equations->work[0], *q = equations->trial, value = INFINITY, before = INFINITY, magnitude;
  for (int k = 0; k < RETURNS && !(value < enough); k++) {
    value = INFINITY;
    if (flesh_equations_residual(equations, to, b)) break;
    const double norm = flesh_norm(equations->threads, n, b);
    if (!(norm < before)) break;
    for (int d = 0; d < n; d++) b[d] = -b[d];
    if (flesh_newton_step_from(self, to, b, norm, q)) break;
    before = norm;
    for (int d = 0; d < n; d++) to[d] += q[d];
    if (flesh_equations_potential(equations, to, &value, &magnitude)) value = INFINITY;
  }
  return value;
}

static void learn(flesh_newton *self, int taken)
{
  flesh_watchdog *watchdog = &self->iterations.watchdog;
  self->stats.watchdog_steps += taken;
  if (!taken) watchdog->pause = watchdog->next_pause;
  if (taken) watchdog->next_pause = 1;
  else if (watchdog->next_pause < LONGEST_PAUSE) watchdog->next_pause *= 2;
}

static void run_watchdog(flesh_newton *self, flesh_step *step)
{
  flesh_equations *equations = &self->equations;
  const int n = equations->n;
  const double cut = step->cut, *u = step->u, *p = step->p;
  double *r = equations->work[0], *to = equations->work[1];
  if (!flesh_uses(&self->options, FLESH_TECHNIQUE_WATCHDOG)) return;
  if (!(cut < tried_below) || step->kind == FLESH_DIRECTION_NEGATIVE_CURVATURE || ++self->iterations.watchdog.cuts < 2) return;
  if (self->iterations.watchdog.pause > 0) {
    self->iterations.watchdog.pause--;
    return;
  }
  const double length = flesh_norm(equations->threads, n, p) / cut, known = self->iterations.watchdog.length;
  const double s = fmin(1, known > 0 ? fmax(known / length, 2 * cut) : first_length * cut);
  for (int d = 0; d < n; d++) to[d] = u[d] + s / cut * p[d];
  /* Stop here unless stiff parts have cut the step. */
  if (flesh_equations_residual(equations, to, r)) return;
  if (flesh_norm(equations->threads, n, r) < strain_growth * flesh_norm(equations->threads, n, step->b)) return;
  const double falls = s / cut * flesh_dot(equations->threads, n, step->b, p);
  const double value = go_back(self, step->value, to);
  /* The excess over the quadratic model grows with a power of the length, the gain linearly: this is the best length for
   * the next try. */
  const double excess = fmax(value - (step->start - falls * (1 - s / 2)), 1e-6 * falls);
  self->iterations.watchdog.length = s * length * fmin(fmax(pow(falls / (power * excess), 1 / (power - 1)), 0.1), 4);
  for (int d = 0; d < n; d++) equations->proposal[d] = to[d] - u[d];
  learn(self, value < step->value && take_proposal(self, step));
}

/* Continues a filtered step that has gained more than predicted along its arc, doubling it each time. */
static void go_along_arc(flesh_newton *self, flesh_step *step)
{
  const int falls_short = step->kind == FLESH_DIRECTION_FILTERED && step->length == 1 &&
                          step->actual > flesh_short_gain * step->predicted;
  if (!falls_short || !flesh_uses(&self->options, FLESH_TECHNIQUE_LONGER_STEPS)) return;
  while (flesh_volume_arc_double(&self->arc, step->u, step->p, self->equations.proposal) && take_proposal(self, step)) continue;
}

void flesh_newton_accelerate(flesh_newton *self, flesh_step *step)
{
  go_along_arc(self, step);
  if (propose_elimination(self, step)) take_proposal(self, step);
  run_watchdog(self, step);
}
