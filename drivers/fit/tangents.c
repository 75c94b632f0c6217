/* tangents.c: differentiates the measured quantities by tangents. At equilibria a linear solve for each parameter
 * replaces two runs: the tangent dx/dp takes the equilibrium to x +- h dx/dp, p +- h, where the quantities are
 * differenced without a solve, from the tables that a run writes. A motion has tangents along its steps: it is run once
 * more and recorded, its stages are factored, and each parameter takes a linear solve for each stage instead of two
 * runs. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "fit/told.h"
#include "flesh/observer.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"

/* Relative residual of the linear solves. */
static const double tolerance = 1e-8;

typedef struct tangenting {
  flesh_fit *fit;
  flesh_fit_experiment *e;
  int experiment;
  flesh_scene *scene;
  flesh_sensitivity **at; /* [kept]; NULL for the start */
  double *dx;             /* [kept * 3 * nodes]; the other arrays stand behind it */
  double *values[2];      /* [count] */
  double *direction;      /* [parameters] */
  char *folder;
  int solves;
} tangenting;

static int factor(tangenting *t)
{
  const flesh_fit_kept *kept = &t->e->kept;
  int status = FLESH_OK;
  for (int r = kept->has_start; r < kept->count && !status; r++) {
    status = flesh_sensitivity_create(flesh_scene_system(t->scene), flesh_scene_solver(t->scene), tolerance, &t->at[r]);
    if (!status) status = flesh_sensitivity_set(t->at[r], &kept->states[r], NULL);
  }
  return status;
}

/* Has the tables observe a state, as a run that ends where it begins. */
static int observe(const flesh_scene *scene, flesh_state *state, flesh_history *history, flesh_probes *probes)
{
  const flesh_observer observers[] = {{flesh_history_observe, history}, {flesh_probes_observe, probes}};
  const int from = !history, count = (history != NULL) + (probes != NULL);
  const flesh_run_options run = {.h = 1, .end = state->t, .observer_count = count, .observers = observers + from};
  flesh_integrator *integrator = NULL;
  int status = flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_STATIC, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_run(flesh_scene_system(scene), integrator, &run, state, NULL);
  flesh_integrator_destroy(&integrator);
  return status;
}

/* Reads the measured quantities at the states `h` along the tangents, with the scene there. */
static int take_along(const tangenting *t, const flesh_scene *scene, double h, double *values)
{
  const flesh_fit_kept *kept = &t->e->kept;
  const int unknowns = 3 * t->e->nodes;
  flesh_history *history = NULL;
  flesh_probes *probes = NULL;
  flesh_state state = {0};
  int wanted[3] = {0};
  for (int k = 0; k < t->e->measured_count; k++) wanted[t->e->measured[k].table] = 1;
  int status = flesh_fit_tables_open(scene, t->folder, wanted[FLESH_FIT_OF_HISTORY] ? &history : NULL,
                                     wanted[FLESH_FIT_OF_PROBES] ? &probes : NULL);
  for (int r = 0; r < kept->count && !status; r++) {
    flesh_fit_state_free(&state);
    status = flesh_fit_state_copy(&kept->states[r], t->e->nodes, &state);
    for (int i = 0; i < unknowns && !status; i++) state.x[i] += h * t->dx[(size_t)r * (size_t)unknowns + (size_t)i];
    if (!status && (history || probes)) status = observe(scene, &state, history, probes);
  }
  const int closed[] = {flesh_history_close(&history), flesh_probes_close(&probes)};
  if (!status) status = closed[0] ? closed[0] : closed[1];
  if (!status) status = flesh_fit_take(t->e, t->folder, state.x, values);
  flesh_fit_state_free(&state);
  return status;
}

