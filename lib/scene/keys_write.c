/* keys_write.c: writes a struct as YAML by its table of keys, so that reading gives the same struct, and finds the
 * files that the struct names. */
#include "scene/keys.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/file.h"

static int value_absent(const flesh_key *key, const void *value)
{
  switch (key->type) {
  case FLESH_KEY_NUMBER:
  case FLESH_KEY_VECTOR:
  case FLESH_KEY_BOX: return isnan(*(const double *)value);
  case FLESH_KEY_INTEGER: return *(const int *)value == INT_MIN;
  case FLESH_KEY_BOOLEAN:
  case FLESH_KEY_CHOICE: return *(const int *)value < 0;
  case FLESH_KEY_TEXT:
  case FLESH_KEY_PATH: return !*(char *const *)value;
  case FLESH_KEY_TREE: return !*(const flesh_node *const *)value;
  case FLESH_KEY_SET: return !*(const unsigned *)value && !key->may_be_all;
  case FLESH_KEY_INTEGERS: return !((const flesh_integers *)value)->count;
  case FLESH_KEY_OBJECTS:
  case FLESH_KEY_EFFECTS: return !((const flesh_objects *)value)->count;
  case FLESH_KEY_OBJECT: return flesh_keys_absent(key->children, value);
  }
  return 1;
}

int flesh_keys_absent(const flesh_key *keys, const void *target)
{
  for (; keys->name; keys++)
    if (!value_absent(keys, (const char *)target + keys->offset)) return 0;
  return 1;
}

static void write_number(double value, flesh_text *text)
{
  char digits[FLESH_NUMBER_SIZE];
  if (isinf(value)) flesh_text_print(text, value < 0 ? "-.inf" : ".inf");
  else flesh_text_print(text, "%s", flesh_number_text(value, digits));
}

static void write_vector(const double values[3], flesh_text *text)
{
  for (int i = 0; i < 3; i++) {
    flesh_text_print(text, i ? ", " : "[");
    write_number(values[i], text);
  }
  flesh_text_print(text, "]");
}

static void write_integers(const flesh_integers *integers, int indent, flesh_text *text)
{
  enum { PER_LINE = 16 };
  flesh_text_print(text, "[");
  for (int i = 0; i < integers->count; i++) {
    if (i)
      flesh_text_print(text, i % PER_LINE ? ", " : ",\n%*s", i % PER_LINE ? 0 : indent + 2, "");
    flesh_text_print(text, "%d", integers->values[i]);
  }
  flesh_text_print(text, "]");
}

static void write_objects(const flesh_key *key, const flesh_objects *objects, int indent,
                          flesh_text *text)
{
  for (int i = 0; i < objects->count; i++) {
    const void *item = (const char *)objects->values + (size_t)i * key->child_size;
    if (flesh_keys_absent(key->children, item)) {
      flesh_text_print(text, "\n%*s- {}", indent + 2, "");
      continue;
    }
    flesh_text_print(text, "\n");
    size_t start = text->size;
    flesh_keys_write(key->children, item, indent + 4, text);
    if (text->failed) return;
    text->data[start + (size_t)indent + 2] = '-'; /* in the indentation of the first key */
    text->size--;                                 /* the caller ends the line */
    text->data[text->size] = 0;
  }
}

/* Writes an absolute path, as the text may be read from another folder. */
static void write_path(const char *path, flesh_text *text)
{
  char *whole = realpath(path, NULL);
  flesh_text_quote(text, whole ? whole : path);
  free(whole);
}

/* Writes the choices of a set. If may_be_all and more than half are chosen, writes "[all]", or the others with a
 * minus. */
static void write_set(const flesh_key *key, unsigned set, flesh_text *text)
{
  const char *before = "";
  int there = 0, count = 0;
  while (key->choices[count]) there += set >> count++ & 1;
  const int leaves_out = key->may_be_all && 2 * there > count;
  flesh_text_print(text, leaves_out && there == count ? "[all" : "[");
  for (int k = 0; k < count; k++) {
    if ((set >> k & 1) == (unsigned)leaves_out) continue;
    flesh_text_print(text, "%s%s%s", before, leaves_out ? "-" : "", key->choices[k]);
    before = ", ";
  }
  flesh_text_print(text, "]");
}

