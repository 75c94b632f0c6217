/* spec.c: reads the spec of a sweep by a table of keys (spec_keys.c), as scenes are read; checks that the scene's keys
 * accept its values; computes the fingerprint of its plan. Its samples are points that fill a cube evenly, from GSL's
 * quasi-random sequences. */
#include <gsl/gsl_qrng.h>
#include <gsl/gsl_rng.h>
#include <limits.h>
#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "sweep/sweep.h"

/* Largest number of cases in a sweep. */
enum { CASE_LIMIT = 10000000 };

typedef flesh_sweep_axis axis;

static int add_column(flesh_sweep *sweep, const axis *a, const flesh_node *node, int count)
{
  if (!a->key) return flesh_node_fail(node, "key is missing; an axis has key, zip or sample");
  if (sweep->column_count == FLESH_STUDY_COLUMNS)
    return flesh_node_fail(node, "there are more than %d axes", FLESH_STUDY_COLUMNS);
  flesh_study_column *column = &sweep->columns[sweep->column_count++];
  *column = (flesh_study_column){
      .name = a->name, .key = a->key, .place = node, .count = count,
      .values = flesh_arena_take(&sweep->arena, sizeof(char *) * (size_t)count),
      .nodes = flesh_arena_take(&sweep->arena, sizeof(flesh_node *) * (size_t)count)};
  return column->values && column->nodes ? FLESH_OK : flesh_no_memory();
}

static int has_range(const axis *a) { return !isnan(a->from) || !isnan(a->to); }

/* Checks an axis without zip or sample, and counts its values. */
static int axis_length(const axis *a, const flesh_node *node, int sampled, int *count)
{
  if (a->zip.count || a->sample.count != INT_MIN)
    return flesh_node_fail(node, "zip and sample cannot stand in zip or sample");
  if (!a->values == !has_range(a))
    return flesh_node_fail(node, "the axis needs either values or from and to");
  if (a->values) {
    if (a->values->kind != FLESH_NODE_LIST || !a->values->count) {
      char shown[FLESH_SHOW_SIZE];
      return flesh_node_fail(a->values, "values is %s; it must be a list of at least one value",
                             flesh_node_show(a->values, shown));
    }
    if (a->count != INT_MIN)
      return flesh_node_fail(flesh_node_find(node, "count"), "count applies to a range; leave it out beside values");
    *count = a->values->count;
    return FLESH_OK;
  }
  if (isnan(a->from) || isnan(a->to)) return flesh_node_fail(node, "a range needs both from and to");
  if (a->spacing == FLESH_LOGARITHMIC && !(a->from > 0 && a->to > 0))
    return flesh_node_fail(flesh_node_find(node, a->from > 0 ? "to" : "from"),
                           "%s is %g; it must be > 0 when spacing is logarithmic", a->from > 0 ? "to" : "from",
                           a->from > 0 ? a->to : a->from);
  if (sampled && a->count != INT_MIN)
    return flesh_node_fail(flesh_node_find(node, "count"), "count belongs in sample, not in its axes");
  if (!sampled && a->count == INT_MIN)
    return flesh_node_fail(node, "count is missing; it must be how many values the range has");
  *count = sampled ? 1 : a->count;
  return FLESH_OK;
}

/* Prints a value of a range. Between the ends it has 15 digits, without the rounding of the arithmetic: 0.45, not
 * 0.45000000000000007. */
static const char *range_text(flesh_sweep *sweep, const axis *a, double part)
{
  char digits[FLESH_NUMBER_SIZE];
  if (part <= 0 || part >= 1)
    return flesh_arena_print(&sweep->arena, "%s", flesh_number_text(part > 0 ? a->to : a->from, digits));
  return flesh_arena_print(&sweep->arena, "%.15g", a->spacing == FLESH_LOGARITHMIC ? a->from * pow(a->to / a->from, part)
                                                                                   : a->from + part * (a->to - a->from));
}

/* Fills a column with the axis's own values, in order. */
static int fill_column(flesh_sweep *sweep, const axis *a)
{
  flesh_study_column *column = &sweep->columns[sweep->column_count - 1];
  const flesh_node *node = a->values ? a->values->first : NULL;
  for (int k = 0; k < column->count; k++) {
    column->nodes[k] = node;
    column->values[k] = node ? flesh_setting_value(&sweep->arena, sweep->path, a->key, node)
                             : range_text(sweep, a, column->count > 1 ? (double)k / (column->count - 1) : 0);
    if (!column->values[k]) return flesh_no_memory();
    if (node) node = node->next;
  }
  return FLESH_OK;
}

