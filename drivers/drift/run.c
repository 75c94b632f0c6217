/* run.c: finds, names and runs the cases. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/confine.h"
#include "base/error.h"
#include "drift/drift.h"
#include "cli/path.h"
#include "material/form.h"
#include "mesh/mesh.h"
#include "cli/json_memory.h"
#include "run/describe.h"
#include "run/start.h"
#include "scene/scene.h"
#include "study/bodies.h"

/* A frame that is kept for a picture. */
typedef struct frame {
  flesh_state state;
  double drift; /* V/V_rest - 1 */
  int known;
} frame;

/* Keeps two frames: that with the largest change of volume, and the last one before the scene's last event (the
 * release), at which all energies can be compared. */
typedef struct watcher {
  frame worst, event;
  double event_t; /* time of the scene's last event before its end; the end if there is none */
  flesh_mesh_info info;
  int unknowns, first_inverted_step, first_bound_step; /* first steps with J <= 0 at points, and anywhere; -1: none */
} watcher;

static void keep(frame *kept, const flesh_step_record *record, double drift, int unknowns)
{
  kept->known = 1;
  kept->drift = drift;
  kept->state.t = record->state->t;
  memcpy(kept->state.x, record->state->x, sizeof(double) * (size_t)unknowns);
  memcpy(kept->state.v, record->state->v, sizeof(double) * (size_t)unknowns);
}

static int watch(void *data, const flesh_step_record *record)
{
  watcher *w = data;
  if (record->inverted && w->first_inverted_step < 0) w->first_inverted_step = record->step;
  if (!(record->J_bound > 0) && w->first_bound_step < 0) w->first_bound_step = record->step;
  double drift = record->volume / record->rest_volume - 1;
  if (!flesh_study_is_near(&w->info, record->state->x)) return FLESH_OK;
  if (!w->worst.known || fabs(drift) > fabs(w->worst.drift)) keep(&w->worst, record, drift, w->unknowns);
  if (record->state->t < w->event_t) keep(&w->event, record, drift, w->unknowns);
  return FLESH_OK;
}

static int open_watcher(watcher *w, const flesh_scene *scene)
{
  const flesh_system *system = flesh_scene_system(scene);
  double end = flesh_scene_times(scene)->end;
  flesh_mesh_inspect(flesh_scene_mesh(scene), &w->info);
  w->unknowns = 3 * w->info.nodes;
  w->event_t = INFINITY;
  for (double t = flesh_system_next_event(system, -INFINITY); t < end; t = flesh_system_next_event(system, t))
    if (t > 0) w->event_t = t;
  const int status = flesh_state_make(w->info.nodes, 0, 0, &w->worst.state);
  return status ? status : flesh_state_make(w->info.nodes, 0, 0, &w->event.state);
}

/* Writes the frames that were kept, and removes those of an older comparison. */
static int write_frames(const watcher *w, const char *folder)
{
  const char *const paths[] = {flesh_path("%s/worst_state.txt", folder), flesh_path("%s/event_state.txt", folder)};
  int status = FLESH_OK;
  for (int k = 0; k < 2 && !status; k++) {
    const frame *kept = k ? &w->event : &w->worst;
    flesh_path_unlink(paths[k]);
    if (kept->known) status = flesh_state_write(paths[k], w->unknowns / 3, &kept->state);
  }
  return status;
}

/* Overrides of the plain solver: steps are accepted as they are, and a run continues whatever energy it gains. */
static const char *const plain[][2] = {{"solver.line_search", "none"}, {"time.max_energy_gain", "1e300"},
                                       {"solver.eigenvalue_filter", "clamp-always"}, {"solver.max_newton", "10"},
                                       {"solver.max_cutbacks", "0"}, {"solver.accept_unconverged", "true"}};

/* Collects the plan's overrides and those of the scene; the caller closes them. */
static void set_overrides(const flesh_drift_plan *plan, const flesh_drift_scene *s, flesh_overrides *overrides)
{
  flesh_overrides_copy(overrides, &plan->options.overrides.texts);
  if (*s->element) flesh_overrides_add(overrides, "body.element", s->element);
  if (*s->refine) flesh_overrides_add(overrides, "body.refine", s->refine);
}

