/* tet_tiles.h: cutting batches into the tiles (tet_kernel.h) that kernels work in. */
#ifndef FLESH_ELEMENT_TET_TILES_H
#define FLESH_ELEMENT_TET_TILES_H

#include <stddef.h>

#include "element/tet_kernel.h"

/* Makes batches->tiles, of a mesh of so many nodes; lanes, first and nodes are known. No tile goes beyond one of the
 * `pieces` pieces, which begin at the batches piece[0..pieces-1] and at the tiles that are written there instead;
 * piece[pieces] is where the last ends. FLESH_ERR_MEMORY; to be cleared also when it fails. */
int flesh_tiles_create(flesh_batches *batches, int nodes_of_mesh, int pieces, int *piece);
void flesh_tiles_clear(flesh_tiles *tiles);

/* How many blocks they list. */
int flesh_tiles_blocks(const flesh_tiles *tiles);

/* Bytes that the tiles of these batches hold. */
size_t flesh_tiles_memory(const flesh_batches *batches);

#endif
