/* plan.c: the methods, the rows that a plan makes of them, and the overrides that put a row into a scene. */
#include <assert.h>
#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/error.h"
#include "cli/path.h"

/* Number of rows that are not reported: the reference, its sources, tight, limits, timings of three choices, meshes. */
enum { CHOICES = 3, SLOTS = 3 + FLESH_ACCURACY_SOURCES + CHOICES + FLESH_ACCURACY_MESHES };

#define METHOD(name, scene, adaptive, order, colour, mark) {name, scene, adaptive, order, colour, mark},
const flesh_accuracy_method flesh_accuracy_methods[] = {FLESH_ACCURACY_METHOD_LIST(METHOD){0}};
static_assert((int)FLESH_ACCURACY_METHODS <= (int)FLESH_ACCURACY_LIMIT, "a plan holds every method");

int flesh_accuracy_method_find(const char *name)
{
  for (int m = 0; flesh_accuracy_methods[m].name; m++)
    if (!strcmp(flesh_accuracy_methods[m].name, name)) return m;
  return -1;
}

const flesh_accuracy_source flesh_accuracy_sources[] = {
    {"ida5", 0, 0}, {"midpoint", 2, 2}, {"newmark", 2, 2}, {"bdf2", 2, 1}, {"backward-euler", 1, 1}};

#define GROUP_NAME(group, name) name,
const char *const flesh_accuracy_group_names[] = {FLESH_ACCURACY_GROUP_LIST(GROUP_NAME)};

/* Overrides with which every solve converges to rounding, whatever the scene says. */
static const char *const tight[][2] = {{"solver.newton_tolerance", "1e-12"}, {"solver.linear_tolerance", "1e-3"},
                                       {"solver.max_newton", "100"},         {"solver.max_cutbacks", "8"},
                                       {"solver.line_search", "potential"},  {"solver.accept_unconverged", "false"}};

static void add_mesh(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_overrides *all)
{
  char number[32];
  snprintf(number, sizeof number, "%d", row->refine + (row->source ? 0 : plan->meshes.own_refine));
  if (!row->source || row->refine) flesh_overrides_add(all, "body.refine", number);
  flesh_overrides_add(all, "body.element", flesh_element_name((flesh_element)row->element));
}

void flesh_accuracy_override(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_overrides *all)
{
  char order[16];
  flesh_overrides_copy(all, &plan->options.overrides.texts);
  if (row->group == FLESH_ACCURACY_RESOLUTION || row->group == FLESH_ACCURACY_TIMING) add_mesh(plan, row, all);
  if (row->method < 0) return;
  const flesh_accuracy_method *method = &flesh_accuracy_methods[row->method];
  flesh_overrides_add(all, "time.method", method->scene);
  flesh_overrides_add(all, "time.step", row->step.text);
  if (method->adaptive && *row->tolerance.text) {
    flesh_overrides_add(all, "time.tolerance", row->tolerance.text);
    if (method->adaptive == 2) flesh_overrides_add(all, "time.adaptive", "true");
  }
  if (plan->controlled && method->adaptive != 2) flesh_overrides_add(all, "time.adaptive", "false");
  snprintf(order, sizeof order, "%d", method->max_order);
  if (method->max_order) flesh_overrides_add(all, "time.max_order", order);
  for (size_t k = 0; row->tight && k < sizeof tight / sizeof *tight; k++) flesh_overrides_add(all, tight[k][0], tight[k][1]);
  const char *is = strchr(row->extra, '=');
  char key[sizeof row->extra];
  snprintf(key, sizeof key, "%.*s", is ? (int)(is - row->extra) : 0, row->extra);
  if (is) flesh_overrides_add(all, key, is + 1);
}

const char *flesh_accuracy_scene_of(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  return row->source ? plan->meshes.sources[row->source] : plan->scene;
}

const char *flesh_accuracy_method_name(const flesh_accuracy_row *row)
{
  return row->method >= 0 ? flesh_accuracy_methods[row->method].name : row->group >= FLESH_ACCURACY_RESOLUTION ? "static" : "";
}

