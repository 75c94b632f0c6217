/* adapt.c: `flesh run --to`: solves, estimates the error, marks tets and refines them, until the bar is small
 * enough. */
#include "error/error.h"

#include <gsl/gsl_fit.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/folder.h"
#include "base/sort.h"
#include "base/text.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "error/companion.h"
#include "error/meshes.h"
#include "mesh/mesh.h"
#include "mesh/smooth.h"
#include "output/resume.h"
#include "run/start.h"
#include "scene/scene.h"
#include "sensitivity/sensitivity.h"

/* Share of the sum of the indicators that the marked tets have together (Doerfler 1996); these are halved once. With a
 * share of 0.3 tets whose errors the recovery does not see were never refined. */
static const double marked_share = 0.6;
/* Half of that share is marked if the bar is at most this many times the tolerance, so that the last mesh has fewer
 * dofs. */
static const double nearly_allowed = 1.5;
/* Constants of a bar, from data/results/error_bars.md. It uses the last meshes, with at least the share looked_back of
 * the last one's dofs, and needs a last mesh with at least least_growth times the dofs of the first one. Factors: of
 * the distance of the values from their limit plus their scatter; of the sum of the sizes in the estimate by recovery;
 * and of the former without an estimate. */
static const double looked_back = 0.25, least_growth = 1.5;
static const double of_values = 1.2, of_sizes = 0.3, of_values_alone = 3;
/* A change of the value by more than this many bars of the mesh before means another equilibrium. */
static const double jump_bars = 3;
/* If a bar is not smaller with this many times the dofs, it will not become smaller: for positions; for other columns,
 * whose bars scatter. */
static const double stuck_growth = 4, stuck_growth_of_others = 10;
/* Largest Newton tolerance except for positions: residuals affect the strain of small tets more. */
static const double newton_tolerance = 1e-8;
/* Tets with radius ratios below this are improved after halving, by moving nodes. */
static const double smooth_below = 0.3;
enum { LEVELS = 60, LEAST_LEVELS = 4, LEAST_BACK = 3, MOST_DOFS = 400000 };

/* A mesh and its results. */
typedef struct level {
  int nodes, tets, dofs;
  double value, moved, bar, cpu_s, quality; /* moved: the value of which a relative tolerance is a share */
  double estimate, cut_off; /* sum of the indicators' sizes, NaN if they are no error's; sum of the shares of cut tets */
} level;

typedef struct adapt {
  const flesh_runner_options *options;
  flesh_overrides overrides;
  char column[96];
  const char *unit;
  int figure; /* index of the column's last value among the figures of probes */
  double tolerance;
  int relative;
  flesh_mesh *mesh; /* with its marks */
  double *indicators; /* [tets] of the mesh */
  int local;        /* a tet that is halved in any case; -1: none */
  double jump;      /* largest change so far to another equilibrium */
  int levels;
  level list[LEVELS];
} adapt;

/* Reads TOLERANCE[%]:COLUMN. */
static int read_spec(const char *spec, double *tolerance, int *relative, const char **column)
{
  char *end;
  *tolerance = strtod(spec, &end);
  *relative = *end == '%';
  if (*relative) *tolerance /= 100, end++;
  *column = end + 1;
  return end > spec && *end == ':' && end[1] && isfinite(*tolerance) && *tolerance > 0 && (!*relative || *tolerance < 1);
}

int flesh_adapt_is_spec(const char *spec)
{
  double tolerance;
  int relative;
  const char *column;
  return read_spec(spec, &tolerance, &relative, &column);
}

