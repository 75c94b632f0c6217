/* keys.c: reads a mapping into a struct by a table of keys, with a sentence for every error. */
#include "scene/keys.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "base/text.h"
#include "scene/words.h"

const flesh_key *flesh_key_named(const flesh_key *keys, const char *name)
{
  for (; keys->name; keys++)
    if (!strcmp(keys->name, name)) return keys;
  return NULL;
}

const flesh_key *flesh_key_at(const flesh_key *keys, size_t offset)
{
  for (; keys->name; keys++)
    if (keys->offset == offset) return keys;
  return NULL;
}

char *flesh_key_path(flesh_arena *arena, const char *path, const char *name)
{
  return flesh_arena_print(arena, "%s%s%s", path, *path ? "." : "", name);
}

static const char *const range_words[] = {"", " > 0", " >= 0", " > 0 and < 1", " in (-1, 0.5]"}; /* in the order of the enum */

static int in_range(flesh_key_range range, double value)
{
  switch (range) {
  case FLESH_RANGE_POSITIVE: return value > 0;
  case FLESH_RANGE_NOT_NEGATIVE: return value >= 0;
  case FLESH_RANGE_FRACTION: return value > 0 && value < 1;
  case FLESH_RANGE_POISSON: return value > -1 && value <= 0.5;
  default: return 1;
  }
}

int flesh_key_takes_infinity(const flesh_key *key)
{
  return key->type == FLESH_KEY_BOX || (key->default_value && strstr(key->default_value, "inf"));
}

const char *flesh_key_expectation(const flesh_key *key, char text[FLESH_EXPECTATION_SIZE])
{
  const char *range = range_words[key->range], *each = *range ? ", each" : "";
  const size_t most = FLESH_EXPECTATION_SIZE - 40; /* most bytes of a list; the unit follows it */
#define SAY(...) flesh_text_add(text, FLESH_EXPECTATION_SIZE, __VA_ARGS__)
  *text = 0;
  switch (key->type) {
  case FLESH_KEY_NUMBER:
    SAY("a number%s%s", range, !flesh_key_takes_infinity(key) ? "" : key->range ? " or .inf" : ", .inf or -.inf");
    break;
  case FLESH_KEY_INTEGER: SAY("a whole number%s", range); break;
  case FLESH_KEY_BOOLEAN: SAY("true or false"); break;
  case FLESH_KEY_CHOICE:
  case FLESH_KEY_SET:
    SAY(key->type == FLESH_KEY_SET ? "a list of some of" : "one of");
    for (const char *const *choice = key->choices; *choice && strlen(text) < most; choice++)
      SAY("%s %s", choice == key->choices ? "" : ",", *choice);
    if (key->may_be_all) SAY("; [all], or [-%s] for all but that", *key->choices);
    break;
  case FLESH_KEY_TEXT: SAY("text"); break;
  case FLESH_KEY_PATH: SAY("the path of a file"); break;
  case FLESH_KEY_VECTOR: SAY("three numbers [x, y, z]%s%s", each, range); break;
  case FLESH_KEY_BOX: SAY("two corners [[x, y, z], [x, y, z]], the low one first"); break;
  case FLESH_KEY_INTEGERS: SAY("a list of whole numbers%s%s", each, range); break;
  case FLESH_KEY_OBJECT:
  case FLESH_KEY_OBJECTS:
    SAY(!key->children || !key->children->name ? "{}: it has no keys"
        : key->type == FLESH_KEY_OBJECT        ? "a mapping of the keys"
                                               : "a list of mappings of the keys");
    for (const flesh_key *child = key->children; child && child->name && strlen(text) < most; child++)
      SAY("%s %s", child == key->children ? "" : ",", child->name);
    break;
  case FLESH_KEY_EFFECTS: SAY("a list of effects, each \"- name: {its keys}\""); break;
  case FLESH_KEY_TREE: SAY("as documented"); break;
  }
  if (key->unit) SAY(" [%s]", key->unit);
#undef SAY
  return text;
}

/* Returns the words of the int limit that a whole number exceeds; "" if it does not. */
static const char *integer_limit(const flesh_key *key, const flesh_node *node)
{
  const int whole = key->type == FLESH_KEY_INTEGER || key->type == FLESH_KEY_INTEGERS;
  const double number = whole && node->kind == FLESH_NODE_SCALAR ? strtod(node->text, NULL) : 0;
  return number > INT_MAX ? ", at most 2147483647" : number < -INT_MAX ? ", at least -2147483647" : "";
}