/* Computes the column of derivatives by a parameter. */
static int differentiate(tangenting *t, int k, double *tangents)
{
  const flesh_fit *fit = t->fit;
  const flesh_fit_kept *kept = &t->e->kept;
  const size_t unknowns = 3 * (size_t)t->e->nodes;
  flesh_scene *scenes[2] = {NULL};
  const double h = flesh_fit_direct(fit, kept->p, k, t->direction);
  int status = flesh_fit_scenes_beside(fit, t->experiment, kept->p, t->direction, h, scenes);
  if (!status) {
    const flesh_parameter parameter = {{NULL, flesh_scene_system(scenes[0]), flesh_scene_system(scenes[1]), NULL}, h};
    memset(t->dx, 0, (size_t)kept->count * unknowns * sizeof *t->dx);
    for (int r = kept->has_start; r < kept->count && !status; r++, t->solves++)
      status = flesh_sensitivity_tangent(t->at[r], &parameter, t->dx + (size_t)r * unknowns);
  }
  for (int s = 0; s < 2 && !status; s++) status = take_along(t, scenes[s], s ? h : -h, t->values[s]);
  for (int d = 0; d < t->e->count && !status; d++)
    tangents[(size_t)d * (size_t)fit->key_count + (size_t)k] = (t->values[1][d] - t->values[0][d]) / (2 * h);
  flesh_scene_destroy(&scenes[0]);
  flesh_scene_destroy(&scenes[1]);
  return status;
}

int flesh_fit_tangents(flesh_fit *fit, int experiment, double *tangents)
{
  flesh_fit_experiment *e = &fit->experiments[experiment];
  const size_t rows = (size_t)e->kept.count + 1, all = rows * 3 * (size_t)e->nodes, count = (size_t)e->count;
  tangenting t = {.fit = fit, .e = e, .experiment = experiment, .at = calloc(rows, sizeof(flesh_sensitivity *)),
                  .dx = malloc((all + 2 * count + (size_t)fit->parameter_count) * sizeof(double)),
                  .folder = flesh_fit_scratch(fit, e)};
  int status = t.at && t.dx && t.folder ? flesh_folder_make(t.folder) : flesh_no_memory();
  if (t.dx) t.values[0] = t.dx + all, t.values[1] = t.values[0] + count, t.direction = t.values[1] + count;
  if (!status) status = flesh_fit_scene_at(fit, experiment, e->kept.p, &t.scene);
  if (!status) status = factor(&t);
  for (int k = 0; k < fit->key_count && !status; k++)
    if (e->acts[k]) status = differentiate(&t, k, tangents);
  for (int r = 0; r < e->kept.count && t.at; r++) flesh_sensitivity_destroy(&t.at[r]);
  flesh_scene_destroy(&t.scene);
  fit->linear += t.solves;
  flesh_fit_scratch_remove(t.folder);
  free(t.at);
  free(t.dx);
  return status;
}

struct flesh_fit_motion {
  flesh_fit *fit;
  int experiment, n, column_count;
  const double *p;
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_trajectory *trajectory;
  flesh_fit_told told;
  flesh_response *columns; /* of probes; they are linear in the state, so their derivatives are the same at all states */
};

const char *flesh_fit_motion_refused(const flesh_fit_experiment *e, const flesh_scene *scene)
{
  for (int k = 0; k < e->measured_count; k++)
    if (e->measured[k].table == FLESH_FIT_OF_HISTORY) return "it is a motion of which history is measured";
  for (int c = 0; c < e->column_count; c++) {
    flesh_response response;
    const int status = flesh_response_find(scene, e->columns[c], e->end, &response);
    const int is_other = status || response.over != FLESH_AT_END || response.probes;
    flesh_response_clear(&response);
    if (is_other) return "it is a motion of which more than positions and velocities is measured";
  }
  return "";
}

/* Records the time of a state. Implements flesh_observer's function. */
static int note(void *told, const flesh_step_record *record) { return flesh_fit_told_add(told, record->state->t); }

