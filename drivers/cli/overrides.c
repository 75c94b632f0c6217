/* overrides.c: a list of "key=value" texts, some of the command line and some made here. */
#include "cli/overrides.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"

enum { EXTRA = 16 };

int flesh_overrides_open(flesh_overrides *overrides, int argc)
{
  *overrides = (flesh_overrides){.room = argc + EXTRA};
  overrides->texts.values = calloc((size_t)(argc + EXTRA), sizeof *overrides->texts.values);
  overrides->owned = calloc(EXTRA, sizeof *overrides->owned);
  if (overrides->texts.values && overrides->owned) return FLESH_OK;
  flesh_overrides_close(overrides);
  return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
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
  if (overrides->owned_count == EXTRA || overrides->texts.count == overrides->room)
    return flesh_fail(FLESH_ERR_ARGUMENT, "too many values are set; at most %d can be", EXTRA);
  char *text = malloc(strlen(key) + 2 * strlen(value) + 4), *end = text;
  if (!text) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  end = stpcpy(stpcpy(end, key), quoted ? "='" : "=");
  for (const char *c = value; *c; c++) {
    if (quoted && *c == '\'') *end++ = '\''; /* YAML doubles it */
    *end++ = *c;
  }
  strcpy(end, quoted ? "'" : "");
  overrides->owned[overrides->owned_count++] = text;
  overrides->texts.values[overrides->texts.count++] = text;
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
