/* local_level.h: a coarse level of each rank's own, over its overlap (overlap.h).
 *
 * With many ranks, the coarse level that all ranks share has few vertices, as each rank factors all of it. This level
 * corrects displacements that are too fine for its cells and too smooth for an incomplete factor, without the other ranks:
 * with it a rank's incomplete factor is nearer to an exact one of its overlap. */
#ifndef FLESH_LINEAR_LOCAL_LEVEL_H
#define FLESH_LINEAR_LOCAL_LEVEL_H

#include "linear/coarse.h"
#include "linear/overlap.h"

typedef struct flesh_local_level {
  flesh_coarse *coarse; /* NULL: there is none */
  uint8_t *fixed;       /* [3*overlap] constrained dofs of the present matrix */
  int serves;           /* 1: the level serves for that matrix, which is not indefinite on it */
} flesh_local_level;

/* Makes the level with at most `vertices` vertices, or eight. overlap->vector has the rest positions of the overlap's nodes
 * (flesh_overlap_create), and `bisection` is that of the overlap's matrix. FLESH_ERR_MEMORY on this rank alone. Clear it
 * also after a failure. */
FLESH_PER_ISA int flesh_local_level_create(const flesh_overlap *overlap, int vertices,
                                           const flesh_bisection *bisection, flesh_threads *threads,
                                           flesh_local_level *level);
FLESH_PER_ISA void flesh_local_level_clear(flesh_local_level *level);

/* Factors scale times `all`, the overlap's matrix, on the level; `fixed` [3*rows] (NULL: none). Collective; does nothing if
 * there is no such level. */
FLESH_PER_ISA void flesh_local_level_setup(flesh_local_level *level, const flesh_overlap *overlap,
                                           const flesh_block_matrix *all, double scale, int rows,
                                           const uint8_t *fixed);
/* Returns the coarse level; NULL: it does not serve. */
FLESH_PER_ISA flesh_coarse *flesh_local_level_coarse(const flesh_local_level *level);

FLESH_PER_ISA void flesh_local_level_archive(flesh_local_level *level, flesh_archive *archive);

#endif
