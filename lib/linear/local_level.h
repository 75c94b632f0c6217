/* local_level.h: a coarse level of each rank's own, over its overlap (overlap.h).
 *
 * The coarse level that all ranks share has few vertices where there are many ranks, as each of them factors all of it.
 * What is too fine for its cells and too smooth for an incomplete factor is left to this one, which no other rank has a
 * part in: with it a rank's incomplete factor is nearer to an exact one of its overlap. */
#ifndef FLESH_LINEAR_LOCAL_LEVEL_H
#define FLESH_LINEAR_LOCAL_LEVEL_H

#include "linear/coarse.h"
#include "linear/overlap.h"

typedef struct flesh_local_level {
  flesh_coarse *coarse; /* NULL: there is none */
  uint8_t *fixed;       /* [3*overlap] the constrained dofs of the matrix at hand */
  int serves;           /* for that matrix: it is not indefinite */
} flesh_local_level;

/* With at most so many vertices, or eight; overlap->vector has the places at rest of the overlap's nodes
 * (flesh_overlap_create), and `bisection` is that of the overlap's matrix. FLESH_ERR_MEMORY on this rank alone. To be
 * cleared also when it fails. */
FLESH_PER_ISA int flesh_local_level_create(const flesh_overlap *overlap, int vertices,
                                           const flesh_bisection *bisection, flesh_threads *threads,
                                           flesh_local_level *level);
FLESH_PER_ISA void flesh_local_level_clear(flesh_local_level *level);

/* Factors scale times `all`, the overlap's matrix, on the level; `fixed` [3*rows] (NULL: none). Collective; nothing is
 * done where there is no such level. */
FLESH_PER_ISA void flesh_local_level_setup(flesh_local_level *level, const flesh_overlap *overlap,
                                           const flesh_block_matrix *all, double scale, int rows,
                                           const uint8_t *fixed);
/* NULL: it does not serve. */
FLESH_PER_ISA flesh_coarse *flesh_local_level_coarse(const flesh_local_level *level);

FLESH_PER_ISA void flesh_local_level_archive(flesh_local_level *level, flesh_archive *archive);

#endif
