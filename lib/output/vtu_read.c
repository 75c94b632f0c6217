/* vtu_read.c: reads the XML that vtu.c writes, by its tags; other VTK files are refused. */
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

/* The value of `name="..."` within a tag of `length` bytes; 0 when there is none or it is long. */
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

/* The next tag `<name ...>` at or after *at, before `end`; its length, and *at on it. 0: none. */
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

/* Copies a vector array out of the appended data. */
static int read_array(const char *path, const char *header, const char *header_end,
                      const char *data, const char *data_end, const char *name, int points,
                      double *target)
{
  char value[VALUE_SIZE];
  const char *at = header;
  uint64_t bytes, wanted = 3 * sizeof(double) * (uint64_t)points;
  for (size_t length; (length = next_tag(&at, header_end, "DataArray")); at += length) {
    if (!attribute(at, length, "Name", value) || strcmp(value, name)) continue;
    if (!attribute(at, length, "type", value) || strcmp(value, "Float64") ||
        !attribute(at, length, "NumberOfComponents", value) || strcmp(value, "3") ||
        !attribute(at, length, "offset", value))
      break;
    uint64_t offset = strtoull(value, NULL, 10), room = (uint64_t)(data_end - data);
    if (offset > room || room - offset < sizeof bytes) break;
    memcpy(&bytes, data + offset, sizeof bytes);
    if (bytes != wanted || room - offset - sizeof bytes < bytes) break;
    memcpy(target, data + offset + sizeof bytes, bytes);
    return FLESH_OK;
  }
  snprintf(value, sizeof value, "there is no whole array '%.20s' of vectors", name);
  return refuse(path, value);
}

int flesh_vtu_read(const char *path, int points, int count, const char *const *names,
                   double *const *targets)
{
  char *text, value[VALUE_SIZE];
  size_t size, length;
  int status = flesh_file_load(path, &text, &size);
  if (status) return status;
  static const char mark[] = "<AppendedData encoding=\"raw\">\n_", last[] = "</VTKFile>\n";
  const char *at = text, *data = strstr(text, mark); /* the header holds no 0 */
  if (!(length = next_tag(&at, text + size, "VTKFile")) ||
      !attribute(at, length, "byte_order", value) || strcmp(value, byte_order()) || !data)
    status = refuse(path, "this is no .vtu of raw data in this machine's byte order");
  else if (memcmp(text + size - (sizeof last - 1), last, sizeof last - 1))
    status = refuse(path, "the file is cut off");
  else if (!(length = next_tag(&at, data, "Piece")) ||
           !attribute(at, length, "NumberOfPoints", value))
    status = refuse(path, "it does not say how many points it has");
  else if (strtoll(value, NULL, 10) != points)
    status = flesh_fail(FLESH_ERR_FILE, "%s: the frame has %s points; the mesh has %d nodes", path,
                        value, points);
  for (int k = 0; k < count && !status; k++)
    status = read_array(path, text, data, data + sizeof mark - 1, text + size, names[k], points,
                        targets[k]);
  free(text);
  return status;
}

static int read_pvd(const char *path, const char *text, size_t size, flesh_pvd *pvd)
{
  char time[VALUE_SIZE], file[VALUE_SIZE], why[3 * VALUE_SIZE], *name;
  const char *at = text;
  size_t length = next_tag(&at, text + size, "VTKFile");
  if (!length || !attribute(at, length, "type", time) || strcmp(time, "Collection"))
    return refuse(path, "this is no .pvd");
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
      snprintf(why, sizeof why, "the timestep of %s is '%s', no time in seconds", file, time);
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
      status = flesh_fail(FLESH_ERR_FILE, "%s: the frame of step %d is missing, which the run had written", path, k * every);
  }
  if (!status) index->count = last / every + 1;
  return status ? status : flesh_pvd_write(path, index->count, index->times, index->files);
}
