/* spec.c: reads the spec of a fit by a table of keys, as specs of sweeps are read. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "fit/map.h"
#include "flesh/scene.h"
#include "run/provenance.h"
#include "scene/scene.h"

/* Largest Newton tolerance of runs: equilibria at slightly different parameters are compared, so they must be solved
 * more accurately. */
static const double newton_tolerance = 1e-8;

static const char *const derivatives[] = {"tangents", "differences", NULL};

#define AT(member) .offset = offsetof(flesh_fit_measured, member)
static const flesh_key measured_table[] = {
    {.name = "probes", .type = FLESH_KEY_PATH, AT(paths[FLESH_FIT_OF_PROBES]), .default_value = "",
     .doc = "CSV with columns of probes.csv: t [s], tip.position_z [m]; without t, one row of the end"},
    {.name = "history", .type = FLESH_KEY_PATH, AT(paths[FLESH_FIT_OF_HISTORY]), .default_value = "",
     .doc = "instead of probes: CSV with columns of history.csv"},
    {.name = "positions", .type = FLESH_KEY_PATH, AT(paths[FLESH_FIT_OF_POSITIONS]), .default_value = "",
     .doc = "instead of probes: CSV of positions at the end, x,y,z, of nodes (column node, from 0) or of points of the body "
            "at rest (columns X,Y,Z) or at most a quarter of an edge outside"},
    {.name = "columns", .type = FLESH_KEY_TREE, AT(chosen), .default_value = "",
     .doc = "a list of the columns that count, without units; default: all"},
    {.name = "deviation", .type = FLESH_KEY_NUMBER, AT(deviation), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "standard deviation of each number, in its unit; or the file has columns NAME_deviation"},
    {.name = "weight", .type = FLESH_KEY_NUMBER, AT(weight), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "instead of a deviation: of each squared residual, which is 1/deviation^2"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_fit_experiment, member)
static const flesh_key experiment_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name), .doc = "of letters, digits and _; of its folder DIR/runs/NAME"},
    {.name = "scene", .type = FLESH_KEY_PATH, AT(scene), .doc = "of a file, relative to the spec"},
    {.name = "set", .type = FLESH_KEY_TREE, AT(given), .default_value = "",
     .doc = "a mapping of values by the scene's keys: {time.end: 1}"},
    {.name = "measured", .type = FLESH_KEY_OBJECTS, AT(files), .children = measured_table,
     .child_size = sizeof(flesh_fit_measured), .doc = "files of measurements"},
    {.name = "derivatives", .type = FLESH_KEY_CHOICE, AT(by_differences), .choices = derivatives, .default_value = "tangents",
     .doc = "by tangents where the scene has them, a linear solve for each nonlinear one and parameter; or by differences of two "
            "runs for each parameter, which are cheaper in motions damped by the current stiffness"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_fit_parameter, member)
static const flesh_key parameter_table[] = {
    {.name = "key", .type = FLESH_KEY_TEXT, AT(key), .doc = "of the scene, as in --set: body.material.young"},
    {.name = "name", .type = FLESH_KEY_TEXT, AT(name), .default_value = "",
     .doc = "in tables, of letters, digits and _; default: the key's last word, or the whole key"},
    {.name = "start", .type = FLESH_KEY_NUMBER, AT(start), .doc = "value that the search begins with"},
    {.name = "from", .type = FLESH_KEY_NUMBER, AT(from), .default_value = "-.inf", .doc = "least value"},
    {.name = "to", .type = FLESH_KEY_NUMBER, AT(to), .default_value = ".inf", .doc = "largest value"},
    {.name = "spacing", .type = FLESH_KEY_CHOICE, AT(spacing), .choices = flesh_spacings, .default_value = "linear",
     .doc = "logarithmic: the logarithm is searched and gets the error, for positive values of unknown size"},
    {.name = "scale", .type = FLESH_KEY_NUMBER, AT(scale), .range = FLESH_RANGE_POSITIVE, .default_value = "",
     .doc = "typical size of linear changes, a thousandth of which differences take; default: the size of start"},
    {.name = "experiments", .type = FLESH_KEY_TREE, AT(experiment_list), .default_value = "",
     .doc = "a list of the experiments whose scenes have the key; default: all"},
    {.name = NULL},
};
#undef AT

