/* step_energy.c: finds the work of a stage's forces and reactions, and the energy that changes with time at fixed
 * positions. */
#include "time/step_energy.h"

#include <math.h>
#include <string.h>

#include "base/parallel_vector.h"
#include "system/one_effect.h"
#include "system/ranks.h"
#include "system/work.h"

int flesh_step_energy_begin(flesh_energy_watch *watch, const flesh_prescribed *prescribed, const flesh_state *state,
                            double t, double h, const double *a, double *r)
{
  const flesh_point point = flesh_energy_watch_point(watch, t, state, a);
  double power = 0, work;
  int status = FLESH_OK;
  for (int d = 0; d < watch->n; d++) r[d] = prescribed->fixed[d] ? state->v[d] : 0;
  const int moves = flesh_largest(watch->evaluation->threads, watch->n, r) > 0;
  if (moves) status = flesh_system_residual(watch->system, &point, r);
  for (int d = 0; d < watch->n && moves; d++)
    if (!prescribed->fixed[d]) r[d] = 0;
  if (moves && !status) power = flesh_system_product(watch->system, state->v, r);
  if (!status && watch->kinds & FLESH_WORK_OF_FORCES) {
    status = flesh_system_work_of_forces(watch->system, &point, t, t + h, NULL, watch->scratch, &work);
    power += work / h;
  }
  flesh_energy_watch_begin(watch, t, status ? NAN : power);
  return status < 0 ? status : FLESH_OK;
}

/* Finds sums over the constrained dofs: the work of their reactions [count] along u; that with the velocities v
 * prescribed at the step's end, those of the cubic through four positions over the step (prescribed.h); u.u, u.v and
 * v.v. */
static void sum_works(const flesh_step_energy *step, const flesh_state *state, const double *u, double sums[5])
{
  const flesh_energy_watch *watch = step->watch;
  const int *dofs;
  int count, moves = 0;
  double *const *x = step->scratch;
  const double h = step->to - step->from, *reactions = flesh_nonlinear_reactions(step->nonlinear, &dofs, &count);
  for (int c = 0; c < 5; c++) sums[c] = 0;
  while (count > 0 && dofs[count - 1] >= watch->evaluation->own) count--;
  for (int k = 0; k < count; k++) {
    sums[0] += reactions[k] * u[dofs[k]];
    moves |= u[dofs[k]] != 0;
  }
  for (int k = 0; k < 2 && moves; k++) {
    memcpy(x[k], state->x, (size_t)watch->n * sizeof *x[k]);
    flesh_system_prescribe(watch->system, step->from + (k + 1) * h / 3, x[k]);
  }
  for (int k = 0; k < count && moves; k++) {
    const int d = dofs[k];
    const double first = x[0][d] - state->x[d], second = x[1][d] - state->x[d];
    const double v = (11 * u[d] - 18 * second + 9 * first) / 2;
    sums[1] += reactions[k] * v;
    sums[2] += u[d] * u[d], sums[3] += u[d] * v, sums[4] += v * v;
  }
  flesh_team_sum(flesh_system_team(watch->system), 5, sums);
}

/* Finds the power [W] of the stage's reactions and forces with its velocities. */
static int find_power(const flesh_step_energy *step, double *power)
{
  const flesh_energy_watch *watch = step->watch;
  const flesh_stage *stage = step->stage;
  const double *u = step->nonlinear->u, h = step->to - step->from;
  const int *constrained;
  int count, status = FLESH_OK;
  double part = 0;
  const double *reactions = flesh_nonlinear_reactions(step->nonlinear, &constrained, &count);
  *power = 0;
  for (int k = 0; k < count && constrained[k] < watch->evaluation->own; k++) {
    const int d = constrained[k];
    *power += reactions[k] * (stage->v0[d] + stage->shift.v * u[d]);
  }
  *power = flesh_team_total(flesh_system_team(watch->system), *power);
  if (!(watch->kinds & FLESH_WORK_OF_FORCES)) return FLESH_OK;
  const flesh_point point = flesh_nonlinear_point(step->nonlinear);
  status = flesh_system_work_of_forces(watch->system, &point, step->from, step->to, NULL, watch->scratch, &part);
  *power += part / h;
  return status;
}

int flesh_step_energy_add(flesh_step_energy *step, double weight, double start)
{
  const flesh_energy_watch *watch = step->watch;
  const double h = step->to - step->from;
  const int first = step->stages++ == 0;
  int status = find_power(step, &step->power);
  if (status) step->power = NAN;
  if (first) step->work = h * start * (isnan(watch->rate) ? step->power : watch->rate);
  step->work += h * weight * step->power;
  return status < 0 ? status : FLESH_OK;
}

/* Finds the work of a step of first order: that of its forces along the displacements, and of the reactions as
 * energy_watch.c says. */
