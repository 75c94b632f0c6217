/* pc2.c: writes point caches. */
#include "output/pc2.h"

#include <errno.h>
#include <limits.h>
#include <stdint.h>
#include <string.h>

#include "base/error.h"

static void write_header(const flesh_pc2 *cache)
{
  static const char mark[12] = "POINTCACHE2";
  FILE *stream = cache->file.stream;
  fwrite(mark, 1, sizeof mark, stream);
  flesh_word_write(stream, 1);
  flesh_word_write(stream, (uint32_t)cache->points);
  flesh_single_write(stream, 0);
  flesh_single_write(stream, 1);
  flesh_word_write(stream, (uint32_t)cache->samples);
}

int flesh_pc2_open(const char *path, int points, flesh_pc2 *cache)
{
  *cache = (flesh_pc2){.points = points};
  int status = flesh_file_open(path, &cache->file);
  if (!status) write_header(cache);
  return status;
}

int flesh_pc2_add(flesh_pc2 *cache, const double *positions)
{
  if (cache->samples == INT_MAX)
    return flesh_fail(FLESH_ERR_FILE, "%s: a point cache holds at most %d samples",
                      cache->file.path, INT_MAX);
  for (size_t d = 0; d < 3 * (size_t)cache->points; d++)
    flesh_single_write(cache->file.stream, positions[d]);
  if (ferror(cache->file.stream))
    return flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", cache->file.path,
                      errno ? strerror(errno) : "the disk may be full");
  cache->samples++;
  return FLESH_OK;
}

int flesh_pc2_commit(flesh_pc2 *cache)
{
  if (fseek(cache->file.stream, 0, SEEK_SET)) {
    if (errno == ESPIPE)
      flesh_fail(FLESH_ERR_FILE, "%s: its header cannot be completed; it must be a regular file", cache->file.path);
    else
      flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", cache->file.path, strerror(errno));
    flesh_file_abandon(&cache->file);
    return FLESH_ERR_FILE;
  }
  write_header(cache);
  return flesh_file_commit(&cache->file);
}

void flesh_pc2_abandon(flesh_pc2 *cache) { flesh_file_abandon(&cache->file); }
