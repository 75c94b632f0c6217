/* overrides.c: a list of "key=value" texts, some of the command line and some made here. */
#include "cli/overrides.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"

int flesh_overrides_open(flesh_overrides *overrides, int argc)
{
  *overrides = (flesh_overrides){.room = argc + 1};
  overrides->texts.values = calloc((size_t)argc + 1, sizeof *overrides->texts.values);
  return overrides->texts.values ? FLESH_OK : flesh_no_memory();
}

int flesh_overrides_copy(flesh_overrides *overrides, const flesh_texts *given)
{
  const int status = flesh_overrides_open(overrides, given->count);
  for (int k = 0; k < given->count && !status; k++) overrides->texts.values[overrides->texts.count++] = given->values[k];
  return status;
}

void flesh_overrides_close(flesh_overrides *overrides)
{
  for (int o = 0; o < overrides->owned_count; o++) free(overrides->owned[o]);
  free(overrides->owned);
  free(overrides->texts.values);
  *overrides = (flesh_overrides){0};
}

static int add(flesh_overrides *overrides, const char *key, const char *value, int quoted)
{
  flesh_texts *texts = &overrides->texts;
  if (!flesh_grow(&texts->values, sizeof *texts->values, texts->count, &overrides->room) ||
      !flesh_grow(&overrides->owned, sizeof *overrides->owned, overrides->owned_count, &overrides->owned_room))
    return flesh_no_memory();
  char *text = malloc(strlen(key) + 2 * strlen(value) + 4), *end = text;
  if (!text) return flesh_no_memory();
  end = stpcpy(stpcpy(end, key), quoted ? "='" : "=");
  for (const char *c = value; *c; c++) {
    if (quoted && *c == '\'') *end++ = '\''; /* YAML doubles it */
    *end++ = *c;
  }
  strcpy(end, quoted ? "'" : "");
  overrides->owned[overrides->owned_count++] = text;
  texts->values[texts->count++] = text;
  return FLESH_OK;
}

int flesh_overrides_add_text(flesh_overrides *overrides, const char *key, const char *value)
{
  return add(overrides, key, value, 1);
}

int flesh_overrides_add(flesh_overrides *overrides, const char *key, const char *value)
{
  return add(overrides, key, value, 0);
}
