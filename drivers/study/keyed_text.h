/* keyed_text.h: files of YAML that a table of keys (base/key.h) describes, as the specs of sweeps. */
#ifndef FLESH_STUDY_KEYED_TEXT_H
#define FLESH_STUDY_KEYED_TEXT_H

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

#endif