/* Reads axes that advance together; `place` is that of the first. */
static int read_zip(flesh_sweep *sweep, const axis *parts, const flesh_node *place, flesh_sweep_group *group)
{
  for (int k = 0; k < group->columns; k++, place = place->next) {
    int count, status = axis_length(&parts[k], place, 0, &count);
    if (!status && k && count != group->count)
      return flesh_node_fail(place, "zip[%d] has %d values and zip[0] has %d; they must be as many", k, count,
                             group->count);
    if (!status && count > CASE_LIMIT)
      return flesh_node_fail(place, "the axis has %d values; it can have at most %d", count, CASE_LIMIT);
    if (!status) status = add_column(sweep, &parts[k], place, count);
    if (!status) status = fill_column(sweep, &parts[k]);
    if (status) return status;
    group->count = count;
  }
  return FLESH_OK;
}

static int read_sample(flesh_sweep *sweep, const axis *a, const flesh_node *node, flesh_sweep_group *group)
{
  const struct flesh_sweep_axis_sample *sample = &a->sample;
  const axis *parts = sample->axes.values;
  node = flesh_node_find(node, "sample");
  if (!sample->axes.count || sample->axes.count > FLESH_STUDY_COLUMNS)
    return flesh_node_fail(flesh_node_find(node, "axes"), "sample.axes are %d; they must be 1 to %d",
                           sample->axes.count, FLESH_STUDY_COLUMNS);
  if (sample->count > CASE_LIMIT || sample->skip > CASE_LIMIT)
    return flesh_node_fail(node, "sample.count and skip must be at most %d", CASE_LIMIT);
  const flesh_node *place = flesh_node_find(node, "axes")->first;
  int dimensions = sample->axes.count, status = FLESH_OK;
  double *points = malloc(sizeof *points * (size_t)dimensions * (size_t)sample->count);
  if (!points) return flesh_no_memory();
  status = flesh_sweep_sample(sample->sequence, dimensions, sample->count, sample->skip, sample->seed, points);
  if (status == FLESH_ERR_ARGUMENT) flesh_node_fail_within(status, node, "%s", "");
  for (int d = 0; !status && d < dimensions; d++, place = place->next) {
    const axis *part = &parts[d];
    int count;
    status = axis_length(part, place, 1, &count);
    if (!status) status = add_column(sweep, part, place, sample->count);
    if (status) break;
    flesh_study_column *column = &sweep->columns[sweep->column_count - 1];
    for (int k = 0; !status && k < sample->count; k++) {
      double u = points[k * dimensions + d];
      if (part->values) {
        int item = (int)(u * count);
        column->nodes[k] = flesh_node_item(part->values, item < count ? item : count - 1);
        column->values[k] = flesh_setting_value(&sweep->arena, sweep->path, part->key, column->nodes[k]);
      } else column->values[k] = range_text(sweep, part, u);
      if (!column->values[k]) status = flesh_no_memory();
    }
  }
  free(points);
  group->count = sample->count;
  return status;
}

static int read_axis(flesh_sweep *sweep, const axis *a, const flesh_node *node)
{
  const int sampled = a->sample.count != INT_MIN, kinds = (a->key != NULL) + (a->zip.count > 0) + sampled;
  if (kinds != 1) return flesh_node_fail(node, "an axis has either key, zip or sample");
  if (!a->key && (a->values || has_range(a) || a->name || a->count != INT_MIN))
    return flesh_node_fail(node, "beside zip or sample an axis has no other keys");
  flesh_sweep_group *group = &sweep->groups[sweep->group_count++];
  *group = (flesh_sweep_group){.first = sweep->column_count,
                               .columns = sampled ? a->sample.axes.count : a->zip.count ? a->zip.count : 1};
  const int status = sampled        ? read_sample(sweep, a, node, group)
                     : a->zip.count ? read_zip(sweep, a->zip.values, flesh_node_find(node, "zip")->first, group)
                                    : read_zip(sweep, a, node, group);
  if (status) return status;
  if ((double)sweep->case_count * group->count > CASE_LIMIT)
    return flesh_node_fail(node, "with this axis there are more than %d cases", CASE_LIMIT);
  sweep->case_count *= group->count;
  return FLESH_OK;
}

static int taken(const flesh_sweep *sweep, int except, const char *name)
{
  for (int c = 0; c < sweep->column_count; c++)
    if (c != except && sweep->columns[c].name && !strcasecmp(sweep->columns[c].name, name)) return 1;
  return 0;
}

/* Fails if the key of a column, or a key that contains it or is part of it, also varies on another axis: the later one would
 * win in every case, and the other's column would have values that no run had. */
