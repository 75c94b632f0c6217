/* spec.c: reads the spec of a sweep by a table of keys, as scenes are. */
#include <limits.h>
#include <math.h>
#include <sha256.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "scene/keys.h"
#include "scene/scene.h"
#include "scene/words.h"
#include "sweep/sweep.h"

const char *const flesh_sweep_commands[] = {"run", "drift", "accuracy", "hardcases", NULL};
static const char *const spacings[] = {"linear", "logarithmic", NULL};

enum { LINEAR, LOGARITHMIC, CASE_LIMIT = 10000000 };

typedef struct axis {
  char *key, *name;
  const flesh_node *values;
  double from, to;
  int count, spacing;
  flesh_objects zip;
  struct axis_sample {
    int sequence, count, seed, skip;
    flesh_objects axes;
  } sample;
} axis;

typedef struct derived {
  char *name, *is;
} derived;

typedef struct spec {
  char *title, *scene;
  int command, repeats, seed, keep;
  double max_seconds;
  const flesh_node *set, *arguments;
  flesh_objects axes, columns;
} spec;

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
    {.name = "spacing", .type = FLESH_KEY_CHOICE, .offset = offsetof(axis, spacing), .choices = spacings,
     .default_value = "linear", .doc = "of a range"},
    {.name = "zip", .type = FLESH_KEY_OBJECTS, .offset = offsetof(axis, zip), .default_value = "",
     .children = axis_table, .child_size = sizeof(axis), .doc = "axes of equal length that advance together"},
    {.name = "sample", .type = FLESH_KEY_OBJECT, .offset = offsetof(axis, sample), .default_value = "",
     .children = sample_table, .doc = "points in the space of several axes"},
    {.name = NULL},
};

static const flesh_key column_table[] = {
    {.name = "name", .type = FLESH_KEY_TEXT, .offset = offsetof(derived, name), .doc = "of the column"},
    {.name = "is", .type = FLESH_KEY_TEXT, .offset = offsetof(derived, is),
     .doc = "SQLite's expression of the columns of results, those derived before included"},
    {.name = NULL},
};

static const flesh_key spec_table[] = {
    {.name = "title", .type = FLESH_KEY_TEXT, .offset = offsetof(spec, title), .default_value = "",
     .doc = "what the sweep is for"},
    {.name = "command", .type = FLESH_KEY_CHOICE, .offset = offsetof(spec, command), .choices = flesh_sweep_commands,
     .default_value = "run", .doc = "what is done with the scene in each case"},
    {.name = "scene", .type = FLESH_KEY_PATH, .offset = offsetof(spec, scene), .default_value = "",
     .doc = "relative to the spec; of every command but hardcases, which has scenes of its own"},
    {.name = "set", .type = FLESH_KEY_TREE, .offset = offsetof(spec, set), .default_value = "",
     .doc = "a mapping of values that all cases have: {time.end: 1, output.frame_interval: 0}"},
    {.name = "axes", .type = FLESH_KEY_OBJECTS, .offset = offsetof(spec, axes), .default_value = "[]",
     .children = axis_table, .child_size = sizeof(axis), .doc = "what varies; every value of one with every value of "
     "the others"},
    {.name = "repeats", .type = FLESH_KEY_INTEGER, .offset = offsetof(spec, repeats), .range = FLESH_RANGE_POSITIVE,
     .default_value = "1", .doc = "how often each case is run; a column repeat numbers them"},
    {.name = "seed", .type = FLESH_KEY_INTEGER, .offset = offsetof(spec, seed), .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "", .doc = "output.seed of the first repeat; one more in each further one"},
    {.name = "max_seconds", .type = FLESH_KEY_NUMBER, .offset = offsetof(spec, max_seconds),
     .range = FLESH_RANGE_POSITIVE, .unit = "s", .default_value = ".inf",
     .doc = "of each case; what has not stopped 2 s later is ended"},
    {.name = "keep", .type = FLESH_KEY_BOOLEAN, .offset = offsetof(spec, keep), .default_value = "false",
     .doc = "true: each case leaves its history, state and log in DIR/cases/ID"},
    {.name = "arguments", .type = FLESH_KEY_TREE, .offset = offsetof(spec, arguments), .default_value = "",
     .doc = "a list of further words of the command line of drift, accuracy or hardcases: [--quick]"},
    {.name = "columns", .type = FLESH_KEY_OBJECTS, .offset = offsetof(spec, columns), .default_value = "[]",
     .children = column_table, .child_size = sizeof(derived), .doc = "derived columns of the results"},
    {.name = NULL},
};

