/* archive.c: members as bytes, each with its length. */
#include "base/archive.h"

#include <string.h>

void flesh_archive_bytes(flesh_archive *archive, void *p, size_t bytes)
{
  const size_t at = archive->at, whole = sizeof(uint64_t) + bytes;
  uint64_t length = bytes;
  if (archive->mode == FLESH_ARCHIVE_MEASURE) {
    archive->at += whole;
    return;
  }
  if (archive->wrong || archive->size - at < sizeof length || archive->size - at - sizeof length < bytes) {
    archive->wrong = 1;
    return;
  }
  uint8_t *to = archive->data + at;
  if (archive->mode == FLESH_ARCHIVE_SAVE) {
    memcpy(to, &length, sizeof length);
    if (bytes) memcpy(to + sizeof length, p, bytes);
  } else {
    memcpy(&length, to, sizeof length);
    archive->wrong = length != bytes;
    if (!archive->wrong && bytes) memcpy(p, to + sizeof length, bytes);
  }
  archive->at += whole;
}

void flesh_archive_int(flesh_archive *archive, int *value, int least, int most)
{
  int copy = *value;
  FLESH_ARCHIVE(archive, copy);
  if (archive->mode != FLESH_ARCHIVE_LOAD || archive->wrong) return;
  if (copy < least || copy > most) archive->wrong = 1;
  else *value = copy;
}

/* Multiply and rotate, a word at a time; the multipliers are Knuth's and the golden ratio. */
static uint64_t mix(uint64_t sum, uint64_t word)
{
  sum = (sum ^ word) * 6364136223846793005u;
  return (sum << 29 | sum >> 35) + 0x9e3779b97f4a7c15u;
}

uint64_t flesh_archive_sum(uint64_t before, const void *data, size_t bytes)
{
  const uint8_t *p = data;
  uint64_t sum = mix(before, bytes), word;
  for (; bytes >= sizeof word; p += sizeof word, bytes -= sizeof word) {
    memcpy(&word, p, sizeof word);
    sum = mix(sum, word);
  }
  word = 0;
  memcpy(&word, p, bytes);
  return mix(sum, word);
}
