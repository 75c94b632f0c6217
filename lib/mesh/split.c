/* split.c: the index of a split mesh, as text: a title, then counts, region tags and a row for each part. */
#include "mesh/split.h"

#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/memory.h"

static const char title[] = "flesh-split-mesh";
enum { VERSION = 3, SUM_SIZE = 32 };

int flesh_split_begins(const flesh_scanner *s)
{
  return (size_t)(s->end - s->at) > sizeof title && !memcmp(s->at, title, sizeof title - 1);
}

int flesh_split_is_index(const char *path)
{
  char begin[sizeof title] = "";
  FILE *file;
  if (flesh_regular_open(path, &file)) return 0;
  const size_t got = fread(begin, 1, sizeof title - 1, file);
  fclose(file);
  return got == sizeof title - 1 && !memcmp(begin, title, got);
}

/* Reads the row `word N` with N from `least` to `most`. */
static int read_number(flesh_scanner *s, const char *word, int64_t least, int64_t most, int64_t *number)
{
  char form[48];
  snprintf(form, sizeof form, "%s N", word);
  s->item = "the index of a split mesh";
  s->form = form;
  s->index = -1;
  if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the file ends where `%s` is expected", form);
  if (!flesh_scan_word(s, word)) return flesh_scan_fail(s, "%s stands where `%s` is expected", flesh_scan_show(s), form);
  int status = flesh_scan_integer(s, number);
  if (!status) status = flesh_scan_row_end(s);
  s->form = NULL;
  if (!status && (*number < least || *number > most))
    status = flesh_scan_fail(s, "%s is %" PRId64 "; it must be %" PRId64 " to %" PRId64, word, *number, least, most);
  return status;
}

static int read_int(flesh_scanner *s, const char *word, int least, int most, int *number)
{
  int64_t wide = 0;
  const int status = read_number(s, word, least, most, &wide);
  *number = (int)wide;
  return status;
}

static int read_regions(flesh_scanner *s, flesh_split *split)
{
  int64_t before = INT64_MIN;
  int status = flesh_scan_count(s, "region tag", 1, 2, &split->region_count);
  if (!status) status = flesh_scan_row_end(s);
  if (!status && !(split->regions = flesh_malloc((size_t)split->region_count * sizeof *split->regions)))
    status = flesh_no_memory_for(s->path);
  for (int k = 0; k < split->region_count && !status; k++) {
    int64_t tag = 0;
    s->item = "region tag", s->index = k, s->form = "tag";
    flesh_scan_next(s);
    status = flesh_scan_integer(s, &tag);
    if (!status) status = flesh_scan_row_end(s);
    if (!status && (tag <= before || tag < INT_MIN || tag > INT_MAX))
      status = flesh_scan_fail(s, "region tag %d is %" PRId64 "; tags must rise and be integers of 32 bits", k, tag);
    split->regions[k] = (int)tag;
    before = tag;
  }
  return status;
}

/* Reads the names of sets, each on a line of its own. */
static int read_sets(flesh_scanner *s, flesh_split *split)
{
  int count, status = flesh_scan_count(s, "set", 0, 2, &count);
  if (!status) status = flesh_scan_row_end(s);
  flesh_scan_skip_line(s);
  for (int k = 0; k < count && !status; k++) {
    const char *end = memchr(s->at, '\n', (size_t)(s->end - s->at)), *name = s->at;
    int set;
    if (!end || end == name) return flesh_scan_fail(s, "the name of set %d is missing; split the mesh again", k);
    status = flesh_mesh_sets_take(&split->sets, name, (size_t)(end - name), &set);
    if (status) return flesh_fail_within(status, "%s:%" PRId64 ": ", s->path, s->line);
    if (set != k) return flesh_scan_fail(s, "the set %s is there twice; split the mesh again", flesh_scan_show(s));
    flesh_scan_skip_line(s);
  }
  return status;
}