/* Fails with the reason if a quantity of the scene has no bar of its mesh. */
static int check(adapt *a, const flesh_scene *scene)
{
  const char *dot = strrchr(a->column, '.');
  int count, held = 0;
  const flesh_probe *probes = flesh_scene_probes(scene, &count), *own = flesh_probe_of(scene, a->column);
  flesh_probe_column columns[FLESH_PROBE_COLUMNS];
  int k = own ? flesh_probe_columns(own, columns) : 0;
  if (scene->time.method != FLESH_METHOD_STATIC)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--to refines the meshes of equilibria (time.method static); for a motion, --error "
                                          "gives the bars of a mesh");
  if (scene->keys.bodies.count || !scene->body.materials || scene->keys.body.material_map)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--to refines the mesh of a scene of one body that has a material and no "
                                          "material_map, whose tets would be others");
  while (k-- > 0 && strcmp(columns[k].name, dot + 1)) continue;
  if (k < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--to names %s; it must be a column of output.probes, as %s.position_z", a->column,
                      count ? probes[0].name : "tip");
  a->figure = k;
  a->unit = columns[k].unit;
  for (; probes < own; probes++) a->figure += flesh_probe_columns(probes, columns);
  a->figure *= FLESH_PROBE_FIGURES;
  if (isnan(own->point[0]) && (!strncmp(dot, ".position_", 10) || !strncmp(dot, ".velocity_", 10)))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s is a mean over nodes, of which finer meshes have others; give the probe a point",
                      a->column);
  const int status = strncmp(dot, ".position_", 10) && strncmp(dot, ".reaction_", 10)
                         ? flesh_probe_is_at_pin(scene, own, scene->start.t, &held)
                         : FLESH_OK;
  return status || !held ? status
                         : flesh_fail(FLESH_ERR_ARGUMENT, "%s is a strain beside a pin, which grows without end as the mesh gets "
                                                          "finer: it has no bar", a->column);
}

/* Warns of what the bar of a column leaves out; for positions the bar includes different materials. */
static int warn_of_cut(const flesh_scene *scene, const char *column)
{
  flesh_cut_words cut;
  const int status = flesh_cut_say(scene, &cut), is_place = strstr(column, ".position_") != NULL;
  if (*cut.regions && (cut.has_density || !is_place))
    fprintf(stderr, "flesh: warning: %s on the first mesh; the bar of %s does not count %s\n", cut.regions, column,
            is_place ? "the densities" : "that");
  if (*cut.muscles)
    fprintf(stderr, "flesh: warning: %s on the first mesh; the bar of %s does not count that\n", cut.muscles, column);
  return status;
}

/* Reads the given scene with ten-node tets, and takes its mesh with the selections as named sets. */
static int begin(adapt *a, const flesh_texts *given)
{
  flesh_scene *scene = NULL;
  flesh_overrides_copy(&a->overrides, given);
  flesh_overrides_add(&a->overrides, "body.element", "tet10-mean");
  flesh_overrides_add(&a->overrides, "output.error_bars", "false");
  int status = flesh_overrides_read(&a->overrides, a->options->scene_path, &scene);
  if (!status) status = check(a, scene);
  if (!status && !a->options->quiet) status = warn_of_cut(scene, a->column);
  if (!status) status = flesh_error_carry(scene, a->options->quiet, &a->overrides, &a->mesh);
  flesh_overrides_add(&a->overrides, "body.refine", "0");
  if (!status && !strstr(a->column, ".position_") && flesh_scene_solver(scene)->newton_tolerance > newton_tolerance)
    flesh_overrides_add(&a->overrides, "solver.newton_tolerance", "1e-8");
  if (!status && scene->keys.body.curved.count) flesh_overrides_add(&a->overrides, "body.curved", "null");
  if (!status && a->overrides.failed) status = flesh_no_memory();
  flesh_scene_destroy(&scene);
  return status;
}

/* Takes the column's last value; for a position, `moved` is the distance from rest, 0 if it is only rounding. */
static void take_value(const adapt *a, const flesh_figures *figures, const flesh_scene *scene, level *l)
{
  l->moved = l->value = figures->probes[a->figure];
  const char *dot = strrchr(a->column, '.');
  flesh_mesh_info info;
  flesh_mesh_inspect(scene->mesh, &info);
  if (strncmp(dot, ".position_", 10)) return;
  l->moved -= flesh_probe_of(scene, a->column)->point[dot[10] - 'x'];
  if (fabs(l->moved) <= 1e-12 * info.edge_max) l->moved = 0;
}

