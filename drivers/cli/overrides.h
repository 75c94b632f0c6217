/* overrides.h: the --set values of a command line, and further ones that commands add. If memory runs out for one,
 * reading a scene with them fails. */
#ifndef FLESH_CLI_OVERRIDES_H
#define FLESH_CLI_OVERRIDES_H

#include "cli/options.h"
#include "flesh/scene.h"
#include "scene/arena.h"

/* Zero-initialise. */
typedef struct flesh_overrides {
  flesh_texts texts; /* the target of a FLESH_OPTION_LIST */
  flesh_arena arena; /* of the texts that were added */
  int failed;
} flesh_overrides;

/* Starts with the texts of another list, which are borrowed. */
void flesh_overrides_copy(flesh_overrides *overrides, const flesh_texts *given);
void flesh_overrides_close(flesh_overrides *overrides);

/* Add key=value: with the value quoted as YAML text, or with the value as it is (NULL: memory ran out for it). */
void flesh_overrides_add_text(flesh_overrides *overrides, const char *key, const char *value);
void flesh_overrides_add(flesh_overrides *overrides, const char *key, const char *value);

/* Calls flesh_scene_read with these values. */
int flesh_overrides_read(const flesh_overrides *overrides, const char *path, flesh_scene **scene);

#endif
