/* json_memory.c: jansson's memory, watched, and texts for it. */
#include "cli/json_memory.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "cli/safe_text.h"

static atomic_int lacks;

static void *take(size_t size)
{
  void *memory = malloc(size);
  if (!memory) lacks = 1;
  return memory;
}

void flesh_json_watch(void) { json_set_alloc_funcs(take, free); }

void flesh_json_note_lack(void) { lacks = 1; }

int flesh_json_lacks(void) { return lacks; }

json_t *flesh_json_bytes(const char *bytes, size_t size)
{
  char *copy = malloc(size + 1);
  if (!copy) {
    flesh_json_note_lack();
    return NULL;
  }
  memcpy(copy, bytes, size);
  copy[size] = 0;
  for (size_t k = 0; k < size;) {
    const int length = flesh_text_letter(copy + k);
    if (!length) copy[k] = copy[k] ? '?' : ' ';
    k += length ? (size_t)length : 1;
  }
  json_t *value = json_string(copy);
  free(copy);
  return value;
}

json_t *flesh_json_text(const char *text) { return flesh_json_bytes(text, strlen(text)); }