/* Writes a tree on one line. */
static void write_tree(const flesh_node *node, flesh_text *text)
{
  const char *before = "";
  if (node->kind == FLESH_NODE_SCALAR) {
    if (flesh_node_is_null(node)) flesh_text_print(text, "null");
    else flesh_text_quote(text, node->text);
    return;
  }
  flesh_text_print(text, node->kind == FLESH_NODE_LIST ? "[" : "{");
  for (const flesh_node *child = node->first; child; child = child->next, before = ", ") {
    flesh_text_print(text, "%s", before);
    if (child->key) flesh_text_quote(text, child->key);
    if (child->key) flesh_text_print(text, ": ");
    write_tree(child, text);
  }
  flesh_text_print(text, node->kind == FLESH_NODE_LIST ? "]" : "}");
}

static void write_value(const flesh_key *key, const void *value, int indent, flesh_text *text)
{
  switch (key->type) {
  case FLESH_KEY_NUMBER: write_number(*(const double *)value, text); break;
  case FLESH_KEY_VECTOR: write_vector(value, text); break;
  case FLESH_KEY_BOX:
    flesh_text_print(text, "[");
    write_vector(value, text);
    flesh_text_print(text, ", ");
    write_vector((const double *)value + 3, text);
    flesh_text_print(text, "]");
    break;
  case FLESH_KEY_INTEGER: flesh_text_print(text, "%d", *(const int *)value); break;
  case FLESH_KEY_BOOLEAN: flesh_text_print(text, *(const int *)value ? "true" : "false"); break;
  case FLESH_KEY_CHOICE: flesh_text_print(text, "%s", key->choices[*(const int *)value]); break;
  case FLESH_KEY_TEXT: flesh_text_quote(text, *(char *const *)value); break;
  case FLESH_KEY_PATH: write_path(*(char *const *)value, text); break;
  case FLESH_KEY_SET: write_set(key, *(const unsigned *)value, text); break;
  case FLESH_KEY_INTEGERS: write_integers(value, indent, text); break;
  case FLESH_KEY_OBJECTS: write_objects(key, value, indent, text); break;
  case FLESH_KEY_OBJECT:
    flesh_text_print(text, "\n");
    flesh_keys_write(key->children, value, indent + 2, text);
    if (!text->failed) text->data[--text->size] = 0; /* the caller ends the line */
    break;
  case FLESH_KEY_EFFECTS: key->list->write(value, indent, text); break;
  case FLESH_KEY_TREE: write_tree(*(const flesh_node *const *)value, text); break;
  }
}

void flesh_keys_write(const flesh_key *keys, const void *target, int indent, flesh_text *text)
{
  for (const flesh_key *key = keys; key->name; key++) {
    const void *value = (const char *)target + key->offset;
    if (value_absent(key, value)) continue;
    flesh_text_print(text, "%*s%s:", indent, "", key->name);
    if (key->type != FLESH_KEY_OBJECT && key->type != FLESH_KEY_OBJECTS &&
        key->type != FLESH_KEY_EFFECTS)
      flesh_text_print(text, " ");
    write_value(key, value, indent, text);
    flesh_text_print(text, "\n");
  }
}

void flesh_keys_visit_paths(const flesh_key *keys, const void *target,
                            void (*visit)(void *data, const char *path), void *data)
{
  for (; keys->name; keys++) {
    const void *value = (const char *)target + keys->offset;
    const flesh_objects *list = value;
    if (value_absent(keys, value)) continue;
    if (keys->type == FLESH_KEY_PATH) visit(data, *(char *const *)value);
    if (keys->type == FLESH_KEY_OBJECT) flesh_keys_visit_paths(keys->children, value, visit, data);
    for (int k = 0; keys->type == FLESH_KEY_OBJECTS && k < list->count; k++)
      flesh_keys_visit_paths(keys->children, (char *)list->values + (size_t)k * keys->child_size,
                             visit, data);
    if (keys->type == FLESH_KEY_EFFECTS) keys->list->visit_paths(list, visit, data);
  }
}