static void describe(FILE *stream, const flesh_key *keys, int indent)
{
  char expected[FLESH_EXPECTATION_SIZE];
  for (; keys->name; keys++) {
    int nested = keys->children && keys->children != axis_table;
    fprintf(stream, "%*s%-*s %s", indent, "", 14 - indent, keys->name, keys->doc);
    if (keys->type == FLESH_KEY_CHOICE || keys->type == FLESH_KEY_NUMBER || keys->type == FLESH_KEY_INTEGER)
      fprintf(stream, " (%s)", flesh_key_expectation(keys, expected));
    if (keys->default_value && *keys->default_value && !keys->children && !strstr(keys->default_value, "inf"))
      fprintf(stream, "; default %s", keys->default_value);
    putc('\n', stream);
    if (nested) describe(stream, keys->children, indent + 2);
  }
}

void flesh_sweep_describe_keys(FILE *stream)
{
  fputs("Keys of a spec:\n", stream);
  describe(stream, spec_table, 2);
  fputs("Keys of an axis:\n", stream);
  describe(stream, axis_table, 2);
}

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory while reading a sweep"); }

/* The node as YAML on one line. */
static void print_flow(const flesh_node *node, flesh_text *text)
{
  if (node->kind == FLESH_NODE_SCALAR) {
    int plain = !node->quoted && !strpbrk(node->text, ",[]{}:#\"'\n");
    if (plain) flesh_text_append(text, node->text, strlen(node->text));
    else flesh_text_quote(text, node->text);
    return;
  }
  int mapping = node->kind == FLESH_NODE_MAPPING;
  flesh_text_print(text, mapping ? "{" : "[");
  for (const flesh_node *child = node->first; child; child = child->next) {
    if (mapping) flesh_text_quote(text, child->key);
    if (mapping) flesh_text_print(text, ": ");
    print_flow(child, text);
    if (child->next) flesh_text_print(text, ", ");
  }
  flesh_text_print(text, mapping ? "}" : "]");
}

static int is_path(const char *key)
{
  const flesh_key *keys = flesh_scene_table, *found = NULL;
  char word[64];
  if (!strcmp(key, "scene")) return 1;
  for (const char *at = key; *at && keys;) {
    size_t size = strcspn(at, ".[");
    if (!size || size >= sizeof word) return 0;
    snprintf(word, sizeof word, "%.*s", (int)size, at);
    found = flesh_key_named(keys, word);
    if (!found) return 0;
    keys = found->children;
    at += size + (at[size] == '.');
  }
  return found && found->type == FLESH_KEY_PATH;
}

/* The value as --set takes it; paths, which there are relative to the working directory, from the spec's folder. */
static const char *value_text(flesh_sweep *sweep, const char *key, const flesh_node *node)
{
  flesh_text text = {0};
  const char *slash = strrchr(sweep->path, '/');
  if (node->kind == FLESH_NODE_SCALAR && is_path(key)) {
    char *whole = *node->text == '/' || !slash ? flesh_arena_print(&sweep->arena, "%s", node->text)
                                               : flesh_arena_print(&sweep->arena, "%.*s/%s", (int)(slash - sweep->path),
                                                                   sweep->path, node->text);
    if (!whole || !strcmp(key, "scene")) return whole;
    flesh_text_quote(&text, whole);
  } else print_flow(node, &text);
  const char *value = text.failed ? NULL : flesh_arena_print(&sweep->arena, "%s", text.data ? text.data : "");
  free(text.data);
  return value;
}

