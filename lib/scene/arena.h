/* arena.h: memory that lives as long as a scene and is freed in one go; and text that grows. */
#ifndef FLESH_SCENE_ARENA_H
#define FLESH_SCENE_ARENA_H

#include <stddef.h>

typedef struct flesh_arena {
  struct flesh_arena_block *blocks;
} flesh_arena;

/* Zeroed memory for any type; NULL when there is none. Size 0 gives a valid pointer. */
void *flesh_arena_take(flesh_arena *arena, size_t size);
/* A copy of `size` bytes with a 0 behind; NULL when there is no memory. */
char *flesh_arena_text(flesh_arena *arena, const char *text, size_t size);
/* A printed copy. */
char *flesh_arena_print(flesh_arena *arena, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
void flesh_arena_free(flesh_arena *arena);

/* Text that grows; `failed` stays set once memory was short. Start with {0}, free() `data`. */
typedef struct flesh_text {
  char *data; /* ended by 0; NULL while empty */
  size_t size, capacity;
  int failed;
} flesh_text;

void flesh_text_append(flesh_text *text, const char *data, size_t size);
void flesh_text_print(flesh_text *text, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* In double quotes, escaped so that YAML and JSON both read it back. */
void flesh_text_quote(flesh_text *text, const char *value);

#endif