/* Runs the scene quietly on the mesh, in `folder`; the last run also writes frames and the saved state. */
static int run(adapt *a, const char *folder, int last, flesh_scene **scene, level *l)
{
  flesh_figures figures = {0};
  flesh_outcome outcome = {0};
  int status = flesh_folder_make(folder);
  if (status) return status;
  const char *mesh = flesh_path("%s/mesh.msh", folder);
  char *absolute = NULL;
  status = flesh_mesh_write(a->mesh, mesh);
  if (!status && !(absolute = realpath(mesh, NULL))) status = flesh_fail(FLESH_ERR_FILE, "%s: cannot be found", mesh);
  if (!status) {
    flesh_overrides_add_text(&a->overrides, "body.mesh", absolute);
    status = flesh_overrides_read(&a->overrides, a->options->scene_path, scene);
  }
  free(absolute);
  if (status) return status;
  flesh_runner_options options = *a->options;
  flesh_error_stability stability = {.scene = *scene, .options = a->options, .from_rest = a->levels == 1};
  options.observer_count = !last;
  options.observers = &(flesh_observer){flesh_error_watch_stability, &stability};
  options.out = folder;
  options.quiet = 1;
  options.no_frames |= !last;
  options.save_state = last ? options.save_state : NULL;
  status = flesh_runner_run(*scene, &options, &figures, &outcome);
  if (outcome.status) status = flesh_fail(outcome.status, "%s", outcome.message);
  else if (!status && figures.final_inverted)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "the equilibrium on a mesh of %d tets has %d inverted ones, as where a body folds; "
                                            "meshes fold otherwise, and there is no bar", a->mesh->tets, figures.final_inverted);
  else if (!status && *stability.words)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "on a mesh of %d tets %s, and there is no bar", a->mesh->tets, stability.words);
  l->cpu_s = figures.cpu_s;
  if (!status) take_value(a, &figures, *scene, l);
  flesh_figures_close(&figures);
  return status;
}

static int count_free(const flesh_scene *scene)
{
  const int size = 3 * scene->mesh->nodes;
  uint8_t *fixed = calloc((size_t)size, 1);
  const int count = size - (fixed ? flesh_system_fixed(scene->system, scene->time.end, fixed) : 0);
  free(fixed);
  return count;
}

/* Returns the largest bar that the tolerance allows. */
static double allowed(const adapt *a) { return a->tolerance * (a->relative ? fabs(a->list[a->levels - 1].moved) : 1); }

/* Returns how far the last value is from the limit in a fit of limit + slope/dofs to the values of the last meshes,
 * weighted by their dofs squared, plus the scatter about the fit. The errors of thin bodies decrease like dofs^(-2/3)
 * if pressures are constant in tets, those at edges and corners faster; a fit of slope/dofs^2 found only half of the
 * errors of thin bodies. */
static double judge_values(const adapt *a)
{
  const level *last = &a->list[a->levels - 1];
  int first = a->levels - 1;
  double x[LEVELS], y[LEVELS], weights[LEVELS], limit, slope, off, errors[3];
  int count = 0;
  while (first > 0 && (a->levels - first < LEAST_BACK || a->list[first - 1].dofs >= looked_back * last->dofs)) first--;
  for (int k = first; k < a->levels; k++) {
    const double n = (double)a->list[k].dofs / last->dofs;
    x[count] = 1 / n, weights[count] = n * n, y[count++] = a->list[k].value - last->value;
  }
  gsl_fit_wlinear(x, 1, weights, 1, y, 1, (size_t)count, &limit, &slope, &errors[0], &errors[1], &errors[2], &off);
  return fabs(limit) + sqrt(off / (count - 2));
}

/* Computes the bar of the last level; a jump to another equilibrium counts in all later bars. */
static void judge(adapt *a)
{
  level *l = &a->list[a->levels - 1], *before = l - 1;
  l->bar = NAN;
  if (a->levels < LEAST_LEVELS || l->dofs < least_growth * a->list[0].dofs) return;
  const double change = fabs(l->value - before->value), values = judge_values(a);
  if (change > jump_bars * before->bar && change > allowed(a)) {
    a->jump = fmax(a->jump, change);
    fprintf(stderr, "flesh: warning: %s changes by %.2g %s from mesh %d to %d, %.2g times its bar: the body has another "
                    "equilibrium on finer meshes, as where it bends otherwise\n", a->column, change, a->unit, a->levels - 2,
            a->levels - 1, change / before->bar);
  }
  l->bar = isfinite(l->estimate) ? of_values * values + of_sizes * l->estimate + fabs(l->cut_off)
                                 : of_values_alone * values;
  l->bar = fmax(l->bar, a->jump);
}

typedef struct indicated {
  double size; /* size of its indicator, negative so that the largest comes first */
  int tet;
} indicated;

