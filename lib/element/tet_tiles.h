/* tet_tiles.h: splits batches into the tiles (tet_kernel.h) on which kernels work. */
#ifndef FLESH_ELEMENT_TET_TILES_H
#define FLESH_ELEMENT_TET_TILES_H

#include <stddef.h>

#include "element/tet_kernel.h"

/* Makes batches->tiles for a mesh of that many nodes; lanes, first and nodes are known. No tile crosses the border of
 * one of the `pieces` pieces: on entry piece[p] is the first batch of piece p, on return its first tile; piece[pieces]
 * is the end. FLESH_ERR_MEMORY; the caller clears the tiles, also after an error. */
int flesh_tiles_create(flesh_batches *batches, int nodes_of_mesh, int pieces, int *piece);
void flesh_tiles_clear(flesh_tiles *tiles);

/* Returns how many blocks the tiles list. */
int flesh_tiles_blocks(const flesh_tiles *tiles);

/* Returns the bytes that the tiles of these batches hold. */
size_t flesh_tiles_memory(const flesh_batches *batches);

#endif
