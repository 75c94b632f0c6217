/* spec_keys.c: the table of a spec's keys, and its words for the help. */
#include <stdio.h>
#include <string.h>

#include "scene/keys.h"
#include "sweep/spec.h"

typedef flesh_sweep_axis axis;
typedef flesh_sweep_derived_row derived;
typedef flesh_sweep_spec spec;

const char *const flesh_sweep_commands[] = {"run", "drift", "accuracy", "hardcases", NULL};
static const char *const spacings[] = {"linear", "logarithmic", NULL};

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

const flesh_key flesh_sweep_spec_table[] = {
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
  describe(stream, flesh_sweep_spec_table, 2);
  fputs("Keys of an axis:\n", stream);
  describe(stream, axis_table, 2);
}
