/* mesh_run.c: runs the scene on its meshes and with the elements, each in a process of its own, and extrapolates from
 * the finest to the limit (Richardson; Roache, Verification and Validation in Computational Science, 1998, ch. 5). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/clock.h"
#include "base/confine.h"
#include "base/error.h"
#include "cli/json_memory.h"
#include "study/embedded.h"

static int first_of(const flesh_accuracy_plan *plan) { return flesh_accuracy_slot(plan, FLESH_ACCURACY_RESOLUTION); }
static const flesh_accuracy_row *row_of(const flesh_accuracy_plan *plan, int k) { return &plan->rows[first_of(plan) + k]; }
static int is_complete(const flesh_accuracy_row *row) { return row->done && !row->figures.status; }

static void describe(const flesh_scene *scene, flesh_accuracy_figures *f)
{
  f->tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  f->nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  f->poisson = NAN;
  const flesh_material *materials = flesh_scene_body(scene)->materials;
  for (int k = 0; materials && k < flesh_scene_material_count(scene); k++)
    f->poisson = fmax(f->poisson, materials[k].poisson); /* fmax ignores NaN */
}

int flesh_accuracy_run_mesh(const flesh_accuracy_plan *plan, int number)
{
  const double started = flesh_wall_seconds();
  flesh_accuracy_row *row = &plan->rows[number];
  const int keep = row->group == FLESH_ACCURACY_RESOLUTION;
  flesh_scene *scene = NULL;
  flesh_accuracy_track track = {0};
  int status = flesh_accuracy_read(plan, row, &scene);
  if (!status) describe(scene, &row->figures);
  if (!status) status = flesh_accuracy_sample(plan, scene, keep ? &track : NULL, &row->figures.cost.cpu_s);
  if (!status && keep) status = flesh_accuracy_track_write(flesh_accuracy_states_path(plan, number), &track);
  flesh_accuracy_track_close(&track);
  flesh_scene_destroy(&scene);
  row->figures.took_s = flesh_wall_seconds() - started;
  return status;
}

/* Returns a row on a mesh with the method and step of another row `by`, which is NULL in equilibrium. */
static flesh_accuracy_row make_row(const flesh_accuracy_plan *plan, flesh_accuracy_group group, int source, int element,
                                   int refine, const flesh_accuracy_row *by)
{
  flesh_accuracy_row row = {.group = group, .method = -1, .source = source, .element = element, .refine = refine,
                            .inputs = plan->meshes.inputs[source], .figures = flesh_accuracy_unknown};
  if (by) row.method = by->method, row.step = by->step, row.tolerance = by->tolerance;
  snprintf(row.setting, sizeof row.setting, "%s, refined %d times%s%.40s", flesh_element_name((flesh_element)element), refine,
           by ? ", " : "", by ? by->setting : "");
  return row;
}

static const flesh_accuracy_row *shared_row(const flesh_accuracy_plan *plan)
{
  return plan->meshes.shared < 0 ? NULL : &plan->rows[plan->meshes.shared];
}

/* Adds a row, and takes its record or runs it; adds its wall time in seconds to *spent. */
static int add(flesh_accuracy_plan *plan, int source, int element, int refine, double *spent)
{
  const int number = first_of(plan) + plan->meshes.row_count++;
  flesh_accuracy_row *row = &plan->rows[number];
  *row = make_row(plan, FLESH_ACCURACY_RESOLUTION, source, element, refine, shared_row(plan));
  const int status = flesh_accuracy_do(plan, number);
  *spent += row->figures.took_s;
  return status;
}

/* Runs the coarser meshes, then the scene's mesh refined repeatedly, for each element as far as the seconds allow; the
 * two elements that make the reference get at least two meshes. */