#define AT(member) .offset = offsetof(flesh_fit, member)
static const flesh_key fit_table[] = {
    {.name = "title", .type = FLESH_KEY_TEXT, AT(title), .default_value = "", .doc = "what the fit is for"},
    {.name = "experiments", .type = FLESH_KEY_OBJECTS, AT(experiment_list), .children = experiment_table,
     .child_size = sizeof(flesh_fit_experiment), .doc = "scenes of which something was measured"},
    {.name = "parameters", .type = FLESH_KEY_OBJECTS, AT(parameter_list), .children = parameter_table,
     .child_size = sizeof(flesh_fit_parameter), .default_value = "",
     .doc = "what is fitted, alone or beside a map"},
    {.name = "map", .type = FLESH_KEY_OBJECT, AT(map_keys), .children = flesh_fit_map_table, .default_value = "",
     .doc = "a constant of the material of each tet, fitted alone or with the parameters"},
    {.name = "max_iterations", .type = FLESH_KEY_INTEGER, AT(max_iterations), .range = FLESH_RANGE_POSITIVE,
     .default_value = "50", .doc = "steps of the search at most; of a map with each weight"},
    {.name = "tolerance", .type = FLESH_KEY_NUMBER, AT(tolerance), .range = FLESH_RANGE_FRACTION,
     .default_value = "0.01", .doc = "the search ends where a further step would be this share of the standard errors"},
    {.name = NULL},
};
#undef AT

const flesh_settings_part flesh_fit_keys[] = {{"Keys of a spec", fit_table, NULL}, {0}};

/* Collects the overrides of an experiment: those that the fit sets itself (no frames, no error bars, and accurate
 * solves), then those of the spec. */
static int set_own(flesh_fit *fit, flesh_fit_experiment *e)
{
  flesh_settings given = {0};
  flesh_scene *scene = NULL;
  char number[FLESH_NUMBER_SIZE];
  int status = flesh_settings_read(&fit->arena, fit->path, e->given, &given);
  for (int k = 0; k <= given.count && !status; k++)
    status = flesh_settings_check(k ? given.nodes[k - 1] : e->scene_node, e->scene, k, given.texts);
  if (status) return status;
  status = flesh_scene_read(e->scene, given.count, given.texts, &scene);
  if (status) return flesh_node_fail_within(status, e->scene_node, "%s", "");
  flesh_number_text(fmin(flesh_scene_solver(scene)->newton_tolerance, newton_tolerance), number);
  const int first = !flesh_scene_uses_newton_tolerance(scene), count = 3 - first;
  flesh_scene_destroy(&scene);
  e->set.values = flesh_arena_take(&fit->arena, sizeof(char *) * (size_t)(given.count + count));
  const char *tolerance = flesh_arena_print(&fit->arena, "solver.newton_tolerance=%s", number);
  if (!e->set.values || !tolerance) return flesh_no_memory();
  const char *const own[] = {tolerance, "output.frame_interval=0", "output.error_bars=false"};
  for (; e->set.count < given.count + count; e->set.count++)
    e->set.values[e->set.count] = e->set.count < count ? own[first + e->set.count] : given.texts[e->set.count - count];
  return FLESH_OK;
}

/* Lists the measured columns of probes. */
static int list_columns(flesh_arena *arena, flesh_fit_experiment *e)
{
  int most = 1;
  for (int k = 0; k < e->measured_count; k++) most += e->measured[k].quantity_count;
  e->columns = flesh_arena_take(arena, sizeof *e->columns * (size_t)most);
  if (!e->columns) return flesh_no_memory();
  for (int k = 0; k < e->measured_count; k++) {
    flesh_fit_measured *m = &e->measured[k];
    m->first_column = e->column_count;
    for (int q = 0; q < m->quantity_count && m->table == FLESH_FIT_OF_PROBES; q++)
      e->columns[e->column_count++] = m->quantities[q].name;
  }
  return FLESH_OK;
}