static int add_column(flesh_sweep *sweep, const axis *a, const flesh_node *node, int count)
{
  if (!a->key) return flesh_node_fail(node, "key is missing; an axis has key, zip or sample");
  if (sweep->column_count == FLESH_SWEEP_COLUMNS)
    return flesh_node_fail(node, "there are more than %d axes", FLESH_SWEEP_COLUMNS);
  flesh_sweep_column *column = &sweep->columns[sweep->column_count++];
  *column = (flesh_sweep_column){
      .name = a->name, .key = a->key, .place = node,
      .values = flesh_arena_take(&sweep->arena, sizeof(char *) * (size_t)count),
      .nodes = flesh_arena_take(&sweep->arena, sizeof(flesh_node *) * (size_t)count)};
  return column->values && column->nodes ? FLESH_OK : no_memory();
}

static int has_range(const axis *a) { return !isnan(a->from) || !isnan(a->to); }

/* How many values an axis has of its own. */
static int axis_length(const axis *a, const flesh_node *node, int sampled, int *count)
{
  if (a->zip.count || a->sample.count != INT_MIN)
    return flesh_node_fail(node, "zip and sample cannot stand in zip or sample");
  if (!a->values == !has_range(a))
    return flesh_node_fail(node, "the axis needs either values or from and to");
  if (a->values) {
    if (a->values->kind != FLESH_NODE_LIST || !a->values->count) {
      char shown[FLESH_SHOW_SIZE];
      return flesh_node_fail(a->values, "values is %s; it must be a list", flesh_node_show(a->values, shown));
    }
    if (a->count != INT_MIN)
      return flesh_node_fail(flesh_node_find(node, "count"), "count is of a range; values are counted by themselves");
    *count = a->values->count;
    return FLESH_OK;
  }
  if (isnan(a->from) || isnan(a->to)) return flesh_node_fail(node, "a range needs both from and to");
  if (a->spacing == LOGARITHMIC && !(a->from > 0 && a->to > 0))
    return flesh_node_fail(flesh_node_find(node, a->from > 0 ? "to" : "from"),
                           "%s is %g; it must be > 0 when spacing is logarithmic", a->from > 0 ? "to" : "from",
                           a->from > 0 ? a->to : a->from);
  if (sampled && a->count != INT_MIN)
    return flesh_node_fail(flesh_node_find(node, "count"), "count stands in sample, not in its axes");
  if (!sampled && a->count == INT_MIN)
    return flesh_node_fail(node, "count is missing; it must be how many values the range has");
  *count = sampled ? 1 : a->count;
  return FLESH_OK;
}

static const char *range_text(flesh_sweep *sweep, const axis *a, double part)
{
  char digits[FLESH_NUMBER_SIZE];
  double value = part <= 0   ? a->from
                 : part >= 1 ? a->to
                 : a->spacing == LOGARITHMIC ? a->from * pow(a->to / a->from, part)
                                             : a->from + part * (a->to - a->from);
  return flesh_arena_print(&sweep->arena, "%s", flesh_number_text(value, digits));
}

/* The axis's own values, in order. */
static int fill_column(flesh_sweep *sweep, const axis *a, int count)
{
  flesh_sweep_column *column = &sweep->columns[sweep->column_count - 1];
  const flesh_node *node = a->values ? a->values->first : NULL;
  for (int k = 0; k < count; k++) {
    column->nodes[k] = node;
    column->values[k] = node ? value_text(sweep, a->key, node)
                             : range_text(sweep, a, count > 1 ? (double)k / (count - 1) : 0);
    if (!column->values[k]) return no_memory();
    if (node) node = node->next;
  }
  return FLESH_OK;
}

