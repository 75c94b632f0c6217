/* keyed_text.c: reads YAML by a table of keys. */
#include "study/keyed_text.h"

#include <string.h>

#include "base/error.h"

int flesh_keyed_text_read(flesh_arena *arena, const flesh_keyed_text *text, const flesh_key *keys, flesh_node **root,
                          void *target)
{
  const flesh_source source = {text->path, 0};
  const flesh_key whole = {.type = FLESH_KEY_OBJECT, .children = keys};
  char expected[FLESH_EXPECTATION_SIZE];
  int status = flesh_yaml_parse(arena, text->text, text->size, &source, root);
  if (status) return status;
  if (!*root)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s:1:1: %s is empty; it must be %s", text->path, text->what,
                      flesh_key_expectation(&whole, expected));
  if ((*root)->kind != FLESH_NODE_MAPPING) return flesh_key_fail(&whole, *root, text->what);
  const char *slash = strrchr(text->path, '/');
  const size_t folder = slash ? (size_t)(slash - text->path) + (slash == text->path) : 0;
  const flesh_key_reader reader = {arena, flesh_arena_text(arena, text->path, folder)};
  if (!reader.directory) return flesh_fail(FLESH_ERR_MEMORY, "out of memory while reading %s", text->what);
  return flesh_keys_read(&reader, keys, *root, *root, "", target);
}
