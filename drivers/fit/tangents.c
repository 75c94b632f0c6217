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
#include "fit/observation.h"
#include "flesh/observer.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"

/* Relative residual of the linear solves. */
static const double tolerance = 1e-8;

/* An experiment whose equilibria are differentiated. */
typedef struct equilibrium_tangents {
  flesh_fit *fit;
  const flesh_fit_experiment *e;
  flesh_scene *scene;
  flesh_sensitivity **at; /* [equilibria]; NULL for the start */
  double *dx;             /* [equilibria * 3 * nodes] */
  double *values[2];      /* [count] */
  double *direction;      /* [parameters] */
} equilibrium_tangents;

static int factor(equilibrium_tangents *t)
{
  const flesh_fit_equilibria *kept = &t->e->equilibria;
  int status = FLESH_OK;
  for (int r = kept->has_start; r < kept->count && !status; r++) {
    status = flesh_sensitivity_create(flesh_scene_system(t->scene), flesh_scene_solver(t->scene), tolerance, &t->at[r]);
    if (!status) status = flesh_sensitivity_set(t->at[r], &kept->states[r], NULL);
  }
  return status;
}

/* Has the tables observe a state, as a run that ends where it begins. */
static int observe(const flesh_scene *scene, flesh_state *state, const flesh_fit_tables *tables)
{
  const flesh_observer observers[] = {{flesh_history_observe, tables->history}, {flesh_probes_observe, tables->probes}};
  const int from = !tables->history, count = (tables->history != NULL) + (tables->probes != NULL);
  const flesh_run_options run = {.h = 1, .end = state->t, .observer_count = count, .observers = observers + from};
  flesh_integrator *integrator = NULL;
  if (!count) return FLESH_OK;
  int status = flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_STATIC, flesh_scene_solver(scene), &integrator);
  if (!status) status = flesh_run(flesh_scene_system(scene), integrator, &run, state, NULL);
  flesh_integrator_destroy(&integrator);
  return status;
}

/* Reads the measured quantities at the states `h` along the tangents, with the scene there. */
static int values_along(const equilibrium_tangents *t, const flesh_scene *scene, double h, double *values)
{
  const flesh_fit_equilibria *kept = &t->e->equilibria;
  const int unknowns = 3 * t->e->nodes;
  flesh_fit_tables tables;
  flesh_state state = {0};
  int status = flesh_fit_tables_open(t->e, scene, &tables);
  for (int r = 0; r < kept->count && !status; r++) {
    free(state.x);
    status = flesh_fit_state_copy(&kept->states[r], t->e->nodes, &state);
    for (int i = 0; i < unknowns && !status; i++) state.x[i] += h * t->dx[(size_t)r * (size_t)unknowns + (size_t)i];
    if (!status) status = observe(scene, &state, &tables);
  }
  status = flesh_fit_tables_close(&tables, status);
  if (!status) status = flesh_fit_read_values(t->e, t->e->scratch, state.x, values);
  free(state.x);
  return status;
}

/* Computes the column of derivatives by a parameter. */
static int differentiate(const equilibrium_tangents *t, int k, double *tangents)
{
  flesh_fit *fit = t->fit;
  const flesh_fit_equilibria *kept = &t->e->equilibria;
  const size_t unknowns = 3 * (size_t)t->e->nodes;
  flesh_scene *scenes[2] = {NULL};
  const double h = flesh_fit_direction(fit, kept->p, k, t->direction);
  int status = flesh_fit_scenes_beside(fit, t->e, kept->p, t->direction, h, scenes);
  if (!status) {
    const flesh_parameter parameter = {{NULL, flesh_scene_system(scenes[0]), flesh_scene_system(scenes[1]), NULL}, h};
    memset(t->dx, 0, (size_t)kept->count * unknowns * sizeof *t->dx);
    for (int r = kept->has_start; r < kept->count && !status; r++, fit->linear++)
      status = flesh_sensitivity_tangent(t->at[r], &parameter, t->dx + (size_t)r * unknowns);
  }
  for (int s = 0; s < 2 && !status; s++) status = values_along(t, scenes[s], s ? h : -h, t->values[s]);
  for (int d = 0; d < t->e->count && !status; d++)
    tangents[(size_t)d * (size_t)fit->key_count + (size_t)k] = (t->values[1][d] - t->values[0][d]) / (2 * h);
  flesh_scene_destroy(&scenes[0]);
  flesh_scene_destroy(&scenes[1]);
  return status;
}