/* Refines the tets with the largest indicators, which together make up the share. */
static int refine(adapt *a)
{
  const int tets = a->mesh->tets;
  uint8_t *halvings = calloc((size_t)tets, 1);
  indicated *order = malloc((size_t)tets * sizeof *order);
  int status = halvings && order ? FLESH_OK : flesh_no_memory();
  const double share = a->list[a->levels - 1].bar <= nearly_allowed * allowed(a) ? marked_share / 2 : marked_share;
  double total = 0, sum = 0;
  flesh_mesh *finer = NULL, *smooth = NULL;
  for (int t = 0; t < tets && !status; t++) order[t] = (indicated){-fabs(a->indicators[t]), t}, total -= order[t].size;
  if (!status) flesh_sort(order, (size_t)tets, sizeof *order, flesh_compare_double);
  for (int k = 0; k < tets && !status && (!k || sum < share * total); k++) {
    halvings[order[k].tet] = 1;
    sum -= order[k].size;
  }
  if (!status && a->local >= 0) halvings[a->local] = 3;
  if (!status) status = flesh_mesh_refine_marked(a->mesh, halvings, &finer, NULL);
  if (!status) status = flesh_mesh_smooth(finer, smooth_below, &smooth);
  if (!status) {
    flesh_mesh_destroy(&a->mesh);
    a->mesh = smooth;
  }
  flesh_mesh_destroy(&finer);
  free(halvings);
  free(order);
  return status;
}

/* Returns how many digits of a value to print: down to a tenth of its bar, or six without a bar. */
static int digits_of(const level *l)
{
  return l->bar > 0 ? (int)fmin(17, fmax(6, ceil(log10(fabs(l->value) / l->bar)) + 1)) : 6;
}

/* Makes a level: its run, its indicators, its bar. */
static int step(adapt *a)
{
  flesh_scene *scene = NULL;
  flesh_state state = {0};
  level *l = &a->list[a->levels++];
  flesh_mesh_info info;
  flesh_mesh_inspect(a->mesh, &info);
  *l = (level){.nodes = info.nodes, .tets = info.tets, .quality = info.radius_ratio_min};
  char *folder = flesh_text_new("%s/to/%d", a->options->out, a->levels - 1);
  int status = folder ? run(a, folder, 0, &scene, l) : flesh_no_memory();
  if (!status) l->dofs = count_free(scene);
  if (!status) status = flesh_state_make(a->mesh->nodes, 0, 0, &state);
  if (!status) status = flesh_state_read(flesh_path("%s/state.txt", folder), a->mesh->nodes, &state);
  free(folder);
  free(a->indicators);
  a->indicators = malloc((size_t)a->mesh->tets * sizeof *a->indicators);
  if (!status && !a->indicators) status = flesh_no_memory();
  int is_goal = 0;
  if (!status) status = flesh_error_indicate(scene, &state, a->column, a->indicators, &is_goal, &l->cut_off);
  free(state.x);
  l->estimate = is_goal ? 0 : NAN;
  for (int t = 0; t < a->mesh->tets && !status && is_goal; t++) l->estimate += fabs(a->indicators[t]);
  /* Strain and stress at a point depend more on its tet than the work of the loads does. */
  const flesh_probe *probe = status ? NULL : flesh_probe_of(scene, a->column);
  a->local = !probe || is_goal || isnan(probe->point[0]) ? -1 : probe->tet;
  flesh_scene_destroy(&scene);
  if (!status) judge(a);
  if (!status && !a->options->quiet) {
    printf("mesh %d: %d tets, %d dofs: %s = %.*g %s", a->levels - 1, l->tets, l->dofs, a->column, digits_of(l), l->value,
           a->unit);
    if (isfinite(l->bar)) printf(" +/- %.2g", l->bar);
    putchar('\n');
    fflush(stdout);
  }
  return status;
}

