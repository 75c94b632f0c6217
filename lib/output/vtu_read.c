/* vtu_read.c: reads the XML that vtu.c writes, by its tags; vectors of parts go to their places in the whole. Other VTK
 * files are refused. */
#include "output/vtu_read.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "base/scan.h"

enum { VALUE_SIZE = 64 };

/* Finds the value of `name="..."` within a tag of `length` bytes; returns 0 if there is none or it is too long. */
static int attribute(const char *tag, size_t length, const char *name, char value[VALUE_SIZE])
{
  size_t size = strlen(name);
  for (const char *at = tag; at + size + 2 < tag + length; at++) {
    if (at[0] != ' ' || strncmp(at + 1, name, size) || at[size + 1] != '=' || at[size + 2] != '"')
      continue;
    const char *first = at + size + 3, *last = memchr(first, '"', length - (size_t)(first - tag));
    if (!last || last - first >= VALUE_SIZE) return 0;
    memcpy(value, first, (size_t)(last - first));
    value[last - first] = 0;
    return 1;
  }
  return 0;
}

/* Finds the next tag `<name ...>` at or after *at, before `end`; *at is its place. Returns its length; 0: none. */
static size_t next_tag(const char **at, const char *end, const char *name)
{
  size_t size = strlen(name);
  for (const char *c = *at; c + size + 1 < end; c++) {
    if (*c != '<' || strncmp(c + 1, name, size) || !strchr(" />", c[size + 1])) continue;
    const char *close = memchr(c, '>', (size_t)(end - c));
    if (!close) return 0;
    *at = c;
    return (size_t)(close - c) + 1;
  }
  return 0;
}

static int refuse(const char *path, const char *why)
{
  return flesh_fail(FLESH_ERR_FILE, "%s: %s; frames are read as flesh writes them", path, why);
}

static const char *byte_order(void)
{
  const uint16_t one = 1;
  return *(const uint8_t *)&one ? "LittleEndian" : "BigEndian";
}

/* A .vtu in memory. */
typedef struct vtu_file {
  const char *path;
  char *text;
  size_t size;
  const char *data;   /* appended data, after their mark */
  size_t length_size; /* bytes of the length before each array */
  int64_t points;
} vtu_file;

/* Returns the appended data of an array of `points` items; NULL, after setting the error, if there is no such array. */
static const char *find_array(const vtu_file *f, const char *name, const char *type, const char *components, size_t item)
{
  char value[VALUE_SIZE];
  const char *at = f->text, *data_end = f->text + f->size;
  const size_t length_size = f->length_size;
  const uint64_t wanted = item * (uint64_t)f->points;
  for (size_t length; (length = next_tag(&at, f->data, "DataArray")); at += length) {
    if (!attribute(at, length, "Name", value) || strcmp(value, name)) continue;
    if (!attribute(at, length, "type", value) || strcmp(value, type) ||
        !attribute(at, length, "NumberOfComponents", value) || strcmp(value, components) ||
        !attribute(at, length, "offset", value))
      break;
    uint64_t offset = strtoull(value, NULL, 10), room = (uint64_t)(data_end - f->data);
    if (offset > room || room - offset < length_size) break;
    uint32_t narrow;
    uint64_t bytes;
    memcpy(length_size == sizeof narrow ? (void *)&narrow : &bytes, f->data + offset, length_size);
    if (length_size == sizeof narrow) bytes = narrow;
    if (bytes != wanted || room - offset - length_size < bytes) break;
    return f->data + offset + length_size;
  }
  snprintf(value, sizeof value, "there is no complete array '%.20s' of %s", name,
           item == sizeof(int) ? "numbers" : "vectors");
  refuse(f->path, value);
  return NULL;
}

/* Opens the text as a .vtu. The caller frees it, also after an error. */
static int open_vtu(const char *path, char *text, size_t size, vtu_file *f)
{
  static const char mark[] = "<AppendedData encoding=\"raw\">\n_", last[] = "</VTKFile>\n";
  char value[VALUE_SIZE];
  size_t length;
  const char *at = text, *data = strstr(text, mark); /* the header contains no 0 byte */
  *f = (vtu_file){.path = path, .text = text, .size = size, .data = data ? data + sizeof mark - 1 : NULL};
  if (!(length = next_tag(&at, text + size, "VTKFile")) ||
      !attribute(at, length, "byte_order", value) || strcmp(value, byte_order()) || !data)
    return refuse(path, "this is not a .vtu of raw data in this machine's byte order");
  f->length_size = attribute(at, length, "header_type", value) && !strcmp(value, "UInt64") ? 8 : 4; /* VTK's default */
  if (memcmp(text + size - (sizeof last - 1), last, sizeof last - 1)) return refuse(path, "the file is cut off");
  if (!(length = next_tag(&at, data, "Piece")) || !attribute(at, length, "NumberOfPoints", value))
    return refuse(path, "it does not say how many points it has");
  f->points = strtoll(value, NULL, 10);
  return FLESH_OK;
}

static int read_whole(const char *path, char *text, size_t size, int points, int count, const char *const *names,
                      double *const *targets)
{
  vtu_file f;
  int status = open_vtu(path, text, size, &f);
  if (!status && f.points != points)
    status = flesh_fail(FLESH_ERR_FILE, "%s: the frame has %lld points; the mesh has %d nodes", path,
                        (long long)f.points, points);
  for (int k = 0; k < count && !status; k++) {
    const char *values = find_array(&f, names[k], "Float64", "3", 3 * sizeof(double));
    if (values) memcpy(targets[k], values, 3 * sizeof(double) * (size_t)points);
    else status = FLESH_ERR_FILE;
  }
  return status;
}

