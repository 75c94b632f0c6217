/* motion.c: derivatives of what was measured of a motion, by tangents along its steps: the motion is run once more and
 * recorded, its stages are factored, and each parameter takes a linear solve for each in place of two runs. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "fit/fit.h"
#include "flesh/observer.h"
#include "sensitivity/sensitivity.h"

/* The residual that the linear solves leave. */
static const double tolerance = 1e-8;

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the tangents of a motion"); }

/* A column that is measured, or a component of positions at the end (no weights). */
typedef struct followed {
  flesh_asked asked;
  double before, now; /* derivatives of it at the last two states */
} followed;

/* A parameter, of whose tangent is taken what is measured. */
typedef struct following {
  const flesh_fit_experiment *e;
  flesh_scene *scenes[2]; /* beside its value */
  int n;
  followed *columns; /* of all tables of probes, one after the other */
  int column_count;
  int states;
  double before; /* s */
  double *to;    /* the first entry of a parameter's column of derivatives */
  int stride;
} following;

const char *flesh_fit_motion_refused(const flesh_fit_experiment *e, const flesh_scene *scene)
{
  for (int k = 0; k < e->measured_count; k++) {
    const flesh_fit_measured *m = &e->measured[k];
    if (m->table == FLESH_FIT_OF_HISTORY) return "it is a motion of which history is measured";
    for (int q = 0; q < m->quantity_count && m->table == FLESH_FIT_OF_PROBES; q++) {
      flesh_asked asked;
      const int status = flesh_asked_find(scene, m->quantities[q].name, e->end, &asked);
      const int is_other = status || asked.over != FLESH_AT_END;
      flesh_asked_clear(&asked);
      if (is_other) return "it is a motion of which more than positions and velocities is measured";
    }
  }
  return "";
}

static int open_columns(following *f, const flesh_scene *scene)
{
  int count = 0, status = FLESH_OK;
  for (int k = 0; k < f->e->measured_count; k++)
    if (f->e->measured[k].table == FLESH_FIT_OF_PROBES) count += f->e->measured[k].quantity_count;
  f->columns = calloc((size_t)count + 1, sizeof *f->columns);
  if (!f->columns) return no_memory();
  for (int k = 0; k < f->e->measured_count && !status; k++)
    for (int q = 0; q < f->e->measured[k].quantity_count && f->e->measured[k].table == FLESH_FIT_OF_PROBES && !status; q++)
      status = flesh_asked_find(scene, f->e->measured[k].quantities[q].name, f->e->end, &f->columns[f->column_count++].asked);
  return status;
}

/* A number's derivative at the state at t, or between it and the last; of positions at every state, so that the last stays. */
static void take(const following *f, const flesh_fit_measured *m, const flesh_fit_datum *d, const followed *column, double t,
                 const double *dx, double *to)
{
  if (!column) {
    const flesh_fit_point *point = &m->points[d->row];
    *to = 0;
    for (int a = 0; a < point->count; a++)
      *to += point->weights[a] * dx[3 * (size_t)point->nodes[a] + (size_t)(*m->quantities[d->quantity].name - 'x')];
  } else if (isnan(d->t) || d->t == t) *to = column->now;
  else if (f->states && d->t > f->before && d->t < t)
    *to = column->before + (column->now - column->before) * (d->t - f->before) / (t - f->before);
  else if (d->t > t && d->t - t <= 1e-9 * (1 + fabs(t))) *to = column->now;
}

/* Implements flesh_tangent_visit. */
static int follow(void *data, int parameter, double t, const double *dx, const double *dv)
{
  following *f = (following *)data + parameter;
  for (int c = 0; c < f->column_count; c++) {
    followed *column = &f->columns[c];
    column->before = column->now;
    column->now = 0;
    for (int d = 0; d < f->n; d++) {
      if (column->asked.by_x) column->now += column->asked.by_x[d] * dx[d];
      if (column->asked.by_v) column->now += column->asked.by_v[d] * dv[d];
    }
  }
  double *to = f->to;
  for (int k = 0, first = 0; k < f->e->measured_count; k++) {
    const flesh_fit_measured *m = &f->e->measured[k];
    const int of_probes = m->table == FLESH_FIT_OF_PROBES;
    for (int i = 0; i < m->count; i++, to += f->stride)
      take(f, m, &m->data[i], of_probes ? &f->columns[first + m->data[i].quantity] : NULL, t, dx, to);
    if (of_probes) first += m->quantity_count;
  }
  f->states++;
  f->before = t;
  return flesh_interrupt_signal() ? flesh_fail(FLESH_ERR_INTERRUPTED, "interrupted by %s", flesh_interrupt_name()) : FLESH_OK;
}