int flesh_fit_tangents(flesh_fit *fit, const flesh_fit_experiment *e, double *tangents)
{
  const size_t states = (size_t)e->equilibria.count, count = (size_t)e->count;
  flesh_arena memory = {0};
  equilibrium_tangents t = {.fit = fit, .e = e, .at = flesh_arena_take(&memory, states * sizeof *t.at),
                            .dx = flesh_arena_take(&memory, states * 3 * (size_t)e->nodes * sizeof(double)),
                            .values = {flesh_arena_take(&memory, count * sizeof(double)),
                                       flesh_arena_take(&memory, count * sizeof(double))},
                            .direction = flesh_arena_take(&memory, (size_t)fit->parameter_count * sizeof(double))};
  const int room = t.at && t.dx && t.values[0] && t.values[1] && t.direction;
  int status = room ? flesh_fit_scene_at(fit, e, e->equilibria.p, &t.scene) : flesh_no_memory();
  if (!status) status = factor(&t);
  for (int k = 0; k < fit->key_count && !status; k++)
    if (e->acts[k]) status = differentiate(&t, k, tangents);
  for (size_t r = 0; r < states && t.at; r++) flesh_sensitivity_destroy(&t.at[r]);
  flesh_scene_destroy(&t.scene);
  flesh_fit_scratch_remove(fit, e);
  flesh_arena_free(&memory);
  return status;
}