/* Copies the vectors of a part's points to their places in the whole and marks these in `known`; adds the number of
 * newly marked points to *found. */
static int scatter(const vtu_file *f, int points, int count, const char *const *names, double *const *targets,
                   uint8_t *known, int *found)
{
  const char *numbers = f->points <= points ? find_array(f, "node", "Int32", "1", sizeof(int)) : NULL;
  if (!numbers) return f->points <= points ? FLESH_ERR_FILE : refuse(f->path, "it has more points than the whole");
  for (int k = 0; k < count; k++) {
    const char *values = find_array(f, names[k], "Float64", "3", 3 * sizeof(double));
    if (!values) return FLESH_ERR_FILE;
    for (int64_t i = 0; i < f->points; i++) {
      int node;
      memcpy(&node, numbers + sizeof node * (size_t)i, sizeof node);
      if (node < 0 || node >= points) return refuse(f->path, "it has a node that is not in the mesh");
      memcpy(targets[k] + 3 * (size_t)node, values + 3 * sizeof(double) * (size_t)i, 3 * sizeof(double));
      *found += !known[node];
      known[node] = 1;
    }
  }
  return FLESH_OK;
}

/* Reads the parts that a .pvtu names, which are in its folder. */
static int read_parts(const char *path, const char *text, size_t size, int points, int count, const char *const *names,
                      double *const *targets)
{
  const char *at = text, *slash = strrchr(path, '/');
  char value[VALUE_SIZE], *part = malloc(strlen(path) + VALUE_SIZE + 1);
  uint8_t *known = calloc((size_t)points, 1);
  int found = 0, status = part && known ? FLESH_OK : flesh_no_memory_for(path);
  for (size_t length; !status && (length = next_tag(&at, text + size, "Piece")); at += length) {
    char *data = NULL;
    size_t bytes;
    vtu_file f;
    if (!attribute(at, length, "Source", value) || strchr(value, '/')) {
      status = refuse(path, "a Piece has no plain file name");
      break;
    }
    sprintf(part, "%.*s%s", slash ? (int)(slash - path) + 1 : 0, path, value);
    status = flesh_file_load(part, &data, &bytes);
    if (!status) status = open_vtu(part, data, bytes, &f);
    if (!status) status = scatter(&f, points, count, names, targets, known, &found);
    free(data);
  }
  if (!status && found != points)
    status = flesh_fail(FLESH_ERR_FILE, "%s: the frame's parts have %d nodes; the mesh has %d", path, found, points);
  free(part);
  free(known);
  return status;
}

int flesh_vtu_read(const char *path, int points, int count, const char *const *names,
                   double *const *targets)
{
  char *text, value[VALUE_SIZE];
  size_t size, length;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  const char *at = text;
  length = next_tag(&at, text + size, "VTKFile");
  const int in_parts = length && attribute(at, length, "type", value) && !strcmp(value, "PUnstructuredGrid");
  status = in_parts ? read_parts(path, text, size, points, count, names, targets)
                    : read_whole(path, text, size, points, count, names, targets);
  free(text);
  return status;
}

static int read_pvd(const char *path, const char *text, size_t size, flesh_pvd *pvd)
{
  char time[VALUE_SIZE], file[VALUE_SIZE], why[3 * VALUE_SIZE], *name;
  const char *at = text;
  size_t length = next_tag(&at, text + size, "VTKFile");
  if (!length || !attribute(at, length, "type", time) || strcmp(time, "Collection"))
    return refuse(path, "this is not a .pvd");
  for (; (length = next_tag(&at, text + size, "DataSet")); at += length) {
    if (!attribute(at, length, "timestep", time) || !attribute(at, length, "file", file) ||
        strlen(file) >= FLESH_PVD_NAME_SIZE || strchr(file, '/'))
      return refuse(path, "a DataSet has no timestep or no plain file name");
    int status = flesh_pvd_next(pvd, &name);
    if (status) return status;
    snprintf(name, FLESH_PVD_NAME_SIZE, "%s", file);
    char *end;
    double t = strtod(time, &end);
    if (end == time || *end || !isfinite(t)) {
      snprintf(why, sizeof why, "the timestep of %s is '%s', not a time in seconds", file, time);
      return refuse(path, why);
    }
    pvd->times[pvd->count++] = t;
  }
  return FLESH_OK;
}

int flesh_pvd_read(const char *path, flesh_pvd *pvd)
{
  flesh_plain_locale locale;
  char *text;
  size_t size;
  int status = flesh_plain_locale_begin(&locale);
  if (status) return status;
  status = flesh_file_load(path, &text, &size);
  if (!status) status = read_pvd(path, text, size, pvd);
  free(text);
  flesh_plain_locale_end(&locale);
  return status;
}

int flesh_pvd_resume(const char *path, int every, int last, flesh_pvd *index)
{
  int status = flesh_pvd_read(path, index);
  for (int k = 0; !status && k <= last / every; k++) {
    const char *digits = k < index->count ? strrchr(index->names[k], '_') : NULL;
    if (!digits || atoi(digits + 1) != k * every)
      status = flesh_fail(FLESH_ERR_FILE, "%s: the frame of step %d, which the run had written, is missing", path, k * every);
  }
  if (!status) index->count = last / every + 1;
  return status ? status : flesh_pvd_write(path, index->count, index->times, index->files);
}