int flesh_key_fail(const flesh_key *key, const flesh_node *node, const char *path)
{
  char shown[FLESH_SHOW_SIZE], expected[FLESH_EXPECTATION_SIZE];
  return flesh_node_fail(node, "%s is %s; it must be %s%s", path, flesh_node_show(node, shown),
                         flesh_key_expectation(key, expected), integer_limit(key, node));
}

/* Sets every value to the one that means "absent" in base/key.h. */
static void blank(const flesh_key *keys, void *target)
{
  static const int numbers[FLESH_KEY_TREE + 1] = {[FLESH_KEY_NUMBER] = 1, [FLESH_KEY_VECTOR] = 3, [FLESH_KEY_BOX] = 6};
  static const size_t zeros[FLESH_KEY_TREE + 1] = { /* sizes of values that are absent as zeros or NULL */
      [FLESH_KEY_TEXT] = sizeof(char *), [FLESH_KEY_PATH] = sizeof(char *), [FLESH_KEY_SET] = sizeof(unsigned),
      [FLESH_KEY_INTEGERS] = sizeof(flesh_integers), [FLESH_KEY_OBJECTS] = sizeof(flesh_objects),
      [FLESH_KEY_EFFECTS] = sizeof(flesh_objects), [FLESH_KEY_TREE] = sizeof(flesh_node *)};
  for (const flesh_key *key = keys; key->name; key++) {
    void *value = (char *)target + key->offset;
    if (key->type == FLESH_KEY_OBJECT) blank(key->children, value);
    if (key->type == FLESH_KEY_INTEGER) *(int *)value = INT_MIN;
    if (key->type == FLESH_KEY_BOOLEAN || key->type == FLESH_KEY_CHOICE) *(int *)value = -1;
    for (int i = 0; i < numbers[key->type]; i++) ((double *)value)[i] = NAN;
    memset(value, 0, zeros[key->type]);
  }
}

/* Reads a number; returns whether the node is one that the key takes. */
static int read_number(const flesh_key *key, const flesh_node *node, double *value)
{
  return node && node->kind == FLESH_NODE_SCALAR && flesh_number_parse(node->text, value) &&
         (isfinite(*value) || flesh_key_takes_infinity(key)) && in_range(key->range, *value);
}

static int read_vector(const flesh_key *key, const flesh_node *list, double values[3])
{
  if (list->kind != FLESH_NODE_LIST || list->count != 3) return 0;
  const flesh_node *child = list->first;
  for (int i = 0; i < 3; i++, child = child->next)
    if (!read_number(key, child, &values[i])) return 0;
  return 1;
}

static int read_integer(const flesh_key *key, const flesh_node *node, int *value)
{
  double number;
  if (!read_number(key, node, &number) || number != floor(number)) return 0;
  if (!(number > INT_MIN && number <= INT_MAX)) return 0;
  *value = (int)number;
  return 1;
}

static int read_box(const flesh_key *key, const flesh_node *node, double box[6])
{
  if (node->kind != FLESH_NODE_LIST || node->count != 2) return 0;
  if (!read_vector(key, node->first, box) || !read_vector(key, node->last, box + 3)) return 0;
  for (int d = 0; d < 3; d++)
    if (box[d] > box[3 + d]) return 0;
  return 1;
}

static int read_boolean(const flesh_node *node, int *value)
{
  if (node->kind != FLESH_NODE_SCALAR) return 0;
  *value = !strcasecmp(node->text, "true") || !strcasecmp(node->text, "yes");
  return *value || !strcasecmp(node->text, "false") || !strcasecmp(node->text, "no");
}

static int read_choice(const flesh_key *key, const flesh_node *node, int *value)
{
  if (node->kind != FLESH_NODE_SCALAR) return 0;
  for (*value = 0; key->choices[*value]; ++*value)
    if (!strcmp(key->choices[*value], node->text) ||
        (key->aliases && !strcmp(key->aliases[*value], node->text)))
      return 1;
  return 0;
}

/* Returns the bits of all choices of a set. */
static unsigned all_of(const flesh_key *key)
{
  unsigned all = 0;
  for (int k = 0; key->choices[k]; k++) all |= 1u << k;
  return all;
}

