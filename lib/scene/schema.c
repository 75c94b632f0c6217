/* schema.c: finds the part of the keys that is asked for and writes it as Markdown. */
#include "scene/schema.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "scene/effect_list.h"
#include "scene/scene_keys.h"
#include "scene/words.h"

static int no_memory(void)
{
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory while writing the schema");
}

static const flesh_key *effects_key(void)
{
  return flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, effects));
}

static int is_mapping(const flesh_key *key)
{
  return key->type == FLESH_KEY_OBJECT || key->type == FLESH_KEY_OBJECTS;
}

/* The keys of the list's items have the path of the list with []. */
static char *path_below(flesh_arena *arena, const char *path, const flesh_key *key)
{
  return flesh_arena_print(arena, "%s%s%s%s", path, *path ? "." : "", key->name,
                           key->type == FLESH_KEY_OBJECTS ? "[]" : "");
}

static int effect_part(flesh_arena *arena, const flesh_effect_row *row, flesh_schema_part *part)
{
  *part = (flesh_schema_part){flesh_key_path(arena, effects_key()->name, row->name), row->doc,
                              row->keys, NULL, row->sample};
  return part->path ? FLESH_OK : no_memory();
}

static int unknown(const char *section, const char *word, const flesh_schema_part *above)
{
  flesh_suggestion suggestion = {.word = word};
  char text[512];
  int count, at_top = above->keys == flesh_scene_table;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  for (const flesh_key *key = above->keys; key && key->name; key++)
    flesh_suggestion_offer(&suggestion, key->name);
  for (int i = 0; i < count && (at_top || above->value == effects_key()); i++)
    flesh_suggestion_offer(&suggestion, rows[i]->name);
  return flesh_fail(FLESH_ERR_ARGUMENT, "%.80s is no section of the schema; %s", section,
                    flesh_suggestion_text(&suggestion, text));
}

int flesh_schema_find(flesh_arena *arena, const char *section, flesh_schema_part *part)
{
  *part = (flesh_schema_part){
      .path = "", .keys = flesh_scene_table, .doc = "A scene is a mapping in YAML or JSON."};
  for (const char *at = section ? section : ""; *at;) {
    size_t size = strcspn(at, ".");
    char *word = flesh_arena_text(arena, at, size);
    if (!word) return no_memory();
    at += size + (at[size] == '.');
    if (size > 2 && !strcmp(word + size - 2, "[]")) word[size - 2] = 0;
    const flesh_key *key = part->keys ? flesh_key_named(part->keys, word) : NULL;
    const flesh_effect_row *row = flesh_effect_row_named(word);
    int names_effect = row && (part->keys == flesh_scene_table || part->value == effects_key());
    int status = FLESH_OK;
    if (key && is_mapping(key))
      *part = (flesh_schema_part){path_below(arena, part->path, key), key->doc, key->children, NULL,
                                  NULL};
    else if (key)
      *part = (flesh_schema_part){path_below(arena, part->path, key), key->doc, NULL, key, NULL};
    else if (names_effect) status = effect_part(arena, row, part);
    else return unknown(section, word, part);
    if (status) return status;
    if (!part->path) return no_memory();
  }
  return FLESH_OK;
}

/* Tables that have been written, so that a table of several places is written once. */
typedef struct writer {
  flesh_arena *arena;
  flesh_text *text;
  int count;
  struct {
    const flesh_key *keys;
    const char *path;
  } seen[32];
} writer;

static const char *seen_at(const writer *w, const flesh_key *keys)
{
  for (int i = 0; i < w->count; i++)
    if (w->seen[i].keys == keys) return w->seen[i].path;
  return NULL;
}

static void write_row(writer *w, const char *path, const flesh_key *key)
{
  char expected[FLESH_EXPECTATION_SIZE];
  flesh_text_print(w->text, "| `%s` | ", key->name);
  const char *below = is_mapping(key) ? path_below(w->arena, path, key) : NULL;
  const char *seen = is_mapping(key) ? seen_at(w, key->children) : NULL;
  if (below)
    flesh_text_print(w->text, "%s, see `%s`",
                     key->type == FLESH_KEY_OBJECTS ? "a list of mappings" : "a mapping",
                     seen ? seen : below);
  else flesh_text_print(w->text, "%s", flesh_key_expectation(key, expected));
  if (!key->default_value) flesh_text_print(w->text, " | required | ");
  else if (!*key->default_value || is_mapping(key)) flesh_text_print(w->text, " | | ");
  else flesh_text_print(w->text, " | `%s` | ", key->default_value);
  flesh_text_print(w->text, "%s |\n", key->doc ? key->doc : "");
}