/* Reads the case's scene; with `at_rest` without inertia and external loads, for its rest shape. */
static int read_scene(const flesh_drift_plan *plan, const flesh_drift_case *c, int at_rest,
                      flesh_scene **scene)
{
  flesh_overrides overrides;
  char material[256], key[128];
  flesh_scene *base = NULL;
  int status = flesh_drift_read(plan, c->scene, &base);
  if (status) return status;
  const flesh_material *given = flesh_scene_body(base)->materials;
  double young = given->young;
  if (isnan(young)) {
    double mu, lambda;
    status = flesh_material_small_strain(given, &mu, &lambda, NULL);
    young = flesh_young_of_lame(mu, lambda);
  }
  set_overrides(plan, c->scene, &overrides);
  snprintf(material, sizeof material, "{energy: %s, constants: %s, young: %.17g, poisson: %.17g}",
           flesh_energy_name(c->variant.energy), flesh_constants_name(c->variant.constants), young, c->poisson);
  flesh_overrides_add(&overrides, "body.material", material);
  for (size_t k = 0; k < sizeof plain / sizeof *plain && c->solver == FLESH_DRIFT_PLAIN; k++)
    flesh_overrides_add(&overrides, plain[k][0], plain[k][1]);
  const flesh_system *system = flesh_scene_system(base);
  for (int k = 0; at_rest && k < flesh_system_effect_count(system); k++) {
    const flesh_effect_operations *effect = flesh_system_effect(system, k)->operations;
    if (effect->role != FLESH_ROLE_LOAD && effect->role != FLESH_ROLE_INERTIA) continue;
    snprintf(key, sizeof key, "effects.%s", effect->name);
    flesh_overrides_add(&overrides, key, "null");
  }
  flesh_scene_destroy(&base);
  if (!status) status = flesh_overrides_read(&overrides, c->scene->path, scene);
  flesh_overrides_close(&overrides);
  return status;
}

/* Returns the volume ratio of the body in equilibrium with only its pins, NaN if none is found. It does not depend on
 * the solver, so the guarded one is used. */
static double rest_ratio(const flesh_drift_plan *plan, const flesh_drift_case *c)
{
  flesh_drift_case guarded = *c;
  flesh_scene *scene = NULL;
  flesh_integrator *integrator = NULL;
  double ratio = NAN;
  guarded.solver = FLESH_DRIFT_GUARDED;
  if (read_scene(plan, &guarded, 1, &scene)) return NAN;
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  flesh_state state;
  if (!flesh_state_make(flesh_mesh_node_count(mesh), 0, 0, &state)) {
    memcpy(state.x, flesh_mesh_positions(mesh), sizeof(double) * (size_t)flesh_system_unknowns(flesh_scene_system(scene)));
    if (!flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_STATIC, flesh_scene_solver(scene),
                                 &integrator) &&
        !flesh_integrator_step(integrator, &state, flesh_scene_times(scene)->end, NULL))
      ratio = flesh_mesh_volume(mesh, state.x) / flesh_mesh_volume(mesh, flesh_mesh_positions(mesh));
  }
  free(state.x);
  flesh_integrator_destroy(&integrator);
  flesh_scene_destroy(&scene);
  return ratio;
}

static const char *status_word(int status, int is_stressed_at_rest)
{
  if (!status && is_stressed_at_rest) return "stressed rest";
  return flesh_fields_status(status, status == FLESH_UNDEFINED    ? "undefined"
                                     : status == FLESH_ERR_ENERGY ? "energy grew"
                                                                  : "not converged");
}

/* Returns the distance of the last state from the rest shape, over the body's length; NaN if there is no such state. The
 * state takes the watcher's memory. */
static double distance_from_rest(const flesh_mesh *mesh, const char *folder, watcher *w)
{
  flesh_state last = w->worst.state;
  return flesh_state_read(flesh_path("%s/state.txt", folder), w->unknowns / 3, &last)
             ? NAN
             : flesh_mesh_distance_from_rest(mesh, last.x);
}

