/* mesh_run.c: runs the scene on its meshes and with the elements, each in a process of its own, and finds from the
 * finest what they converge to (Richardson; Roache, Verification and Validation in Computational Science, 1998, ch. 5). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "accuracy/mesh.h"
#include "base/confine.h"
#include "base/clock.h"
#include "base/error.h"
#include "scene/scene.h"
#include "run/describe.h"
#include "pool/pool.h"

typedef struct task {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_meshes *meshes;
  int row;
  const flesh_accuracy_row *step; /* NULL: as all; its method and step otherwise */
  int keep;                       /* 1: the states are written */
} task;

static void states_path(const flesh_accuracy_plan *plan, int row, char path[1500])
{
  snprintf(path, 1500, "%s/mesh_%d.states", plan->out, row);
}

/* The row's scene: its file with the plan's values, and the row's. */
static int read_scene(const task *given, flesh_scene **scene)
{
  const flesh_accuracy_plan *plan = given->plan;
  const flesh_accuracy_meshes *meshes = given->meshes;
  const flesh_accuracy_mesh_row *row = &meshes->rows[given->row];
  const flesh_accuracy_row all_alike = {.method = meshes->method, .step = meshes->step};
  flesh_overrides overrides;
  char number[32];
  *scene = NULL;
  int status = meshes->method < 0 ? flesh_overrides_copy(&overrides, plan->overrides)
                                  : flesh_accuracy_overrides(plan, given->step ? given->step : &all_alike, &overrides);
  if (status) return status;
  snprintf(number, sizeof number, "%d", row->refine + (row->source ? 0 : meshes->own_refine));
  if (!row->source || row->refine) status = flesh_overrides_add(&overrides, "body.refine", number);
  if (!status) status = flesh_overrides_add(&overrides, "body.element", flesh_element_name((flesh_element)row->element));
  if (!status)
    status = flesh_scene_read(meshes->sources[row->source], overrides.texts.count, overrides.texts.values, scene);
  flesh_overrides_close(&overrides);
  return status;
}

static void describe(const flesh_scene *scene, flesh_accuracy_mesh_row *row)
{
  row->tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  row->nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  row->poisson = NAN;
  const flesh_material *materials = flesh_scene_body(scene)->materials;
  for (int k = 0; materials && k < flesh_scene_material_count(scene); k++)
    row->poisson = fmax(row->poisson, materials[k].poisson); /* fmax takes NaN for nothing */
}

static void work(const void *data, void *result)
{
  const task *given = data;
  flesh_accuracy_mesh_row *row = result;
  flesh_scene *scene = NULL;
  flesh_accuracy_sampler sampler = {0};
  int status = read_scene(given, &scene);
  if (!status) describe(scene, row);
  if (!status && given->keep) status = flesh_accuracy_sampler_open(given->plan, scene, &sampler);
  if (!status) status = flesh_accuracy_sample(given->plan, scene, given->keep ? &sampler : NULL, &row->cpu_s);
  char path[1500];
  states_path(given->plan, given->row, path);
  if (!status && given->keep) status = flesh_accuracy_track_write(path, &sampler.track);
  row->status = status;
  if (status) snprintf(row->message, sizeof row->message, "%.199s", flesh_error_text());
  flesh_accuracy_sampler_close(&sampler);
  flesh_scene_destroy(&scene);
}

static void show(const flesh_accuracy_mesh_row *row)
{
  if (!isatty(STDERR_FILENO)) return;
  if (row) fprintf(stderr, "\r\033[Kmesh: %s, refined %d times", flesh_element_name((flesh_element)row->element), row->refine);
  else fputs("\r\033[K", stderr);
  fflush(stderr);
}

static int run_row(const task *given, flesh_accuracy_mesh_row *row)
{
  const flesh_pool_task alone = {work, given, sizeof *row, given->plan->max_seconds, "the meshes were run"};
  int crashed_by = 0, status = flesh_pool_do(given->plan->options.ranks, &alone, row, &crashed_by);
  if (status) return status;
  row->crashed_by = crashed_by;
  if (row->crashed_by) row->status = FLESH_ERR_SOLVE;
  if (row->status == FLESH_ERR_FILE) return flesh_fail(FLESH_ERR_FILE, "%s", row->message);
  row->done = 1;
  return FLESH_OK;
}

double flesh_accuracy_time_mesh(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                const flesh_accuracy_mesh_row *row, const flesh_accuracy_row *step)
{
  flesh_accuracy_mesh_row timed = *row;
  const task given = {plan, meshes, (int)(row - meshes->rows), step, 0};
  return run_row(&given, &timed) || timed.status ? NAN : timed.cpu_s;
}

/* Adds a row and runs it; *took in seconds of the wall. */
static int add(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes, int source, int element, int refine,
               double *took)
{
  const double started = flesh_wall_seconds();
  const task given = {plan, meshes, meshes->row_count, NULL, 1};
  flesh_accuracy_mesh_row *row = &meshes->rows[meshes->row_count++];
  *row = (flesh_accuracy_mesh_row){.source = source, .element = element, .refine = refine,
                                   .poisson = NAN, .cpu_s = NAN, .error = NAN};
  show(row);
  const int status = run_row(&given, row);
  show(NULL);
  *took = flesh_wall_seconds() - started;
  return status;
}

