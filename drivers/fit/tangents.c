/* tangents.c: derivatives of what was measured by tangents of equilibria: a linear solve for each parameter in place of two
 * runs. A tangent dx/dp takes the equilibrium to x +- h dx/dp, p +- h, where the quantities are differenced without a solve,
 * by the tables that a run writes. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "fit/fit.h"
#include "flesh/observer.h"
#include "flesh/sensitivity.h"
#include "scene/scene.h"

/* The residual that the linear solves leave. */
static const double tolerance = 1e-8;

typedef struct tangenting {
  flesh_fit *fit;
  flesh_fit_experiment *e;
  int experiment;
  flesh_scene *scene;
  flesh_sensitivity **at; /* [kept]; NULL at the start */
  double *dx;             /* [kept * 3 * nodes], and the others behind it */
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

/* Has the tables observe a state: as a run that ends where it begins. */
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

/* Takes what was measured at the states that lie `h` along the tangents, of the scene there. */
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

/* The column of a parameter. */
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