static int run_all(flesh_accuracy_plan *plan)
{
  enum { MOST = 5 };
  const double growth = 12; /* factor in time: eight times the tets, and more iterations */
  double spent = 0, last[FLESH_ELEMENT_COUNT] = {0};
  int status = FLESH_OK, ended[FLESH_ELEMENT_COUNT] = {0};
  for (int k = 1; k < plan->meshes.source_count && !status; k++)
    for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT && !status; e++)
      if (plan->meshes.row_count < FLESH_ACCURACY_MESHES - MOST * FLESH_ELEMENT_COUNT) status = add(plan, k, e, 0, &spent);
  for (int refine = 0; refine < MOST && !status; refine++)
    for (int e = FLESH_ELEMENT_COUNT - 1; e >= FLESH_ELEMENT_TET4 && !status; e--) {
      const int needed = refine < 2 && e != FLESH_ELEMENT_TET4;
      if (ended[e] || (!needed && refine && spent + growth * last[e] > plan->mesh_seconds)) {
        ended[e] = 1;
        continue;
      }
      status = add(plan, 0, e, refine, &spent);
      const flesh_accuracy_row *row = row_of(plan, plan->meshes.row_count - 1);
      ended[e] = !is_complete(row);
      last[e] = row->figures.took_s;
    }
  return status;
}

static double size_of(const flesh_accuracy_row *row) { return 1 / cbrt(row->figures.tets); }

/* The meshes' tracks, which of them start elsewhere, and the limits of the elements. */
typedef struct finding {
  const flesh_accuracy_plan *plan;
  flesh_accuracy_track tracks[FLESH_ACCURACY_MESHES], limits[FLESH_ELEMENT_COUNT];
  int elsewhere[FLESH_ACCURACY_MESHES];
  double change[FLESH_ELEMENT_COUNT]; /* distance of the limit from the finest run [m] */
} finding;

/* Picks the last three of the element's complete rows, sorted by tets, between which cells shrink by at least a fifth.
 * Returns how many it found. */
static int pick_levels(const finding *f, int element, int rows[3])
{
  int count = 0, all[FLESH_ACCURACY_MESHES];
  for (int k = 0; k < f->plan->meshes.row_count; k++) {
    if (row_of(f->plan, k)->element != element || !f->tracks[k].times || f->elsewhere[k]) continue;
    int place = count++;
    for (; place > 0 && row_of(f->plan, all[place - 1])->figures.tets > row_of(f->plan, k)->figures.tets; place--)
      all[place] = all[place - 1];
    all[place] = k;
  }
  int taken = 0;
  for (int k = count - 1; k >= 0 && taken < 3; k--)
    if (!taken || size_of(row_of(f->plan, all[k])) > 1.2 * size_of(row_of(f->plan, rows[3 - taken]))) rows[3 - ++taken] = all[k];
  return taken;
}

/* Finds the limit of an element by extrapolation from its last two meshes, with the order of its last three if there
 * are so many, else with 2. With corners and constrained edges the true order is at most 2, so that the limit is too
 * near rather than too far. */
static int find_limit(finding *f, int element, json_t *to)
{
  const flesh_accuracy_measure *measure = &f->plan->measure;
  flesh_accuracy_track *limit = &f->limits[element];
  int rows[3], levels = pick_levels(f, element, rows);
  if (levels < 2) return FLESH_OK;
  const flesh_accuracy_track *coarse = &f->tracks[rows[1]], *fine = &f->tracks[rows[2]];
  double h[3] = {0};
  for (int k = 3 - levels; k < 3; k++) h[k] = size_of(row_of(f->plan, rows[k]));
  const double last = flesh_accuracy_apart(measure, coarse, fine);
  double order = levels > 2 ? flesh_accuracy_order(h, flesh_accuracy_apart(measure, &f->tracks[rows[0]], coarse), last) : NAN;
  if (isnan(order)) levels = 2, order = 2;
  const double factor = 1 / (pow(h[1] / h[2], order) - 1);
  f->change[element] = factor * last;
  const int status = flesh_accuracy_track_open(fine->times, fine->unknowns, limit);
  if (!status) flesh_accuracy_extrapolate(fine, coarse, factor, limit);
  json_array_append_new(to, json_pack("{ss si sf si si}", "element", flesh_element_name((flesh_element)element), "levels", levels,
                                      "order", order, "coarse", row_of(f->plan, rows[1])->figures.tets, "fine",
                                      row_of(f->plan, rows[2])->figures.tets));
  return status;
}

/* Returns the largest distance of the track's first times from the scene's start. */
static double distance_from_start(const finding *f, const flesh_accuracy_track *track, int times)
{
  return flesh_accuracy_apart_from(&f->plan->measure, track, times, f->plan->measure.start);
}