/* The coarser meshes, then the scene's refined again and again, of each element as far as the seconds go: two meshes of
 * the two that make the reference at least. */
static int run_all(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes)
{
  enum { MOST = 5 };
  const double started = flesh_wall_seconds(), growth = 12; /* eight times the tets, and more iterations */
  double took, last[FLESH_ELEMENT_COUNT] = {0};
  int status = FLESH_OK, ended[FLESH_ELEMENT_COUNT] = {0};
  for (int s = 1; s < meshes->source_count && !status; s++)
    for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT && !status; e++)
      if (meshes->row_count < FLESH_ACCURACY_MESH_ROWS - MOST * FLESH_ELEMENT_COUNT)
        status = add(plan, meshes, s, e, 0, &took);
  for (int refine = 0; refine < MOST && !status; refine++)
    for (int e = FLESH_ELEMENT_COUNT - 1; e >= FLESH_ELEMENT_TET4 && !status; e--) {
      const int needed = refine < 2 && e != FLESH_ELEMENT_TET4;
      if (ended[e] || (!needed && refine && flesh_wall_seconds() - started + growth * last[e] > meshes->seconds)) {
        ended[e] = 1;
        continue;
      }
      status = add(plan, meshes, 0, e, refine, &took);
      ended[e] = meshes->rows[meshes->row_count - 1].status != FLESH_OK;
      last[e] = took;
    }
  return status;
}

static double size_of(const flesh_accuracy_mesh_row *row) { return 1 / cbrt(row->tets); }

/* The element's complete rows by their tets, the last three of them in which cells shrink by a fifth at least. */
static int pick_levels(const flesh_accuracy_meshes *meshes, int element, int rows[3])
{
  int count = 0, all[FLESH_ACCURACY_MESH_ROWS];
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[k];
    if (row->element != element || !row->done || row->status) continue;
    int place = count++;
    for (; place > 0 && meshes->rows[all[place - 1]].tets > row->tets; place--) all[place] = all[place - 1];
    all[place] = k;
  }
  int taken = 0;
  for (int k = count - 1; k >= 0 && taken < 3; k--)
    if (!taken || size_of(&meshes->rows[all[k]]) > 1.2 * size_of(&meshes->rows[rows[3 - taken]]))
      rows[3 - ++taken] = all[k];
  return taken;
}

/* The limit of an element: extrapolated from its last two meshes, at the order of its last three where there are so
 * many, else at 2 (at most what corners and held edges leave of it, so that the limit is rather too near). */
static int find_limit(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes, int element,
                      flesh_accuracy_track *limit)
{
  flesh_accuracy_limit *about = &meshes->limits[element];
  flesh_accuracy_track tracks[3] = {{0}};
  char path[1500];
  const int levels = pick_levels(meshes, element, about->rows);
  int status = FLESH_OK;
  if (levels < 2) return FLESH_OK;
  for (int k = 3 - levels; k < 3 && !status; k++) {
    states_path(plan, about->rows[k], path);
    status = flesh_accuracy_track_read(path, &tracks[k]);
  }
  if (!status) {
    double h[3] = {0};
    for (int k = 3 - levels; k < 3; k++) h[k] = size_of(&meshes->rows[about->rows[k]]);
    const double last = flesh_accuracy_apart(&plan->measure, &tracks[1], &tracks[2]);
    about->order = levels > 2 ? flesh_accuracy_order(h, flesh_accuracy_apart(&plan->measure, &tracks[0], &tracks[1]), last) : NAN;
    about->levels = isnan(about->order) ? 2 : 3;
    if (isnan(about->order)) about->order = 2;
    const double factor = 1 / (pow(h[1] / h[2], about->order) - 1);
    about->change = factor * last;
    for (size_t d = 0; d < (size_t)tracks[2].times * (size_t)tracks[2].unknowns; d++)
      tracks[2].x[d] += factor * (tracks[2].x[d] - tracks[1].x[d]);
    *limit = tracks[2];
    tracks[2] = (flesh_accuracy_track){0};
  }
  for (int k = 0; k < 3; k++) flesh_accuracy_track_close(&tracks[k]);
  return status;
}

/* The reference: the limit of tet10-mean, else of tet10, else of tet4; the next of them checks it. */
static int find_reference(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes,
                          flesh_accuracy_track limits[FLESH_ELEMENT_COUNT])
{
  int status = FLESH_OK;
  for (int e = FLESH_ELEMENT_COUNT - 1; e >= FLESH_ELEMENT_TET4 && !status; e--) {
    status = find_limit(plan, meshes, e, &limits[e]);
    if (!meshes->limits[e].levels) continue;
    if (!meshes->first) meshes->first = e;
    else if (!meshes->second) meshes->second = e;
  }
  if (status || !meshes->first) return status;
  const flesh_accuracy_track *reference = &limits[meshes->first];
  flesh_accuracy_track start = {0};
  status = flesh_accuracy_track_open(reference->times, reference->unknowns, &start);
  for (int t = 0; t < start.times && !status; t++)
    memcpy(start.x + (size_t)t * (size_t)start.unknowns, plan->measure.start, sizeof(double) * (size_t)start.unknowns);
  if (!status) meshes->motion = flesh_accuracy_apart(&plan->measure, reference, &start);
  if (!status && meshes->second) meshes->apart = flesh_accuracy_apart(&plan->measure, reference, &limits[meshes->second]);
  meshes->uncertainty = fmax(meshes->apart, meshes->limits[meshes->first].change);
  flesh_accuracy_track_close(&start);
  return status;
}

