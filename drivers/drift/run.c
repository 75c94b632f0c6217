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
#include "run/describe.h"
#include "run/runner.h"
#include "run/start.h"
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
  int unknowns;
  flesh_drift_figures *figures; /* first_inverted_step and first_bound_step are set in these */
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
  if (record->inverted && w->figures->first_inverted_step < 0) w->figures->first_inverted_step = record->step;
  if (!(record->J_bound > 0) && w->figures->first_bound_step < 0) w->figures->first_bound_step = record->step;
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

static void close_watcher(watcher *w)
{
  free(w->worst.state.x);
  free(w->event.state.x);
}

static int write_frame(const char *folder, const char *name, const frame *kept, int nodes)
{
  const char *path = flesh_path("%s/%s", folder, name);
  flesh_path_unlink(path); /* left by an older comparison */
  return kept->known ? flesh_state_write(path, nodes, &kept->state) : FLESH_OK;
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
  const flesh_body *body = flesh_scene_body(base);
  if (!body->materials) {
    flesh_scene_destroy(&base);
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the comparison needs a scene with body.material", c->scene->path);
  }
  double young = body->materials[0].young;
  if (isnan(young)) {
    double mu, lambda;
    status = flesh_material_small_strain(&body->materials[0], &mu, &lambda, NULL);
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

/* Records the library's last error, unless an earlier one was recorded. */
static void note_error(int status, flesh_drift_figures *f)
{
  if (!status || f->status) return;
  f->status = status;
  f->exit_code = flesh_exit_code(status);
  snprintf(f->message, sizeof f->message, "%.399s", flesh_error_text());
}

/* Sets the figures that follow from the run's figures, its outcome and its watcher. */
static void note_run(const flesh_outcome *outcome, const watcher *w, flesh_drift_figures *f)
{
  const flesh_figures *figures = &f->run;
  f->status = outcome->has_failure ? outcome->failure.status : outcome->status;
  f->exit_code = outcome->exit_code;
  snprintf(f->message, sizeof f->message, "%.399s", outcome->message);
  f->newton_per_step = figures->steps ? (double)figures->newton / figures->steps : NAN;
  f->linear_per_newton = figures->newton ? (double)figures->linear / (double)figures->newton : NAN;
  f->failed_at = outcome->status ? (outcome->has_failure ? outcome->failure.t : figures->t) : NAN;
  f->worst_t = w->worst.state.t;
  f->worst_drift = w->worst.drift;
  f->event_t = w->event.state.t;
  f->event_drift = w->event.drift;
}

void flesh_drift_run_case(const flesh_drift_plan *plan, const flesh_drift_case *c, flesh_drift_figures *f)
{
  char path[1400];
  flesh_scene *scene = NULL;
  flesh_outcome outcome = {0};
  watcher w = {.figures = f};
  *f = (flesh_drift_figures){
      .run = {.max_volume_drift = NAN, .final_volume_drift = NAN, .J_min = NAN, .J_bound = NAN, .wall_s = NAN},
      .first_inverted_step = -1, .first_bound_step = -1, .rest_volume_ratio = NAN, .rest_volume_ratio_theory = NAN,
      .newton_per_step = NAN, .linear_per_newton = NAN, .failed_at = NAN, .distance_from_rest = NAN};
  int status = read_scene(plan, c, 0, &scene);
  if (!status) status = open_watcher(&w, scene);
  if (status) {
    note_error(status, f);
    flesh_scene_destroy(&scene);
    close_watcher(&w);
    return;
  }
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  snprintf(path, sizeof path, "%s/%s", plan->options.out, flesh_drift_case_folder(c));
  const flesh_observer watching = {watch, &w};
  const flesh_runner_options options = {.out = path, .scene_path = c->scene->path,
                                        .max_seconds = plan->max_seconds, .no_frames = 1, .quiet = 1,
                                        .observer_count = 1, .observers = &watching};
  flesh_runner_run(scene, &options, &f->run, &outcome);
  f->tets = flesh_mesh_tet_count(mesh);
  f->nodes = flesh_mesh_node_count(mesh);
  f->element = flesh_scene_body(scene)->element;
  if (f->element == FLESH_ELEMENT_AUTO)
    f->element = flesh_mesh_order(mesh) == 2 ? FLESH_ELEMENT_TET10_MEAN : FLESH_ELEMENT_TET4;
  f->point_load = flesh_point_load(scene) != NULL;
  note_run(&outcome, &w, f);
  if (flesh_material_rest_ratio(flesh_scene_body(scene)->materials, &f->rest_volume_ratio_theory))
    f->rest_volume_ratio_theory = NAN;
  status = write_frame(path, "worst_state.txt", &w.worst, w.unknowns / 3);
  if (!status) status = write_frame(path, "event_state.txt", &w.event, w.unknowns / 3);
  note_error(status, f);
  flesh_state last = w.worst.state; /* its memory now holds the last state */
  if (!flesh_state_read(flesh_path("%s/state.txt", path), w.unknowns / 3, &last))
    f->distance_from_rest = flesh_mesh_distance_from_rest(mesh, last.x);
  f->rest_volume_ratio = rest_ratio(plan, c);
  flesh_figures_close(&f->run);
  flesh_scene_destroy(&scene);
  close_watcher(&w);
}

const char *const flesh_drift_solver_names[] = {"guarded", "plain", NULL};

int flesh_drift_case_count(const flesh_drift_plan *plan)
{
  return plan->scene_count * plan->poisson_count * plan->variant_count * plan->solver_count;
}

flesh_drift_case flesh_drift_case_of(const flesh_drift_plan *plan, int number)
{
  const int solver = number % plan->solver_count;
  const int variant = (number /= plan->solver_count) % plan->variant_count;
  const int poisson = (number /= plan->variant_count) % plan->poisson_count;
  return (flesh_drift_case){&plan->scenes[number / plan->poisson_count], plan->variants[variant], plan->poissons[poisson],
                            plan->solvers[solver]};
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
  return status;
}