static int read_zip(flesh_sweep *sweep, const axis *a, const flesh_node *node, flesh_sweep_group *group)
{
  const axis *parts = a->zip.values;
  const flesh_node *place = flesh_node_find(node, "zip")->first;
  for (int k = 0; k < a->zip.count; k++, place = place->next) {
    int count, status = axis_length(&parts[k], place, 0, &count);
    if (!status && k && count != group->count)
      return flesh_node_fail(place, "zip[%d] has %d values and zip[0] has %d; they must be as many", k, count,
                             group->count);
    if (!status) status = add_column(sweep, &parts[k], place, count);
    if (!status) status = fill_column(sweep, &parts[k], count);
    if (status) return status;
    group->count = count;
  }
  group->columns = a->zip.count;
  return FLESH_OK;
}

static int read_sample(flesh_sweep *sweep, const axis *a, const flesh_node *node, flesh_sweep_group *group)
{
  const struct axis_sample *sample = &a->sample;
  const axis *parts = sample->axes.values;
  node = flesh_node_find(node, "sample");
  if (!sample->axes.count || sample->axes.count > FLESH_SWEEP_COLUMNS)
    return flesh_node_fail(flesh_node_find(node, "axes"), "sample.axes are %d; they must be 1 to %d",
                           sample->axes.count, FLESH_SWEEP_COLUMNS);
  if (sample->count > CASE_LIMIT || sample->skip > CASE_LIMIT)
    return flesh_node_fail(node, "sample.count and skip must be at most %d", CASE_LIMIT);
  const flesh_node *place = flesh_node_find(node, "axes")->first;
  int dimensions = sample->axes.count, status = FLESH_OK;
  double *points = malloc(sizeof *points * (size_t)dimensions * (size_t)sample->count);
  if (!points) return no_memory();
  status = flesh_sweep_sample(sample->sequence, dimensions, sample->count, sample->skip, sample->seed, points);
  if (status == FLESH_ERR_ARGUMENT) flesh_node_fail_within(status, node, "%s", "");
  for (int d = 0; !status && d < dimensions; d++, place = place->next) {
    const axis *part = &parts[d];
    int count;
    status = axis_length(part, place, 1, &count);
    if (!status) status = add_column(sweep, part, place, sample->count);
    if (status) break;
    flesh_sweep_column *column = &sweep->columns[sweep->column_count - 1];
    for (int k = 0; !status && k < sample->count; k++) {
      double u = points[k * dimensions + d];
      if (part->values) {
        int item = (int)(u * count);
        column->nodes[k] = flesh_node_item(part->values, item < count ? item : count - 1);
        column->values[k] = value_text(sweep, part->key, column->nodes[k]);
      } else column->values[k] = range_text(sweep, part, u);
      if (!column->values[k]) status = no_memory();
    }
  }
  free(points);
  group->count = sample->count;
  group->columns = dimensions;
  return status;
}

static int read_axis(flesh_sweep *sweep, const axis *a, const flesh_node *node)
{
  flesh_sweep_group group = {.first = sweep->column_count, .columns = 1};
  int sampled = a->sample.count != INT_MIN, kinds = (a->key != NULL) + (a->zip.count > 0) + sampled, status;
  if (kinds != 1) return flesh_node_fail(node, "an axis has either key, zip or sample");
  if (!a->key && (a->values || has_range(a) || a->name || a->count != INT_MIN))
    return flesh_node_fail(node, "beside zip or sample an axis has no other keys");
  if (a->zip.count) status = read_zip(sweep, a, node, &group);
  else if (sampled) status = read_sample(sweep, a, node, &group);
  else {
    status = axis_length(a, node, 0, &group.count);
    if (!status && group.count > CASE_LIMIT)
      return flesh_node_fail(node, "the axis has %d values; it can have at most %d", group.count, CASE_LIMIT);
    if (!status) status = add_column(sweep, a, node, group.count);
    if (!status) status = fill_column(sweep, a, group.count);
  }
  if (status) return status;
  sweep->groups[sweep->group_count++] = group;
  if ((double)sweep->case_count * group.count > CASE_LIMIT)
    return flesh_node_fail(node, "with this axis there are more than %d cases", CASE_LIMIT);
  sweep->case_count *= group.count;
  return FLESH_OK;
}

