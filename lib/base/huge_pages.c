/* huge_pages.c: aligns large arrays to huge pages and advises the system to use such pages. */
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
  /* The last page is huge, too, if that wastes less than an eighth. */
  const size_t up = (bytes + unit - 1) / unit * unit, whole = up - bytes <= bytes / 8 ? up : up - unit;
  void *memory = aligned_alloc(unit, up > 0 ? up : LINE);
#ifdef MADV_HUGEPAGE
  if (memory && unit == PAGE) madvise(memory, whole, MADV_HUGEPAGE); /* only a hint, which may be refused */
#endif
  /* Touches each page now, as the system provides memory at the first write, which must not happen within a step. */
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
