/* overrides.c: a list of "key=value" texts, from the command line and from commands. */
#include "cli/overrides.h"

#include <sqlite3.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/memory.h"

void flesh_overrides_copy(flesh_overrides *overrides, const flesh_texts *given)
{
  flesh_texts *texts = &overrides->texts;
  *overrides = (flesh_overrides){0};
  overrides->failed = !flesh_grow_to(&texts->values, sizeof *texts->values, given->count, &texts->room);
  for (int k = 0; k < given->count && !overrides->failed; k++) texts->values[texts->count++] = given->values[k];
}

void flesh_overrides_close(flesh_overrides *overrides)
{
  flesh_arena_free(&overrides->arena);
  free(overrides->texts.values);
  *overrides = (flesh_overrides){0};
}

void flesh_overrides_add(flesh_overrides *overrides, const char *key, const char *value)
{
  flesh_texts *texts = &overrides->texts;
  const char *text = value ? flesh_arena_print(&overrides->arena, "%s=%s", key, value) : NULL;
  overrides->failed = overrides->failed || !text ||
                      !flesh_grow(&texts->values, sizeof *texts->values, texts->count, &texts->room);
  if (!overrides->failed) texts->values[texts->count++] = text;
}

void flesh_overrides_add_text(flesh_overrides *overrides, const char *key, const char *value)
{
  char *quoted = sqlite3_mprintf("%Q", value); /* YAML quotes texts as SQL does */
  flesh_overrides_add(overrides, key, quoted);
  sqlite3_free(quoted);
}

int flesh_overrides_read(const flesh_overrides *overrides, const char *path, flesh_scene **scene)
{
  return overrides->failed ? flesh_no_memory()
                           : flesh_scene_read(path, overrides->texts.count, overrides->texts.values, scene);
}