int flesh_accuracy_slot(const flesh_accuracy_plan *plan, flesh_accuracy_group group)
{
  static const int behind[FLESH_ACCURACY_GROUPS] = {[FLESH_ACCURACY_SOURCE] = 1,
                                                    [FLESH_ACCURACY_TIGHT] = 1 + FLESH_ACCURACY_SOURCES,
                                                    [FLESH_ACCURACY_LIMITS] = 2 + FLESH_ACCURACY_SOURCES,
                                                    [FLESH_ACCURACY_TIMING] = 3 + FLESH_ACCURACY_SOURCES,
                                                    [FLESH_ACCURACY_RESOLUTION] = SLOTS - FLESH_ACCURACY_MESHES};
  return plan->run_count + behind[group];
}

const char *flesh_accuracy_states_path(const flesh_accuracy_plan *plan, int number)
{
  const flesh_accuracy_row *row = &plan->rows[number];
  if (row->group == FLESH_ACCURACY_SOURCE)
    return flesh_path("%s/reference_%s.states", plan->options.out, flesh_accuracy_methods[row->method].name);
  if (row->group == FLESH_ACCURACY_RESOLUTION)
    return flesh_path("%s/mesh_%d.states", plan->options.out, number - flesh_accuracy_slot(plan, FLESH_ACCURACY_RESOLUTION));
  const int leaves = row->group == FLESH_ACCURACY_REFERENCE || row->group == FLESH_ACCURACY_TIGHT;
  return leaves ? flesh_path("%s/%s.states", plan->options.out, flesh_accuracy_group_names[row->group]) : "";
}

void flesh_accuracy_hash(int count, const char *const *texts, char text[FLESH_STUDY_FINGERPRINT])
{
  SHA2_CTX hash;
  SHA256Init(&hash);
  for (int k = 0; k < count; k++) SHA256Update(&hash, (const uint8_t *)texts[k], strlen(texts[k]) + 1);
  SHA256End(&hash, text);
}

int flesh_accuracy_read(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row, flesh_scene **scene)
{
  flesh_overrides all;
  flesh_accuracy_override(plan, row, &all);
  const int status = flesh_overrides_read(&all, flesh_accuracy_scene_of(plan, row), scene);
  flesh_overrides_close(&all);
  return status;
}

const char *flesh_accuracy_steps_path(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  const flesh_accuracy_method *method = &flesh_accuracy_methods[row->method];
  if (!method->adaptive || row->group != FLESH_ACCURACY_WORK) return "";
  char tolerance[FLESH_ACCURACY_TEXT];
  snprintf(tolerance, sizeof tolerance, "%s", row->tolerance.text);
  flesh_safe_name(tolerance); /* replaces the slash in 1/1000 */
  return flesh_path("%s%ssteps/%s_%s.csv", plan ? plan->options.out : "", plan ? "/" : "", method->name, tolerance);
}

const flesh_accuracy_figures flesh_accuracy_unknown = {.status = FLESH_ERR_INTERRUPTED,
                                                       .cost = {.cpu_s = NAN, .wall_s = NAN, .gain = NAN},
                                                       .wall_s_median = NAN,
                                                       .wall_s_min = NAN,
                                                       .errors = {NAN, NAN, NAN, NAN, NAN},
                                                       .difference = NAN,
                                                       .estimate = NAN,
                                                       .took_s = NAN,
                                                       .poisson = NAN};

static flesh_accuracy_row *add_row(flesh_accuracy_plan *plan, flesh_accuracy_group group,
                                   int method, flesh_accuracy_value step)
{
  flesh_accuracy_row *row = &plan->rows[plan->run_count++];
  *row = (flesh_accuracy_row){.group = group, .method = method, .value = NAN, .step = step, .figures = flesh_accuracy_unknown};
  return row;
}

/* Adds the rows of other prices of the representative run: each key with each of its values, from tight to loose, or
 * words. */
