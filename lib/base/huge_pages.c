/* huge_pages.c: large arrays begin at a large page, and the system is advised to use such pages. */
#define _DEFAULT_SOURCE /* madvise */
#include "base/huge_pages.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "base/memory.h"

enum { LINE = 64, PAGE = 2 << 20, SMALLEST_PAGE = 4096 };

void *flesh_huge_pages_alloc(size_t bytes)
{
  const size_t unit = bytes < PAGE ? LINE : PAGE;
  if (flesh_reserve_entered()) return flesh_malloc(bytes);
  if (bytes > (size_t)-1 - 2 * PAGE) return NULL;
  /* The last page is large, too, where that wastes less than an eighth. */
  const size_t up = (bytes + unit - 1) / unit * unit, whole = up - bytes <= bytes / 8 ? up : up - unit;
  void *memory = aligned_alloc(unit, up > 0 ? up : LINE);
#ifdef MADV_HUGEPAGE
  if (memory && unit == PAGE) madvise(memory, whole, MADV_HUGEPAGE); /* a hint: refused, it costs nothing */
#endif
  /* The system finds a page when it is first written to, which is not to be in a step. */
  for (size_t at = 0; memory && unit == PAGE && at < up; at += SMALLEST_PAGE) ((volatile char *)memory)[at] = 0;
  return memory;
}

void *flesh_huge_pages_calloc(size_t bytes)
{
  void *memory = flesh_huge_pages_alloc(bytes);
  return memory ? memset(memory, 0, bytes) : NULL;
}

double *flesh_huge_pages_vectors(size_t count, size_t n, size_t *stride)
{
  const size_t line = LINE / sizeof(double);
  *stride = (n + line - 1) / line * line;
  return flesh_huge_pages_calloc(count * *stride * sizeof(double));
}
