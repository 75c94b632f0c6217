/* settings.h: what specs have in common: YAML files described by a table of keys (base/key.h), values of scene keys in
 * the form of --set, checking that a scene accepts them, and fingerprints of scenes. */
#ifndef FLESH_STUDY_SETTINGS_H
#define FLESH_STUDY_SETTINGS_H

#include <sha256.h>

#include "flesh/scene.h"
#include "scene/keys.h"

typedef struct flesh_keyed_text {
  const char *path; /* named in error messages; paths within the text are relative to its folder */
  const char *text;
  size_t size;
  const char *what; /* name for the text, as "the spec" */
} flesh_keyed_text;

/* Reads the text's mapping into `target`. *root becomes the tree of the text, for checks beyond the table; both live in
 * the arena. FLESH_ERR_ARGUMENT with file, line, key, value and what is valid. */
int flesh_keyed_text_read(flesh_arena *arena, const flesh_keyed_text *text, const flesh_key *keys, flesh_node **root,
                          void *target);
/* Reads the file *path in the same way, as "the spec". *path becomes a copy in the arena; *text the file's content,
 * which the caller frees. Also FLESH_ERR_FILE. */
int flesh_spec_read(flesh_arena *arena, const char **path, char **text, const flesh_key *keys, flesh_node **root, void *target);

/* Keys with their values, "key=value", and the places of the values in the spec. */
typedef struct flesh_settings {
  int count;
  const char **texts;
  const flesh_node **nodes;
} flesh_settings;

/* Returns the value of a key in the form of --set; paths, which in a spec are relative to its folder, become relative
 * to the working directory. `key` may be "scene". NULL when out of memory. */
const char *flesh_setting_value(flesh_arena *arena, const char *spec, const char *key, const flesh_node *value);
/* Reads a mapping of keys to values, which may be NULL or empty. FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
int flesh_settings_read(flesh_arena *arena, const char *spec, const flesh_node *set, flesh_settings *settings);

/* Checks that the scene's keys accept the overrides; an error is reported at `place`, where the last override
 * stands. */
int flesh_settings_check(const flesh_node *place, const char *scene, int count, const char **overrides);
/* Returns the name of a setting without one: the last word of its key. *whole, in the arena, is the key made one word,
 * which ends with the name. NULL when out of memory. */
char *flesh_setting_name(flesh_arena *arena, const char *key, char **whole);
/* FLESH_ERR_ARGUMENT unless the name consists of letters, digits and _, and does not begin with a digit. */
int flesh_setting_check_name(const flesh_node *place, const char *name);

/* A table of keys in the help; a NULL title ends a list of them. */
typedef struct flesh_settings_part {
  const char *title; /* "Keys of a spec" */
  const flesh_key *keys;
  const flesh_key *apart; /* table below it that is another part; NULL: none */
} flesh_settings_part;
/* Returns as new text the details of a command's help, with its keys between `before` and `after`; NULL when out of
 * memory. */
char *flesh_settings_help(const char *before, const flesh_settings_part *parts, const char *after);

/* Adds a file to a digest. */
int flesh_settings_hash_file(SHA2_CTX *context, const char *path);

/* Names of the spacings of a spec's ranges and parameters, in the order of the enum; ended by NULL. */
enum { FLESH_LINEAR, FLESH_LOGARITHMIC };
extern const char *const flesh_spacings[];

enum { FLESH_STUDY_FINGERPRINT = 65 };

/* Computes the SHA-256 of every value in force, the mesh and the state at the start of the scene. `path` names the
 * scene in error messages. FLESH_ERR_MEMORY. */
int flesh_study_fingerprint(const flesh_scene *scene, const char *path, char text[FLESH_STUDY_FINGERPRINT]);

#endif
