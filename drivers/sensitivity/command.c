/* command.c: `flesh sensitivity`: runs a scene, and differentiates columns of its probes at the end by keys of the
 * scene. */
#include "commands.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "math/differences.h"
#include "output/probe_place.h"
#include "run/ranks.h"
#include "run/start.h"
#include "scene/override.h"
#include "scene/scene.h"
#include "scene/scene_keys.h"
#include "sensitivity/sensitivity.h"
#include "study/embedded.h"
#include "study/csv.h"
#include "system/system.h"
#include "system/velocity_scale.h"

enum { MOST = 64 }; /* columns, and keys */

/* Largest Newton tolerance of the run, as a derivative is only as accurate as the run; tolerance of the derivative's
 * own solves, as little is left of a reaction when dead loads balance it. */
static const double newton_tolerance = 1e-10, tolerance = 1e-12;

/* Length of differences as a share of the size, and by how many such lengths the middle is moved off the value: at an
 * end of a key's range the differences lie within the range. Longer ones cross kinks of contact and of clamped
 * eigenvalues. */
static const struct way {
  double difference;
  int middle;
} ways[] = {{1e-6, 0}, {1e-8, 0}, {1e-8, -2}, {1e-8, 2}};

/* A key of the scene that is a number, and the scenes with four values near its own. */
typedef struct varied_key {
  char key[FLESH_LIST_ITEM];
  double value;
  flesh_scene *scenes[FLESH_DIFFERENCES];
} varied_key;

typedef struct study {
  flesh_arena memory; /* owns the arrays of numbers and `beside` */
  const char *path, *of, *to, *out;
  flesh_overrides overrides;
  flesh_scene *scene;
  flesh_state state;
  int response_count, key_count;
  flesh_response responses[MOST];
  varied_key keys[MOST];
  flesh_parameter parameters[MOST]; /* [keys] */
  flesh_response *beside; /* [responses*keys*4] columns in the scenes beside; n is 0 if one is the scene's own function */
  double *gradients; /* [responses*keys] */
} study;

/* ---- columns and keys ---- */

static int take_column(void *data, const char *name)
{
  study *s = data;
  if (s->response_count == MOST) return flesh_fail(FLESH_ERR_ARGUMENT, "--of has more than %d columns", MOST);
  const int status = flesh_response_find(s->scene, name, flesh_scene_times(s->scene)->end, &s->responses[s->response_count++]);
  return status ? flesh_fail_within(status, "--of is %s; ", name) : FLESH_OK;
}

static int not_there(const char *key, const char *why)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "--to is '%s'; %s; it must be a number of the scene as --set names it, such as "
                    "body.material.young or effects.gravity.acceleration[2]", key, why);
}

/* Returns the size of a value. For a component of a vector it is that of the largest component; for a rotation at least
 * a radian, as the size of a small rotation would leave round-off; 1 if all are 0. For a place it is the size of the
 * body, wherever the origin is; for a length its own, limited to the range from a thousandth of the body's size to that
 * size. Near 1/2 lambda depends on the distance of Poisson's ratio from 1/2, which then limits its size. */
static double size_of(const flesh_scene *scene, const char *path, const flesh_key *key, const flesh_node *parent, double value)
{
  const int is_vector = parent->kind == FLESH_NODE_LIST;
  double size = fmax(fabs(value), strstr(path, ".rotation[") ? 1 : 0), other;
  for (const flesh_node *item = is_vector ? parent->first : NULL; item; item = item->next)
    if (item->kind == FLESH_NODE_SCALAR && !flesh_option_number(item->text, &other) && isfinite(other))
      size = fmax(size, fabs(other));
  if (key && key->unit && !strcmp(key->unit, "m")) {
    const double side = flesh_system_length_scale(flesh_scene_system(scene));
    size = is_vector ? side : fmin(fmax(size, 1e-3 * side), side);
  }
  if (strstr(path, ".poisson") && value < 0.5) size = fmin(size, 1e3 * (0.5 - value));
  return size > 0 ? size : 1;
}

