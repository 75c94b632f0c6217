/* companion.c: chooses and runs companions of a run. */
#include "error/companion.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "error/meshes.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "scene/scene.h"

/* Factors of bars, from data/results/error_bars.md. */
static const double of_element = 1.75, of_element_on_coarser = 2.25, of_coarser_mesh = 1.8, of_coarser_meshes = 1.1,
                    of_coarser_equilibria = 0.62;
static const double of_shorter_steps = 2.5, of_shorter_steps_of_bdf2 = 3, of_newmark = 2, of_tolerance = 2.75;
/* The smaller tolerance, as a share of the scene's. */
static const double tolerance_share = 0.25;
/* A box that ends beyond a node by less than this share of an edge is taken to end at the node's plane; on a mesh
 * refined twice it contains no further nodes. */
static const double least_end = 0.2;
/* Indices into flesh_error_folders. */
enum { MESH, MESH_2, STEP, STEP_2, TWICE, MESH_2_STEPS };
const char *const flesh_error_folders[] = {"error/mesh",   "error/mesh_2", "error/step",
                                           "error/step_2", "error/twice",  "error/mesh_2_steps", NULL};
/* Least number of steps from which an order can be found. */
enum { LEAST_STEPS = 12 };

static void refuse(flesh_error_judge *judge, const char *words)
{
  judge->count = 0;
  snprintf(judge->words, sizeof judge->words, "%s", words);
}

/* Drops companion k, which failed, and those that depend on it, if the remaining ones suffice. Returns whether they
 * do. */
static int drop(flesh_error_judge *judge, int k)
{
  if (!judge->coarser || !k) return 0;
  const int is_last = k == judge->count - 1; /* has the other element; a double step needs all before it */
  judge->count = is_last ? k : 1;
  judge->factor = of_coarser_mesh;
  judge->adds = 0;
  *(is_last ? strrchr(judge->words, ',') : strchr(judge->words, ',')) = 0;
  return 1;
}

/* Adds a companion with key=value, and with time.step=step unless that is 0. */
static void add(flesh_error_judge *judge, int folder, const char *key, double value, double step)
{
  char number[FLESH_NUMBER_SIZE];
  judge->companions[judge->count].folder = flesh_error_folders[folder];
  char(*set)[sizeof *judge->companions->set] = judge->companions[judge->count++].set;
  snprintf(set[0], sizeof *set, "%s=%s", key, flesh_number_text(value, number));
  if (step > 0) snprintf(set[1], sizeof *set, "time.step=%s", flesh_number_text(step, number));
}

/* Adds a companion with a smaller tolerance, and with states twice as often: if steps end at the states, a smaller
 * tolerance alone may change nothing. */
static void add_tolerance(const flesh_scene_time *time, flesh_error_judge *judge)
{
  const double tolerance = tolerance_share * time->adaptive.tolerance;
  judge->factor = of_tolerance;
  add(judge, STEP, "time.tolerance", tolerance, time->step / 2);
  snprintf(judge->words, sizeof judge->words, "a tolerance of %g and a time.step of %g s", tolerance, time->step / 2);
}

/* Returns whether waves that the steps of a motion do not resolve may come out alike on two meshes: the steps have
 * equal lengths and there are at least two of them. Backward Euler damps such waves. */
static int may_miss_waves(const flesh_scene_time *time, double start)
{
  return time->method != FLESH_METHOD_STATIC && time->method != FLESH_METHOD_BACKWARD_EULER &&
         time->method != FLESH_METHOD_IDA && !time->adaptive.control && (time->end - start) / time->step > 1.5;
}

/* Adds companions on the next coarser mesh: with the same steps; with double steps if the run's mesh is compared with
 * these, too; and with another element. */
static void add_coarser(const flesh_scene *scene, int has_twice, flesh_error_judge *judge)
{
  const int refine = scene->keys.body.refine - 1;
  const char *other = flesh_scene_element(scene, 0) == FLESH_ELEMENT_TET10 ? "tet10-mean" : "tet10";
  char words[64] = "";
  judge->doubled = has_twice ? 1 : may_miss_waves(&scene->time, scene->start.t) ? 2 : 0;
  judge->adds = scene->time.method == FLESH_METHOD_STATIC && !has_twice;
  judge->factor = judge->adds ? of_coarser_equilibria : of_coarser_meshes;
  judge->coarser = 1;
  add(judge, MESH, "body.refine", refine, 0);
  if (judge->doubled == 2) add(judge, TWICE, "body.refine", refine + 1, 2 * scene->time.step);
  if (judge->doubled) {
    snprintf(words, sizeof words, ", there with steps of %g s", 2 * scene->time.step);
    add(judge, MESH_2_STEPS, "body.refine", refine, 2 * scene->time.step);
  }
  snprintf(judge->companions[judge->count].set[1], sizeof judge->companions->set[1], "body.element=%s", other);
  add(judge, MESH_2, "body.refine", refine, 0);
  snprintf(judge->words, sizeof judge->words, "the next coarser mesh (body.refine %d)%s, and %s on it", refine, words, other);
}