static int check_key(const flesh_sweep *sweep, int c)
{
  const flesh_study_column *column = &sweep->columns[c];
  for (int other = 0; other < sweep->column_count; other++) {
    const char *whole = sweep->columns[other].key;
    const size_t length = strlen(whole);
    if (other == c || strncmp(whole, column->key, length) || (column->key[length] && !strchr(".[", column->key[length])))
      continue;
    return column->key[length] ? flesh_node_fail(column->place, "%s is a part of %s, which varies on an axis of its own",
                                                 column->key, whole)
                               : flesh_node_fail(column->place, "%s varies on two axes", column->key);
  }
  return FLESH_OK;
}

static int name_columns(flesh_sweep *sweep)
{
  for (int c = 0; c < sweep->column_count; c++) {
    flesh_study_column *column = &sweep->columns[c];
    if (check_key(sweep, c)) return FLESH_ERR_ARGUMENT;
    const int given = column->name != NULL;
    if (!given) {
      char *whole;
      column->name = flesh_setting_name(&sweep->arena, column->key, &whole);
      if (!column->name) return flesh_no_memory();
      if (taken(sweep, c, column->name)) column->name = whole;
    }
    const int status = flesh_setting_check_name(given ? flesh_node_find(column->place, "name") : column->place, column->name);
    if (status) return status;
    if (given && taken(sweep, c, column->name)) return flesh_node_fail(column->place, "two columns are named %s", column->name);
    column->hidden = !strcmp(column->key, "scene") && !strcmp(column->name, "scene");
  }
  return FLESH_OK;
}

static int read_derived(flesh_sweep *sweep, const flesh_node *root)
{
  const flesh_node *node = flesh_node_find(root, "columns");
  int status = FLESH_OK;
  node = node ? node->first : NULL;
  for (flesh_study_derived *row = sweep->derived.values, *end = row + sweep->derived.count; row < end && !status; row++) {
    row->node = node;
    status = flesh_setting_check_name(node, row->name);
    node = node->next;
  }
  return status;
}

/* Checks that the scene accepts the values of a column, with the constants of all cases in `overrides`. */
static int check_column(flesh_sweep *sweep, const flesh_study_column *column, const char **overrides)
{
  const int is_scene = !strcmp(column->key, "scene");
  const flesh_node *last = NULL;
  int status = FLESH_OK;
  for (int k = 0; !status && k < column->count; k++) {
    /* Check the ends of a range, and some values of a list that is sampled repeatedly. */
    if (!column->nodes[k] && k && k < column->count - 1) continue;
    if ((k > 200 || column->nodes[k] == last) && last) continue;
    last = column->nodes[k];
    overrides[sweep->set.count] = flesh_arena_print(&sweep->arena, "%s=%s", column->key, column->values[k]);
    status = overrides[sweep->set.count]
                 ? flesh_settings_check(last ? last : column->place, is_scene ? column->values[k] : sweep->scene,
                                        sweep->set.count + !is_scene, overrides)
                 : flesh_no_memory();
  }
  return status;
}

/* Checks that the key of every constant and of every axis accepts each value. Whether a combination is valid is left to
 * its case. */
static int check_values(flesh_sweep *sweep)
{
  const char **overrides = calloc((size_t)sweep->set.count + 1, sizeof *overrides);
  int status = overrides ? FLESH_OK : flesh_no_memory();
  for (int s = 0; !status && s <= sweep->set.count; s++) {
    if (s) overrides[s - 1] = sweep->set.texts[s - 1];
    status = flesh_settings_check(s ? sweep->set.nodes[s - 1] : sweep->scene_node, sweep->scene, s, overrides);
  }
  for (int c = 0; !status && c < sweep->column_count; c++) status = check_column(sweep, &sweep->columns[c], overrides);
  free(overrides);
  return status;
}

static void hash_text(SHA2_CTX *context, const char *text)
{
  SHA256Update(context, (const uint8_t *)text, strlen(text) + 1);
}

/* Hashes what a resumed sweep must not change: what all cases have in common and, if the cases keep folders, whose
 * numbers follow from the values, also the values of the axes. */
