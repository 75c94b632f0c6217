/* archive.c: reads and writes members as bytes, each after its length. */
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

/* Loads `width` numbers for each of `rows` rows. The archive has `count` rows; row i of them goes to row places[i]. */
static void scatter(flesh_archive *archive, int width, int count, const int *places, size_t rows, double *vector)
{
  const size_t bytes = (size_t)width * sizeof *vector, rest = archive->size - archive->at;
  uint64_t length = 0;
  if (!archive->wrong && rest >= sizeof length) memcpy(&length, archive->data + archive->at, sizeof length);
  archive->wrong |= rest < sizeof length || length != (size_t)count * bytes || rest - sizeof length < length;
  if (archive->wrong) return;
  const uint8_t *from = archive->data + archive->at + sizeof length;
  for (int i = 0; i < count; i++)
    if (places[i] >= 0 && (size_t)places[i] < rows)
      memcpy(vector + (size_t)width * (size_t)places[i], from + (size_t)i * bytes, bytes);
  archive->at += sizeof length + (size_t)length;
}

void flesh_archive_nodes(flesh_archive *archive, double *vector, size_t nodes)
{
  const flesh_archive_others *others = archive->mode == FLESH_ARCHIVE_LOAD ? archive->others : NULL;
  if (others) scatter(archive, 3, others->nodes, others->node_places, nodes, vector);
  else flesh_archive_bytes(archive, vector, 3 * nodes * sizeof *vector);
}

void flesh_archive_tets(flesh_archive *archive, double *vector, size_t tets)
{
  const flesh_archive_others *others = archive->mode == FLESH_ARCHIVE_LOAD ? archive->others : NULL;
  if (others) scatter(archive, 1, others->tets, others->tet_places, tets, vector);
  else flesh_archive_bytes(archive, vector, tets * sizeof *vector);
}

void flesh_archive_int(flesh_archive *archive, int *value, int least, int most)
{
  int copy = *value;
  FLESH_ARCHIVE(archive, copy);
  if (archive->mode != FLESH_ARCHIVE_LOAD || archive->wrong) return;
  if (copy < least || copy > most) archive->wrong = 1;
  else *value = copy;
}

/* Multiplies and rotates, a word at a time; the constants are Knuth's multiplier and the golden ratio. */
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