/* Adds ten-node tets as a judge of four-node tets: on the coarser mesh, if there is one, where they have the nodes of
 * the finer one. */
static void add_element(int refine, flesh_error_judge *judge)
{
  judge->better = 1;
  judge->factor = refine ? of_element_on_coarser : of_element;
  add(judge, MESH, "body.refine", refine ? refine - 1 : 0, 0);
  strcpy(judge->companions[0].set[1], "body.element=tet10-mean");
  snprintf(judge->words, sizeof judge->words, "tet10-mean on the %s the better answer",
           refine ? "next coarser mesh, mostly" : "same mesh, which is");
}

static void choose_mesh(const flesh_scene *scene, int has_twice, flesh_error_judge *judge)
{
  const int others = scene->keys.bodies.count;
  int linear = 0;
  for (int k = 0; k <= others; k++) linear += flesh_scene_element(scene, k) == FLESH_ELEMENT_TET4;
  if (!scene->body.materials) refuse(judge, "no body has a material");
  else if (linear && others) refuse(judge, "four-node tets are judged in scenes of one body only");
  else if (linear) add_element(scene->keys.body.refine, judge);
  else if (!others && scene->keys.body.refine > 0) add_coarser(scene, has_twice, judge);
  else refuse(judge, "no coarser mesh is known; body.refine of 1 or more makes one");
}

/* Returns whether the results of a static scene depend on its steps, because something breaks, slips or touches on the
 * way. */
static int depends_on_path(const flesh_scene *scene)
{
  int contact = 0;
  for (int e = 0; e < flesh_system_effect_count(scene->system); e++)
    contact |= flesh_system_effect(scene->system, e)->operations->role == FLESH_ROLE_CONTACT;
  return contact || flesh_system_internal_count(scene->system) > 0;
}

static void choose_steps(const flesh_scene *scene, flesh_error_judge *judge)
{
  const flesh_scene_time *time = &scene->time;
  if ((time->end - scene->start.t) / time->step < LEAST_STEPS - 0.5) {
    refuse(judge, "less than twelve steps tell nothing of their order");
    return;
  }
  judge->factor = time->method == FLESH_METHOD_BDF2 ? of_shorter_steps_of_bdf2 : of_shorter_steps;
  add(judge, STEP, "time.step", time->step / 2, 0);
  add(judge, STEP_2, "time.step", 2 * time->step, 0);
  snprintf(judge->words, sizeof judge->words, "steps of %g s and of %g s", time->step / 2, 2 * time->step);
}

static void choose_step(const flesh_scene *scene, flesh_error_judge *judge)
{
  const flesh_scene_time *time = &scene->time;
  if (time->adaptive.control || time->method == FLESH_METHOD_IDA) add_tolerance(time, judge);
  else if (time->method == FLESH_METHOD_STATIC && !depends_on_path(scene))
    refuse(judge, "these equilibria do not depend on the steps between them");
  else if (time->method == FLESH_METHOD_BACKWARD_EULER) {
    judge->factor = of_newmark;
    add(judge, STEP, "", 0, 0);
    strcpy(judge->companions[0].set[0], "time.method=newmark");
    snprintf(judge->words, sizeof judge->words, "newmark with the same steps");
  } else choose_steps(scene, judge);
}

typedef struct ends {
  const flesh_mesh *mesh;
  char *words; /* [FLESH_ERROR_WORDS] about a selection that ends within tets; "" if there is none */
} ends;

/* Returns whether the selection contains one end of half an edge, or of a whole edge, and continues along it. If it
 * ends at less than `least_end` after the node, it is taken to end at the node. */
static int goes_on(const flesh_selection *selection, const double *p, const double *q)
{
  double x[3];
  for (int c = 0; c < 3; c++) x[c] = p[c] + least_end * (q[c] - p[c]);
  return flesh_selection_contains(selection, p) && flesh_selection_contains(selection, x) &&
         !flesh_selection_contains(selection, q);
}

static int see_ends(void *data, const flesh_selection *selection, const char *path)
{
  const ends *e = data;
  const double *X = e->mesh->positions;
  int n[10], is_within = 0;
  for (int t = 0; t < e->mesh->tets && !is_within; t++) {
    const int middles = flesh_mesh_tet_nodes(e->mesh, t, n) > 4;
    for (int k = 0; k < 12; k++) {
      const int *corners = flesh_edge_corners[k / 2], p = n[corners[k % 2]], q = n[middles ? 4 + k / 2 : corners[1 - k % 2]];
      is_within |= goes_on(selection, X + 3 * (size_t)p, X + 3 * (size_t)q) ||
                   (middles && goes_on(selection, X + 3 * (size_t)q, X + 3 * (size_t)p));
    }
  }
  if (is_within)
    snprintf(e->words, FLESH_ERROR_WORDS, "%.200s ends within tets: on another mesh it acts on another part of the body", path);
  return FLESH_OK;
}