/* Method and step of all runs: of those with fixed steps the one of least CPU time whose error is a hundredth of the
 * motion at most, else the most accurate. */
static void choose_step(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes)
{
  const flesh_accuracy_row *best = NULL;
  double least = INFINITY;
  meshes->method = -1;
  meshes->step_error = 0;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    const double error = *row->tolerance.text ? NAN : flesh_accuracy_step_error(plan, row);
    /* Accurate ones by their time, which is below 1e6 s; the others by their error. */
    const double rank = error <= 0.01 ? row->figures.cpu_s : 1e6 * (1 + error);
    if (!(rank < least)) continue;
    least = rank, best = row;
    meshes->step_error = error;
  }
  if (!best) return;
  meshes->method = best->method;
  meshes->step = best->step;
}

/* A coarser scene that starts elsewhere, as one does that has a start state of its own, is another motion. */
static int check_starts(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes)
{
  const double same = 0.01; /* of the motion */
  int status = FLESH_OK;
  for (int k = 0; k < meshes->row_count && !status; k++) {
    flesh_accuracy_mesh_row *row = &meshes->rows[k];
    flesh_accuracy_track track = {0};
    char path[1500];
    if (!row->source || !row->done || row->status || meshes->method < 0) continue;
    states_path(plan, k, path);
    status = flesh_accuracy_track_read(path, &track);
    if (status) break;
    flesh_accuracy_track first = track, last = {0};
    first.times = 1;
    status = flesh_accuracy_track_open(track.times, track.unknowns, &last);
    const size_t size = sizeof(double) * (size_t)track.unknowns;
    for (int t = 0; t < track.times && !status; t++) memcpy(last.x + (size_t)t * (size_t)track.unknowns, plan->measure.start, size);
    if (!status && flesh_accuracy_apart(&plan->measure, &first, &last) > same * flesh_accuracy_apart(&plan->measure, &track, &last))
      row->status = FLESH_ERR_ARGUMENT;
    flesh_accuracy_track_close(&last);
    flesh_accuracy_track_close(&track);
  }
  return status;
}

static int judge(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes)
{
  flesh_accuracy_track limits[FLESH_ELEMENT_COUNT] = {{0}};
  int status = check_starts(plan, meshes);
  if (!status) status = find_reference(plan, meshes, limits);
  for (int k = 0; k < meshes->row_count && !status && meshes->first; k++) {
    flesh_accuracy_mesh_row *row = &meshes->rows[k];
    flesh_accuracy_track track = {0};
    char path[1500];
    if (!row->done || row->status) continue;
    states_path(plan, k, path);
    status = flesh_accuracy_track_read(path, &track);
    if (status) break;
    const double error = flesh_accuracy_apart(&plan->measure, &track, &limits[meshes->first]);
    row->below = error <= meshes->uncertainty;
    row->error = error / meshes->motion;
    flesh_accuracy_track_close(&track);
  }
  for (int e = 0; e < FLESH_ELEMENT_COUNT; e++) flesh_accuracy_track_close(&limits[e]);
  return status;
}

static void remove_states(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes)
{
  char path[1500];
  for (int k = 0; k < meshes->row_count; k++) {
    states_path(plan, k, path);
    flesh_path_unlink(path);
  }
}

int flesh_accuracy_run_meshes(const flesh_accuracy_plan *plan, flesh_accuracy_meshes *meshes)
{
  flesh_scene *scene = NULL;
  int status = flesh_accuracy_read_as_it_stands(plan, plan->scene, &scene);
  if (status) return status;
  meshes->own_refine = scene->keys.body.refine;
  meshes->own_element = (int)flesh_scene_body(scene)->element;
  if (meshes->own_element == FLESH_ELEMENT_AUTO)
    meshes->own_element = flesh_mesh_order(flesh_scene_mesh(scene)) == 2 ? FLESH_ELEMENT_TET10_MEAN : FLESH_ELEMENT_TET4;
  meshes->point_load = flesh_point_load(scene);
  choose_step(plan, meshes);
  const int in_time = flesh_system_has_role(flesh_scene_system(scene), FLESH_ROLE_INERTIA);
  flesh_scene_destroy(&scene);
  if (in_time && meshes->method < 0)
    return flesh_fail(FLESH_ERR_SOLVE, "the meshes are not compared: no method of fixed steps reached the end");
  status = run_all(plan, meshes);
  if (!status) status = judge(plan, meshes);
  remove_states(plan, meshes);
  return status;
}