/* Reads the states. A coarser scene that starts elsewhere, for example from its own start state, has another motion. */
static int read_tracks(finding *f)
{
  const double same = 0.01; /* share of the motion */
  int status = FLESH_OK;
  for (int k = 0; k < f->plan->meshes.row_count && !status; k++) {
    if (!is_complete(row_of(f->plan, k))) continue;
    status = flesh_accuracy_track_read(flesh_accuracy_states_path(f->plan, first_of(f->plan) + k), &f->tracks[k]);
    if (status || !row_of(f->plan, k)->source || f->plan->meshes.shared < 0) continue;
    f->elsewhere[k] = distance_from_start(f, &f->tracks[k], 1) > same * distance_from_start(f, &f->tracks[k], f->tracks[k].times);
  }
  return status;
}

/* Finds the reference, the limit of tet10-mean, else of tet10, else of tet4; the next of them with a limit checks
 * it. */
static int judge(finding *f, json_t *to)
{
  int status = FLESH_OK, first = 0, second = 0;
  for (int e = FLESH_ELEMENT_COUNT - 1; e >= FLESH_ELEMENT_TET4 && !status; e--) {
    status = find_limit(f, e, to);
    if (!f->limits[e].times) continue;
    if (!first) first = e;
    else if (!second) second = e;
  }
  if (status || !first) return status;
  const flesh_accuracy_track *reference = &f->limits[first];
  const double motion = distance_from_start(f, reference, reference->times);
  double apart = second ? flesh_accuracy_apart(&f->plan->measure, reference, &f->limits[second]) : 0;
  const double uncertainty = fmax(apart, f->change[first]);
  json_array_append_new(to, json_pack("{ss ss sf sf sf}", "first", flesh_element_name((flesh_element)first), "second",
                                      second ? flesh_element_name((flesh_element)second) : "", "apart", apart, "uncertainty",
                                      uncertainty, "motion", motion));
  for (int k = 0; k < f->plan->meshes.row_count; k++) {
    if (!f->tracks[k].times || f->elsewhere[k]) continue;
    const double error = flesh_accuracy_apart(&f->plan->measure, &f->tracks[k], reference);
    json_array_append_new(to, json_pack("{si sf sb}", "mesh", k, "error", error / motion, "below", error <= uncertainty));
  }
  return status;
}

int flesh_accuracy_find_limits(const flesh_accuracy_plan *plan, json_t *rows)
{
  finding *f = calloc(1, sizeof *f);
  if (!f) return flesh_no_memory();
  f->plan = plan;
  int status = read_tracks(f);
  for (int k = 0; k < plan->meshes.row_count; k++)
    if (f->elsewhere[k]) json_array_append_new(rows, json_pack("{si sb}", "mesh", k, "elsewhere", 1));
  if (!status) status = judge(f, rows);
  for (int k = 0; k < plan->meshes.row_count; k++) flesh_accuracy_track_close(&f->tracks[k]);
  for (int e = 0; e < FLESH_ELEMENT_COUNT; e++) flesh_accuracy_track_close(&f->limits[e]);
  free(f);
  return status;
}

json_t *flesh_accuracy_mesh_facts(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  const flesh_accuracy_meshes *meshes = &plan->meshes;
  const char *path = meshes->sources[row->source], *slash = strrchr(path, '/');
  const flesh_accuracy_row *shared = shared_row(plan);
  if (row->group == FLESH_ACCURACY_TIMING) return json_pack("{si si}", "timed_mesh", row->mesh, "timed_by", row->timed_by);
  if (row->group == FLESH_ACCURACY_LIMITS)
    return json_pack("{ss* ss* si so}", "shared_method", shared ? flesh_accuracy_method_name(shared) : NULL, "shared_step",
                     shared ? shared->step.text : NULL, "shared", meshes->shared, "point_load",
                     flesh_json_text(meshes->point_load));
  return json_pack("{si ss si si so sb}", "mesh", (int)(row - plan->rows) - first_of(plan), "element",
                   flesh_element_name((flesh_element)row->element), "kind", row->element, "refine", row->refine, "source",
                   flesh_json_text(slash ? slash + 1 : path), "own",
                   !row->source && !row->refine && row->element == meshes->own_element);
}

