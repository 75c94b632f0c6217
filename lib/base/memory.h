/* memory.h: allocates memory from the system or, while a thread has entered a reserve, from that reserve.
 *
 * A step allocates nothing from the system. Nonlinear elimination makes a small body with its effects, system and
 * solver within a step; their memory comes from a reserve made beforehand. Hence everything that such a body is made of
 * asks for memory here: the rooms element, system, linear and newton, meshes, and the effects that can be restricted to
 * some cells. */
#ifndef FLESH_BASE_MEMORY_H
#define FLESH_BASE_MEMORY_H

#include <stddef.h>

/* Like malloc, calloc, realloc, aligned_alloc and free of the C library; within a reserve, memory is aligned to 64
 * bytes. NULL when there is none left. Memory from a reserve must be freed while its thread is in the reserve, or by
 * flesh_reserve_empty. */
void *flesh_malloc(size_t bytes);
void *flesh_calloc(size_t count, size_t bytes);
void *flesh_realloc(void *memory, size_t bytes);
void *flesh_aligned_alloc(size_t alignment, size_t bytes);
void flesh_free(void *memory);
/* Makes room for one more item of `size` bytes after `count` items, in an array of *room items; `array` points to its
 * pointer. Returns whether there is room; without memory the array stays unchanged. */
int flesh_grow(void *array, size_t size, int count, int *room);
/* Like flesh_grow, for `wanted` items in all. */
int flesh_grow_to(void *array, size_t size, int wanted, int *room);

/* Returns the bytes of memory that the machine has; INFINITY if unknown. */
double flesh_physical_memory(void);

typedef struct flesh_reserve flesh_reserve;

/* Returns a new reserve of `bytes` bytes; NULL when there are none. Only addresses are reserved: the system provides
 * memory at the first write. */
flesh_reserve *flesh_reserve_create(size_t bytes);
/* Frees the reserve and sets the pointer to NULL; NULL-safe. None of its memory may be in use. */
void flesh_reserve_destroy(flesh_reserve **reserve);

/* Lets the calling thread allocate from the reserve from now on (NULL: from the system). Returns the reserve used
 * before, which the caller enters again at the end. */
flesh_reserve *flesh_reserve_enter(flesh_reserve *reserve);
/* Returns whether the calling thread is in a reserve. */
int flesh_reserve_entered(void);
/* Frees all memory that the reserve has given out. */
void flesh_reserve_empty(flesh_reserve *reserve);
/* Returns the largest number of bytes that were in use at one time. */
size_t flesh_reserve_most(const flesh_reserve *reserve);

#endif
