/* spec_keys.c: the table of a spec's keys and its text in the help; checks that the scene's keys accept a sweep's
 * values; computes the fingerprint of its plan. */
#include <sha256.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "sweep/sweep.h"

typedef flesh_sweep_axis axis;

static const flesh_key axis_table[];

#define AT(member) .offset = offsetof(axis, member) - offsetof(axis, sample)
static const flesh_key sample_table[] = {
    {.name = "sequence", .type = FLESH_KEY_CHOICE, AT(sample.sequence), .choices = flesh_sweep_sequences,
     .default_value = "sobol", .doc = "how the points are chosen; random: not evenly"},
    {.name = "count", .type = FLESH_KEY_INTEGER, AT(sample.count), .range = FLESH_RANGE_POSITIVE, .doc = "points"},
    {.name = "seed", .type = FLESH_KEY_INTEGER, AT(sample.seed), .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0", .doc = "other than 0: the points are shifted at random as a whole"},
    {.name = "skip", .type = FLESH_KEY_INTEGER, AT(sample.skip), .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0", .doc = "points left out at the start, to go on where another sweep ended"},
    {.name = "axes", .type = FLESH_KEY_OBJECTS, AT(sample.axes), .children = axis_table, .child_size = sizeof(axis),
     .doc = "a dimension each: key with from and to, or with values, each of which gets an equal share"},
    {.name = NULL},
};
#undef AT

static const flesh_key axis_table[] = {
    {.name = "key", .type = FLESH_KEY_TEXT, .offset = offsetof(axis, key), .default_value = "",
     .doc = "of the scene, as in --set: body.material.young; scene: the scene itself"},
    {.name = "name", .type = FLESH_KEY_TEXT, .offset = offsetof(axis, name), .default_value = "",
     .doc = "of the column; default: the key's last word"},
    {.name = "values", .type = FLESH_KEY_TREE, .offset = offsetof(axis, values), .default_value = "",
     .doc = "a list of values; paths are relative to the spec"},
    {.name = "from", .type = FLESH_KEY_NUMBER, .offset = offsetof(axis, from), .default_value = "",
     .doc = "instead of values: first of a range"},
    {.name = "to", .type = FLESH_KEY_NUMBER, .offset = offsetof(axis, to), .default_value = "",
     .doc = "last of a range, included"},
    {.name = "count", .type = FLESH_KEY_INTEGER, .offset = offsetof(axis, count), .range = FLESH_RANGE_POSITIVE,
     .default_value = "", .doc = "how many values a range has (not of a sample's axes)"},
    {.name = "spacing", .type = FLESH_KEY_CHOICE, .offset = offsetof(axis, spacing), .choices = flesh_spacings,
     .default_value = "linear", .doc = "of a range"},
    {.name = "zip", .type = FLESH_KEY_OBJECTS, .offset = offsetof(axis, zip), .default_value = "",
     .children = axis_table, .child_size = sizeof(axis), .doc = "axes of equal length that advance together"},
    {.name = "sample", .type = FLESH_KEY_OBJECT, .offset = offsetof(axis, sample), .default_value = "",
     .children = sample_table, .doc = "points in the space of several axes"},
    {.name = NULL},
};

static const flesh_key column_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, .offset = offsetof(flesh_study_derived, name), .doc = "of the column"},
    {.name = "is", .type = FLESH_KEY_TEXT, .offset = offsetof(flesh_study_derived, expression),
     .doc = "SQLite's expression of the columns of results, those derived before included"},
    {.name = NULL},
};

#define AT(member) .offset = offsetof(flesh_sweep, member)
const flesh_key flesh_sweep_table[] = {
    {.name = "title", .type = FLESH_KEY_TEXT, AT(title), .default_value = "", .doc = "what the sweep is for"},
    {.name = "scene", .type = FLESH_KEY_PATH, AT(scene), .default_value = "", .doc = "what each case runs; relative to the spec"},
    {.name = "set", .type = FLESH_KEY_TREE, AT(given), .default_value = "",
     .doc = "a mapping of values that all cases have: {time.end: 1, output.frame_interval: 0}"},
    {.name = "axes", .type = FLESH_KEY_OBJECTS, AT(axes), .default_value = "[]", .children = axis_table,
     .child_size = sizeof(axis), .doc = "what varies; every value of one with every value of the others"},
    {.name = "repeats", .type = FLESH_KEY_INTEGER, AT(repeats), .range = FLESH_RANGE_POSITIVE, .default_value = "1",
     .doc = "how often each case is run; a column repeat numbers them"},
    {.name = "seed", .type = FLESH_KEY_INTEGER, AT(seed), .range = FLESH_RANGE_NOT_NEGATIVE, .default_value = "",
     .doc = "output.seed of the first repeat; one more in each further one"},
    {.name = "max_seconds", .type = FLESH_KEY_NUMBER, AT(max_seconds), .range = FLESH_RANGE_POSITIVE, .unit = "s",
     .default_value = ".inf", .doc = "of each case; a case that has not stopped 2 s later is killed"},
    {.name = "keep", .type = FLESH_KEY_BOOLEAN, AT(keep), .default_value = "false",
     .doc = "true: each case leaves its history, state and log in DIR/cases/ID"},
    {.name = "columns", .type = FLESH_KEY_OBJECTS, AT(derived), .default_value = "[]", .children = column_table,
     .child_size = sizeof(flesh_study_derived), .doc = "derived columns of the results"},
    {.name = NULL},
};
#undef AT

