/* archive.h: turns the state of an object into bytes and back. One walk over the members measures, saves and loads
 * them, so that the three cannot differ. */
#ifndef FLESH_BASE_ARCHIVE_H
#define FLESH_BASE_ARCHIVE_H

#include <stddef.h>
#include <stdint.h>

typedef enum flesh_archive_mode { FLESH_ARCHIVE_MEASURE, FLESH_ARCHIVE_SAVE, FLESH_ARCHIVE_LOAD } flesh_archive_mode;

/* Number of nodes and tets in the data that are loaded, and for each the number that it has now (-1: it does not exist
 * here). */
typedef struct flesh_archive_others {
  int nodes, tets;
  const int *node_places, *tet_places;
} flesh_archive_others;

/* An archive; zero-initialised, it measures. A member is stored as its length in bytes (8 bytes) and its bytes as they
 * are in memory. */
typedef struct flesh_archive {
  flesh_archive_mode mode;
  uint8_t *data; /* [size] borrowed; not written to while loading */
  size_t size, at;
  int wrong; /* a member had another length, or the data ended early; the members after it are not loaded */
  /* The numbering of data that were saved with other nodes or tets than there are now; NULL: the numbering is
   * unchanged. */
  const flesh_archive_others *others;
} flesh_archive;

/* Writes the `bytes` bytes at p to the archive, or reads them from it. */
void flesh_archive_bytes(flesh_archive *archive, void *p, size_t bytes);
#define FLESH_ARCHIVE(archive, member) flesh_archive_bytes(archive, &(member), sizeof(member))
/* Saves or loads three numbers for each node, vector [3*nodes]. Loading leaves nodes that the archive lacks
 * unchanged. */
void flesh_archive_nodes(flesh_archive *archive, double *vector, size_t nodes);
/* Saves or loads one number for each tet, vector [tets]. Loading leaves tets that the archive lacks unchanged. */
void flesh_archive_tets(flesh_archive *archive, double *vector, size_t tets);
/* Saves or loads an integer. A loaded value outside [least, most] makes the archive wrong and leaves *value
 * unchanged. */
void flesh_archive_int(flesh_archive *archive, int *value, int least, int most);

/* Returns a checksum of the data, continued from `before` (0 at the start). */
uint64_t flesh_archive_sum(uint64_t before, const void *data, size_t bytes);

#endif