static int read_set(flesh_sweep *sweep, const flesh_node *set)
{
  char shown[FLESH_SHOW_SIZE];
  if (!set || flesh_node_is_null(set)) return FLESH_OK;
  if (set->kind != FLESH_NODE_MAPPING)
    return flesh_node_fail(set, "set is %s; it must be a mapping such as {time.end: 1}", flesh_node_show(set, shown));
  sweep->set = flesh_arena_take(&sweep->arena, sizeof(char *) * (size_t)set->count);
  sweep->set_nodes = flesh_arena_take(&sweep->arena, sizeof(flesh_node *) * (size_t)set->count);
  if (!sweep->set || !sweep->set_nodes) return no_memory();
  for (const flesh_node *child = set->first; child; child = child->next) {
    const char *value = value_text(sweep, child->key, child);
    const char *text = value ? flesh_arena_print(&sweep->arena, "%s=%s", child->key, value) : NULL;
    if (!text) return no_memory();
    sweep->set_nodes[sweep->set_count] = child;
    sweep->set[sweep->set_count++] = text;
  }
  return FLESH_OK;
}

static int read_arguments(flesh_sweep *sweep, const flesh_node *list)
{
  char shown[FLESH_SHOW_SIZE];
  if (!list || flesh_node_is_null(list)) return FLESH_OK;
  if (list->kind != FLESH_NODE_LIST)
    return flesh_node_fail(list, "arguments is %s; it must be a list of words", flesh_node_show(list, shown));
  if (sweep->command == FLESH_SWEEP_RUN && list->count)
    return flesh_node_fail(list, "arguments are of drift, accuracy and hardcases; run takes what stands in set");
  sweep->arguments = flesh_arena_take(&sweep->arena, sizeof(char *) * (size_t)list->count);
  if (!sweep->arguments) return no_memory();
  for (const flesh_node *child = list->first; child; child = child->next) {
    if (child->kind != FLESH_NODE_SCALAR)
      return flesh_node_fail(child, "an argument is %s; it must be a word", flesh_node_show(child, shown));
    if (!strncmp(child->text, "--out", 5) || !strncmp(child->text, "--set", 5))
      return flesh_node_fail(child, "%s is the sweep's own; values stand in set", child->text);
    sweep->arguments[sweep->argument_count++] = child->text;
  }
  return FLESH_OK;
}

/* A column's name is a word of SQL, so that nobody has to quote it. */
static int check_name(const flesh_node *node, const char *name)
{
  static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789";
  if (strspn(name, letters) == strlen(name) && !(*name >= '0' && *name <= '9')) return FLESH_OK;
  char shown[FLESH_SHOW_SIZE];
  return flesh_node_fail(node, "name is %s; it must be of letters, digits and _", flesh_word_show(name, shown));
}

static int taken(const flesh_sweep *sweep, int except, const char *name)
{
  for (int c = 0; c < sweep->column_count; c++)
    if (c != except && sweep->columns[c].name && !strcasecmp(sweep->columns[c].name, name)) return 1;
  return 0;
}

static int name_columns(flesh_sweep *sweep)
{
  for (int c = 0; c < sweep->column_count; c++) {
    flesh_sweep_column *column = &sweep->columns[c];
    if (column->name) {
      int status = check_name(flesh_node_find(column->place, "name"), column->name);
      if (status) return status;
      if (taken(sweep, c, column->name))
        return flesh_node_fail(column->place, "two columns are named %s", column->name);
      continue;
    }
    const char *dot = strrchr(column->key, '.');
    char *whole = flesh_arena_print(&sweep->arena, "%s", column->key);
    if (!whole) return no_memory();
    for (char *letter = whole; *letter; letter++)
      if (strchr(".[]", *letter)) *letter = '_';
    column->name = whole + (dot ? dot + 1 - column->key : 0);
    size_t length = strlen(whole);
    if (length && whole[length - 1] == '_') whole[length - 1] = 0;
    for (int other = 0; other < sweep->column_count; other++)
      if (other != c && !strcmp(sweep->columns[other].key, column->key))
        return flesh_node_fail(column->place, "%s varies on two axes", column->key);
    if (taken(sweep, c, column->name)) column->name = whole;
    int status = check_name(column->place, column->name);
    if (status) return status;
  }
  return FLESH_OK;
}

