/* huge_pages.h: memory for large arrays, on large pages where the system has them.
 *
 * A step streams through arrays of megabytes; on pages of 4 kB a tenth of its time goes into finding them. */
#ifndef FLESH_BASE_HUGE_PAGES_H
#define FLESH_BASE_HUGE_PAGES_H

#include <stddef.h>

/* `bytes` of memory aligned to at least 64 bytes, not set; NULL when there is none. Freed by
 * flesh_free(). In a reserve it comes from there, without large pages. */
void *flesh_huge_pages_alloc(size_t bytes);

/* Like flesh_huge_pages_alloc, set to zero. */
void *flesh_huge_pages_calloc(size_t bytes);

/* `count` vectors of n numbers, zero, in one piece, so that short ones lie on large pages, too; NULL when there is no
 * memory. Vector k begins `*stride` numbers after vector k - 1, at a multiple of 64 bytes. Freeing the first frees
 * all. */
double *flesh_huge_pages_vectors(size_t count, size_t n, size_t *stride);

#endif
