/* tag_map.c: an open-addressing hash table of 64-bit numbers. */
#include "mesh/tag_map.h"

#include <stdlib.h>

#include "base/error.h"

/* Returns the bucket that has the tag, or where it would go. */
static size_t bucket_of(const flesh_tag_map *map, int64_t tag)
{
  uint64_t h = (uint64_t)tag * 0x9e3779b97f4a7c15u;
  size_t b = (size_t)(h ^ (h >> 32)) & (map->buckets - 1);
  while (map->taken[b] && map->tags[b] != tag) b = (b + 1) & (map->buckets - 1);
  return b;
}

static int grow(flesh_tag_map *map)
{
  size_t buckets = map->buckets ? 2 * map->buckets : 64;
  flesh_tag_map grown = {.tags = malloc(buckets * sizeof *grown.tags),
                         .values = malloc(buckets * sizeof *grown.values),
                         .taken = calloc(buckets, 1),
                         .buckets = buckets,
                         .count = map->count};
  if (!grown.tags || !grown.values || !grown.taken) {
    flesh_tag_map_clear(&grown);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a table of %zu numbers", buckets);
  }
  for (size_t i = 0; i < map->buckets; i++)
    if (map->taken[i]) {
      size_t b = bucket_of(&grown, map->tags[i]);
      grown.tags[b] = map->tags[i];
      grown.values[b] = map->values[i];
      grown.taken[b] = 1;
    }
  flesh_tag_map_clear(map);
  *map = grown;
  return FLESH_OK;
}

int flesh_tag_map_set(flesh_tag_map *map, int64_t tag, int value)
{
  if (2 * map->count >= map->buckets && grow(map)) return FLESH_ERR_MEMORY;
  size_t b = bucket_of(map, tag);
  int there = map->taken[b];
  map->tags[b] = tag;
  map->values[b] = value;
  map->taken[b] = 1;
  map->count += !there;
  return there;
}

int flesh_tag_map_find(const flesh_tag_map *map, int64_t tag, int *value)
{
  if (!map->buckets) return 0;
  size_t b = bucket_of(map, tag);
  if (map->taken[b]) *value = map->values[b];
  return map->taken[b];
}

void flesh_tag_map_clear(flesh_tag_map *map)
{
  free(map->tags);
  free(map->values);
  free(map->taken);
  *map = (flesh_tag_map){0};
}
