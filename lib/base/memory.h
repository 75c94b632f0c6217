/* memory.h: where memory comes from: the system, or, while a thread is in an arena, that arena.
 *
 * A step allocates nothing. What nonlinear elimination makes within one, a small body with its effects, system and
 * solver, comes from an arena that is there before. Whatever such a body is made of asks for its memory here: the rooms
 * element, system, linear and newton, meshes, and the effects that can be restricted to some cells. */
#ifndef FLESH_BASE_MEMORY_H
#define FLESH_BASE_MEMORY_H

#include <stddef.h>

/* As the functions of the C library; at multiples of 64 bytes in an arena. NULL where there is none left. What came
 * from an arena is freed while its thread is in it, or by flesh_arena_empty. */
void *flesh_malloc(size_t bytes);
void *flesh_calloc(size_t count, size_t bytes);
void *flesh_realloc(void *memory, size_t bytes);
void *flesh_aligned_alloc(size_t alignment, size_t bytes);
void flesh_free(void *memory);

typedef struct flesh_arena flesh_arena;

/* Room for `bytes`: addresses only, of which the system makes memory where they are first written to. Returns new;
 * NULL where there are none. */
flesh_arena *flesh_arena_create(size_t bytes);
/* NULL-safe; nothing of it may be in use. */
void flesh_arena_destroy(flesh_arena **arena);

/* From here on the calling thread's memory comes from the arena (NULL: from the system). Returns where it came from
 * before, which is to be entered again at the end. */
flesh_arena *flesh_arena_enter(flesh_arena *arena);
/* Whether the calling thread is in an arena. */
int flesh_arena_entered(void);
/* Frees all that it gave. */
void flesh_arena_empty(flesh_arena *arena);
/* The most bytes that were in use at a time, and those that there are. */
size_t flesh_arena_most(const flesh_arena *arena);
size_t flesh_arena_size(const flesh_arena *arena);

#endif
