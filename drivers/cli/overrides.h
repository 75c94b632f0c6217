/* overrides.h: the --set values of a command line. */
#ifndef FLESH_CLI_OVERRIDES_H
#define FLESH_CLI_OVERRIDES_H

#include "cli/options.h"

typedef struct flesh_overrides {
  flesh_texts texts; /* the target of a FLESH_OPTION_LIST; passed to flesh_scene_read */
  char **owned;      /* texts that were added */
  int owned_count, owned_room, room;
} flesh_overrides;

/* Room for `argc` texts of the command line; those that are added take more. */
int flesh_overrides_open(flesh_overrides *overrides, int argc);
/* With the texts of another list, borrowed. */
int flesh_overrides_copy(flesh_overrides *overrides, const flesh_texts *given);
void flesh_overrides_close(flesh_overrides *overrides);

/* Adds key=value with the value quoted as YAML text; key=value with a value taken as it stands. */
int flesh_overrides_add_text(flesh_overrides *overrides, const char *key, const char *value);
int flesh_overrides_add(flesh_overrides *overrides, const char *key, const char *value);

#endif
