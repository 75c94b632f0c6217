/* schema.h: the documentation of a part of a scene's keys. */
#ifndef FLESH_SCENE_SCHEMA_H
#define FLESH_SCENE_SCHEMA_H

#include "flesh/scene.h"
#include "scene/keys.h"

/* A part of the keys: a mapping (key->children), or a single value. */
typedef struct flesh_schema_part {
  const char *path, *doc;
  const flesh_key *keys;  /* keys of a mapping; NULL for a single value */
  const flesh_key *value; /* row of a single value or of the list of effects */
  const char *sample;     /* sample of an effect; NULL otherwise */
} flesh_schema_part;

/* A key to write. `default_value` NULL: required; "": none. */
typedef struct flesh_schema_row {
  const char *path; /* path of the mapping that has the key */
  const flesh_key *key;
  const char *expected, *default_value;
} flesh_schema_row;

/* Functions that write the introduction, a section (`doc` may be NULL; has_keys -1: a list of effects), a row and an
 * effect's example in one style. */
typedef struct flesh_schema_style {
  int everywhere; /* 1: a table used in several places is written at each of them */
  void (*introduction)(flesh_text *text);
  void (*section)(flesh_text *text, const char *path, const char *doc, int has_keys);
  void (*row)(flesh_text *text, const flesh_schema_row *row);
  void (*example)(flesh_text *text, const char *name, const char *sample);
} flesh_schema_style;

extern const flesh_schema_style flesh_schema_markdown, flesh_schema_man, flesh_schema_paths;

/* Writes the part as JSON Schema, draft 2020-12. */
void flesh_schema_json(flesh_arena *arena, const flesh_schema_part *part, flesh_text *text);

/* Like flesh_scene_schema, but for one section. */
int flesh_scene_schema_section(flesh_schema_format format, const char *section, char **text);

#endif
