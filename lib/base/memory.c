/* memory.c: memory from the system, and from reserves that are filled from their beginning. */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include "base/memory.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#ifndef MAP_NORESERVE
#define MAP_NORESERVE 0
#endif

enum { LINE = 64 };

/* Header before every piece of memory. Pieces lie one after the other. */
typedef struct piece {
  _Alignas(LINE) size_t bytes; /* size of the piece in whole cache lines, without this header */
  struct piece *before;        /* NULL: the first */
  int freed;
} piece;

/* A stack of pieces: the memory of a freed piece is used again once all later pieces are freed. Temporary arrays are
 * mostly freed in that order. */
struct flesh_reserve {
  char *memory;
  size_t size, used, most; /* bytes */
  piece *last;             /* NULL: empty */
};

static _Thread_local flesh_reserve *entered;

int flesh_grow_to(void *array, size_t size, int wanted, int *room)
{
  void *grown;
  if (wanted <= *room) return 1;
  if (wanted < 0 || wanted > INT_MAX / 4) return 0;
  memcpy(&grown, array, sizeof grown);
  grown = flesh_realloc(grown, (2 * (size_t)wanted + 16) * size);
  if (!grown) return 0;
  memcpy(array, &grown, sizeof grown);
  *room = 2 * wanted + 16;
  return 1;
}

int flesh_grow(void *array, size_t size, int count, int *room)
{
  return count < *room || flesh_grow_to(array, size, count + 1, room);
}

double flesh_physical_memory(void)
{
  const long pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);
  return pages > 0 && size > 0 ? (double)pages * (double)size : INFINITY;
}

flesh_reserve *flesh_reserve_create(size_t bytes)
{
  flesh_reserve *self = calloc(1, sizeof *self);
  if (!self) return NULL;
  self->size = (bytes + LINE - 1) / LINE * LINE;
  self->memory = mmap(NULL, self->size ? self->size : LINE, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (self->memory != MAP_FAILED) return self;
  free(self);
  return NULL;
}

void flesh_reserve_destroy(flesh_reserve **reserve)
{
  if (!reserve || !*reserve) return;
  munmap((*reserve)->memory, (*reserve)->size ? (*reserve)->size : LINE);
  free(*reserve);
  *reserve = NULL;
}

flesh_reserve *flesh_reserve_enter(flesh_reserve *reserve)
{
  flesh_reserve *before = entered;
  entered = reserve;
  return before;
}

int flesh_reserve_entered(void) { return entered != NULL; }

void flesh_reserve_empty(flesh_reserve *reserve)
{
  reserve->used = 0;
  reserve->last = NULL;
}

size_t flesh_reserve_most(const flesh_reserve *reserve) { return reserve->most; }

static size_t whole_lines(size_t bytes) { return bytes > LINE ? (bytes + LINE - 1) / LINE * LINE : LINE; }

static void *take(flesh_reserve *self, size_t bytes)
{
  if (bytes > self->size) return NULL;
  const size_t whole = sizeof(piece) + whole_lines(bytes);
  if (whole > self->size - self->used) return NULL;
  piece *made = (piece *)(void *)(self->memory + self->used);
  *made = (piece){.bytes = whole - sizeof(piece), .before = self->last};
  self->last = made;
  self->used += whole;
  if (self->used > self->most) self->most = self->used;
  return made + 1;
}

static int owns(const flesh_reserve *self, const void *memory)
{
  return (uintptr_t)memory - (uintptr_t)self->memory < self->size;
}

static void give_back(flesh_reserve *self, void *memory)
{
  ((piece *)memory - 1)->freed = 1;
  while (self->last && self->last->freed) {
    self->used -= sizeof(piece) + self->last->bytes;
    self->last = self->last->before;
  }
}

/* Shrinks the piece if it is the last one. */
static void shrink(flesh_reserve *self, void *memory, size_t bytes)
{
  piece *of = (piece *)memory - 1;
  if (of != self->last) return;
  self->used -= of->bytes - whole_lines(bytes);
  of->bytes = whole_lines(bytes);
}

void *flesh_malloc(size_t bytes) { return entered ? take(entered, bytes) : malloc(bytes); }

void *flesh_calloc(size_t count, size_t bytes)
{
  if (!entered) return calloc(count, bytes);
  if (bytes && count > (size_t)-1 / bytes) return NULL;
  void *memory = take(entered, count * bytes);
  return memory ? memset(memory, 0, count * bytes) : NULL;
}

void *flesh_realloc(void *memory, size_t bytes)
{
  if (!entered || (memory && !owns(entered, memory))) return realloc(memory, bytes);
  if (!memory) return take(entered, bytes);
  const size_t before = ((piece *)memory - 1)->bytes;
  if (bytes <= before) {
    shrink(entered, memory, bytes);
    return memory;
  }
  void *grown = take(entered, bytes);
  if (!grown) return NULL;
  memcpy(grown, memory, before);
  give_back(entered, memory);
  return grown;
}

void *flesh_aligned_alloc(size_t alignment, size_t bytes)
{
  if (!entered) return aligned_alloc(alignment, bytes);
  return alignment <= LINE ? take(entered, bytes) : NULL;
}

void flesh_free(void *memory)
{
  if (entered && memory && owns(entered, memory)) give_back(entered, memory);
  else free(memory);
}