static int read_measured(flesh_fit *fit, const flesh_scene *scene, flesh_fit_experiment *e)
{
  const flesh_node *list = flesh_node_find(e->node, "measured"), *node = list->first;
  int status = FLESH_OK;
  e->measured = e->files.values;
  e->first = fit->count;
  if (!e->files.count) return flesh_node_fail(list, "measured is []; it must name at least one file");
  for (int k = 0; k < e->files.count && !status; k++, node = node->next) {
    e->measured[k].node = node;
    status = flesh_fit_measured_read(&fit->arena, scene, &e->measured[k]);
    if (!status) e->measured_count++, e->count += e->measured[k].count;
  }
  fit->count += e->count;
  return status ? status : list_columns(&fit->arena, e);
}

static int read_experiment(flesh_fit *fit, flesh_fit_experiment *e)
{
  flesh_scene *scene = NULL;
  e->scene_node = flesh_node_find(e->node, "scene");
  e->folder = flesh_arena_print(&fit->arena, "%s/runs/%s", fit->options.out, e->name);
  e->scratch = flesh_arena_print(&fit->arena, "%s/runs/%s/scratch", fit->options.out, e->name);
  if (!e->folder || !e->scratch) return flesh_no_memory();
  int status = flesh_setting_check_name(flesh_node_find(e->node, "name"), e->name);
  for (int k = 0; k < fit->experiment_count && !status; k++)
    if (!strcmp(fit->experiments[k].name, e->name))
      status = flesh_node_fail(flesh_node_find(e->node, "name"), "two experiments are named %s; names must differ", e->name);
  if (!status) status = set_own(fit, e);
  if (!status) {
    status = flesh_scene_read(e->scene, e->set.count, e->set.values, &scene);
    if (status) flesh_node_fail_within(status, e->scene_node, "%s", "");
  }
  if (status) return status;
  e->end = flesh_scene_times(scene)->end;
  e->nodes = flesh_mesh_node_count(flesh_scene_mesh(scene));
  e->inputs = flesh_provenance_scene(scene, e->scene);
  status = flesh_study_fingerprint(scene, e->scene, e->fingerprint);
  if (!status) status = read_measured(fit, scene, e);
  e->moves = flesh_scene_times(scene)->method != FLESH_METHOD_STATIC;
  if (!status)
    snprintf(e->differences, sizeof e->differences, "%s",
             e->by_differences ? "the spec asks for them"
             : e->moves        ? flesh_fit_motion_refused(e, scene)
                               : flesh_scene_tangents_refused(scene));
  flesh_scene_destroy(&scene);
  return status;
}

/* Lists all measured numbers. */
static int list_data(flesh_fit *fit)
{
  int i = 0;
  fit->data = flesh_arena_take(&fit->arena, (size_t)fit->count * sizeof *fit->data);
  for (int e = 0; e < fit->experiment_count && fit->data; e++)
    for (int k = 0; k < fit->experiments[e].measured_count; k++)
      for (int d = 0; d < fit->experiments[e].measured[k].count; d++) fit->data[i++] = &fit->experiments[e].measured[k].data[d];
  return fit->data ? FLESH_OK : flesh_no_memory();
}

/* Returns whether a parameter before the k-th has its name. */
static int is_taken(const flesh_fit *fit, int k)
{
  int taken = 0;
  for (int j = 0; j < k; j++) taken |= !strcmp(fit->parameters[j].name, fit->parameters[k].name);
  return taken;
}

static int name_parameter(flesh_fit *fit, int k)
{
  flesh_fit_parameter *p = &fit->parameters[k];
  char *whole, *last = flesh_setting_name(&fit->arena, p->key, &whole);
  const flesh_node *given = flesh_node_find(p->node, "name");
  if (!last) return flesh_no_memory();
  if (!p->name) p->name = last;
  if (!given && is_taken(fit, k)) p->name = whole;
  if (is_taken(fit, k))
    return flesh_node_fail(given ? given : p->node, "two parameters are named %s; names must differ", p->name);
  return flesh_setting_check_name(given ? given : p->node, p->name);
}

/* Finds the experiments on which the parameter acts. */
static int choose_experiments(flesh_fit *fit, int k)
{
  const flesh_fit_parameter *p = &fit->parameters[k];
  const flesh_node *list = p->experiment_list;
  char shown[FLESH_SHOW_SIZE];
  for (int e = 0; e < fit->experiment_count && !list; e++) fit->experiments[e].acts[k] = 1;
  if (list && (list->kind != FLESH_NODE_LIST || !list->count))
    return flesh_node_fail(list, "experiments is %s; it must be a list of names", flesh_node_show(list, shown));
  for (const flesh_node *child = list ? list->first : NULL; child; child = child->next) {
    int found = 0;
    for (int e = 0; e < fit->experiment_count; e++)
      if (child->kind == FLESH_NODE_SCALAR && !strcmp(child->text, fit->experiments[e].name))
        found = fit->experiments[e].acts[k] = 1;
    if (!found)
      return flesh_node_fail(child, "experiments has %s; it must be the name of an experiment, as %s",
                             flesh_node_show(child, shown), fit->experiments[0].name);
  }
  return FLESH_OK;
}

