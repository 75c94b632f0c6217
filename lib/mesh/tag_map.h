/* tag_map.h: a hash map from 64-bit numbers, such as tags of a file, to ints. */
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

/* Sets tag -> value. Returns 1 if the tag was there (its value is replaced), 0 if it is new, FLESH_ERR_MEMORY. */
int flesh_tag_map_set(flesh_tag_map *map, int64_t tag, int value);
/* Finds the tag's value; returns whether it is there. */
int flesh_tag_map_find(const flesh_tag_map *map, int64_t tag, int *value);
void flesh_tag_map_clear(flesh_tag_map *map);

#endif
