/* keys.h: uses tables of keys (base/key.h) to read a mapping into a struct, to write a struct as a mapping, and to say
 * in words what is valid. */
#ifndef FLESH_SCENE_KEYS_H
#define FLESH_SCENE_KEYS_H

#include "base/key.h"
#include "scene/node.h"

typedef struct flesh_key_reader {
  flesh_arena *arena; /* holds texts and lists */
  const char
      *directory; /* folder to which paths in a file are relative; NULL or "": the working directory */
} flesh_key_reader;

/* How a list whose entries have their own keys is read, written, and searched for names of files. */
typedef struct flesh_key_list {
  int (*read)(const flesh_key_reader *reader, const flesh_node *list, const char *path, flesh_objects *entries);
  void (*write)(const flesh_objects *entries, int indent, flesh_text *text);
  void (*visit_paths)(const flesh_objects *entries, void (*visit)(void *data, const char *path), void *data);
} flesh_key_list;

/* Reads `mapping` (NULL: none given, defaults only) into `target`. `path` is the key of the mapping ("body.material";
 * "" at the top), `place` the node at which a missing key is reported. FLESH_ERR_ARGUMENT with place, full key, value
 * and what is valid; FLESH_ERR_MEMORY. */
int flesh_keys_read(const flesh_key_reader *reader, const flesh_key *keys,
                    const flesh_node *mapping, const flesh_node *place, const char *path,
                    void *target);

/* Appends the values of `target` that are not absent as YAML, one key per line, indented. */
void flesh_keys_write(const flesh_key *keys, const void *target, int indent, flesh_text *text);
/* Calls visit(data, path) for every file that a key of `target` names, keys of effects included. */
void flesh_keys_visit_paths(const flesh_key *keys, const void *target,
                            void (*visit)(void *data, const char *path), void *data);
/* Returns whether all values are absent, so that there is nothing to write. */
int flesh_keys_absent(const flesh_key *keys, const void *target);

/* Return the row with that name, or with the value at `offset`; NULL: none. */
const flesh_key *flesh_key_named(const flesh_key *keys, const char *name);
const flesh_key *flesh_key_at(const flesh_key *keys, size_t offset);

/* Says what is valid, as in "a number > 0 [kg/m^3]", to end the sentence "it must be ...". Returns `text`. */
enum { FLESH_EXPECTATION_SIZE = 400 };
const char *flesh_key_expectation(const flesh_key *key, char text[FLESH_EXPECTATION_SIZE]);
/* Returns whether the key takes infinity, that is, its default is infinite. */
int flesh_key_takes_infinity(const flesh_key *key);

/* Returns "path.name", or "name" at the top; NULL when there is no memory. */
char *flesh_key_path(flesh_arena *arena, const char *path, const char *name);
/* Fails with FLESH_ERR_ARGUMENT and "place: path is VALUE; it must be ...". */
int flesh_key_fail(const flesh_key *key, const flesh_node *node, const char *path);
/* Makes a tree of a default's text; a scalar needs no parser. FLESH_ERR_MEMORY. */
int flesh_key_default(flesh_arena *arena, const flesh_key *key, flesh_node **node);

#endif