/* Finds the value in force of a key, and its size. */
static int find_value(const flesh_scene *scene, const char *path, double *value, double *size)
{
  flesh_text text = {0};
  flesh_arena arena = {0};
  flesh_node *root = NULL, *node, *parent;
  const flesh_key *key;
  if (strncmp(path, "body.", 5) && strncmp(path, "bodies[", 7) && strncmp(path, "effects", 7) &&
      strncmp(path, "start.", 6))
    return not_there(path, "derivatives are by keys of bodies, effects and the start");
  flesh_scene_print(scene, &text);
  int status = text.failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for a scene") : FLESH_OK;
  if (!status) status = flesh_yaml_parse(&arena, text.data, text.size, &(flesh_source){"the scene", 0}, &root);
  if (!status) status = flesh_override_find(&arena, flesh_scene_table, path, root, &node, &parent, &key);
  if (status == FLESH_ERR_ARGUMENT) status = not_there(path, "the scene has no such key");
  if (!status && (node->kind != FLESH_NODE_SCALAR || flesh_option_number(node->text, value)))
    status = not_there(path, "this key is no number");
  if (!status) *size = size_of(scene, path, key, parent, *value);
  flesh_arena_free(&arena);
  free(text.data);
  return status;
}

/* Reads the scenes with the key varied by `difference`. If a load or friction begins at its value, these scenes need
 * solves that the scene's own run did not make, and are refused. */
static int make_scenes(const study *s, double difference, int middle, varied_key *varied, flesh_parameter *parameter)
{
  const flesh_system *own = flesh_scene_system(s->scene);
  int status = FLESH_OK;
  for (int k = 0; k < FLESH_DIFFERENCES && !status; k++) {
    flesh_overrides set;
    char number[64];
    snprintf(number, sizeof number, "%.17g", varied->value + (flesh_difference_at[k] + middle) * difference);
    flesh_overrides_copy(&set, &s->overrides.texts);
    flesh_overrides_add(&set, varied->key, number);
    status = flesh_overrides_read(&set, s->path, &varied->scenes[k]);
    flesh_overrides_close(&set);
    if (status) break;
    const flesh_system *beside = parameter->systems[k] = flesh_scene_system(varied->scenes[k]);
    if (flesh_system_has_follower_loads(beside) != flesh_system_has_follower_loads(own) ||
        flesh_system_multiplier_count(beside) != flesh_system_multiplier_count(own))
      status = flesh_fail(FLESH_ERR_ARGUMENT, "beside its value the scene is of another kind, as where friction begins or tets "
                                              "are no longer incompressible");
  }
  parameter->difference = difference;
  return status;
}

static void clear_scenes(varied_key *varied)
{
  for (int k = 0; k < FLESH_DIFFERENCES; k++) flesh_scene_destroy(&varied->scenes[k]);
}

/* Reads the scene again with the key at p -+ 1 and 2 millionths of its size; with a hundredth of these if the scene
 * does not accept them. FLESH_ERR_ARGUMENT with a sentence if there is no such key or it is not a number; fails also as
 * reading scenes does. */
static int take_key(void *data, const char *key)
{
  study *s = data;
  if (s->key_count == MOST) return flesh_fail(FLESH_ERR_ARGUMENT, "--to has more than %d keys", MOST);
  varied_key *varied = &s->keys[s->key_count];
  flesh_parameter *parameter = &s->parameters[s->key_count++];
  snprintf(varied->key, sizeof varied->key, "%s", key);
  double size = 1;
  int status = find_value(s->scene, key, &varied->value, &size);
  if (status) return status;
  for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
    status = make_scenes(s, ways[k].difference * size, ways[k].middle, varied, parameter);
    if (status != FLESH_ERR_ARGUMENT) return status;
    clear_scenes(varied);
  }
  return flesh_fail_within(status, "--to is '%s', differences of which are refused: ", key);
}

