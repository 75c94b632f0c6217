/* schema.c: finds a part of the keys and writes it as JSON Schema or in one of the styles. */
#include "scene/schema.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "scene/effect_list.h"
#include "scene/scene_keys.h"
#include "scene/words.h"

static const flesh_key *effects_key(void)
{
  return flesh_key_at(flesh_scene_table, offsetof(flesh_scene_keys, effects));
}

static int is_mapping(const flesh_key *key)
{
  return key->type == FLESH_KEY_OBJECT || key->type == FLESH_KEY_OBJECTS;
}

/* Returns the path of a key; keys of a list's items have the list's path with []. */
static char *path_below(flesh_arena *arena, const char *path, const flesh_key *key)
{
  return flesh_arena_print(arena, "%s%s%s%s", path, *path ? "." : "", key->name,
                           key->type == FLESH_KEY_OBJECTS ? "[]" : "");
}

static int effect_part(flesh_arena *arena, const flesh_effect_row *row, flesh_schema_part *part)
{
  *part = (flesh_schema_part){flesh_key_path(arena, effects_key()->name, row->name), row->doc,
                              row->keys, NULL, row->sample};
  return part->path ? FLESH_OK : flesh_no_memory();
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
  if (at_top) flesh_suggestion_offer(&suggestion, "results");
  return flesh_fail(FLESH_ERR_ARGUMENT, "%.80s is no section of the schema; %s", section,
                    flesh_suggestion_text(&suggestion, text));
}

/* Finds the part for "body.material", "solver.threads", "effects.pin", or "pin"; NULL or "": everything. The arena
 * holds the texts. FLESH_ERR_ARGUMENT with the nearest name. */
static int find(flesh_arena *arena, const char *section, flesh_schema_part *part)
{
  *part = (flesh_schema_part){
      .path = "", .keys = flesh_scene_table, .doc = "A scene is a mapping in YAML or JSON."};
  for (const char *at = section ? section : ""; *at;) {
    size_t size = strcspn(at, ".");
    char *word = flesh_arena_text(arena, at, size);
    if (!word) return flesh_no_memory();
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
    if (!part->path) return flesh_no_memory();
  }
  return FLESH_OK;
}

/* State of writing, with the tables written so far, so that a table used in several places is written once. */
typedef struct writer {
  flesh_arena *arena;
  flesh_text *text;
  const flesh_schema_style *style;
  int count;
  struct {
    const flesh_key *keys;
    const char *path;
  } seen[32];
} writer;

static const char *seen_at(const writer *w, const flesh_key *keys)
{
  for (int i = 0; i < w->count && !w->style->everywhere; i++)
    if (w->seen[i].keys == keys) return w->seen[i].path;
  return NULL;
}

static void write_row(writer *w, const char *path, const flesh_key *key)
{
  char expected[FLESH_EXPECTATION_SIZE];
  flesh_schema_row row = {.path = path, .key = key, .default_value = key->default_value};
  if (is_mapping(key)) {
    const char *seen = seen_at(w, key->children), *below = seen ? seen : path_below(w->arena, path, key);
    row.expected = flesh_arena_print(w->arena, "%s, see `%s`",
                                     key->type == FLESH_KEY_OBJECTS ? "a list of mappings" : "a mapping",
                                     below ? below : "");
    if (row.default_value) row.default_value = "";
  } else {
    row.expected = flesh_key_expectation(key, expected);
  }
  if (!row.expected) w->text->failed = 1;
  else w->style->row(w->text, &row);
}

static void write_mapping(writer *w, const flesh_schema_part *part);

static void write_effects(writer *w)
{
  const flesh_key *key = effects_key();
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  w->style->section(w->text, key->name, key->doc, -1);
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
  w->style->section(w->text, *part->path ? part->path : "scene", part->doc ? part->doc : "", part->keys->name != NULL);
  for (const flesh_key *key = part->keys; key->name; key++) write_row(w, part->path, key);
  if (part->sample) {
    const char *name = strrchr(part->path, '.');
    w->style->example(w->text, name ? name + 1 : part->path, part->sample);
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

static void write(flesh_arena *arena, const flesh_schema_style *style, const flesh_schema_part *part, flesh_text *text)
{
  writer w = {.arena = arena, .text = text, .style = style};
  if (!*part->path) style->introduction(text);
  if (part->keys) {
    write_mapping(&w, part);
  } else if (part->value->type == FLESH_KEY_EFFECTS) {
    write_effects(&w);
  } else {
    style->section(text, part->path, NULL, 1);
    write_row(&w, part->path, part->value);
  }
}

static const flesh_schema_style *style_of(flesh_schema_format format)
{
  return format == FLESH_SCHEMA_MAN     ? &flesh_schema_man
         : format == FLESH_SCHEMA_PATHS ? &flesh_schema_paths
                                        : &flesh_schema_markdown;
}

int flesh_scene_schema_section(flesh_schema_format format, const char *section, char **text)
{
  *text = NULL;
  flesh_arena arena = {0};
  flesh_text made = {0};
  flesh_schema_part part;
  int status = find(&arena, section, &part);
  if (!status) {
    if (format == FLESH_SCHEMA_JSON) flesh_schema_json(&arena, &part, &made);
    else write(&arena, style_of(format), &part, &made);
    if (made.failed) status = flesh_no_memory();
  }
  flesh_arena_free(&arena);
  if (status) {
    free(made.data);
    return status;
  }
  /* Drops the blank line before the first section. */
  size_t blank = made.size && made.data[0] == '\n';
  memmove(made.data, made.data + blank, made.size + 1 - blank);
  *text = made.data;
  return FLESH_OK;
}

int flesh_scene_schema(flesh_schema_format format, char **text)
{
  FLESH_NEED({text, "text"});
  return flesh_scene_schema_section(format, NULL, text);
}