/* Finds the limits of the meshes; again if the set of meshes has changed, for which all meshes need their states. */
static int find_limits(flesh_accuracy_plan *plan)
{
  flesh_accuracy_meshes *meshes = &plan->meshes;
  const int number = flesh_accuracy_slot(plan, FLESH_ACCURACY_LIMITS);
  const char *texts[2 * FLESH_ACCURACY_MESHES];
  for (int k = 0; k < meshes->row_count; k++) texts[2 * k] = row_of(plan, k)->setting, texts[2 * k + 1] = row_of(plan, k)->inputs;
  flesh_accuracy_hash(2 * meshes->row_count, texts, meshes->all_inputs);
  plan->rows[number] = (flesh_accuracy_row){.group = FLESH_ACCURACY_LIMITS, .method = -1, .setting = "of all meshes",
                                            .inputs = meshes->all_inputs, .figures = flesh_accuracy_unknown};
  int status = flesh_accuracy_known(plan, number);
  for (int k = 0; k < meshes->row_count && !status && !plan->rows[number].done; k++) {
    plan->rows[first_of(plan) + k].needs_states = 1;
    status = flesh_accuracy_do(plan, first_of(plan) + k);
  }
  if (!status) status = flesh_accuracy_do(plan, number);
  if (!status && plan->rows[number].figures.status)
    status = flesh_fail(plan->rows[number].figures.status, "the meshes: %s", plan->rows[number].figures.message);
  for (int k = 0; k < meshes->row_count && !status; k++)
    flesh_path_unlink(flesh_accuracy_states_path(plan, first_of(plan) + k));
  return status;
}

static int tell(flesh_accuracy_plan *plan, const char *first, const char *second)
{
  flesh_study study = plan->study;
  study.case_count = flesh_accuracy_slot(plan, FLESH_ACCURACY_RESOLUTION) + plan->meshes.row_count;
  study.table = "mesh", study.words = "mesh.txt";
  study.results[0] = first ? flesh_own_text(first) : flesh_own_text(second);
  study.results[1] = first ? flesh_own_text(second) : NULL;
  return flesh_study_conclude(&study, &plan->store, &plan->options, FLESH_OK);
}

/* Times the choices of mesh and step that were not run in this combination. */
static int time_choices(flesh_accuracy_plan *plan)
{
  const int first = flesh_accuracy_slot(plan, FLESH_ACCURACY_TIMING);
  const int count = flesh_study_store_number(&plan->store, "SELECT count(*) FROM choices WHERE NOT measured");
  int status = FLESH_OK;
  for (int k = 0; k < count && !status; k++) {
    static const char query[] = "SELECT %s FROM choices WHERE NOT measured ORDER BY share LIMIT 1 OFFSET %d";
    const int mesh = flesh_study_store_number(&plan->store, query, "mesh", k);
    const int by = flesh_study_store_number(&plan->store, query, "step", k);
    const flesh_accuracy_row *row = row_of(plan, mesh);
    plan->rows[first + k] = make_row(plan, FLESH_ACCURACY_TIMING, row->source, row->element, row->refine, &plan->rows[by]);
    plan->rows[first + k].mesh = mesh, plan->rows[first + k].timed_by = by;
    status = flesh_accuracy_do(plan, first + k);
  }
  return status;
}

int flesh_accuracy_run_meshes(flesh_accuracy_plan *plan)
{
  const int in_time = plan->run_count > 0;
  plan->meshes.shared =
      in_time ? flesh_study_store_number(&plan->store, "SELECT coalesce((SELECT number FROM shared), -1)") : -1;
  if (in_time && plan->meshes.shared < 0)
    return flesh_fail(FLESH_ERR_SOLVE, "the meshes are not compared: no method of fixed steps reached the end");
  int status = run_all(plan);
  if (!status) status = find_limits(plan);
  if (!status) status = in_time ? tell(plan, NULL, "mesh") : tell(plan, "runs", "mesh");
  if (!status) status = time_choices(plan);
  if (!status) status = tell(plan, NULL, "mesh_words");
  return status == FLESH_ERR_INTERRUPTED ? flesh_fail(status, "interrupted while the meshes were run; --resume goes on") : status;
}
