/* json_memory.c: watches jansson's memory; makes JSON texts and numbers; reads and writes JSON files. */
#include "cli/json_memory.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/scan.h"
#include "cli/path.h"

static atomic_int lacks;

static void *take(size_t size)
{
  void *memory = malloc(size);
  if (!memory) lacks = 1;
  return memory;
}

void flesh_json_watch(void) { json_set_alloc_funcs(take, free); }

void flesh_json_note_lack(void) { lacks = 1; }

int flesh_json_lacks(void) { return lacks; }

json_t *flesh_json_bytes(const char *bytes, size_t size)
{
  char *copy = malloc(size + 1);
  if (!copy) {
    flesh_json_note_lack();
    return NULL;
  }
  memcpy(copy, bytes, size);
  copy[size] = 0;
  flesh_text_mend(copy, size);
  json_t *value = json_string(copy);
  free(copy);
  return value;
}

json_t *flesh_json_text(const char *text) { return flesh_json_bytes(text, strlen(text)); }

json_t *flesh_json_number(double value) { return isfinite(value) ? json_real(value) : json_null(); }

json_t *flesh_json_numbers(int count, const double *values)
{
  json_t *array = json_array();
  for (int k = 0; k < count; k++) json_array_append_new(array, flesh_json_number(values[k]));
  return array;
}

int flesh_json_read(const char *path, json_t **value)
{
  char *text = NULL;
  size_t size = 0;
  const int status = flesh_file_load(path, &text, &size);
  *value = status ? NULL : json_loadb(text, size, 0, NULL);
  free(text);
  if (status || *value) return status;
  return lacks ? flesh_no_memory_for(path)
               : flesh_fail(FLESH_ERR_FILE, "%s: there is no JSON that can be read in it", path);
}

int flesh_json_write(const char *path, json_t *value)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (!status) {
    const int bad = json_dumpf(value, file.stream, JSON_INDENT(2));
    putc('\n', file.stream);
    const int lacks_memory = (bad || flesh_json_lacks()) && !ferror(file.stream);
    if (lacks_memory) flesh_file_abandon(&file);
    status = lacks_memory ? flesh_no_memory_for(path) : flesh_file_commit(&file);
  }
  json_decref(value);
  return status;
}
