/* spec_keys.c: the table of a spec's keys and its text in the help. */

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

const flesh_settings_part flesh_sweep_keys[] = {{"Keys of a spec", flesh_sweep_table, axis_table},
                                                {"Keys of an axis", axis_table, axis_table},
                                                {0}};
