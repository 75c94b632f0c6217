/* arena.c: memory that lives as long as a scene and is freed all at once; and text that grows. */
#include "scene/arena.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_SIZE = 16384, ALIGNMENT = _Alignof(max_align_t) };

typedef struct flesh_arena_block {
  struct flesh_arena_block *next;
  size_t used, size;
  _Alignas(max_align_t) char data[];
} flesh_arena_block;

void *flesh_arena_take(flesh_arena *arena, size_t size)
{
  if (size > SIZE_MAX / 2) return NULL;
  size = (size + ALIGNMENT) / ALIGNMENT * ALIGNMENT;
  flesh_arena_block *block = arena->blocks;
  if (!block || block->size - block->used < size) {
    size_t room = size > BLOCK_SIZE ? size : BLOCK_SIZE;
    block = calloc(1, sizeof *block + room);
    if (!block) return NULL;
    *block = (flesh_arena_block){.next = arena->blocks, .size = room};
    arena->blocks = block;
  }
  void *memory = block->data + block->used;
  block->used += size;
  return memory;
}

char *flesh_arena_text(flesh_arena *arena, const char *text, size_t size)
{
  char *copy = flesh_arena_take(arena, size + 1);
  if (copy && size) memcpy(copy, text, size);
  return copy;
}

char *flesh_arena_print(flesh_arena *arena, const char *format, ...)
{
  va_list args, again;
  va_start(args, format);
  va_copy(again, args);
  int size = vsnprintf(NULL, 0, format, args);
  va_end(args);
  char *copy = size < 0 ? NULL : flesh_arena_take(arena, (size_t)size + 1);
  if (copy) vsnprintf(copy, (size_t)size + 1, format, again);
  va_end(again);
  return copy;
}

void flesh_arena_free(flesh_arena *arena)
{
  while (arena->blocks) {
    flesh_arena_block *next = arena->blocks->next;
    free(arena->blocks);
    arena->blocks = next;
  }
}

static int reserve(flesh_text *text, size_t more)
{
  if (text->failed) return 0;
  if (text->capacity - text->size > more) return 1;
  size_t capacity = 2 * text->capacity + more + 256;
  char *data = realloc(text->data, capacity);
  if (!data) {
    text->failed = 1;
    return 0;
  }
  text->data = data;
  text->capacity = capacity;
  return 1;
}

void flesh_text_append(flesh_text *text, const char *data, size_t size)
{
  if (!reserve(text, size)) return;
  memcpy(text->data + text->size, data, size);
  text->size += size;
  text->data[text->size] = 0;
}

void flesh_text_print(flesh_text *text, const char *format, ...)
{
  va_list args, again;
  va_start(args, format);
  va_copy(again, args);
  int size = vsnprintf(NULL, 0, format, args);
  va_end(args);
  if (size < 0) {
    text->failed = 1;
  } else if (reserve(text, (size_t)size)) {
    vsnprintf(text->data + text->size, (size_t)size + 1, format, again);
    text->size += (size_t)size;
  }
  va_end(again);
}

void flesh_text_quote(flesh_text *text, const char *value)
{
  flesh_text_append(text, "\"", 1);
  for (; *value; value++) {
    unsigned char c = (unsigned char)*value;
    if (c == '"' || c == '\\') flesh_text_print(text, "\\%c", c);
    else if (c == '\n') flesh_text_append(text, "\\n", 2);
    else if (c == '\t') flesh_text_append(text, "\\t", 2);
    else if (c < 32 || c == 127) flesh_text_print(text, "\\u%04x", c);
    else flesh_text_append(text, value, 1);
  }
  flesh_text_append(text, "\"", 1);
}