static int check(const flesh_node *node, const char *scene, int count, const char **overrides)
{
  int status = flesh_scene_check_keys(scene, count, overrides);
  if (!status) return FLESH_OK;
  /* The spec's place instead of the words that a command line would have had. */
  char words[1600], prefix[1600];
  snprintf(words, sizeof words, "%s", flesh_error_text());
  snprintf(prefix, sizeof prefix, "--set %s: ", count ? overrides[count - 1] : "");
  const char *rest = strncmp(words, prefix, strlen(prefix)) ? words : words + strlen(prefix);
  flesh_fail(status, "%s", rest);
  return flesh_node_fail_within(status, node, "%s", "");
}

/* Every constant and every value of every axis must be one that its key takes. What a combination makes of them is
 * for its case to say. */
static int check_values(flesh_sweep *sweep)
{
  if (sweep->command == FLESH_SWEEP_HARDCASES) return FLESH_OK; /* its cases' scenes are made when they are run */
  const char **overrides = calloc((size_t)sweep->set_count + 1, sizeof *overrides);
  int status = overrides ? FLESH_OK : no_memory();
  for (int s = 0; !status && s <= sweep->set_count; s++) {
    if (s) overrides[s - 1] = sweep->set[s - 1];
    status = check(s ? sweep->set_nodes[s - 1] : sweep->scene_node, sweep->scene, s, overrides);
  }
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_sweep_column *column = &sweep->columns[sweep->groups[g].first + c];
      int count = sweep->groups[g].count, is_scene = !strcmp(column->key, "scene");
      const flesh_node *last = NULL;
      for (int k = 0; !status && k < count; k++) {
        /* Of a range the ends suffice, of a list that is sampled again and again some. */
        if (!column->nodes[k] && k && k < count - 1) continue;
        if ((k > 200 || column->nodes[k] == last) && last) continue;
        last = column->nodes[k];
        char *text = malloc(strlen(column->key) + strlen(column->values[k]) + 2);
        if (!text) status = no_memory();
        else {
          sprintf(text, "%s=%s", column->key, column->values[k]);
          overrides[sweep->set_count] = text;
          status = check(last ? last : column->place, is_scene ? column->values[k] : sweep->scene,
                         sweep->set_count + !is_scene, overrides);
        }
        free(text);
      }
    }
  free(overrides);
  return status;
}

static int hash_file(SHA2_CTX *context, const char *path)
{
  char *text;
  size_t size;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  SHA256Update(context, (const uint8_t *)text, size);
  free(text);
  return FLESH_OK;
}

/* Of the plan: a sweep may only be gone on with when it is the same. */
static int make_fingerprint(flesh_sweep *sweep)
{
  SHA2_CTX context;
  SHA256Init(&context);
  SHA256Update(&context, (const uint8_t *)sweep->text, strlen(sweep->text));
  int status = sweep->scene ? hash_file(&context, sweep->scene) : FLESH_OK;
  for (int g = 0; !status && g < sweep->group_count; g++)
    for (int c = 0; !status && c < sweep->groups[g].columns; c++) {
      const flesh_sweep_column *column = &sweep->columns[sweep->groups[g].first + c];
      for (int k = 0; !strcmp(column->key, "scene") && !status && k < sweep->groups[g].count; k++)
        status = hash_file(&context, column->values[k]);
    }
  SHA256End(&context, sweep->fingerprint);
  return status;
}

