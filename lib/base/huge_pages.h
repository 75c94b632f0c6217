/* huge_pages.h: memory for large arrays, on huge pages if the system has them.
 *
 * A step streams through arrays of megabytes; with pages of 4 kB a tenth of its time goes into address translation. */
#ifndef FLESH_BASE_HUGE_PAGES_H
#define FLESH_BASE_HUGE_PAGES_H

#include <stddef.h>

/* Returns `bytes` of uninitialised memory aligned to at least 64 bytes; NULL when there is none. The caller frees it by
 * flesh_free(). Within a reserve the memory comes from the reserve, without huge pages. */
void *flesh_huge_pages_alloc(size_t bytes);

/* Like flesh_huge_pages_alloc, but set to zero. */
void *flesh_huge_pages_calloc(size_t bytes);

/* Returns `count` zeroed vectors of n numbers in one allocation, so that short ones lie on huge pages, too; NULL when
 * there is no memory. Vector k begins `*stride` numbers after vector k - 1, at a multiple of 64 bytes. Freeing the
 * first frees all. */
double *flesh_huge_pages_vectors(size_t count, size_t n, size_t *stride);

#endif