/* ---- the run ---- */

/* Returns the scene of column k of `beside`. */
static const flesh_scene *beside_of(const study *s, int k) { return s->keys[k / 4 % s->key_count].scenes[k % 4]; }

/* Returns whether quantities of tets, as functions of the state, are the same in the scenes of key j. */
static int tets_respond_alike(const study *s, int j)
{
  const flesh_system *system = flesh_scene_system(s->scene);
  const int count = flesh_system_effect_count(system);
  unsigned char *same = calloc((size_t)count + 1, 1);
  int alike = same && flesh_parameter_compare(&s->parameters[j], system, same);
  for (int e = 0; e < count && alike; e++) {
    const flesh_effect_operations *can = flesh_system_effect(system, e)->operations;
    alike = same[e] || (can->role != FLESH_ROLE_ELASTICITY && !(can->figures && can->figures->stress));
  }
  free(same);
  return alike;
}

/* Finds the columns in the scenes beside, except those that are the same functions of the state as in the scene. */
static int find_beside(study *s)
{
  const size_t pairs = (size_t)s->response_count * (size_t)s->key_count;
  s->gradients = flesh_arena_take(&s->memory, pairs * sizeof *s->gradients);
  s->beside = flesh_arena_take(&s->memory, 4 * pairs * sizeof *s->beside);
  int status = s->gradients && s->beside ? FLESH_OK : flesh_no_memory();
  for (int k = 0; k < 4 * s->response_count * s->key_count && !status; k++) {
    const flesh_response *own = &s->responses[k / 4 / s->key_count];
    if (own->probe.quantities & FLESH_PROBE_OF_TETS && tets_respond_alike(s, k / 4 % s->key_count)) continue;
    status = flesh_response_find(beside_of(s, k), own->name, flesh_scene_times(s->scene)->end, &s->beside[k]);
  }
  return status;
}

/* Implements flesh_observer.observe: measures the columns, in the scenes beside, too, where they differ. */
static int observe(void *data, const flesh_step_record *record)
{
  study *s = data;
  int status = FLESH_OK;
  for (int k = 0; k < s->response_count && !status; k++) {
    status = flesh_response_observe(s->scene, record, &s->responses[k]);
    if (!status) status = flesh_response_differentiate(s->scene, record, &s->responses[k]);
  }
  for (int k = 0; k < 4 * s->response_count * s->key_count && !status; k++)
    if (s->beside[k].n) status = flesh_response_observe(beside_of(s, k), record, &s->beside[k]);
  return status;
}

/* ---- derivatives ---- */

