/* archive.h: what something remembers, to and from bytes. The same walk over its members measures, saves and loads them,
 * so that the three cannot differ. */
#ifndef FLESH_BASE_ARCHIVE_H
#define FLESH_BASE_ARCHIVE_H

#include <stddef.h>
#include <stdint.h>

typedef enum flesh_archive_mode { FLESH_ARCHIVE_MEASURE, FLESH_ARCHIVE_SAVE, FLESH_ARCHIVE_LOAD } flesh_archive_mode;

/* Nodes and tets of which something was saved: how many, and of each its number here (-1: it is of nobody here). */
typedef struct flesh_archive_others {
  int nodes, tets;
  const int *node_places, *tet_places;
} flesh_archive_others;

/* Zero-initialised it measures. A member is its length in bytes, 8 of them, and the bytes as memory has them. */
typedef struct flesh_archive {
  flesh_archive_mode mode;
  uint8_t *data; /* [size] borrowed; not written to while loading */
  size_t size, at;
  int wrong; /* a member had another length, or the data end before it; what follows is left alone */
  /* For loading data that were saved with other nodes or tets than there are here; NULL: they are the same. */
  const flesh_archive_others *others;
} flesh_archive;

/* p [bytes] to the archive, or from it. */
void flesh_archive_bytes(flesh_archive *archive, void *p, size_t bytes);
#define FLESH_ARCHIVE(archive, member) flesh_archive_bytes(archive, &(member), sizeof(member))
/* Three numbers for each node, vector [3*nodes]. Those that are nowhere in the archive stay as they are. */
void flesh_archive_nodes(flesh_archive *archive, double *vector, size_t nodes);
/* One number for each tet, vector [tets]. Numbers of tets that the archive lacks stay as they are. */
void flesh_archive_tets(flesh_archive *archive, double *vector, size_t tets);
/* An integer that must lie in [least, most] where it is loaded; else the archive is wrong, and *value is not changed. */
void flesh_archive_int(flesh_archive *archive, int *value, int least, int most);

/* A number that other bytes would hardly have, which goes on from `before` (0: at first). */
uint64_t flesh_archive_sum(uint64_t before, const void *data, size_t bytes);

#endif