static int read_set(const flesh_key *key, const flesh_node *node, unsigned *set)
{
  if (node->kind != FLESH_NODE_LIST || (!node->count && !key->may_be_all)) return 0;
  *set = 0;
  for (const flesh_node *child = node->first; child; child = child->next) {
    const int scalar = key->may_be_all && child->kind == FLESH_NODE_SCALAR, leaves_out = scalar && *child->text == '-';
    flesh_node item = *child;
    int choice;
    if (leaves_out) item.text++;
    if (scalar && (!strcmp(child->text, "all") || (leaves_out && child == node->first))) *set = all_of(key);
    if (scalar && !strcmp(child->text, "all")) continue;
    if (!read_choice(key, &item, &choice)) return 0;
    *set = leaves_out ? *set & ~(1u << choice) : *set | 1u << choice;
  }
  return 1;
}

static int read_text(const flesh_key_reader *reader, const flesh_key *key, const flesh_node *node,
                     const char *path, char **value)
{
  if (node->kind != FLESH_NODE_SCALAR || flesh_node_is_null(node) || !*node->text)
    return flesh_key_fail(key, node, path);
  int relative = key->type == FLESH_KEY_PATH && node->text[0] != '/' && !node->override &&
                 reader->directory && *reader->directory;
  *value = relative ? flesh_arena_print(reader->arena, "%s/%s", reader->directory, node->text)
                    : flesh_arena_text(reader->arena, node->text, strlen(node->text));
  return *value ? FLESH_OK : flesh_no_memory();
}

/* Reads a list of integers. An error names the wrong item, as the list may be long. */
static int read_integers(const flesh_key_reader *reader, const flesh_key *key,
                         const flesh_node *node, const char *path, flesh_integers *integers)
{
  if (node->kind != FLESH_NODE_LIST || !node->count) return flesh_key_fail(key, node, path);
  integers->values =
      flesh_arena_take(reader->arena, (size_t)node->count * sizeof *integers->values);
  if (!integers->values) return flesh_no_memory();
  integers->count = node->count;
  int i = 0;
  for (const flesh_node *child = node->first; child; child = child->next, i++)
    if (!read_integer(key, child, &integers->values[i])) {
      char shown[FLESH_SHOW_SIZE];
      return flesh_node_fail(child, "%s[%d] is %s; it must be a whole number%s%s", path, i,
                             flesh_node_show(child, shown), range_words[key->range], integer_limit(key, child));
    }
  return FLESH_OK;
}

static int read_objects(const flesh_key_reader *reader, const flesh_key *key,
                        const flesh_node *node, const char *path, flesh_objects *objects)
{
  if (node->kind != FLESH_NODE_LIST) return flesh_key_fail(key, node, path);
  objects->values = flesh_arena_take(reader->arena, (size_t)node->count * key->child_size);
  if (!objects->values) return flesh_no_memory();
  objects->count = node->count;
  int i = 0;
  for (const flesh_node *child = node->first; child; child = child->next, i++) {
    char *item_path = flesh_arena_print(reader->arena, "%s[%d]", path, i);
    if (!item_path) return flesh_no_memory();
    if (child->kind != FLESH_NODE_MAPPING) {
      char shown[FLESH_SHOW_SIZE], expected[FLESH_EXPECTATION_SIZE];
      flesh_key item = {.type = FLESH_KEY_OBJECT, .children = key->children};
      return flesh_node_fail(child, "%s is %s; it must be %s", item_path,
                             flesh_node_show(child, shown), flesh_key_expectation(&item, expected));
    }
    int status = flesh_keys_read(reader, key->children, child, child, item_path,
                                 (char *)objects->values + (size_t)i * key->child_size);
    if (status) return status;
  }
  return FLESH_OK;
}

