/* arena.h: memory that lives as long as a scene and is freed all at once; and text that grows. */
#ifndef FLESH_SCENE_ARENA_H
#define FLESH_SCENE_ARENA_H

#include <stddef.h>

typedef struct flesh_arena {
  struct flesh_arena_block *blocks;
} flesh_arena;

/* Returns zeroed memory, aligned for any type; NULL when there is none. Size 0 gives a valid pointer. */
void *flesh_arena_take(flesh_arena *arena, size_t size);
/* Returns a copy of `size` bytes followed by a 0; NULL when there is no memory. */
char *flesh_arena_text(flesh_arena *arena, const char *text, size_t size);
/* Returns the text that printf would print; NULL when there is no memory. */
char *flesh_arena_print(flesh_arena *arena, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void flesh_arena_free(flesh_arena *arena);

/* A text that grows; `failed` stays set after memory ran out. Start with {0}, free() `data`. */
typedef struct flesh_text {
  char *data; /* ended by 0; NULL while empty */
  size_t size, capacity;
  int failed;
} flesh_text;

void flesh_text_append(flesh_text *text, const char *data, size_t size);
void flesh_text_print(flesh_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Appends the value in double quotes, escaped so that both YAML and JSON read it back. */
void flesh_text_quote(flesh_text *text, const char *value);

#endif
