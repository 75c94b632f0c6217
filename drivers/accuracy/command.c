/* command.c: `flesh accuracy SCENE`: measures what accuracy costs, method by method. */
#include "commands.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/error.h"
#include "cli/output.h"
#include "cli/interrupt.h"
#include "cli/lists.h"
#include "base/file.h"
#include "parallel/body_figures.h"
#include "run/describe.h"
#include "run/provenance.h"
#include "scene/scene.h"
#include "study/embedded.h"
#include "study/study.h"

#define METHOD_NAME(name, ...) name,
#define METHOD_ITEM(name, ...) "," name

/* Writes a step as its shortest text: 1/N if it is such a fraction. */
static void value_text(double value, flesh_accuracy_value *to)
{
  char text[FLESH_NUMBER_SIZE];
  double inverse = 1 / value, whole = round(inverse);
  to->value = value;
  if (inverse > 1.5 && inverse < 1e9 && fabs(inverse - whole) < 1e-9 * whole)
    snprintf(to->text, sizeof to->text, "1/%.0f", whole);
  else snprintf(to->text, sizeof to->text, "%.30s", flesh_number_text(value, text));
}

static int compare_down(const void *a, const void *b)
{
  double x = ((const flesh_accuracy_value *)a)->value, y = ((const flesh_accuracy_value *)b)->value;
  return (x < y) - (x > y);
}

/* The destination of a list's values. */
typedef struct values {
  const char *option;
  flesh_accuracy_value *values;
  int *count;
} values;