/* Fails if finer meshes do not make the bar smaller, or if there are too many meshes. */
static int check_progress(const adapt *a)
{
  const level *l = &a->list[a->levels - 1];
  const int is_zero = fabs(l->moved) <= 1e-12 * fabs(l->value) || /* or not distinguished from zero with many times the dofs */
                      (l->bar >= fabs(l->moved) && l->dofs >= stuck_growth * stuck_growth * a->list[0].dofs);
  if (a->relative && isfinite(l->bar) && is_zero)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s %s %.2g %s, which its bar of %.2g %s does not tell from nothing; --to must have "
                                          "a tolerance in %s, as 0.001:%s", a->column,
                      strstr(a->column, ".position_") ? "has moved by" : "is", l->moved, a->unit, l->bar, a->unit, a->unit,
                      a->column);
  const double growth = isfinite(l->estimate) ? stuck_growth : stuck_growth_of_others;
  for (const level *k = a->list; k < l; k++)
    if (growth * k->dofs <= l->dofs && l->bar >= k->bar)
      return flesh_fail(FLESH_ERR_BUDGET, "the bar of %s is %.2g %s on a mesh of %d dofs, and was %.2g %s with %d dofs; meshes "
                                          "have different equilibria, as where a body buckles or folds, or the quantity does "
                                          "not settle, or solver.newton_tolerance is too large", a->column, l->bar, a->unit,
                        l->dofs, k->bar, a->unit, k->dofs);
  if (a->levels < LEVELS && l->dofs <= MOST_DOFS) return FLESH_OK;
  return flesh_fail(FLESH_ERR_BUDGET, "the bar of %s is %.2g %s after %d meshes, of which the last has %d dofs; --to "
                                      "must have a larger tolerance", a->column, l->bar, a->unit, a->levels, l->dofs);
}

/* Adds the meshes and their values to result.json. */
static int write_result(adapt *a)
{
  json_t *result, *levels = json_array();
  const char *path = flesh_path("%s/result.json", a->options->out);
  const int status = flesh_json_read(path, &result);
  if (status) {
    json_decref(levels);
    return status;
  }
  for (int k = 0; k < a->levels; k++) {
    const level *l = &a->list[k];
    json_array_append_new(
        levels, json_pack("{si si si sf sf sf so* so* so*}", "tets", l->tets, "nodes", l->nodes, "dofs", l->dofs, "value",
                          l->value, "radius_ratio_min", l->quality, "cpu_s", l->cpu_s, "error_mesh", flesh_json_number(l->bar),
                          "estimate", flesh_json_number(l->estimate), "cut_off",
                          l->cut_off ? flesh_json_number(l->cut_off) : NULL));
  }
  json_object_set_new(result, "adapted_mesh",
                      json_pack("{sssssfsbso}", "column", a->column, "unit", a->unit, "tolerance", a->tolerance, "relative",
                                a->relative, "meshes", levels));
  return flesh_json_write(path, result);
}

/* Runs the scene on the last mesh in the folder of the results, and prints the result and the cost. */
static int finish(adapt *a)
{
  flesh_scene *scene = NULL;
  level again = {0};
  const level *last = &a->list[a->levels - 1];
  double cpu_s = 0, quality = 1;
  for (int k = 0; k < a->levels; k++) {
    cpu_s += a->list[k].cpu_s;
    quality = fmin(quality, a->list[k].quality);
  }
  int status = run(a, a->options->out, 1, &scene, &again);
  flesh_scene_destroy(&scene);
  if (!status) status = write_result(a);
  if (status || a->options->quiet) return status;
  printf("%s = %.*g %s +/- %.2g (mesh)\n", a->column, digits_of(last), last->value, a->unit, last->bar);
  printf("%d meshes and %d solves, %d dofs in the last, least radius ratio %.2g, %.3g s of CPU time\n", a->levels,
         a->levels + 1, last->dofs, quality, cpu_s + again.cpu_s);
  printf("mesh: %s/mesh.msh\nagain: flesh run %s/scene.yaml\n", a->options->out, a->options->out);
  return FLESH_OK;
}

int flesh_adapt_run(const flesh_runner_options *options, const flesh_texts *overrides, const char *spec)
{
  adapt a = {.options = options};
  const char *column;
  if (strlen(spec) >= sizeof a.column) return flesh_fail(FLESH_ERR_ARGUMENT, "--to is too long");
  read_spec(spec, &a.tolerance, &a.relative, &column);
  strcpy(a.column, column);
  int status = begin(&a, overrides), reached = 0;
  while (!status && !reached) {
    status = step(&a);
    if (!status) reached = a.list[a.levels - 1].bar <= allowed(&a);
    if (!status && !reached) status = check_progress(&a);
    if (!status && !reached) status = refine(&a);
  }
  if (!status) status = finish(&a);
  flesh_overrides_close(&a.overrides);
  flesh_mesh_destroy(&a.mesh);
  free(a.indicators);
  return status;
}
