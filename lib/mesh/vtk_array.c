/* vtk_array.c: reads an array of a VTK XML file from text, base 64 or bytes, inline or appended, plain or compressed
 * (VTK File Formats, "XML File Formats"). Plain bytes follow their number. Compressed bytes follow the number of
 * blocks, the size of each block and of the last if that is shorter, and the compressed size of each block. */
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/error.h"
#include "mesh/vtk.h"

int flesh_vtk_fail(const flesh_vtk_file *file, int64_t line, const char *format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return flesh_fail(FLESH_ERR_FILE, "%s:%lld: %s", file->s->path, (long long)line, text);
}

static const struct {
  const char *name;
  char kind;
  int size;
} types[] = {{"Float32", 'f', 4}, {"Float64", 'f', 8}, {"Int8", 'i', 1},  {"UInt8", 'u', 1},  {"Int16", 'i', 2},
             {"UInt16", 'u', 2},  {"Int32", 'i', 4},   {"UInt32", 'u', 4}, {"Int64", 'i', 8}, {"UInt64", 'u', 8}};

int flesh_vtk_array_read(const flesh_vtk_file *file, const flesh_xml_tag *tag, const char *name, flesh_vtk_array *array)
{
  const int64_t components = flesh_xml_number(tag, "NumberOfComponents", 1);
  *array = (flesh_vtk_array){.name = name, .text = file->s->at, .line = tag->line, .offset = flesh_xml_number(tag, "offset", -1)};
  for (size_t k = 0; k < sizeof types / sizeof *types; k++)
    if (flesh_xml_attribute_is(tag, "type", types[k].name)) array->kind = types[k].kind, array->size = types[k].size;
  if (!array->size)
    return flesh_vtk_fail(file, tag->line, "the array %s has no known type; type=\"Float64\", Float32, Int8 to "
                                           "Int64 or UInt8 to UInt64 is expected", name);
  if (components < 1 || components > 1000)
    return flesh_vtk_fail(file, tag->line, "NumberOfComponents of the array %s is no number from 1 to 1000", name);
  array->components = (int)components;
  if (flesh_xml_attribute_is(tag, "format", "binary")) array->format = FLESH_VTK_BINARY;
  else if (flesh_xml_attribute_is(tag, "format", "appended")) array->format = FLESH_VTK_APPENDED;
  else if (!flesh_xml_attribute_is(tag, "format", "ascii"))
    return flesh_vtk_fail(file, tag->line, "the array %s has no known format; format=\"ascii\", binary or appended is "
                                           "expected", name);
  if (array->format == FLESH_VTK_APPENDED && array->offset < 0)
    return flesh_vtk_fail(file, tag->line, "the array %s is appended, but its offset is no number", name);
  return FLESH_OK;
}

/* Bytes of a binary array. Base 64 may be padded inside, where one piece ends and another begins. */
typedef struct stream {
  const char *at, *end;
  int base64;
  unsigned char triple[3];
  int next, have; /* next byte of the triple, and how many it has */
} stream;