static int take_value(void *data, const char *item)
{
  const values *v = data;
  flesh_accuracy_value value;
  if (strlen(item) >= FLESH_ACCURACY_TEXT - 1 || flesh_option_number(item, &value.value) || !(value.value > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has '%.100s'; every value must be a positive number", v->option, item);
  if (*v->count == FLESH_ACCURACY_LIMIT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has more than %d values", v->option, FLESH_ACCURACY_LIMIT);
  snprintf(value.text, sizeof value.text, "%.30s", item);
  if (item[strspn(item, "0123456789.eE+-/")]) value_text(value.value, &value); /* it has blanks */
  for (int other = 0; other < *v->count; other++)
    if (v->values[other].value == value.value) return flesh_list_fail_twice(v->option, item);
  v->values[(*v->count)++] = value;
  return FLESH_OK;
}

/* Reads positive numbers, as they are written, and sorts them from the largest to the smallest. */
static int read_values(const char *option, const char *text, flesh_accuracy_value *to, int *count)
{
  values v = {option, to, count};
  *count = 0;
  const int status = flesh_list_each(option, text, take_value, &v);
  qsort(to, (size_t)*count, sizeof *to, compare_down);
  return status;
}

/* Checks that no step is longer than the run, or so short that the run would never end. */
static int check_steps(const flesh_accuracy_plan *plan, double duration)
{
  const double most = 1e9;
  for (int k = 0; k < plan->step_count; k++) {
    const flesh_accuracy_value *step = &plan->steps[k];
    if (step->value > duration * (1 + 1e-9))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--steps has %s; a step must not be longer than the run, which takes %g s",
                        step->text, duration);
    if (!(duration / step->value <= most))
      return flesh_fail(FLESH_ERR_ARGUMENT, "--steps has %s; a step must not be shorter than %g s, as a run "
                                            "has at most %g steps", step->text, duration / most, most);
  }
  return FLESH_OK;
}

/* Chooses the method and step for the other prices: the scene's own if it has fixed steps, else the first method that
 * has. Steps chosen by error control would hide the errors of the solves. */
static void choose_representative(const flesh_scene_time *time, double duration, flesh_accuracy_plan *plan)
{
  const char *own = flesh_method_name(time->method);
  plan->representative = -1;
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    if (!method->adaptive && (plan->representative < 0 || (own && !strcmp(method->name, own))))
      plan->representative = plan->methods[m];
  }
  value_text(fmin(time->step, duration), &plan->representative_step);
  value_text(duration, &plan->whole_run);
}

/* Fails if a file of the command would replace an input. */
static int spare_inputs(const flesh_accuracy_plan *plan, const char *path, const flesh_scene *scene)
{
  static const char *const names[] = {"accuracy.csv", "accuracy.json", "orders.csv", "verdict.txt", "reference.states",
                                      NULL};
  static const char *const subfolders[] = {"steps", NULL};
  flesh_inputs inputs = {0};
  flesh_inputs_add_scene(&inputs, path, scene);
  return flesh_inputs_spare_in(&inputs, plan->options.out, names, subfolders);
}

/* Plans the steps, with the scene's own among them, and the times at which states are compared. */
static int plan_times(flesh_accuracy_plan *plan, const flesh_scene_time *time, double start)
{
  const double duration = time->end - start;
  plan->controlled = time->adaptive.control;
  if (!(duration > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: the start at t = %g s is not before time.end = %g s", plan->scene, start,
                      time->end);
  if (!plan->step_count) { /* the scene's step, or half of a shorter run, doubled once and then halved repeatedly */
    plan->step_count = plan->quick ? 5 : 8;
    for (int k = 0; k < plan->step_count; k++) value_text(ldexp(fmin(time->step, duration / 2), 1 - k), &plan->steps[k]);
  }
  const int status = check_steps(plan, duration);
  if (status) return status;
  choose_representative(time, duration, plan);
  flesh_accuracy_grid_make(start, time->end, plan->steps[0].value, flesh_accuracy_room(3 * plan->measure.nodes),
                           &plan->grid);
  return FLESH_OK;
}

/* Takes from the scene what the plan needs of it, and makes the fingerprint: of everything that affects all figures. */
static int take_scene(flesh_accuracy_plan *plan, const flesh_scene *scene)
{
  char identity[FLESH_IDENTITY_SIZE], build[FLESH_STUDY_FINGERPRINT], digest[FLESH_STUDY_FINGERPRINT];
  const char *load = flesh_point_load(scene);
  const flesh_element element = flesh_scene_element(scene, 0);
  flesh_instructions used = FLESH_INSTRUCTIONS_AUTO;
  plan->mass = flesh_scene_body(scene)->mass == FLESH_MASS_LUMPED ? "body.mass=lumped" : "body.mass=consistent";
  plan->tets = flesh_mesh_tet_count(flesh_scene_mesh(scene));
  plan->reference.scale.length = flesh_body_longest_side(flesh_scene_mesh(scene), NULL);
  plan->meshes.own_refine = scene->keys.body.refine;
  plan->meshes.own_element = element == FLESH_ELEMENT_AUTO ? FLESH_ELEMENT_TET10_MEAN : element; /* AUTO: it has tets of both */
  snprintf(plan->meshes.point_load, sizeof plan->meshes.point_load, "%.79s", load ? load : "");
  plan->meshes.sources[plan->meshes.source_count++] = plan->scene;
  flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &used);
  flesh_provenance_identity(identity);
  flesh_accuracy_hash(2, (const char *const[]){identity, flesh_instructions_name(used)}, build);
  const int status = flesh_study_fingerprint(scene, plan->scene, digest);
  snprintf(plan->fingerprint, sizeof plan->fingerprint, "scene %s, longest step %.15g s, build %.16s", digest, plan->grid.longest,
           build);
  return status;
}

static int prepare(flesh_accuracy_plan *plan, const char *steps, const char *tolerances)
{
  flesh_scene *scene = NULL;
  int status = flesh_overrides_read(&plan->options.overrides, plan->scene, &scene);
  if (status) return status;
  const flesh_scene_time *time = flesh_scene_times(scene);
  status = spare_inputs(plan, plan->scene, scene);
  const int in_time = flesh_system_has_role(flesh_scene_system(scene), FLESH_ROLE_INERTIA);
  if (!status && !in_time && !plan->mesh)
    status = flesh_fail(FLESH_ERR_ARGUMENT,
                        "%s: the scene has no inertia, so nothing is integrated in time; --mesh measures the error of its mesh",
                        plan->scene);
  if (!status)
    status = read_values("tolerances", tolerances, plan->tolerances, &plan->tolerance_count);
  if (!status && steps) status = read_values("steps", steps, plan->steps, &plan->step_count);
  if (!status) status = flesh_accuracy_measure_open(scene, &plan->measure);
  if (!status && in_time) status = plan_times(plan, time, plan->measure.start_t);
  if (!status && !in_time) plan->method_count = 0, plan->representative = -1, plan->grid = (flesh_accuracy_grid){.count = 1};
  if (!status) status = take_scene(plan, scene);
  flesh_scene_destroy(&scene);
  return status;
}

static int take_coarser(flesh_accuracy_plan *plan, const char *path)
{
  flesh_scene *scene = NULL;
  int status = flesh_overrides_read(&plan->options.overrides, path, &scene);
  if (!status) status = spare_inputs(plan, path, scene);
  if (!status) status = flesh_study_fingerprint(scene, path, plan->meshes.inputs[plan->meshes.source_count]);
  plan->meshes.sources[plan->meshes.source_count++] = path;
  const int tets = status ? 0 : flesh_mesh_tet_count(flesh_scene_mesh(scene));
  if (tets > plan->tets)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--coarser %s has %d tets, and is finer than %s with its %d; it must not have more",
                        path, tets, plan->scene, plan->tets);
  flesh_scene_destroy(&scene);
  return status;
}