static int read_parameter(flesh_fit *fit, int k)
{
  const flesh_fit_parameter *p = &fit->parameters[k];
  for (int j = 0; j < k; j++)
    if (!strcmp(fit->parameters[j].key, p->key) && !p->experiment_list)
      return flesh_node_fail(flesh_node_find(p->node, "key"), "%s is fitted twice; it must be one parameter", p->key);
  int status = name_parameter(fit, k);
  if (!status) status = choose_experiments(fit, k);
  if (!status) status = flesh_fit_check_numbers(&fit->parameters[k]);
  for (int e = 0; e < fit->experiment_count && !status; e++)
    if (fit->experiments[e].acts[k]) status = flesh_fit_check_values(&fit->experiments[e], p->key, p, "start");
  return status;
}

static int read_parameters(flesh_fit *fit, const flesh_node *list)
{
  const flesh_node *node = list ? list->first : NULL;
  int status = FLESH_OK;
  fit->parameters = fit->parameter_list.values;
  for (int k = 0; k < fit->parameter_list.count && !status; k++, node = node->next) {
    fit->parameters[k].node = node;
    fit->parameter_count = fit->key_count = k + 1;
    status = read_parameter(fit, k);
  }
  if (!status && fit->count < fit->parameter_count)
    status = flesh_node_fail(list, "parameters are %d; they must be at most as many as the measured numbers, which are %d",
                             fit->parameter_count, fit->count);
  return status;
}

/* Makes the map's tets the last parameters. */
static int read_map(flesh_fit *fit, const flesh_node *node)
{
  const size_t count = (size_t)fit->key_count;
  fit->map = &fit->map_keys;
  fit->map->of.node = node;
  const int status = flesh_fit_map_prepare(fit);
  if (status) return status;
  flesh_fit_parameter *all = flesh_arena_take(&fit->arena, (count + (size_t)fit->map->count) * sizeof *all);
  if (!all) return flesh_no_memory();
  if (count) memcpy(all, fit->parameters, count * sizeof *all);
  for (int k = 0; k < fit->map->count; k++) all[fit->parameter_count++] = fit->map->of;
  fit->parameters = all;
  for (int k = 0; k <= fit->key_count; k++)
    if (all[k].start <= all[k].from || all[k].start >= all[k].to)
      return flesh_node_fail(flesh_node_find(all[k].node, "start"), "start is %g, which is a bound; in a fit of a map it must "
                             "lie between from and to", all[k].start);
  return FLESH_OK;
}

int flesh_fit_read(const char *path, flesh_fit *fit)
{
  flesh_node *root = NULL;
  fit->path = path;
  int status = flesh_spec_read(&fit->arena, &fit->path, &fit->text, fit_table, &root, fit);
  if (status) return status;
  const flesh_node *list = flesh_node_find(root, "experiments"), *parameters = flesh_node_find(root, "parameters"),
                   *map = flesh_node_find(root, "map"), *node = list->first;
  const int count = fit->parameter_list.count;
  fit->experiments = fit->experiment_list.values;
  if (!node) return flesh_node_fail(list, "experiments is []; it must have one or more");
  if ((!map && !count) || count > FLESH_FIT_PARAMETERS)
    return flesh_node_fail(count ? parameters : root, "parameters are %d; they must be 1 to %d, or there is a map", count,
                           FLESH_FIT_PARAMETERS);
  for (int e = 0; e < fit->experiment_list.count && !status; e++, fit->experiment_count++, node = node->next) {
    fit->experiments[e].node = node;
    status = read_experiment(fit, &fit->experiments[e]);
  }
  if (!status) status = list_data(fit);
  if (!status) status = read_parameters(fit, parameters);
  return status || !map ? status : read_map(fit, map);
}
