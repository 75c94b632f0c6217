/* effect_list.c: the scene's list of effects: one-key mappings whose names are rows of the registry. */
#include "scene/effect_list.h"

#include <string.h>

#include "base/error.h"
#include "scene/words.h"

const flesh_effect_row *flesh_effect_row_named(const char *name)
{
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  for (int i = 0; i < count; i++)
    if (!strcmp(rows[i]->name, name)) return rows[i];
  return NULL;
}

int flesh_effect_list_normalise(flesh_arena *arena, flesh_node *list)
{
  if (!list || list->kind != FLESH_NODE_LIST) return FLESH_OK;
  for (flesh_node *item = list->first; item; item = item->next) {
    int bare = item->kind == FLESH_NODE_SCALAR && !flesh_node_is_null(item);
    int empty =
        item->kind == FLESH_NODE_MAPPING && item->count == 1 && flesh_node_is_null(item->first);
    if (bare) {
      flesh_node *name = flesh_arena_take(arena, sizeof *name);
      if (!name) return flesh_no_memory();
      *name = *item;
      name->key = item->text;
      name->key_line = item->line;
      name->key_column = item->column;
      name->next = NULL;
      item->kind = FLESH_NODE_MAPPING;
      flesh_node_append(item, name);
    }
    if ((bare || empty) && !item->first->removed) {
      item->first->kind = FLESH_NODE_MAPPING;
      item->first->text = "";
    }
  }
  return FLESH_OK;
}

static int unknown_effect(const flesh_node *node, const char *path)
{
  flesh_suggestion suggestion = {.word = node->key};
  char text[512], shown[FLESH_SHOW_SIZE];
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  for (int i = 0; i < count; i++) flesh_suggestion_offer(&suggestion, rows[i]->name);
  return flesh_node_fail_at_key(node, "%s is %s, which is no effect; %s", path,
                                flesh_word_show(node->key, shown),
                                flesh_suggestion_text(&suggestion, text));
}

static int read_entry(const flesh_key_reader *reader, const flesh_node *item, const char *path,
                      flesh_effect_entry *entry)
{
  char shown[FLESH_SHOW_SIZE];
  if (item->kind != FLESH_NODE_MAPPING || item->count != 1)
    return flesh_node_fail(item, "%s is %s%s; it must be one effect: \"- name: {its keys}\"", path,
                           flesh_node_show(item, shown),
                           item->kind == FLESH_NODE_MAPPING && item->count > 1 ? " of several keys"
                                                                               : "");
  const flesh_node *node = item->first;
  *entry = (flesh_effect_entry){.row = flesh_effect_row_named(node->key), .node = node};
  if (!entry->row) return unknown_effect(node, path);
  if (node->removed) return FLESH_OK;
  entry->path = flesh_key_path(reader->arena, path, node->key);
  entry->parameters = flesh_arena_take(reader->arena, entry->row->parameters_size);
  if (!entry->path || !entry->parameters) return flesh_no_memory();
  if (node->kind != FLESH_NODE_MAPPING) {
    char expected[FLESH_EXPECTATION_SIZE];
    flesh_key as_key = {.type = FLESH_KEY_OBJECT, .children = entry->row->keys};
    return flesh_node_fail(node, "%s is %s; it must be %s", entry->path,
                           flesh_node_show(node, shown), flesh_key_expectation(&as_key, expected));
  }
  return flesh_keys_read(reader, entry->row->keys, node, node, entry->path, entry->parameters);
}

/* Refuses a second effect of a kind that acts on the whole body and would count twice, such as inertia. */
static int check_once(const flesh_effect_entry *entries, int count)
{
  const flesh_effect_entry *added = &entries[count];
  for (int i = 0; added->row->once && i < count; i++)
    if (entries[i].row == added->row)
      return flesh_node_fail_at_key(added->node,
                                    "%.*s is %s again; it stands in %.*s already, and a second one "
                                    "would count twice",
                                    (int)strcspn(added->path, "."), added->path, added->row->name,
                                    (int)strcspn(entries[i].path, "."), entries[i].path);
  return FLESH_OK;
}

static int read_list(const flesh_key_reader *reader, const flesh_node *list, const char *path,
                           flesh_objects *entries)
{
  char shown[FLESH_SHOW_SIZE];
  *entries = (flesh_objects){0};
  if (list->kind != FLESH_NODE_LIST)
    return flesh_node_fail(list,
                           "%s is %s; it must be a list of effects, each \"- name: {its keys}\"",
                           path, flesh_node_show(list, shown));
  flesh_effect_entry *values =
      flesh_arena_take(reader->arena, (size_t)list->count * sizeof *values);
  if (!values) return flesh_no_memory();
  entries->values = values;
  int index = 0;
  for (const flesh_node *item = list->first; item; item = item->next, index++) {
    char *below = flesh_arena_print(reader->arena, "%s[%d]", path, index);
    if (!below) return flesh_no_memory();
    int status = read_entry(reader, item, below, &values[entries->count]);
    if (status) return status;
    if (!values[entries->count].parameters) continue; /* a removed effect is only checked */
    if ((status = check_once(values, entries->count))) return status;
    entries->count++;
  }
  return FLESH_OK;
}

static void write_list(const flesh_objects *entries, int indent, flesh_text *text)
{
  const flesh_effect_entry *entry = entries->values;
  for (int i = 0; i < entries->count; i++, entry++) {
    flesh_text_print(text, "\n%*s- %s:", indent + 2, "", entry->row->name);
    if (flesh_keys_absent(entry->row->keys, entry->parameters)) {
      flesh_text_print(text, " {}");
      continue;
    }
    flesh_text_print(text, "\n");
    flesh_keys_write(entry->row->keys, entry->parameters, indent + 6, text);
    if (!text->failed) text->data[--text->size] = 0;
  }
}

static void visit_paths(const flesh_objects *entries, void (*visit)(void *data, const char *path), void *data)
{
  const flesh_effect_entry *entry = entries->values;
  for (int k = 0; k < entries->count; k++, entry++)
    flesh_keys_visit_paths(entry->row->keys, entry->parameters, visit, data);
}

const flesh_key_list flesh_effect_key_list = {read_list, write_list, visit_paths};