static int make_fingerprint(flesh_sweep *sweep)
{
  SHA2_CTX context;
  char numbers[120];
  const flesh_study_column *columns = sweep->columns;
  SHA256Init(&context);
  snprintf(numbers, sizeof numbers, "%d %d %d %.17g", sweep->keep, sweep->keep ? sweep->repeats : sweep->repeats > 1,
           sweep->seed, sweep->max_seconds);
  hash_text(&context, numbers);
  for (int k = 0; k < sweep->set.count; k++) hash_text(&context, sweep->set.texts[k]);
  for (int c = 0; c < sweep->column_count; c++) hash_text(&context, columns[c].name), hash_text(&context, columns[c].key);
  for (int c = 0; sweep->keep && c < sweep->column_count; c++)
    for (int k = 0; k < columns[c].count; k++) hash_text(&context, columns[c].values[k]);
  int status = flesh_settings_hash_file(&context, sweep->scene);
  for (int c = 0; c < sweep->column_count; c++)
    for (int k = 0; !status && !strcmp(columns[c].key, "scene") && k < columns[c].count; k++)
      status = flesh_settings_hash_file(&context, columns[c].values[k]);
  SHA256End(&context, sweep->fingerprint);
  return status;
}

static int make(flesh_sweep *sweep, const flesh_node *root)
{
  if (!sweep->scene || !*sweep->scene) return flesh_node_fail(root, "scene is missing; it must be the path of a file");
  sweep->scene_node = flesh_node_find(root, "scene");
  if (sweep->seed == INT_MIN) sweep->seed = -1;
  if (isinf(sweep->max_seconds)) sweep->max_seconds = 0;
  sweep->case_count = 1;
  const axis *axes = sweep->axes.values;
  const flesh_node *place = flesh_node_find(root, "axes");
  place = place ? place->first : NULL;
  int status = flesh_settings_read(&sweep->arena, sweep->path, sweep->given, &sweep->set);
  for (int a = 0; !status && a < sweep->axes.count; a++, place = place->next) status = read_axis(sweep, &axes[a], place);
  if (!status) status = name_columns(sweep);
  if (!status) status = read_derived(sweep, root);
  if (!status && (double)sweep->case_count * sweep->repeats > CASE_LIMIT)
    status = flesh_node_fail(flesh_node_find(root, "repeats"), "there are more than %d cases", CASE_LIMIT);
  if (!status && sweep->seed > INT_MAX - sweep->repeats)
    status = flesh_node_fail(flesh_node_find(root, "seed"), "the seed is %d; with %d repeats it must be at most %d",
                             sweep->seed, sweep->repeats, INT_MAX - sweep->repeats);
  if (status) return status;
  sweep->case_count *= sweep->repeats;
  status = check_values(sweep);
  return status ? status : make_fingerprint(sweep);
}

int flesh_sweep_read(const char *path, flesh_sweep *sweep)
{
  flesh_node *root = NULL;
  *sweep = (flesh_sweep){.path = path};
  const int status = flesh_spec_read(&sweep->arena, &sweep->path, &sweep->text, flesh_sweep_table, &root, sweep);
  return status ? status : make(sweep, root);
}

void flesh_sweep_close(flesh_sweep *sweep)
{
  flesh_arena_free(&sweep->arena);
  free(sweep->text);
  *sweep = (flesh_sweep){0};
}

const char *const flesh_sweep_sequences[] = {"sobol", "niederreiter", "halton", "reverse-halton", "random", NULL};

/* Generators, in the order of flesh_sweep_sequences; NULL: random numbers. */
static const gsl_qrng_type **const types[] = {&gsl_qrng_sobol, &gsl_qrng_niederreiter_2, &gsl_qrng_halton,
                                              &gsl_qrng_reversehalton, NULL};

int flesh_sweep_sample(int sequence, int dimensions, int count, int skip, int seed, double *points)
{
  const gsl_qrng_type *type = types[sequence] ? *types[sequence] : NULL;
  if (type && (unsigned)dimensions > type->max_dimension)
    return flesh_fail(FLESH_ERR_ARGUMENT, "sample.axes are %d; %s takes at most %u", dimensions,
                      flesh_sweep_sequences[sequence], type->max_dimension);
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  gsl_qrng *sampler = type ? gsl_qrng_alloc(type, (unsigned)dimensions) : NULL;
  double shift[FLESH_STUDY_COLUMNS] = {0}, point[FLESH_STUDY_COLUMNS];
  if (!random || (type && !sampler)) {
    if (random) gsl_rng_free(random);
    return flesh_no_memory();
  }
  gsl_rng_set(random, (unsigned long)seed);
  for (int d = 0; sampler && seed && d < dimensions; d++) shift[d] = gsl_rng_uniform(random);
  for (int k = -skip; k < count; k++) {
    for (int d = 0; !sampler && d < dimensions; d++) point[d] = gsl_rng_uniform_pos(random);
    if (sampler) gsl_qrng_get(sampler, point);
    for (int d = 0; k >= 0 && d < dimensions; d++) points[k * dimensions + d] = fmod(point[d] + shift[d], 1);
  }
  if (sampler) gsl_qrng_free(sampler);
  gsl_rng_free(random);
  return FLESH_OK;
}