static int read_value(const flesh_key_reader *reader, const flesh_key *key, const flesh_node *node,
                      const char *path, void *value)
{
  int good = 0;
  switch (key->type) {
  case FLESH_KEY_NUMBER: good = read_number(key, node, value); break;
  case FLESH_KEY_INTEGER: good = read_integer(key, node, value); break;
  case FLESH_KEY_BOOLEAN: good = read_boolean(node, value); break;
  case FLESH_KEY_CHOICE: good = read_choice(key, node, value); break;
  case FLESH_KEY_VECTOR: good = read_vector(key, node, value); break;
  case FLESH_KEY_BOX: good = read_box(key, node, value); break;
  case FLESH_KEY_SET: good = read_set(key, node, value); break;
  case FLESH_KEY_TEXT:
  case FLESH_KEY_PATH: return read_text(reader, key, node, path, value);
  case FLESH_KEY_INTEGERS: return read_integers(reader, key, node, path, value);
  case FLESH_KEY_OBJECTS: return read_objects(reader, key, node, path, value);
  case FLESH_KEY_EFFECTS: return key->list->read(reader, node, path, value);
  case FLESH_KEY_TREE:
    *(const flesh_node **)value = node;
    return FLESH_OK;
  case FLESH_KEY_OBJECT:
    if (flesh_node_is_null(node))
      return flesh_keys_read(reader, key->children, NULL, node, path, value);
    if (node->kind != FLESH_NODE_MAPPING) break;
    return flesh_keys_read(reader, key->children, node, node, path, value);
  }
  return good ? FLESH_OK : flesh_key_fail(key, node, path);
}

int flesh_key_default(flesh_arena *arena, const flesh_key *key, flesh_node **node)
{
  flesh_source source = {key->name, 0};
  if (strchr("[{", key->default_value[0]))
    return flesh_yaml_parse(arena, key->default_value, strlen(key->default_value), &source, node);
  *node = flesh_node_create(arena, FLESH_NODE_SCALAR, &source);
  if (!*node) return flesh_no_memory();
  (*node)->text = key->default_value;
  return FLESH_OK;
}

static int read_absent(const flesh_key_reader *reader, const flesh_key *key,
                       const flesh_node *place, const char *path, void *value)
{
  if (!key->default_value) {
    char expected[FLESH_EXPECTATION_SIZE];
    return flesh_node_fail(place, "%s is missing; it must be %s", path,
                           flesh_key_expectation(key, expected));
  }
  if (!*key->default_value) return FLESH_OK; /* the value stays absent */
  if (key->type == FLESH_KEY_OBJECT)
    return flesh_keys_read(reader, key->children, NULL, place, path, value);
  flesh_node *node = NULL;
  int status = flesh_key_default(reader->arena, key, &node);
  return status ? status : read_value(reader, key, node, path, value);
}

/* Refuses names that no row has, also below removed nodes, so that the misspelt path of a removal is noticed. */
static int check_names(const flesh_key_reader *reader, const flesh_key *keys,
                       const flesh_node *mapping, const char *path)
{
  for (const flesh_node *child = mapping->first; child; child = child->next) {
    const flesh_key *key = flesh_key_named(keys, child->key);
    if (!key) {
      flesh_suggestion suggestion = {.word = child->key};
      char text[512], shown[FLESH_SHOW_SIZE];
      for (key = keys; key->name; key++) flesh_suggestion_offer(&suggestion, key->name);
      return flesh_node_fail_at_key(child, "%s%s%s is unknown%s%s", path, *path ? "." : "",
                                    flesh_word_show(child->key, shown),
                                    keys->name ? "; " : ": there are no keys here",
                                    flesh_suggestion_text(&suggestion, text));
    }
    if (child->removed && child->kind == FLESH_NODE_MAPPING && key->type == FLESH_KEY_OBJECT) {
      char *below = flesh_key_path(reader->arena, path, child->key);
      if (!below) return flesh_no_memory();
      int status = check_names(reader, key->children, child, below);
      if (status) return status;
    }
  }
  return FLESH_OK;
}

int flesh_keys_read(const flesh_key_reader *reader, const flesh_key *keys,
                    const flesh_node *mapping, const flesh_node *place, const char *path,
                    void *target)
{
  blank(keys, target);
  int status = mapping ? check_names(reader, keys, mapping, path) : FLESH_OK;
  for (const flesh_key *key = keys; !status && key->name; key++) {
    void *value = (char *)target + key->offset;
    const flesh_node *node = flesh_node_find(mapping, key->name);
    char *below = flesh_key_path(reader->arena, path, key->name);
    if (!below) return flesh_no_memory();
    status = node && !node->removed ? read_value(reader, key, node, below, value)
                                    : read_absent(reader, key, place, below, value);
  }
  return status;
}