/* Runs the motion and records its trajectory. */
static int record(flesh_fit_motion *m)
{
  const flesh_scene_time *time = flesh_scene_times(m->scene);
  const flesh_observer observer = {note, &m->told};
  const flesh_run_options run = {.h = time->step, .end = time->end, .stop = flesh_interrupt_asked, .observer_count = 1,
                                 .observers = &observer};
  const flesh_system *system = flesh_scene_system(m->scene);
  flesh_state state = {0};
  int status = flesh_start_make(m->scene, &state);
  if (!status) status = flesh_start_integrator(m->scene, system, flesh_scene_solver(m->scene), &m->integrator);
  if (!status) status = flesh_trajectory_create(m->integrator, tolerance, FLESH_TRAJECTORY_STATES, &m->trajectory);
  if (!status) status = flesh_run(system, m->integrator, &run, &state, NULL);
  free(state.x);
  return status;
}

int flesh_fit_motion_create(flesh_fit *fit, int experiment, const double *p, flesh_fit_motion **motion)
{
  const flesh_fit_experiment *e = &fit->experiments[experiment];
  flesh_fit_motion *m = *motion = calloc(1, sizeof *m);
  if (!m) return flesh_no_memory();
  *m = (flesh_fit_motion){.fit = fit, .experiment = experiment, .n = 3 * e->nodes, .p = p, .told = {.e = e}};
  m->columns = calloc((size_t)e->column_count + 1, sizeof *m->columns);
  int status = m->columns ? flesh_fit_scene_at(fit, experiment, p, &m->scene) : flesh_no_memory();
  for (int c = 0; c < e->column_count && !status; c++)
    status = flesh_response_find(m->scene, e->columns[c], e->end, &m->columns[m->column_count++]);
  if (!status) status = record(m);
  fit->made++;
  if (status) flesh_fit_motion_destroy(motion);
  return status;
}

void flesh_fit_motion_destroy(flesh_fit_motion **motion)
{
  flesh_fit_motion *m = *motion;
  if (!m) return;
  flesh_trajectory_destroy(&m->trajectory);
  flesh_integrator_destroy(&m->integrator);
  flesh_scene_destroy(&m->scene);
  for (int c = 0; c < m->column_count; c++) flesh_response_clear(&m->columns[c]);
  free(m->columns);
  free(m->told.times);
  free(m);
  *motion = NULL;
}

/* A change of parameters, along whose tangent the measured quantities are differentiated. */
typedef struct following {
  const flesh_fit_motion *motion;
  flesh_scene *scenes[2]; /* on both sides of p */
  int states;
  const double *dx, *dv;
  double *to; /* first entry of its column of derivatives */
  int stride;
} following;

static void take(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c)
{
  const following *f = data;
  const flesh_response *response = &f->motion->columns[c < 0 ? 0 : c];
  double sum = c < 0 ? flesh_fit_told_position(m, d, f->dx) : 0;
  for (int i = 0; i < f->motion->n && c >= 0; i++)
    sum += (response->by_x ? response->by_x[i] * f->dx[i] : 0) + (response->by_v ? response->by_v[i] * f->dv[i] : 0);
  f->to[(size_t)row * (size_t)f->stride] += weight * sum;
}

/* Implements flesh_tangent_visit. */
static int follow(void *data, int change, double t, const double *dx, const double *dv)
{
  following *f = (following *)data + change;
  (void)t;
  f->dx = dx;
  f->dv = dv;
  flesh_fit_told_visit(&f->motion->told, f->states++, take, f);
  return flesh_interrupt_check();
}

/* Reads the scenes on both sides of p along a change; returns their systems, and the derivatives of the start [2*n]. */
static int take_change(following *f, const double *change, double h, flesh_parameter *parameter, double *start)
{
  const flesh_fit_motion *m = f->motion;
  flesh_state starts[2] = {{0}}; /* v stands behind x in memory */
  int status = flesh_fit_scenes_beside(m->fit, m->experiment, m->p, change, h, f->scenes);
  for (int s = 0; s < 2 && !status; s++) status = flesh_start_make(f->scenes[s], &starts[s]);
  if (!status) {
    *parameter = (flesh_parameter){{NULL, flesh_scene_system(f->scenes[0]), flesh_scene_system(f->scenes[1]), NULL}, h};
    for (int d = 0; d < 2 * m->n; d++) start[d] = (starts[1].x[d] - starts[0].x[d]) / (2 * h);
  }
  free(starts[0].x);
  free(starts[1].x);
  return status;
}