void flesh_sweep_describe_keys(FILE *stream)
{
  fputs("Keys of a spec:\n", stream);
  flesh_settings_describe(stream, flesh_sweep_table, axis_table);
  fputs("Keys of an axis:\n", stream);
  flesh_settings_describe(stream, axis_table, axis_table);
}

int flesh_sweep_check_values(flesh_sweep *sweep)
{
  const char **overrides = calloc((size_t)sweep->set.count + 1, sizeof *overrides);
  int status = overrides ? FLESH_OK : flesh_no_memory();
  for (int s = 0; !status && s <= sweep->set.count; s++) {
    if (s) overrides[s - 1] = sweep->set.texts[s - 1];
    status = flesh_settings_check(s ? sweep->set.nodes[s - 1] : sweep->scene_node, sweep->scene, s, overrides);
  }
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_study_column *column = &sweep->columns[sweep->groups[g].first + c];
      int count = sweep->groups[g].count, is_scene = !strcmp(column->key, "scene");
      const flesh_node *last = NULL;
      for (int k = 0; !status && k < count; k++) {
        /* Check the ends of a range, and some values of a list that is sampled repeatedly. */
        if (!column->nodes[k] && k && k < count - 1) continue;
        if ((k > 200 || column->nodes[k] == last) && last) continue;
        last = column->nodes[k];
        overrides[sweep->set.count] = flesh_arena_print(&sweep->arena, "%s=%s", column->key, column->values[k]);
        status = overrides[sweep->set.count]
                     ? flesh_settings_check(last ? last : column->place, is_scene ? column->values[k] : sweep->scene,
                                            sweep->set.count + !is_scene, overrides)
                     : flesh_no_memory();
      }
    }
  free(overrides);
  return status;
}

static void hash_text(SHA2_CTX *context, const char *text)
{
  SHA256Update(context, (const uint8_t *)text, strlen(text) + 1);
}

/* Hashes what a resumed sweep must not change: what all cases have in common and, if the cases keep folders, whose
 * numbers follow from the values, also the values of the axes. */
static void hash_plan(SHA2_CTX *context, const flesh_sweep *sweep)
{
  char numbers[120];
  snprintf(numbers, sizeof numbers, "%d %d %d %.17g", sweep->keep, sweep->keep ? sweep->repeats : sweep->repeats > 1,
           sweep->seed, sweep->max_seconds);
  hash_text(context, numbers);
  for (int k = 0; k < sweep->set.count; k++) hash_text(context, sweep->set.texts[k]);
  for (int k = 0; k < sweep->column_count; k++)
    hash_text(context, sweep->columns[k].name), hash_text(context, sweep->columns[k].key);
  for (int g = 0; sweep->keep && g < sweep->group_count; g++)
    for (int c = 0; c < sweep->groups[g].columns; c++)
      for (int k = 0; k < sweep->groups[g].count; k++)
        hash_text(context, sweep->columns[sweep->groups[g].first + c].values[k]);
}

int flesh_sweep_make_fingerprint(flesh_sweep *sweep)
{
  SHA2_CTX context;
  SHA256Init(&context);
  hash_plan(&context, sweep);
  int status = flesh_settings_hash_file(&context, sweep->scene);
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_study_column *column = &sweep->columns[sweep->groups[g].first + c];
      for (int k = 0; !strcmp(column->key, "scene") && !status && k < sweep->groups[g].count; k++)
        status = flesh_settings_hash_file(&context, column->values[k]);
    }
  SHA256End(&context, sweep->fingerprint);
  return status;
}