static void write_mapping(writer *w, const flesh_schema_part *part);

static void write_effects(writer *w)
{
  const flesh_key *key = effects_key();
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  flesh_text_print(w->text, "\n## %s\n\n%s\n", key->name, key->doc);
  for (int i = 0; i < count; i++) {
    flesh_schema_part part;
    if (effect_part(w->arena, rows[i], &part)) {
      w->text->failed = 1;
      return;
    }
    write_mapping(w, &part);
  }
}

static void write_mapping(writer *w, const flesh_schema_part *part)
{
  if (seen_at(w, part->keys)) return;
  if (w->count < (int)(sizeof w->seen / sizeof *w->seen) && part->keys->name) {
    w->seen[w->count].keys = part->keys;
    w->seen[w->count++].path = part->path;
  }
  flesh_text_print(w->text, "\n## %s\n\n%s\n", *part->path ? part->path : "scene",
                   part->doc ? part->doc : "");
  if (!part->keys->name) flesh_text_print(w->text, "\nIt has no keys.\n");
  else flesh_text_print(w->text, "\n| key | value | default | meaning |\n|---|---|---|---|\n");
  for (const flesh_key *key = part->keys; key->name; key++) write_row(w, part->path, key);
  if (part->sample) {
    const char *name = strrchr(part->path, '.');
    flesh_text_print(w->text, "\nExample: `- %s: %s`\n", name ? name + 1 : part->path,
                     part->sample);
  }
  for (const flesh_key *key = part->keys; key->name; key++) {
    if (key->type == FLESH_KEY_EFFECTS) write_effects(w);
    if (!is_mapping(key)) continue;
    flesh_schema_part below = {path_below(w->arena, part->path, key), key->doc, key->children, NULL,
                               NULL};
    if (!below.path) {
      w->text->failed = 1;
      return;
    }
    write_mapping(w, &below);
  }
}

static const char introduction[] = "# Keys of a scene\n"
                                   "\n"
                                   "A number may be written as a fraction a/b (1/60; in JSON "
                                   "\"1/60\"). Units are SI. Paths are relative to the\n"
                                   "scene's file; in `--set` to the working directory. `--set "
                                   "path=value` changes a key: `body.material.young=1e5`,\n"
                                   "`body.regions[0].density=900` (items count from 0, one past "
                                   "the end appends), `effects.gravity.acceleration[2]=0`\n"
                                   "(the first effect of that name, appended when there is none), "
                                   "`effects.pin[1].until=2` (the second pin),\n"
                                   "`effects[3].pin.until=2` (the fourth effect). The value is "
                                   "YAML; `null` takes the key, item or effect away.\n"
                                   "Several apply in their order.\n";

void flesh_schema_markdown(flesh_arena *arena, const flesh_schema_part *part, flesh_text *text)
{
  writer w = {.arena = arena, .text = text};
  if (!*part->path) flesh_text_print(text, "%s", introduction);
  if (part->keys) {
    write_mapping(&w, part);
  } else if (part->value->type == FLESH_KEY_EFFECTS) {
    write_effects(&w);
  } else {
    flesh_text_print(text, "\n## %s\n\n| key | value | default | meaning |\n|---|---|---|---|\n",
                     part->path);
    write_row(&w, part->path, part->value);
  }
}

int flesh_scene_schema_section(flesh_schema_format format, const char *section, char **text)
{
  *text = NULL;
  flesh_arena arena = {0};
  flesh_text made = {0};
  flesh_schema_part part;
  int status = flesh_schema_find(&arena, section, &part);
  if (!status) {
    if (format == FLESH_SCHEMA_JSON) flesh_schema_json(&arena, &part, &made);
    else flesh_schema_markdown(&arena, &part, &made);
    if (made.failed) status = no_memory();
  }
  flesh_arena_free(&arena);
  if (status) {
    free(made.data);
    return status;
  }
  /* A section begins with the blank line that separates sections. */
  size_t blank = made.data[0] == '\n';
  memmove(made.data, made.data + blank, made.size + 1 - blank);
  *text = made.data;
  return FLESH_OK;
}

int flesh_scene_schema(flesh_schema_format format, char **text)
{
  FLESH_NEED({text, "text"});
  return flesh_scene_schema_section(format, NULL, text);
}