static int differentiate_equilibrium(study *s, const flesh_solver_options *options)
{
  const flesh_system *system = flesh_scene_system(s->scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  double *by_x = flesh_arena_take(&s->memory, 3 * n * sizeof *by_x), *by_v = by_x + n, *residual = by_v + n; /* by_v stays 0 */
  flesh_sensitivity *sensitivity = NULL;
  flesh_point point = flesh_point_at(s->state.t, s->state.x, s->state.v, s->state.v); /* v is 0 */
  point.multipliers = s->state.multipliers;
  point.internal = s->state.internal;
  int status = by_x ? flesh_system_residual(system, &point, residual) : flesh_no_memory();
  if (!status) status = flesh_sensitivity_create(system, options, tolerance, &sensitivity);
  if (!status) status = flesh_sensitivity_set(sensitivity, &s->state, NULL);
  for (int k = 0; k < s->response_count && !status; k++) {
    flesh_response *response = &s->responses[k];
    const flesh_quantity quantity = {response->probes ? by_x : response->by_x, response->of_residual};
    memset(by_x, 0, n * sizeof *by_x);
    if (response->probes) flesh_response_visit(response, s->state.t, by_x, by_v);
    flesh_response_measure(residual, response);
    status = flesh_sensitivity_gradient(sensitivity, &quantity, s->key_count, s->parameters,
                                        s->gradients + (size_t)k * (size_t)s->key_count);
  }
  flesh_sensitivity_destroy(&sensitivity);
  return status;
}

/* Adds how key j changes the start; by_start [responses][6*nodes] are the derivatives by x and v at the start. */
static int add_start(study *s, int j, const double *by_start)
{
  const size_t n = 2 * (size_t)flesh_system_unknowns(flesh_scene_system(s->scene));
  flesh_state starts[4] = {{0}}; /* v stands behind x in memory */
  int status = FLESH_OK;
  for (int i = 0; i < 4 && !status; i++) status = flesh_start_make(s->keys[j].scenes[i], &starts[i]);
  for (size_t d = 0; d < n && !status; d++) {
    const double slope = flesh_difference_of(starts[0].x[d], starts[1].x[d], starts[2].x[d], starts[3].x[d],
                                             s->parameters[j].difference);
    for (int k = 0; k < s->response_count && slope != 0; k++)
      s->gradients[k * s->key_count + j] += slope * by_start[(size_t)k * n + d];
  }
  for (int i = 0; i < 4; i++) free(starts[i].x);
  return status;
}

static int differentiate_motion(study *s, flesh_trajectory *trajectory)
{
  const size_t n = 2 * (size_t)flesh_system_unknowns(flesh_scene_system(s->scene));
  double *by_start = flesh_arena_take(&s->memory, (size_t)s->response_count * n * sizeof *by_start);
  int status = by_start ? FLESH_OK : flesh_no_memory();
  for (int k = 0; k < s->response_count && !status; k++) {
    flesh_response *response = &s->responses[k];
    const flesh_motion_quantity quantity = {response->by_x, response->by_v, response->over,
                                            response->probes ? flesh_response_visit : NULL, response};
    status = flesh_trajectory_gradient(trajectory, &quantity, s->key_count, s->parameters,
                                       s->gradients + (size_t)k * (size_t)s->key_count, by_start + (size_t)k * n);
  }
  for (int j = 0; j < s->key_count && !status; j++) status = add_start(s, j, by_start);
  return status;
}

/* Adds how the keys change a column directly, at a constant state. */
static void add_direct(study *s)
{
  for (int k = 0; k < s->response_count * s->key_count; k++) {
    const flesh_response *at = s->beside + 4 * (size_t)k;
    s->gradients[k] += flesh_difference_of(at[0].value, at[1].value, at[2].value, at[3].value,
                                           s->parameters[k % s->key_count].difference);
  }
}

static int differentiate(study *s)
{
  const int all_steps = *flesh_scene_tangents_refused(s->scene) != 0; /* a motion, or equilibria that depend on earlier ones */
  flesh_solver_options options = *flesh_scene_solver(s->scene);
  flesh_integrator *integrator = NULL;
  flesh_trajectory *trajectory = NULL;
  options.newton_tolerance = fmin(options.newton_tolerance, newton_tolerance);
  int status = find_beside(s);
  if (!status)
    status = flesh_response_run(s->scene, &options, &(flesh_observer){observe, s}, &s->state, &integrator, tolerance,
                                all_steps ? &trajectory : NULL);
  if (!status) status = trajectory ? differentiate_motion(s, trajectory) : differentiate_equilibrium(s, &options);
  if (!status) add_direct(s);
  flesh_trajectory_destroy(&trajectory);
  flesh_integrator_destroy(&integrator);
  return status;
}

/* ---- output ---- */

static void print_table(const study *s)
{
  for (int k = 0; k < s->response_count; k++) {
    const flesh_response *response = &s->responses[k];
    const char *unit = response->unit + (*response->unit == '1'), *gap = strchr(" ", *unit) ? "" : " ";
    printf("%s = %.9g%s%s at t = %.6g s\n", response->name, response->value, gap, unit, s->state.t);
    for (int j = 0; j < s->key_count; j++) {
      const varied_key *varied = &s->keys[j];
      const double slope = s->gradients[k * s->key_count + j];
      printf("  by %-40s %.6g: %.9g", varied->key, varied->value, slope);
      if (varied->value != 0) printf("; %+.4g%s%s for 1 %% more", 0.01 * varied->value * slope, gap, unit);
      printf("\n");
    }
  }
}

static int write_table(const study *s)
{
  flesh_file file;
  int status = flesh_file_open(s->out, &file);
  if (status) return status;
  fprintf(file.stream, "of,value,unit,to,at,derivative\n");
  for (int k = 0; k < s->response_count; k++)
    for (int j = 0; j < s->key_count; j++) {
      fprintf(file.stream, "%s", s->responses[k].name);
      flesh_table_field(file.stream, s->responses[k].value);
      fprintf(file.stream, ",%s,%s", s->responses[k].unit, s->keys[j].key);
      flesh_table_field(file.stream, s->keys[j].value);
      flesh_table_field(file.stream, s->gradients[k * s->key_count + j]);
      fprintf(file.stream, "\n");
    }
  return flesh_file_commit(&file);
}

static int analyse(study *s)
{
  flesh_inputs inputs = {0};
  flesh_interrupt_watch();
  int status = flesh_overrides_read(&s->overrides, s->path, &s->scene);
  if (!status) status = flesh_list_each("of", s->of, take_column, s);
  if (!status) status = flesh_list_each("to", s->to, take_key, s);
  if (!status && s->out) {
    flesh_inputs_add_scene(&inputs, s->path, s->scene);
    status = flesh_output_prepare(s->out, &inputs);
    if (!status) status = flesh_output_check_folder(s->out);
  }
  if (!status) status = differentiate(s);
  if (!status && s->out) status = write_table(s);
  if (!status) print_table(s);
  flesh_inputs_close(&inputs);
  for (int k = 0; k < s->response_count; k++) flesh_response_clear(&s->responses[k]);
  for (int k = 0; k < 4 * s->response_count * s->key_count && s->beside; k++) flesh_response_clear(&s->beside[k]);
  for (int j = 0; j < s->key_count; j++) clear_scenes(&s->keys[j]);
  flesh_scene_destroy(&s->scene);
  free(s->state.x);
  flesh_arena_free(&s->memory);
  return status;
}

int flesh_command_sensitivity(int argc, char **argv)
{
  study s = {0};
  int count, code = flesh_ranks_refuse("sensitivity");
  if (code) return code;
  const flesh_option rows[] = {
      {"of", "PROBE.COLUMN[,...]", FLESH_OPTION_TEXT, &s.of, "what is differentiated: columns of output.probes"},
      {"to", "KEY[,...]", FLESH_OPTION_TEXT, &s.to, "by what: keys of the scene, such as body.material.young"},
      {"out", "FILE", FLESH_OPTION_TEXT, &s.out, "write the table there as CSV, too"},
      {"set", "KEY=VALUE", FLESH_OPTION_LIST, &s.overrides.texts, "a value of the scene"},
      {0}};
  const flesh_usage usage = {"sensitivity", "SCENE --of PROBE.COLUMN --to KEY",
                             "Differentiates what probes tell at the end by keys of the scene.",
                             flesh_own_text("sensitivity_help"), 1, 1, rows, NULL,
                             FLESH_EXITS_OF_SOLVES | FLESH_EXITS_OF_INTERRUPTS};
  code = flesh_options_read(&usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    s.path = argv[1];
    if (!s.of) code = flesh_option_refuse(usage.command, "of", NULL, "columns of probes, such as tip.position_z");
    else if (!s.to)
      code = flesh_option_refuse(usage.command, "to", NULL, "keys of the scene, such as body.material.young");
    else {
      const int status = analyse(&s);
      code = status ? flesh_command_fail(usage.command, status) : 0;
    }
  }
  flesh_overrides_close(&s.overrides);
  return code;
}
