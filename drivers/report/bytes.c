/* bytes.c: numbers packed into bytes. */
#include <stdlib.h>
#include <string.h>

#include "report/report.h"

void flesh_report_bytes_add(flesh_report_bytes *bytes, const void *data, size_t size)
{
  if (bytes->failed) return;
  if (bytes->size + size > bytes->room) {
    const size_t room = 2 * (bytes->size + size) + 4096;
    unsigned char *longer = realloc(bytes->data, room);
    if (!longer) {
      bytes->failed = 1;
      return;
    }
    bytes->data = longer;
    bytes->room = room;
  }
  if (size) memcpy(bytes->data + bytes->size, data, size);
  bytes->size += size;
}

void flesh_report_bytes_add_number(flesh_report_bytes *bytes, int64_t value)
{
  unsigned char packed[10];
  size_t count = 0;
  uint64_t rest = value < 0 ? 2 * (uint64_t)(-(value + 1)) + 1 : 2 * (uint64_t)value;
  for (; rest > 127; rest >>= 7) packed[count++] = (unsigned char)(rest & 127) | 128;
  packed[count++] = (unsigned char)rest;
  flesh_report_bytes_add(bytes, packed, count);
}

void flesh_report_bytes_add_list(flesh_report_bytes *bytes, size_t count, const int *values)
{
  int64_t last = 0;
  for (size_t k = 0; k < count; k++) {
    flesh_report_bytes_add_number(bytes, values[k] - last);
    last = values[k];
  }
}

void flesh_report_bytes_free(flesh_report_bytes *bytes)
{
  free(bytes->data);
  *bytes = (flesh_report_bytes){0};
}