/* Takes and checks the other scenes, before hours are spent. */
static int take_others(flesh_accuracy_plan *plan)
{
  if (plan->coarser.count && !plan->mesh)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--coarser is given without --mesh; give both, or neither");
  if (plan->coarser.count >= FLESH_ACCURACY_LEVELS)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--coarser is given more than %d times", FLESH_ACCURACY_LEVELS - 1);
  int status = FLESH_OK;
  for (int k = 0; k < plan->coarser.count && !status; k++) status = take_coarser(plan, plan->coarser.values[k]);
  return status;
}

/* Makes the plan, on every rank, with the lists of methods, steps and tolerances (NULL: the default), and carries it
 * out. Returns the exit code. */
static int run(flesh_accuracy_plan *plan, const char *methods, const char *steps, const char *tolerances)
{
  static const char *const names[] = {FLESH_ACCURACY_METHOD_LIST(METHOD_NAME) NULL};
  if (!(plan->max_seconds > 0)) plan->max_seconds = plan->quick ? 60 : 600;
  if (!(plan->reference_seconds > 0)) plan->reference_seconds = plan->quick ? 10 : 60;
  if (!(plan->mesh_seconds > 0)) plan->mesh_seconds = plan->quick ? 20 : 120;
  if (!tolerances) tolerances = plan->quick ? "1e-2,1e-3,1e-4" : "1e-2,1e-3,1e-4,1e-5,1e-6";
  flesh_interrupt_watch();
  int status = flesh_list_words("methods", methods, names, plan->methods, &plan->method_count);
  if (!status) status = prepare(plan, steps, tolerances);
  if (!status) status = flesh_accuracy_make_rows(plan);
  if (!status) status = take_others(plan);
  plan->store.lock = -1;
  plan->study = flesh_accuracy_study(plan);
  plan->options.jobs = 1; /* times are compared */
  return flesh_study_lead(&plan->study, &plan->options, status, flesh_accuracy_run);
}

int flesh_command_accuracy(int argc, char **argv)
{
  const char *methods = &(FLESH_ACCURACY_METHOD_LIST(METHOD_ITEM))[1], *tolerances = NULL, *steps = NULL;
  flesh_accuracy_plan plan = {.options = {.out = "out/accuracy"}};
  const flesh_option rows[] = {
      {"methods", "LIST", FLESH_OPTION_TEXT, &methods, "methods to compare (default: all)"},
      {"tolerances", "LIST", FLESH_OPTION_TEXT, &tolerances,
       "of the adaptive methods (default 1e-2,1e-3,...,1e-6; to 1e-4 with --quick)"},
      {"steps", "LIST", FLESH_OPTION_TEXT, &steps,
       "of the others, in s (default twice the scene's, the scene's, its half, ... to its 64th; to its 8th with --quick)"},
      {"mesh", NULL, FLESH_OPTION_SWITCH, &plan.mesh, "measure the error of the mesh too, with tet4, tet10, tet10-mean"},
      {"coarser", "SCENE2", FLESH_OPTION_LIST, &plan.coarser, "the same scene on a coarser mesh, for --mesh"},
      {"mesh-seconds", "S", FLESH_OPTION_POSITIVE, &plan.mesh_seconds,
       "how long meshes are refined, beyond what two of each element need (default 120; 20 with --quick)"},
      {"repeat", "N", FLESH_OPTION_COUNT, &plan.repeat, "runs of each, for the times"},
      {"quick", NULL, FLESH_OPTION_SWITCH, &plan.quick, "fewer settings, one run each: minutes"},
      FLESH_STUDY_OPTION_ROWS(&plan.options, "accuracy",
                              "also with further methods and settings; crashed\n"
                              "                         runs and runs out of budget are repeated"),
      FLESH_STUDY_OPTION_SET(&plan.options, "a value of the scene"),
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &plan.max_seconds,
       "budget of each run (default 600; 60 with --quick)"},
      {"reference-seconds", "S", FLESH_OPTION_POSITIVE, &plan.reference_seconds,
       "how long each of the two references is refined, beyond what it needs at least (default 60; 10 with --quick)"},
      {0}};
  const flesh_usage usage = {"accuracy", "SCENE", "Shows what accuracy costs.", flesh_own_text("accuracy_help"),
                             1, 1, rows, NULL, FLESH_EXITS_ALL};
  int count, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    plan.scene = argv[1];
    code = run(&plan, methods, steps, tolerances);
  }
  flesh_study_close(&plan.options);
  flesh_accuracy_measure_close(&plan.measure);
  free(plan.rows);
  free(plan.coarser.values);
  return code;
}