static int value_of(char c)
{
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* Decodes the next four letters into bytes; returns 0 if there are none. */
static int decode(stream *b)
{
  uint32_t bits = 0;
  int letters = 0, padding = 0;
  while (letters + padding < 4 && b->at < b->end) {
    const char c = *b->at++;
    if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
    const int value = value_of(c);
    if (value < 0 && c != '=') return 0;
    if (value < 0) padding++;
    else if (padding) return 0;
    else bits |= (uint32_t)value << (18 - 6 * letters++);
  }
  if (letters + padding < 4 || letters < 2) return 0;
  for (int k = 0; k < 3; k++) b->triple[k] = (unsigned char)(bits >> (16 - 8 * k));
  b->next = 0;
  b->have = letters - 1;
  return 1;
}

/* Copies the next bytes; returns 0 if there are not enough. */
static int take(stream *b, void *to, size_t bytes)
{
  unsigned char *out = to;
  if (!b->base64) {
    if ((size_t)(b->end - b->at) < bytes) return 0;
    memcpy(to, b->at, bytes);
    b->at += bytes;
    return 1;
  }
  for (size_t k = 0; k < bytes; k++) {
    if (b->next == b->have && !decode(b)) return 0;
    out[k] = b->triple[b->next++];
  }
  return 1;
}

/* Copies a number of the file in this machine's byte order. */
static void put_number(const flesh_vtk_file *file, const char *from, int size, void *number)
{
  char *to = number;
  for (int k = 0; k < size; k++) to[k] = from[file->swap ? size - 1 - k : k];
}

static int take_length(const flesh_vtk_file *file, stream *b, uint64_t *length)
{
  char bytes[8];
  uint32_t word = 0;
  if (!take(b, bytes, (size_t)file->header_size)) return 0;
  put_number(file, bytes, file->header_size, file->header_size == 8 ? (void *)length : &word);
  if (file->header_size == 4) *length = word;
  return 1;
}

static int ends_early(const flesh_vtk_file *file, const flesh_vtk_array *array)
{
  return flesh_vtk_fail(file, array->line, "the data of the array %s end too early, or are not base 64", array->name);
}

static int inflate_blocks(const flesh_vtk_file *file, const flesh_vtk_array *array, stream *b, char *to, size_t bytes)
{
  uint64_t head[3] = {0}, *sizes = NULL;
  for (int k = 0; k < 3; k++)
    if (!take_length(file, b, &head[k])) return ends_early(file, array);
  const uint64_t blocks = head[0], each = head[1], last = head[2] ? head[2] : head[1];
  if (blocks < 1 || blocks > (uint64_t)(b->end - b->at) || last < 1 || last > each ||
      (blocks > 1 && each > bytes) || (blocks - 1) * each + last != bytes)
    return flesh_vtk_fail(file, array->line, "the array %s has %llu blocks of %llu bytes (the last of %llu); together they "
                                             "must have %zu", array->name, (unsigned long long)blocks,
                          (unsigned long long)each, (unsigned long long)last, bytes);
  sizes = malloc((size_t)blocks * sizeof *sizes);
  char *deflated = malloc((size_t)(b->end - b->at) + 1);
  int status = sizes && deflated ? FLESH_OK : flesh_no_memory_for(file->s->path);
  for (uint64_t k = 0; k < blocks && !status; k++)
    if (!take_length(file, b, &sizes[k])) status = ends_early(file, array);
  for (uint64_t k = 0; k < blocks && !status; k++) {
    uLongf inflated = (uLongf)(k + 1 < blocks ? each : last);
    const uLongf expected = inflated;
    if (sizes[k] > (uint64_t)(b->end - b->at) || !take(b, deflated, (size_t)sizes[k])) status = ends_early(file, array);
    else if (uncompress((Bytef *)to + k * each, &inflated, (const Bytef *)deflated, (uLong)sizes[k]) != Z_OK ||
             inflated != expected)
      status = flesh_vtk_fail(file, array->line, "block %llu of the array %s cannot be inflated (zlib)",
                              (unsigned long long)k, array->name);
  }
  free(sizes);
  free(deflated);
  return status;
}

/* Opens the bytes of a binary array. */
static int open_stream(const flesh_vtk_file *file, const flesh_vtk_array *array, stream *b)
{
  const flesh_scanner *s = file->s;
  *b = (stream){.at = array->text, .end = s->end, .base64 = 1};
  if (array->format == FLESH_VTK_BINARY) {
    const char *tag = memchr(b->at, '<', (size_t)(s->end - b->at));
    if (tag) b->end = tag;
    return FLESH_OK;
  }
  if (!file->appended) return flesh_vtk_fail(file, array->line, "the array %s is appended, but there is no <AppendedData>",
                                             array->name);
  if (array->offset > s->end - file->appended)
    return flesh_vtk_fail(file, array->line, "the array %s has the offset %lld; only %lld bytes are appended", array->name,
                          (long long)array->offset, (long long)(s->end - file->appended));
  b->at = file->appended + array->offset;
  b->base64 = file->appended_base64;
  return FLESH_OK;
}

/* Reads the bytes of `count` numbers, as they are in the file. Returns new. Before it takes memory, it checks that the
 * file is long enough: zlib expands a byte to at most 1032. */
static int read_bytes(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, char **bytes)
{
  const size_t size = (size_t)count * (size_t)array->size;
  uint64_t length = 0;
  stream b;
  int status = open_stream(file, array, &b);
  if (status) return status;
  if (size / (file->compressed ? 1032 : 1) > (size_t)(b.end - b.at))
    return flesh_vtk_fail(file, array->line, "the array %s should have %lld numbers, but only %lld bytes of the file are left",
                          array->name, (long long)count, (long long)(b.end - b.at));
  if (!(*bytes = malloc(size + 1))) return flesh_no_memory_for(file->s->path);
  if (file->compressed) return inflate_blocks(file, array, &b, *bytes, size);
  if (!take_length(file, &b, &length)) return ends_early(file, array);
  if (length != size)
    return flesh_vtk_fail(file, array->line, "the array %s has %llu bytes; it must have %zu, for %lld numbers of %d bytes",
                          array->name, (unsigned long long)length, size, (long long)count, array->size);
  return take(&b, *bytes, size) ? FLESH_OK : ends_early(file, array);
}

/* Reads the numbers of a text array into `reals` or `integers`, whichever is not NULL. */
static int read_text(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, double *reals,
                     int64_t *integers)
{
  flesh_scanner s = *file->s;
  const char *tag = memchr(array->text, '<', (size_t)(s.end - array->text));
  s.at = array->text, s.line = array->line, s.end = tag ? tag : s.end;
  s.item = array->name, s.form = "numbers", s.free_rows = 1, s.comment = 0;
  int status = FLESH_OK;
  for (int64_t k = 0; k < count && !status; k++) {
    s.index = k;
    status = reals ? flesh_scan_real(&s, &reals[k]) : flesh_scan_integer(&s, &integers[k]);
  }
  if (!status && flesh_scan_next(&s))
    status = flesh_scan_fail(&s, "%s stands behind the last of %lld numbers of the array %s", flesh_scan_show(&s),
                             (long long)count, array->name);
  return status;
}

static int64_t integer_of(const flesh_vtk_file *file, const flesh_vtk_array *array, const char *from)
{
  int8_t narrow;
  int16_t half;
  int32_t word;
  int64_t wide;
  const int is_signed = array->kind == 'i';
  switch (array->size) {
  case 1:
    put_number(file, from, 1, &narrow);
    return is_signed ? narrow : (int64_t)(uint8_t)narrow;
  case 2:
    put_number(file, from, 2, &half);
    return is_signed ? half : (int64_t)(uint16_t)half;
  case 4:
    put_number(file, from, 4, &word);
    return is_signed ? word : (int64_t)(uint32_t)word;
  default:
    put_number(file, from, 8, &wide);
    return wide;
  }
}

static double real_of(const flesh_vtk_file *file, const flesh_vtk_array *array, const char *from)
{
  float narrow;
  double wide;
  if (array->kind != 'f') return (double)integer_of(file, array, from);
  if (array->size == 4) {
    put_number(file, from, 4, &narrow);
    return narrow;
  }
  put_number(file, from, 8, &wide);
  return wide;
}

/* Reads all numbers into `reals` or `integers`, whichever is not NULL. */
static int read_numbers(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, double **reals,
                        int64_t **integers)
{
  const int64_t left = file->s->end - array->text;
  char *bytes = NULL;
  int status = FLESH_OK;
  if (array->format == FLESH_VTK_ASCII && count > left / 2 + 1)
    return flesh_vtk_fail(file, array->line, "the array %s should have %lld numbers, but only %lld bytes of the file are left",
                          array->name, (long long)count, (long long)left);
  if (array->format != FLESH_VTK_ASCII) status = read_bytes(file, array, count, &bytes);
  void *numbers = status ? NULL : malloc(8 * (size_t)count + 1);
  if (!status && !numbers) status = flesh_no_memory_for(file->s->path);
  if (reals) *reals = numbers;
  else *integers = numbers;
  if (!status && !bytes) status = read_text(file, array, count, reals ? *reals : NULL, reals ? NULL : *integers);
  for (int64_t k = 0; k < count && !status && bytes; k++) {
    const char *from = bytes + k * array->size;
    if (reals) (*reals)[k] = real_of(file, array, from);
    else (*integers)[k] = integer_of(file, array, from);
  }
  free(bytes);
  return status;
}

int flesh_vtk_reals(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, double **numbers)
{
  *numbers = NULL;
  return read_numbers(file, array, count, numbers, NULL);
}

int flesh_vtk_integers(const flesh_vtk_file *file, const flesh_vtk_array *array, int64_t count, int64_t **numbers)
{
  *numbers = NULL;
  if (array->kind == 'f' && array->format != FLESH_VTK_ASCII)
    return flesh_vtk_fail(file, array->line, "the array %s has real numbers; integers are expected", array->name);
  return read_numbers(file, array, count, NULL, numbers);
}