static int read_row(flesh_scanner *s, const flesh_split *split, int part, flesh_split_row *row)
{
  int64_t own = 0, tets = 0, nodes = 0, members = 0;
  s->item = "part", s->index = part, s->form = "own-tets tets nodes members-of-sets";
  flesh_scan_next(s);
  int status = flesh_scan_integer(s, &own);
  if (!status) status = flesh_scan_integer(s, &tets);
  if (!status) status = flesh_scan_integer(s, &nodes);
  if (!status) status = flesh_scan_integer(s, &members);
  if (!status) status = flesh_scan_row_end(s);
  if (!status && (own < 1 || own > tets || tets > split->tets || nodes < 4 || nodes > split->nodes))
    status = flesh_scan_fail(s, "part %d has %" PRId64 " own of %" PRId64 " tets and %" PRId64 " nodes, of a mesh of %d "
                             "tets and %d nodes; it must have one own tet at least and no more than the whole",
                             part, own, tets, nodes, split->tets, split->nodes);
  if (!status && (members < 0 || members > INT_MAX / 4))
    status = flesh_scan_fail(s, "part %d has %" PRId64 " members of sets; it must be 0 to %d", part, members, INT_MAX / 4);
  *row = (flesh_split_row){(int)own, (int)tets, (int)nodes, (int)members};
  return status;
}

/* Makes the last line, a checksum of the bytes before it. */
static void sum_line(const char *text, size_t size, char line[SUM_SIZE])
{
  snprintf(line, SUM_SIZE, "sum %016" PRIx64 "\n", flesh_archive_sum(0, text, size));
}

static int check_sum(flesh_scanner *s, int parts)
{
  char line[SUM_SIZE];
  if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the file ends where `sum N` is expected; split the mesh again");
  if (strncmp(s->at, "sum ", 4))
    return flesh_scan_fail(s, "%s stands behind the last of %d parts", flesh_scan_show(s), parts);
  sum_line(s->begin, (size_t)(s->at - s->begin), line);
  if ((size_t)(s->end - s->at) == strlen(line) && !memcmp(s->at, line, strlen(line))) return FLESH_OK;
  return flesh_scan_fail(s, "the index is damaged (the checksum does not match); split the mesh again");
}

static int read_rows(flesh_scanner *s, flesh_split *split)
{
  int64_t sum = 0;
  int status = flesh_scan_count(s, "part", 1, 8, &split->parts);
  if (!status) status = flesh_scan_row_end(s);
  if (!status && !(split->rows = flesh_calloc((size_t)split->parts, sizeof *split->rows)))
    status = flesh_no_memory_for(s->path);
  for (int k = 0; k < split->parts && !status; k++) {
    status = read_row(s, split, k, &split->rows[k]);
    sum += split->rows[k].own;
  }
  if (!status && sum != split->tets)
    status = flesh_scan_fail(s, "the parts have %" PRId64 " tets of their own, the whole has %d", sum, split->tets);
  return status ? status : check_sum(s, split->parts);
}

/* Reads the word that must come before a count. */
static int expect(flesh_scanner *s, const char *word)
{
  s->item = word, s->form = "a count", s->index = -1;
  if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the file ends where `%s N` is expected", word);
  return flesh_scan_word(s, word) ? FLESH_OK
                                  : flesh_scan_fail(s, "%s stands where `%s N` is expected", flesh_scan_show(s), word);
}

int flesh_split_read(flesh_scanner *s, flesh_split *split)
{
  int version;
  *split = (flesh_split){.path = flesh_malloc(strlen(s->path) + 1)};
  if (!split->path) return flesh_no_memory_for(s->path);
  strcpy(split->path, s->path);
  int status = read_int(s, title, VERSION, VERSION, &version);
  if (!status) status = read_number(s, "mark", 0, INT64_MAX, &split->mark);
  if (!status) status = read_int(s, "order", 1, 2, &split->order);
  if (!status) status = read_int(s, "nodes", 4, INT_MAX / 3, &split->nodes);
  if (!status) status = read_int(s, "tets", 1, flesh_mesh_most_tets(split->order), &split->tets);
  if (!status) status = expect(s, "regions");
  if (!status) status = read_regions(s, split);
  if (!status) status = expect(s, "sets");
  if (!status) status = read_sets(s, split);
  if (!status) status = expect(s, "parts");
  return status ? status : read_rows(s, split);
}