int flesh_fit_motion_along(flesh_fit_motion *m, int count, const double *changes, const double *h, double *to)
{
  const size_t unknowns = 2 * (size_t)m->n;
  flesh_arena memory = {0};
  following *all = flesh_arena_take(&memory, (size_t)count * sizeof *all);
  flesh_parameter *parameters = flesh_arena_take(&memory, (size_t)count * sizeof *parameters);
  double *starts = flesh_arena_take(&memory, (size_t)count * unknowns * sizeof *starts);
  int used = 0, status = all && parameters && starts ? FLESH_OK : flesh_no_memory();
  memset(to, 0, (size_t)m->told.e->count * (size_t)count * sizeof *to);
  for (int k = 0; k < count && !status; k++) {
    if (h[k] == 0) continue;
    following *f = &all[used];
    *f = (following){.motion = m, .to = to + k, .stride = count};
    status = take_change(f, changes + (size_t)k * (size_t)m->fit->parameter_count, h[k], &parameters[used],
                         starts + (size_t)used * unknowns);
    used++;
  }
  if (!status && used) status = flesh_trajectory_tangents(m->trajectory, used, parameters, starts, follow, all);
  m->fit->linear += used * flesh_trajectory_get_costs(m->trajectory).parts;
  for (int k = 0; k < used; k++)
    for (int s = 0; s < 2; s++) flesh_scene_destroy(&all[k].scenes[s]);
  flesh_arena_free(&memory);
  return status;
}

/* The input of an adjoint: weights of the measured numbers. */
typedef struct giving {
  const flesh_fit_motion *motion;
  const double *y;
  double *by_x, *by_v;
} giving;

static void give(void *data, const flesh_fit_measured *m, const flesh_fit_datum *d, int row, double weight, int c)
{
  const giving *g = data;
  const double y = weight * g->y[row];
  if (c < 0) flesh_fit_told_give(m, d, y, g->by_x);
  const flesh_response *response = &g->motion->columns[c < 0 ? 0 : c];
  for (int i = 0; i < g->motion->n && c >= 0; i++) {
    if (response->by_x) g->by_x[i] += y * response->by_x[i];
    if (response->by_v) g->by_v[i] += y * response->by_v[i];
  }
}

/* Implements flesh_adjoint_visit. */
static int give_all(void *data, double t, double *by_x, double *by_v)
{
  giving *g = data;
  const flesh_fit_told *told = &g->motion->told;
  int s = told->count - 1;
  while (s && fabs(told->times[s - 1] - t) < fabs(told->times[s] - t)) s--;
  g->by_x = by_x;
  g->by_v = by_v;
  flesh_fit_told_visit(told, s, give, g);
  return flesh_interrupt_check();
}

int flesh_fit_motion_back(flesh_fit_motion *m, const flesh_tet_parameter *parameter, const double *y, double *gradient)
{
  giving g = {.motion = m, .y = y};
  m->fit->linear += flesh_trajectory_get_costs(m->trajectory).parts;
  return flesh_trajectory_tet_gradient(m->trajectory, parameter, give_all, &g, gradient);
}

int flesh_fit_motion_tangents(flesh_fit *fit, int experiment, const double *p, double *tangents)
{
  const size_t count = (size_t)fit->key_count, all = (size_t)fit->parameter_count;
  double *changes = malloc((count * all + 1) * sizeof *changes), *h = malloc((count + 1) * sizeof *h);
  flesh_fit_motion *motion = NULL;
  int status = changes && h ? flesh_fit_motion_create(fit, experiment, p, &motion) : flesh_no_memory();
  for (int k = 0; k < fit->key_count && !status; k++) {
    h[k] = flesh_fit_direct(fit, p, k, changes + (size_t)k * all);
    if (!fit->experiments[experiment].acts[k]) h[k] = 0;
  }
  if (!status) status = flesh_fit_motion_along(motion, fit->key_count, changes, h, tangents);
  flesh_fit_motion_destroy(&motion);
  free(changes);
  free(h);
  return status;
}
