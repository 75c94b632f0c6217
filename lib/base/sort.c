/* sort.c: merge sort (Knuth, The Art of Computer Programming 3, section 5.2.4). */
#include "base/sort.h"

#include <string.h>

#include "base/memory.h"

enum { FEW = 8, LARGEST = 64, SMALL = 1024 };

typedef struct sort {
  size_t size;
  int (*compare)(const void *a, const void *b);
} sort;

/* Insertion sort; items of at most LARGEST bytes are moved through a buffer, larger ones are swapped byte by byte. */
static void insert(const sort *s, char *things, size_t count)
{
  const size_t size = s->size;
  char piece[LARGEST];
  for (size_t k = 1; k < count; k++) {
    size_t at = k;
    while (at > 0 && s->compare(things + (at - 1) * size, things + k * size) > 0) at--;
    if (at == k) continue;
    if (size <= LARGEST) {
      memcpy(piece, things + k * size, size);
      memmove(things + (at + 1) * size, things + at * size, (k - at) * size);
      memcpy(things + at * size, piece, size);
      continue;
    }
    for (size_t j = k; j > at; j--)
      for (size_t byte = 0; byte < size; byte++) {
        const char other = things[j * size + byte];
        things[j * size + byte] = things[(j - 1) * size + byte];
        things[(j - 1) * size + byte] = other;
      }
  }
}

/* Merge sort; `room` holds count / 2 items. */
static void merge(const sort *s, char *things, size_t count, char *room)
{
  const size_t size = s->size, half = count / 2;
  if (count <= FEW) {
    insert(s, things, count);
    return;
  }
  merge(s, things, half, room);
  merge(s, things + half * size, count - half, room);
  char *second = things + half * size, *end = things + count * size, *to = things;
  if (s->compare(second - size, second) <= 0) return;
  memcpy(room, things, half * size);
  for (char *first = room, *last = room + half * size; first < last; to += size) {
    if (second < end && s->compare(first, second) > 0) {
      memcpy(to, second, size);
      second += size;
    } else {
      memcpy(to, first, size);
      first += size;
    }
  }
}

void flesh_sort(void *things, size_t count, size_t size, int (*compare)(const void *a, const void *b))
{
  const sort s = {size, compare};
  if (count < 2 || size == 0) return;
  char small[SMALL], *room = count / 2 <= SMALL / size ? small : flesh_malloc(count / 2 * size);
  if (room) merge(&s, things, count, room);
  else insert(&s, things, count);
  if (room != small) flesh_free(room);
}

int flesh_compare_int(const void *a, const void *b)
{
  const int x = *(const int *)a, y = *(const int *)b;
  return (x > y) - (x < y);
}

int flesh_compare_long(const void *a, const void *b)
{
  const long x = *(const long *)a, y = *(const long *)b;
  return (x > y) - (x < y);
}

int flesh_compare_double(const void *a, const void *b)
{
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static int compare_ints(int count, const int *x, const int *y)
{
  for (int k = 0; k < count; k++)
    if (x[k] != y[k]) return x[k] < y[k] ? -1 : 1;
  return 0;
}

int flesh_compare_two_ints(const void *a, const void *b) { return compare_ints(2, a, b); }

int flesh_compare_three_ints(const void *a, const void *b) { return compare_ints(3, a, b); }