/* The start of the scene's motion: new x, with v behind it. */
static int make_start(const flesh_scene *scene, flesh_state *state)
{
  const flesh_system *system = flesh_scene_system(scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  const int multipliers = flesh_system_multiplier_count(system), internal = flesh_system_internal_count(system);
  *state = (flesh_state){.x = calloc(2 * n + (size_t)multipliers + (size_t)internal + 1, sizeof *state->x)};
  if (!state->x) return no_memory();
  state->v = state->x + n;
  state->multipliers = multipliers ? state->v + n : NULL;
  state->multiplier_count = multipliers;
  state->internal = internal ? state->v + n + multipliers : NULL;
  state->internal_count = internal;
  flesh_scene_start(scene, state);
  return FLESH_OK;
}

/* Runs the motion while the trajectory records it. */
static int record(const flesh_scene *scene, flesh_integrator **integrator, flesh_trajectory **trajectory)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_run_options run = {.h = time->step, .end = time->end, .stop = flesh_interrupt_asked};
  flesh_state state = {0};
  int status = make_start(scene, &state);
  if (!status) status = flesh_integrator_create(flesh_scene_system(scene), time->method, flesh_scene_solver(scene), integrator);
  if (!status) status = flesh_integrator_set_method_options(*integrator, &time->options);
  if (!status) status = flesh_integrator_set_adaptive(*integrator, &time->adaptive);
  if (!status) status = flesh_integrator_set_max_energy_gain(*integrator, time->max_energy_gain);
  if (!status) status = flesh_trajectory_create(*integrator, tolerance, FLESH_TRAJECTORY_STATES, trajectory);
  if (!status) status = flesh_run(flesh_scene_system(scene), *integrator, &run, &state, NULL);
  free(state.x);
  return status;
}

/* The systems beside a parameter's value, and the derivatives of the start [2*n] by it. */
static int take_parameter(following *f, const flesh_fit *fit, int experiment, const double *p, int k, flesh_parameter *parameter,
                          double *start)
{
  flesh_state starts[2] = {{0}};
  double h;
  int status = flesh_fit_scenes_beside(fit, experiment, p, k, &h, f->scenes);
  for (int s = 0; s < 2 && !status; s++) status = make_start(f->scenes[s], &starts[s]);
  if (!status) {
    *parameter = (flesh_parameter){{NULL, flesh_scene_system(f->scenes[0]), flesh_scene_system(f->scenes[1]), NULL}, h};
    for (int d = 0; d < 2 * f->n; d++) start[d] = (starts[1].x[d] - starts[0].x[d]) / (2 * h);
  }
  free(starts[0].x);
  free(starts[1].x);
  return status;
}

/* The columns of all parameters that act, [count] of them. */
static int differentiate(following *all, int count, const flesh_fit *fit, int experiment, const double *p,
                         const flesh_scene *scene, flesh_trajectory *trajectory)
{
  const size_t unknowns = 2 * (size_t)all->n;
  flesh_parameter *parameters = calloc((size_t)count, sizeof *parameters);
  double *starts = calloc((size_t)count * unknowns, sizeof *starts);
  int status = parameters && starts ? FLESH_OK : no_memory();
  for (int k = 0, i = 0; k < fit->parameter_count && !status; k++) {
    if (!all->e->acts[k]) continue;
    status = open_columns(&all[i], scene);
    if (!status) status = take_parameter(&all[i], fit, experiment, p, k, &parameters[i], starts + (size_t)i * unknowns);
    i++;
  }
  if (!status) status = flesh_trajectory_tangents(trajectory, count, parameters, starts, follow, all);
  free(parameters);
  free(starts);
  return status;
}

static void close_following(following *f)
{
  for (int s = 0; s < 2; s++) flesh_scene_destroy(&f->scenes[s]);
  for (int c = 0; c < f->column_count; c++) flesh_asked_clear(&f->columns[c].asked);
  free(f->columns);
}

int flesh_fit_motion_tangents(flesh_fit *fit, int experiment, const double *p, double *tangents)
{
  const flesh_fit_experiment *e = &fit->experiments[experiment];
  following *all = calloc((size_t)fit->parameter_count + 1, sizeof *all);
  flesh_scene *scene = NULL;
  flesh_integrator *integrator = NULL;
  flesh_trajectory *trajectory = NULL;
  int count = 0, status = all ? flesh_fit_scene_at(fit, experiment, p, &scene) : no_memory();
  for (int k = 0; k < fit->parameter_count && !status; k++)
    if (e->acts[k]) all[count++] = (following){.e = e, .n = 3 * e->nodes, .stride = fit->parameter_count, .to = tangents + k};
  if (!status) status = record(scene, &integrator, &trajectory);
  if (!status && count) status = differentiate(all, count, fit, experiment, p, scene, trajectory);
  if (!status) fit->linear += count * flesh_trajectory_get_costs(trajectory).parts;
  flesh_trajectory_destroy(&trajectory);
  flesh_integrator_destroy(&integrator);
  for (int k = 0; k < count; k++) close_following(&all[k]);
  free(all);
  flesh_scene_destroy(&scene);
  return status;
}