struct flesh_fit_motion {
  flesh_fit *fit;
  const flesh_fit_experiment *e;
  int n;
  const double *p;
  const double *y; /* [measured numbers] their weights, the input of an adjoint */
  flesh_arena memory; /* owns both arrays */
  flesh_response *columns; /* of probes; they are linear in the state, so their derivatives are the same at all states */
  double *values;          /* [columns] workspace */
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_trajectory *trajectory;
  flesh_fit_observation observation;
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
static int note(void *observation, const flesh_step_record *record)
{
  return flesh_fit_observation_add(observation, record->state->t);
}

int flesh_fit_motion_create(flesh_fit *fit, const flesh_fit_experiment *e, const double *p, flesh_fit_motion **motion)
{
  const size_t count = (size_t)e->column_count;
  flesh_state state = {0};
  flesh_fit_motion *m = *motion = calloc(1, sizeof *m);
  if (!m) return flesh_no_memory();
  *m = (flesh_fit_motion){.fit = fit, .e = e, .n = 3 * e->nodes, .p = p, .observation = {.e = e}};
  m->columns = flesh_arena_take(&m->memory, count * sizeof *m->columns);
  m->values = flesh_arena_take(&m->memory, count * sizeof *m->values);
  int status = m->columns && m->values ? flesh_fit_scene_at(fit, e, p, &m->scene) : flesh_no_memory();
  for (size_t c = 0; c < count && !status; c++)
    status = flesh_response_find(m->scene, e->columns[c], e->end, &m->columns[c]);
  if (!status)
    status = flesh_response_run(m->scene, flesh_scene_solver(m->scene), &(flesh_observer){note, &m->observation}, &state,
                                &m->integrator, tolerance, &m->trajectory);
  free(state.x);
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
  for (int c = 0; c < m->e->column_count && m->columns; c++) flesh_response_clear(&m->columns[c]);
  flesh_arena_free(&m->memory);
  free(m->observation.times);
  free(m);
  *motion = NULL;
}

/* A change of parameters, along whose tangent the measured quantities are differentiated. */
typedef struct following {
  flesh_fit_motion *motion;
  flesh_scene *scenes[2]; /* on both sides of p */
  int states;             /* number of those that were visited */
  double *to;             /* first entry of its column of derivatives */
  int stride;
} following;

/* Implements flesh_tangent_visit. */
static int follow(void *data, int change, double t, const double *dx, const double *dv)
{
  following *f = (following *)data + change;
  const flesh_fit_motion *m = f->motion;
  (void)t;
  for (int c = 0; c < m->e->column_count; c++) {
    const double *by_x = m->columns[c].by_x, *by_v = m->columns[c].by_v;
    m->values[c] = 0;
    for (int i = 0; i < m->n; i++) m->values[c] += (by_x ? by_x[i] * dx[i] : 0) + (by_v ? by_v[i] * dv[i] : 0);
  }
  flesh_fit_observation_apply(&m->observation, f->states++, dx, m->values, f->to, f->stride);
  return flesh_interrupt_check();
}

/* Reads the scenes on both sides of p along a change; returns their systems, and the derivatives of the start [2*n]. */
static int vary(following *f, const double *change, double h, flesh_parameter *parameter, double *start)
{
  const flesh_fit_motion *m = f->motion;
  flesh_state starts[2] = {{0}}; /* v stands behind x in memory */
  int status = flesh_fit_scenes_beside(m->fit, m->e, m->p, change, h, f->scenes);
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
  memset(to, 0, (size_t)m->e->count * (size_t)count * sizeof *to);
  for (int k = 0; k < count && !status; k++) {
    if (h[k] == 0) continue;
    following *f = &all[used];
    *f = (following){.motion = m, .to = to + k, .stride = count};
    status = vary(f, changes + (size_t)k * (size_t)m->fit->parameter_count, h[k], &parameters[used],
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

/* Implements flesh_adjoint_visit. */
static int add_weights(void *motion, double t, double *by_x, double *by_v)
{
  const flesh_fit_motion *m = motion;
  const flesh_fit_observation *o = &m->observation;
  int s = o->count - 1;
  while (s && fabs(o->times[s - 1] - t) < fabs(o->times[s] - t)) s--;
  for (int c = 0; c < m->e->column_count; c++) m->values[c] = 0;
  flesh_fit_observation_transpose(o, s, m->y, by_x, m->values);
  for (int c = 0; c < m->e->column_count; c++)
    for (int i = 0; i < m->n && m->values[c] != 0; i++) {
      if (m->columns[c].by_x) by_x[i] += m->values[c] * m->columns[c].by_x[i];
      if (m->columns[c].by_v) by_v[i] += m->values[c] * m->columns[c].by_v[i];
    }
  return flesh_interrupt_check();
}

int flesh_fit_motion_back(flesh_fit_motion *m, const flesh_tet_parameter *parameter, const double *y, double *gradient)
{
  m->fit->linear += flesh_trajectory_get_costs(m->trajectory).parts;
  m->y = y;
  return flesh_trajectory_tet_gradient(m->trajectory, parameter, add_weights, m, gradient);
}

int flesh_fit_motion_tangents(flesh_fit *fit, const flesh_fit_experiment *e, const double *p, double *tangents)
{
  const size_t count = (size_t)fit->key_count, all = (size_t)fit->parameter_count;
  double *h = malloc((count * (all + 1) + 1) * sizeof *h), *changes = h + count;
  flesh_fit_motion *motion = NULL;
  int status = h ? flesh_fit_motion_create(fit, e, p, &motion) : flesh_no_memory();
  for (int k = 0; k < fit->key_count && !status; k++) {
    h[k] = flesh_fit_direction(fit, p, k, changes + (size_t)k * all);
    if (!e->acts[k]) h[k] = 0;
  }
  if (!status) status = flesh_fit_motion_along(motion, fit->key_count, changes, h, tangents);
  flesh_fit_motion_destroy(&motion);
  free(h);
  return status;
}
