/* step_energy.c: work of a stage's forces and reactions, and what changes with time at a place. */
#include "time/step_energy.h"

#include <math.h>
#include <string.h>

#include "base/parallel_vector.h"
#include "system/work.h"

int flesh_step_energy_begin(flesh_energy_watch *watch, const flesh_prescribed *prescribed, const flesh_state *state,
                            double t, double h, const double *a, double *r)
{
  const flesh_point point = {.t = t, .load = 1, .x = state->x, .v = state->v, .a = a, .threads = watch->threads,
                             .multipliers = state->multipliers, .proximity = watch->proximity,
                             .costs = watch->costs};
  double power = 0, work;
  int moves = 0, status = FLESH_OK;
  for (int d = 0; d < watch->n; d++) moves |= prescribed->fixed[d] && state->v[d] != 0;
  if (moves) status = flesh_system_residual(watch->system, &point, r);
  for (int d = 0; d < watch->n && moves && !status; d++)
    if (prescribed->fixed[d]) power += r[d] * state->v[d];
  if (!status && watch->kinds & FLESH_WORK_OF_FORCES) {
    status = flesh_system_work_of_forces(watch->system, &point, t, t + h, NULL, watch->scratch, &work);
    power += work / h;
  }
  flesh_energy_watch_begin(watch, t, status ? NAN : power);
  return status < 0 ? status : FLESH_OK;
}

/* The work of the reactions [count] of the constrained `dofs` with the velocities v prescribed at the step's end, those
 * of the cubic through four positions over the step (prescribed.h). *cosine: of the angle between u and v. */
static double work_at_end(const flesh_step_energy *step, const flesh_state *state, const int *dofs, int count,
                          const double *reactions, const double *u, double *cosine)
{
  const flesh_system *system = step->watch->system;
  const double h = step->to - step->from;
  double work = 0, uu = 0, uv = 0, vv = 0, *const *x = step->scratch;
  for (int k = 0; k < 2; k++) {
    memcpy(x[k], state->x, (size_t)step->watch->n * sizeof *x[k]);
    flesh_system_prescribe(system, step->from + (k + 1) * h / 3, x[k]);
  }
  for (int k = 0; k < count; k++) {
    const int d = dofs[k];
    const double first = x[0][d] - state->x[d], second = x[1][d] - state->x[d];
    const double v = (11 * u[d] - 18 * second + 9 * first) / 2;
    work += reactions[k] * v;
    uu += u[d] * u[d], uv += u[d] * v, vv += v * v;
  }
  *cosine = vv > 0 ? uv / sqrt(uu * vv) : 1;
  return work;
}

/* The forces of the stage along the displacements (of first order) or with its velocities, the reactions as
 * energy_watch.c says, and what changes with time at the step's start. Where that has no value the balance restarts. */
int flesh_step_energy_count(const flesh_step_energy *step, const flesh_state *state)
{
  flesh_energy_watch *watch = step->watch;
  const flesh_stage *stage = step->stage;
  const double *u = flesh_nonlinear_unknowns(step->nonlinear), h = step->to - step->from;
  const int *constrained;
  double work = 0, part = 0;
  int count, status = FLESH_OK;
  const double *reactions = flesh_nonlinear_reactions(step->nonlinear, &constrained, &count);
  int moves = 0;
  for (int k = 0; k < count; k++) {
    const int d = constrained[k];
    moves |= u[d] != 0;
    work += reactions[k] * (step->second ? h * (stage->v0[d] + stage->shift.v * u[d]) : u[d]);
  }
  watch->turned = 0;
  if (moves && !step->second) {
    double cosine;
    watch->unbalanced += fmax(work_at_end(step, state, constrained, count, reactions, u, &cosine) - work, 0);
    watch->turned = fabs(cosine) < M_SQRT1_2;
  }
  if (watch->kinds & FLESH_WORK_OF_FORCES) {
    const flesh_point point = flesh_nonlinear_point(step->nonlinear);
    status = flesh_system_work_of_forces(watch->system, &point, step->from, step->to, step->second ? NULL : u,
                                         watch->scratch, &part);
    work += part;
  }
  flesh_energy_watch_supply(watch, step->from, step->to, stage->t, work, !step->second);
  if (!status && watch->kinds & FLESH_WORK_IN_TIME && watch->known) {
    status = flesh_system_work_in_time(watch->system, step->from, step->to, state->x, state->v, watch->energies, 0,
                                       &part);
    watch->balance.supplied += step->second ? part / 2 : part;
  }
  if (status) watch->known = 0;
  return status < 0 ? status : FLESH_OK;
}

int flesh_step_energy_judge(const flesh_step_energy *step, const flesh_state *state, const flesh_solve_stats *stats)
{
  flesh_energy_watch *watch = step->watch;
  const int at_stage = step->stage->shift.x == 1;
  if (watch->turned) {
    flesh_energy_watch_jump(watch, step->to, state);
    return FLESH_OK;
  }
  const double left = fmin(stats->residual_last, stats->residual_target);
  const double unbalanced = left * flesh_norm(watch->threads, watch->n, flesh_nonlinear_unknowns(step->nonlinear));
  int status = flesh_energy_watch_meet(watch, step->to, state,
                                       at_stage ? flesh_nonlinear_reached(step->nonlinear) : NULL,
                                       at_stage ? NULL : step->energies);
  if (!status && step->second) status = flesh_energy_watch_supply_in_time(watch, step->from, state);
  return status < 0 ? status : flesh_energy_watch_judge(watch, state, unbalanced);
}