/* Refuses bars of the mesh if a box or sphere ends within tets: on other meshes it holds or loads other parts, and
 * differences of results show that, or separate it from the error of the mesh, only by chance. */
static int check_ends(const flesh_scene *scene, flesh_error_judge *judge)
{
  char words[FLESH_ERROR_WORDS] = "";
  int status = flesh_error_selections(scene, see_ends, &(ends){scene->mesh, words});
  if (!status) status = flesh_error_selections(scene, see_ends, &(ends){judge->companions[0].scene->mesh, words});
  if (*words) refuse(judge, words);
  return status;
}

/* Notes the tets that boxes cut: companions choose the tets of a box again, so their differences show the volume with
 * the wrong material only by chance. */
static int check_cut(const flesh_scene *scene, flesh_error_judge *judge)
{
  flesh_cut_words cut;
  char words[FLESH_ERROR_WORDS] = "";
  const int status = flesh_cut_say(scene, &cut);
  flesh_text_add(words, sizeof words, "%s%s%s", cut.regions, *cut.regions && *cut.muscles ? "; " : "", cut.muscles);
  if (*words) snprintf(judge->left_out, sizeof judge->left_out, "%.290s, which the bars do not count", words);
  return status;
}

static int read_scenes(const char *path, flesh_error_judge *judge)
{
  int status = FLESH_OK;
  for (int k = 0; k < judge->count && !status; k++) {
    const char *const sets[] = {"output.error_bars=false", judge->companions[k].set[0], judge->companions[k].set[1]};
    status = flesh_scene_read(path, *sets[2] ? 3 : 2, sets, &judge->companions[k].scene);
    if (status && status != FLESH_ERR_MEMORY && status != FLESH_ERR_INTERRUPTED && drop(judge, k)) status = FLESH_OK;
  }
  if (status && status != FLESH_ERR_MEMORY && status != FLESH_ERR_INTERRUPTED) {
    refuse(judge, flesh_error_text());
    status = FLESH_OK;
  }
  return status;
}

int flesh_error_choose(const flesh_scene *scene, const char *path, flesh_error_kind kind,
                       flesh_error_judge judges[FLESH_ERROR_KINDS])
{
  if (kind == FLESH_ERROR_STEP) choose_step(scene, &judges[kind]);
  else choose_mesh(scene, judges[FLESH_ERROR_STEP].count > 1, &judges[kind]);
  int status = read_scenes(path, &judges[kind]);
  if (!status && kind == FLESH_ERROR_MESH && judges[kind].count) status = check_ends(scene, &judges[kind]);
  return status || kind == FLESH_ERROR_STEP || !judges[kind].count ? status : check_cut(scene, &judges[kind]);
}

int flesh_error_run(const flesh_runner_options *given, flesh_error_judge *judge)
{
  flesh_error_stability stability = {.scene = judge->companions[0].scene, .options = given, .from_rest = 1};
  const int is_watched = judge->count && (judge->better || judge->coarser) && stability.scene->time.method == FLESH_METHOD_STATIC;
  const flesh_observer observer = {flesh_error_watch_stability, &stability};
  int status = FLESH_OK;
  for (int k = 0; k < judge->count && !status && !*stability.words; k++) {
    char *folder = flesh_text_new("%s/%s", given->out, judge->companions[k].folder);
    if (!folder) return flesh_no_memory();
    const flesh_runner_options options = {.out = folder, .scene_path = given->scene_path, .quiet = 1, .no_frames = 1,
                                          .max_seconds = given->max_seconds, .begun = given->begun,
                                          .argc = given->argc, .argv = given->argv,
                                          .observer_count = !k && is_watched, .observers = &observer};
    flesh_figures figures = {0};
    flesh_outcome outcome = {0};
    flesh_runner_run(judge->companions[k].scene, &options, &figures, &outcome);
    judge->companions[k].cpu_s = figures.cpu_s;
    if (outcome.status == FLESH_ERR_INTERRUPTED) status = outcome.status;
    if (outcome.status && !drop(judge, k)) {
      char words[FLESH_ERROR_WORDS];
      snprintf(words, sizeof words, "the companion (%.120s) ended: %.*s", judge->words,
               (int)strcspn(outcome.message, ";"), outcome.message);
      refuse(judge, words);
    }
    flesh_figures_close(&figures);
    free(folder);
  }
  if (!status && judge->count && *stability.words) refuse(judge, stability.words);
  return status;
}

void flesh_error_judge_close(flesh_error_judge *judge)
{
  for (int k = 0; k < FLESH_ERROR_COMPANIONS; k++) flesh_scene_destroy(&judge->companions[k].scene);
}
