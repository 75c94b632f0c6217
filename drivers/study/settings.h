/* settings.h: what specs share: files of YAML that a table of keys (base/key.h) describes, values of keys of scenes as --set
 * takes them, whether scenes take them, and what a scene is. */
#ifndef FLESH_STUDY_SETTINGS_H
#define FLESH_STUDY_SETTINGS_H

#include <sha256.h>
#include <stdio.h>

#include "flesh/scene.h"
#include "scene/keys.h"

typedef struct flesh_keyed_text {
  const char *path; /* named in sentences; paths within the text are relative to its folder */
  const char *text;
  size_t size;
  const char *what; /* "the spec" */
} flesh_keyed_text;

/* Reads the text's mapping into `target`. Gives the text's tree in *root, for what the table cannot check; both live in
 * the arena. FLESH_ERR_ARGUMENT with file, line, key, value and what is valid. */
int flesh_keyed_text_read(flesh_arena *arena, const flesh_keyed_text *text, const flesh_key *keys, flesh_node **root,
                          void *target);
/* Reads the file *path so, as "the spec"; *path becomes a copy in the arena, *text what the file holds, for the caller to free.
 * FLESH_ERR_FILE too. */
int flesh_spec_read(flesh_arena *arena, const char **path, char **text, const flesh_key *keys, flesh_node **root, void *target);

/* Keys and their values, "key=value", with the places of the values in the spec. */
typedef struct flesh_settings {
  int count;
  const char **texts;
  const flesh_node **nodes;
} flesh_settings;

/* The value of a key as --set takes it; paths, which there are relative to the working directory, from the folder of the
 * spec. `key` may be "scene". NULL without memory. */
const char *flesh_setting_value(flesh_arena *arena, const char *spec, const char *key, const flesh_node *value);
/* Reads a mapping of keys to values, which may be NULL or empty. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_settings_read(flesh_arena *arena, const char *spec, const flesh_node *set, flesh_settings *settings);

/* Whether the scene's keys take the overrides, the last of which stands at `place`, where an error is reported. */
int flesh_settings_check(const flesh_node *place, const char *scene, int count, const char **overrides);
/* The name that a key gives what has none: its last word. *whole, in the arena, is the key as one word, which the name is the
 * end of. NULL without memory. */
char *flesh_setting_name(flesh_arena *arena, const char *key, char **whole);
/* FLESH_ERR_ARGUMENT for a name that is no word of letters, digits and _, or begins with a digit. */
int flesh_setting_check_name(const flesh_node *place, const char *name);

/* Prints a table of keys for the help, with those below them; `apart`: a table that is printed by itself. */
void flesh_settings_describe(FILE *stream, const flesh_key *keys, const flesh_key *apart);
/* The details of a command's help, with its keys amid them. Returns new; NULL without memory. */
char *flesh_settings_help(const char *before, void (*describe_keys)(FILE *), const char *after);

/* Adds a file to a digest. */
int flesh_settings_hash_file(SHA2_CTX *context, const char *path);

/* How a spec's ranges and parameters are spaced, in the order of the names, which a NULL ends. */
enum { FLESH_LINEAR, FLESH_LOGARITHMIC };
extern const char *const flesh_spacings[];

enum { FLESH_STUDY_FINGERPRINT = 65 };

/* SHA-256 of every value in force, of the mesh and of the state that the scene starts from. `path` is the scene's, for
 * sentences. FLESH_ERR_MEMORY. */
int flesh_study_fingerprint(const flesh_scene *scene, const char *path, char text[FLESH_STUDY_FINGERPRINT]);

#endif