static int find_work_of_first_order(const flesh_step_energy *step, const flesh_state *state, double *work)
{
  flesh_energy_watch *watch = step->watch;
  const double *u = step->nonlinear->u;
  double sums[5], part = 0;
  int status = FLESH_OK;
  sum_works(step, state, u, sums);
  *work = sums[0];
  if (sums[2] > 0) watch->unbalanced += fmax(sums[1] - *work, 0);
  if (sums[2] > 0 && sums[4] > 0) watch->turned = fabs(sums[3] / sqrt(sums[2] * sums[4])) < M_SQRT1_2;
  if (!(watch->kinds & FLESH_WORK_OF_FORCES)) return FLESH_OK;
  const flesh_point point = flesh_nonlinear_point(step->nonlinear);
  status = flesh_system_work_of_forces(watch->system, &point, step->from, step->to, u, watch->scratch, &part);
  *work += part;
  return status;
}

/* Finds the work as energy_watch.c says, and the energy that changes with time at the step's start. If that has no
 * value, the balance restarts. */
int flesh_step_energy_count(const flesh_step_energy *step, const flesh_state *state)
{
  flesh_energy_watch *watch = step->watch;
  const double h = step->to - step->from;
  double work = step->work, part = 0;
  int status = FLESH_OK;
  watch->turned = 0;
  if (!step->second) {
    status = find_work_of_first_order(step, state, &work);
  } else if (!step->stages) {
    status = find_power(step, &work);
    work *= h;
  }
  if (step->stages && isnan(work)) status = FLESH_NONFINITE;
  flesh_energy_watch_add_work(watch, step->from, step->to, step->stage->t, work, !step->second || step->stages);
  if (step->stages) flesh_energy_watch_begin(watch, step->to, step->power);
  if (!status && !step->stages && watch->kinds & FLESH_WORK_IN_TIME && watch->known) {
    status = flesh_system_work_in_time(watch->system, step->from, step->to, state, watch->energies, 0, &part);
    watch->balance.supplied += step->second ? part / 2 : part;
  }
  if (status) watch->known = 0;
  return status < 0 ? status : FLESH_OK;
}

/* Finds the energy that changes with time at fixed positions, over a step with several stages: sums by the trapezoidal
 * rule over the step and over its halves, extrapolated to order 4, at positions along the cubic between the step's
 * ends. */
static int add_work_in_time(const flesh_step_energy *step, const flesh_state *start, const flesh_state *end)
{
  flesh_energy_watch *watch = step->watch;
  const double h = step->to - step->from, middle = step->from + h / 2;
  flesh_state between = {.x = step->scratch[1], .v = end->v, .internal = start->internal};
  const struct {
    const flesh_state *place;
    double from, to, weight;
  } parts[] = {{start, step->from, middle, 2. / 3},   {&between, step->from, step->to, 2. / 3},
               {end, middle, step->to, 2. / 3},       {start, step->from, step->to, -1. / 6},
               {end, step->from, step->to, -1. / 6}};
  int status = FLESH_OK;
  if (!(watch->kinds & FLESH_WORK_IN_TIME)) return FLESH_OK;
  for (int d = 0; d < watch->n; d++)
    between.x[d] = (start->x[d] + end->x[d]) / 2 + h * (start->v[d] - end->v[d]) / 8;
  for (size_t k = 0; k < sizeof parts / sizeof parts[0] && !status; k++) {
    double work = 0;
    status = flesh_system_work_in_time(watch->system, parts[k].from, parts[k].to, parts[k].place,
                                       parts[k].place == end ? watch->energies : NULL, 1, &work);
    watch->balance.supplied += parts[k].weight * work;
  }
  if (status) watch->known = 0;
  return status;
}

int flesh_step_energy_record(const flesh_step_energy *step, const flesh_state *start, const flesh_state *end)
{
  flesh_energy_watch *watch = step->watch;
  const int at_stage = step->stage->shift.x == 1;
  if (watch->turned) {
    flesh_energy_watch_jump(watch, step->to, end);
    return FLESH_OK;
  }
  int status = flesh_energy_watch_record_state(watch, step->to, end, at_stage ? &watch->evaluation->known_end.potential : NULL,
                                               at_stage ? NULL : step->energies);
  if (!status && watch->known && step->stages) status = add_work_in_time(step, start, end);
  else if (!status && step->second) status = flesh_energy_watch_add_work_in_time(watch, step->from, end);
  return status < 0 ? status : FLESH_OK;
}

int flesh_step_energy_judge(const flesh_step_energy *step, const flesh_state *end, const flesh_solve_stats *stats)
{
  flesh_energy_watch *watch = step->watch;
  const double left = fmin(stats->residual_last, stats->residual_target) * (step->stages ? step->stages : 1);
  const double unbalanced = left * flesh_norm(watch->evaluation->threads, watch->n, step->nonlinear->u);
  return watch->turned ? FLESH_OK : flesh_energy_watch_judge(watch, end, unbalanced);
}