static void add_prices(flesh_accuracy_plan *plan)
{
  static const struct {
    flesh_accuracy_group group;
    const char *key, *values[2][7]; /* all; those with --quick, NULL: all as well */
  } prices[] = {
      {FLESH_ACCURACY_NEWTON, "solver.newton_tolerance",
       {{"1e-1", "1e-2", "1e-3", "1e-4", "1e-6", "1e-8"}, {"1e-2", "1e-4", "1e-6"}}},
      {FLESH_ACCURACY_LINEAR, "solver.linear_tolerance",
       {{"3e-1", "1e-1", "1e-2", "1e-3", "1e-4", "1e-6"}, {"1e-1", "1e-2", "1e-4"}}},
      {FLESH_ACCURACY_PROJECTION, "solver.eigenvalue_filter", {{"auto", "trust-region-always", "none"}}},
      {FLESH_ACCURACY_MASS, "body.mass", {{"lumped", "consistent"}}}};
  for (size_t p = 0; p < sizeof prices / sizeof *prices; p++)
    for (const char *const *value = prices[p].values[plan->quick && *prices[p].values[1]]; *value; value++) {
      flesh_accuracy_row *row = add_row(plan, prices[p].group, plan->representative, plan->representative_step);
      snprintf(row->extra, sizeof row->extra, "%s=%s", prices[p].key, *value);
      snprintf(row->setting, sizeof row->setting, "%s", row->extra);
      if (flesh_option_number(*value, &row->value)) row->value = NAN;
    }
}

static void make_runs(flesh_accuracy_plan *plan)
{
  for (int m = 0; m < plan->method_count; m++) {
    int method = plan->methods[m], adaptive = flesh_accuracy_methods[method].adaptive;
    for (int k = 0; k < (adaptive ? plan->tolerance_count : plan->step_count); k++) {
      /* Adaptive methods choose their steps; `step` is when they are asked for a state. Those whose steps end there (2)
       * are asked only at the end, and judged at their own steps. */
      flesh_accuracy_value step = adaptive == 2 ? plan->whole_run : adaptive ? plan->representative_step : plan->steps[k];
      flesh_accuracy_row *row = add_row(plan, FLESH_ACCURACY_WORK, method, step);
      if (adaptive) row->tolerance = plan->tolerances[k];
      row->value = adaptive ? row->tolerance.value : step.value;
      snprintf(row->setting, sizeof row->setting, "%s=%s", adaptive ? "tolerance" : "step",
               adaptive ? row->tolerance.text : step.text);
    }
  }
  if (plan->representative >= 0) add_prices(plan);
}

int flesh_accuracy_make_rows(flesh_accuracy_plan *plan)
{
  enum { PRICES = 24 };
  int most = plan->step_count > plan->tolerance_count ? plan->step_count : plan->tolerance_count;
  plan->rows = calloc((size_t)(plan->method_count * most + PRICES + SLOTS), sizeof *plan->rows);
  if (!plan->rows) return flesh_no_memory();
  make_runs(plan);
  flesh_accuracy_row *row = &plan->rows[plan->run_count];
  *row++ = (flesh_accuracy_row){.group = FLESH_ACCURACY_REFERENCE, .method = -1, .setting = "of two methods", .needs_states = 1,
                                .figures = flesh_accuracy_unknown};
  for (int k = 0; k < FLESH_ACCURACY_SOURCES; k++)
    *row++ = (flesh_accuracy_row){.group = FLESH_ACCURACY_SOURCE,
                                  .method = flesh_accuracy_method_find(flesh_accuracy_sources[k].method),
                                  .setting = "refined", .needs_states = 1, .figures = flesh_accuracy_unknown};
  *row = (flesh_accuracy_row){.group = FLESH_ACCURACY_TIGHT, .method = plan->representative, .step = plan->representative_step,
                              .setting = "solved tightly", .tight = 1, .needs_states = 1, .figures = flesh_accuracy_unknown};
  return FLESH_OK;
}
