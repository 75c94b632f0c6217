/* json_memory.c: jansson's memory, watched. */
#include "shared/json_memory.h"

#include <jansson.h>
#include <stdatomic.h>
#include <stdlib.h>

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