int flesh_split_open(const char *path, flesh_split *split)
{
  flesh_scanner scanner;
  *split = (flesh_split){0};
  int status = flesh_scan_open(&scanner, path);
  if (!status) status = flesh_split_read(&scanner, split);
  flesh_scan_close(&scanner);
  return status;
}

void flesh_split_close(flesh_split *split)
{
  flesh_free(split->path);
  flesh_free(split->regions);
  flesh_free(split->rows);
  flesh_mesh_sets_clear(&split->sets);
  *split = (flesh_split){0};
}

/* Returns the path of a file in the folder, new; NULL without memory. */
static char *path_in(const char *folder, const char *name)
{
  char *path = flesh_malloc(strlen(folder) + strlen(name) + 2);
  if (path) sprintf(path, "%s/%s", folder, name);
  return path;
}

int flesh_split_begin(const char *folder)
{
  int status = flesh_folder_make(folder);
  if (status) return status;
  char *path = path_in(folder, "index.txt");
  if (!path) return flesh_no_memory_for(folder);
  if (!flesh_path_access(path, F_OK) && !flesh_split_is_index(path))
    status = flesh_fail(FLESH_ERR_FILE, "%s: exists and is no index of a split mesh; choose another folder", path);
  else flesh_path_unlink(path);
  flesh_free(path);
  flesh_folder_clear(folder);
  return status;
}

/* Removes the files of parts from number `from` on, which an older split with more parts left. */
static void drop_parts(const char *folder, int from)
{
  char name[32];
  for (int gone = 0; !gone && from < INT_MAX; from++) {
    snprintf(name, sizeof name, "part_%05d.bin", from);
    char *path = path_in(folder, name);
    gone = !path || flesh_path_unlink(path);
    flesh_free(path);
  }
}

static void print_index(FILE *stream, const flesh_split *split)
{
  fprintf(stream, "%s %d\nmark %" PRId64 "\norder %d\nnodes %d\ntets %d\nregions %d\n", title, VERSION, split->mark,
          split->order, split->nodes, split->tets, split->region_count);
  for (int k = 0; k < split->region_count; k++) fprintf(stream, "%d\n", split->regions[k]);
  fprintf(stream, "sets %d\n", split->sets.count);
  for (int k = 0; k < split->sets.count; k++) fprintf(stream, "%s\n", split->sets.sets[k].name);
  fprintf(stream, "parts %d\n", split->parts);
  for (int k = 0; k < split->parts; k++)
    fprintf(stream, "%d %d %d %d\n", split->rows[k].own, split->rows[k].tets, split->rows[k].nodes, split->rows[k].members);
}

int flesh_split_write_index(const flesh_split *split, const char *folder)
{
  flesh_file file;
  char *path = path_in(folder, "index.txt");
  if (!path) return flesh_no_memory_for(folder);
  drop_parts(folder, split->parts);
  int status = flesh_file_open(path, &file);
  flesh_free(path);
  if (status) return status;
  char *text = NULL, line[SUM_SIZE];
  size_t size = 0;
  FILE *stream = open_memstream(&text, &size);
  if (stream) print_index(stream, split);
  if (!stream || fclose(stream) || !text) {
    free(text);
    flesh_file_abandon(&file);
    return flesh_no_memory_for(folder);
  }
  sum_line(text, size, line);
  fwrite(text, 1, size, file.stream);
  fputs(line, file.stream);
  free(text);
  return flesh_file_commit(&file);
}