/* Runs the scene, and adds to the figures of the run those of the comparison. */
static json_t *run(const flesh_drift_plan *plan, const flesh_drift_case *c, const flesh_scene *scene, watcher *w)
{
  char path[1400];
  double theory;
  flesh_outcome outcome;
  const flesh_observer watching = {watch, w};
  const flesh_runner_options options = {.out = path, .scene_path = c->scene->path,
                                        .max_seconds = plan->max_seconds, .no_frames = 1, .quiet = 1,
                                        .observer_count = 1, .observers = &watching};
  snprintf(path, sizeof path, "%s/%s", plan->options.out, flesh_drift_case_folder(c));
  json_t *record = flesh_study_run_scene(scene, &options, &outcome);
  json_t *figures = json_object_get(json_object_get(record, "result"), "figures");
  const int written = write_frames(w, path);
  int status = outcome.has_failure ? outcome.failure.status : outcome.status;
  if (!status && (status = written))
    json_object_update_new(record, json_pack("{si so}", "exit_code", flesh_exit_code(status), "message",
                                             flesh_json_text(flesh_error_text())));
  const int stressed = json_number_value(json_object_get(figures, "stressed_rest_J")) > 0;
  json_object_set_new(record, "status", json_string(status_word(status, stressed)));
  if (flesh_material_rest_ratio(flesh_scene_body(scene)->materials, &theory)) theory = NAN;
  json_t *own = json_pack(
      "{si si sb si si so so so so so so so}", "status_code", status, "element_kind", (int)flesh_scene_element(scene, 0), "point_load",
      flesh_point_load(scene) != NULL, "first_inverted_step", w->first_inverted_step, "first_bound_step", w->first_bound_step,
      "worst_t", flesh_json_number(w->worst.state.t), "worst_drift", flesh_json_number(w->worst.drift), "event_t",
      flesh_json_number(w->event.state.t), "event_drift", flesh_json_number(w->event.drift), "distance_from_rest",
      flesh_json_number(distance_from_rest(flesh_scene_mesh(scene), path, w)), "rest_volume_ratio",
      flesh_json_number(rest_ratio(plan, c)), "rest_volume_ratio_theory", flesh_json_number(theory));
  json_object_update_new(figures, own);
  return record;
}

json_t *flesh_drift_run_case(const void *plan, int number, const char *folder)
{
  (void)folder;
  const flesh_drift_case c = flesh_drift_case_of(plan, number);
  flesh_scene *scene = NULL;
  watcher w = {.first_inverted_step = -1, .first_bound_step = -1};
  int status = read_scene(plan, &c, 0, &scene);
  if (!status) status = open_watcher(&w, scene);
  json_t *record = status ? flesh_fields_record(status_word(status, 0), flesh_exit_code(status), flesh_error_text(),
                                                json_pack("{si}", "status_code", status))
                          : run(plan, &c, scene, &w);
  flesh_scene_destroy(&scene);
  free(w.worst.state.x);
  free(w.event.state.x);
  return record;
}

const char *const flesh_drift_solver_names[] = {"guarded", "plain", NULL};

flesh_drift_case flesh_drift_case_of(const flesh_drift_plan *plan, int number)
{
  const int solver = number % plan->solver_count;
  const int variant = (number /= plan->solver_count) % plan->variant_count;
  const int poisson = (number /= plan->variant_count) % plan->poisson_count;
  return (flesh_drift_case){&plan->scenes[number / plan->poisson_count], plan->variants[variant], plan->poissons[poisson],
                            (flesh_drift_solver)plan->solvers[solver]};
}

const char *flesh_drift_case_folder(const flesh_drift_case *c)
{
  return flesh_path("runs/%s_%s_%s_%g_%s", c->scene->name, flesh_energy_name(c->variant.energy),
                    flesh_constants_name(c->variant.constants), c->poisson, flesh_drift_solver_names[c->solver]);
}

int flesh_drift_read(const flesh_drift_plan *plan, const flesh_drift_scene *scene, flesh_scene **read)
{
  flesh_overrides overrides;
  *read = NULL;
  set_overrides(plan, scene, &overrides);
  const int status = flesh_overrides_read(&overrides, scene->path, read);
  flesh_overrides_close(&overrides);
  if (status || flesh_scene_body(*read)->materials) return status;
  flesh_scene_destroy(read);
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the comparison needs a scene with body.material", scene->path);
}
