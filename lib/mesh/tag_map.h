/* tag_map.h: free 64-bit numbers of a file -> int. */
#ifndef FLESH_MESH_TAG_MAP_H
#define FLESH_MESH_TAG_MAP_H

#include <stddef.h>
#include <stdint.h>

typedef struct flesh_tag_map {
  int64_t *tags;
  int *values;
  uint8_t *taken;
  size_t buckets; /* a power of two, or 0 */
  size_t count;
} flesh_tag_map;

/* Sets tag -> value. Returns 1 when the tag was there
 * already (its value is replaced), 0 when it is new, FLESH_ERR_MEMORY when out of memory. */
int flesh_tag_map_set(flesh_tag_map *map, int64_t tag, int value);
/* Finds the tag's value; returns whether it is there. */
int flesh_tag_map_find(const flesh_tag_map *map, int64_t tag, int *value);
void flesh_tag_map_clear(flesh_tag_map *map);

#endif
