/* memory.h: where memory comes from: the system, or, while a thread is in a reserve, that reserve.
 *
 * A step allocates nothing. What nonlinear elimination makes within one, a small body with its effects, system and
 * solver, comes from a reserve that is there before. Whatever such a body is made of asks for its memory here: the rooms
 * element, system, linear and newton, meshes, and the effects that can be restricted to some cells. */
#ifndef FLESH_BASE_MEMORY_H
#define FLESH_BASE_MEMORY_H

#include <stddef.h>

/* Like malloc, calloc and realloc of the C library; in a reserve, memory is aligned to 64 bytes. NULL when there is
 * none left. Memory from a reserve is freed while its thread is in the reserve, or by flesh_reserve_empty. */
void *flesh_malloc(size_t bytes);
void *flesh_calloc(size_t count, size_t bytes);
void *flesh_realloc(void *memory, size_t bytes);
void *flesh_aligned_alloc(size_t alignment, size_t bytes);
void flesh_free(void *memory);
/* Makes room for one more item of `size` bytes behind `count`, in an array of *room items whose pointer `array` points to.
 * Returns whether there is; without memory the array stays as it is. */
int flesh_grow(void *array, size_t size, int count, int *room);
/* Likewise for `wanted` items in all. */
int flesh_grow_to(void *array, size_t size, int wanted, int *room);

/* Bytes of memory that the machine has; INFINITY where that is not known. */
double flesh_physical_memory(void);

typedef struct flesh_reserve flesh_reserve;

/* Room for `bytes`: addresses only, of which the system makes memory where they are first written to. Returns new;
 * NULL where there are none. */
flesh_reserve *flesh_reserve_create(size_t bytes);
/* NULL-safe; nothing of it may be in use. */
void flesh_reserve_destroy(flesh_reserve **reserve);

/* From here on the calling thread's memory comes from the reserve (NULL: from the system). Returns where it came from
 * before, which is to be entered again at the end. */
flesh_reserve *flesh_reserve_enter(flesh_reserve *reserve);
/* Whether the calling thread is in a reserve. */
int flesh_reserve_entered(void);
/* Frees all that it gave. */
void flesh_reserve_empty(flesh_reserve *reserve);
/* The most bytes that were in use at a time. */
size_t flesh_reserve_most(const flesh_reserve *reserve);

#endif