static int read_derived(flesh_sweep *sweep, const spec *s, const flesh_node *root)
{
  const derived *rows = s->columns.values;
  const flesh_node *node = flesh_node_find(root, "columns");
  node = node ? node->first : NULL;
  sweep->derived = flesh_arena_take(&sweep->arena, sizeof *sweep->derived * (size_t)s->columns.count);
  if (!sweep->derived) return no_memory();
  for (int k = 0; k < s->columns.count; k++, node = node->next) {
    int status = check_name(node, rows[k].name);
    if (status) return status;
    sweep->derived[sweep->derived_count++] = (struct flesh_sweep_derived){rows[k].name, rows[k].is, node};
  }
  return FLESH_OK;
}

static int make(flesh_sweep *sweep, const spec *s, const flesh_node *root)
{
  static const char no_scene[] = "flesh hardcases has scenes of its own; --cases among the arguments chooses some";
  sweep->command = s->command;
  sweep->scene = s->scene && *s->scene ? s->scene : NULL;
  sweep->scene_node = flesh_node_find(root, "scene");
  if (!sweep->scene && s->command != FLESH_SWEEP_HARDCASES)
    return flesh_node_fail(root, "scene is missing; it must be the path of a file");
  if (sweep->scene && s->command == FLESH_SWEEP_HARDCASES)
    return flesh_node_fail(sweep->scene_node, "%s", no_scene);
  sweep->repeats = s->repeats;
  sweep->seed = s->seed == INT_MIN ? -1 : s->seed;
  sweep->keep = s->keep;
  sweep->max_seconds = isfinite(s->max_seconds) ? s->max_seconds : 0;
  sweep->case_count = 1;
  const axis *axes = s->axes.values;
  const flesh_node *place = flesh_node_find(root, "axes");
  place = place ? place->first : NULL;
  int status = read_arguments(sweep, s->arguments);
  if (!status) status = read_set(sweep, s->set);
  for (int a = 0; !status && a < s->axes.count; a++, place = place->next) status = read_axis(sweep, &axes[a], place);
  for (int c = 0; !status && c < sweep->column_count && s->command == FLESH_SWEEP_HARDCASES; c++)
    if (!strcmp(sweep->columns[c].key, "scene")) status = flesh_node_fail(sweep->columns[c].place, "%s", no_scene);
  if (!status) status = name_columns(sweep);
  if (!status) status = read_derived(sweep, s, root);
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
  size_t size;
  flesh_node *root = NULL;
  spec s;
  *sweep = (flesh_sweep){0};
  sweep->path = flesh_arena_print(&sweep->arena, "%s", path);
  if (!sweep->path) return no_memory();
  int status = flesh_file_load(path, &sweep->text, &size);
  if (status) return status;
  flesh_source source = {sweep->path, 0};
  status = flesh_yaml_parse(&sweep->arena, sweep->text, size, &source, &root);
  if (status) return status;
  flesh_key whole = {.type = FLESH_KEY_OBJECT, .children = spec_table};
  char expected[FLESH_EXPECTATION_SIZE];
  if (!root)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s:1:1: the spec is empty; it must be %s", path,
                      flesh_key_expectation(&whole, expected));
  if (root->kind != FLESH_NODE_MAPPING) return flesh_key_fail(&whole, root, "the spec");
  const char *slash = strrchr(path, '/');
  flesh_key_reader reader = {
      &sweep->arena, flesh_arena_text(&sweep->arena, path, slash ? (size_t)(slash - path) + (slash == path) : 0)};
  if (!reader.directory) return no_memory();
  status = flesh_keys_read(&reader, spec_table, root, root, "", &s);
  return status ? status : make(sweep, &s, root);
}

void flesh_sweep_close(flesh_sweep *sweep)
{
  flesh_arena_free(&sweep->arena);
  free(sweep->text);
  *sweep = (flesh_sweep){0};
}
