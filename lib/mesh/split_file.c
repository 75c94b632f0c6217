/* split_file.c: the file of a part: a header of numbers, the arrays as they are in memory, and a checksum of both. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/archive.h"
#include "base/confine.h"
#include "base/error.h"
#include "base/file.h"
#include "base/memory.h"
#include "mesh/split.h"

/* The header, 64 bits each: a mark of the byte order, then numbers that the index has, too. */
enum { BYTE_ORDER_MARK, MARK, PARTS, PART, ORDER, WHOLE_NODES, WHOLE_TETS, NODES, TETS, MEMBERS, HEAD_NUMBERS };
static const int64_t byte_order_mark = 0x0102030405060708;
static const char title[16] = "flesh part 2\n";

enum { ARRAYS = 8, HEAD_BYTES = 16 + 8 * HEAD_NUMBERS, SUM_BYTES = 8 };

/* An array of a part, as bytes. */
typedef struct array {
  void **place;
  size_t bytes;
} array;

/* Lists the arrays in the order of the file. */
static void list_arrays(flesh_split_arrays *a, int order, array arrays[ARRAYS])
{
  const size_t nodes = (size_t)a->nodes, tets = (size_t)a->tets;
  arrays[0] = (array){(void **)&a->positions, 3 * nodes * sizeof *a->positions};
  arrays[1] = (array){(void **)&a->node_numbers, nodes * sizeof *a->node_numbers};
  arrays[2] = (array){(void **)&a->tet_nodes, 4 * tets * sizeof *a->tet_nodes};
  arrays[3] = (array){(void **)&a->edge_nodes, order == 2 ? 6 * tets * sizeof *a->edge_nodes : 0};
  arrays[4] = (array){(void **)&a->regions, tets * sizeof *a->regions};
  arrays[5] = (array){(void **)&a->tet_numbers, tets * sizeof *a->tet_numbers};
  arrays[6] = (array){(void **)&a->owners, tets * sizeof *a->owners};
  arrays[7] = (array){(void **)&a->members, (size_t)a->member_count * sizeof *a->members};
}

int flesh_split_arrays_take(flesh_split_arrays *a, const flesh_split_row *counts, int order)
{
  array arrays[ARRAYS];
  int failed = 0;
  *a = (flesh_split_arrays){.nodes = counts->nodes, .tets = counts->tets, .member_count = counts->members};
  list_arrays(a, order, arrays);
  for (int k = 0; k < ARRAYS; k++)
    if (arrays[k].bytes) failed |= !(*arrays[k].place = flesh_malloc(arrays[k].bytes));
  return failed ? flesh_fail(FLESH_ERR_MEMORY, "out of memory for a part of %d tets", counts->tets) : FLESH_OK;
}

void flesh_split_arrays_clear(flesh_split_arrays *a)
{
  array arrays[ARRAYS];
  list_arrays(a, 2, arrays);
  for (int k = 0; k < ARRAYS; k++) flesh_free(*arrays[k].place);
  *a = (flesh_split_arrays){0};
}

/* Returns the path of a part's file in `folder`, or beside the index if that is NULL; new. NULL without memory. */
static char *path_of(const flesh_split *split, const char *folder, int part)
{
  const char *slash = folder ? NULL : strrchr(split->path, '/');
  const int length = folder ? (int)strlen(folder) : slash ? (int)(slash - split->path) : 1;
  char *path = flesh_malloc((size_t)length + 32);
  if (path) sprintf(path, "%.*s/part_%05d.bin", length, folder ? folder : slash ? split->path : ".", part);
  return path;
}

static void fill_head(const flesh_split *split, int part, const flesh_split_row *counts, int64_t head[HEAD_NUMBERS])
{
  const int64_t numbers[HEAD_NUMBERS] = {byte_order_mark, split->mark,  split->parts, part, split->order,
                                         split->nodes,    split->tets, counts->nodes, counts->tets, counts->members};
  memcpy(head, numbers, sizeof numbers);
}

int flesh_split_write_part(flesh_split *split, const char *folder, int part, const flesh_split_arrays *a)
{
  array arrays[ARRAYS];
  flesh_split_arrays copy = *a;
  flesh_file file;
  int64_t head[HEAD_NUMBERS];
  char *path = path_of(split, folder, part);
  if (!path) return flesh_no_memory_for(folder);
  int status = flesh_file_open(path, &file);
  flesh_free(path);
  if (status) return status;
  split->rows[part] = (flesh_split_row){.tets = a->tets, .nodes = a->nodes, .members = a->member_count};
  fill_head(split, part, &split->rows[part], head);
  uint64_t sum = flesh_archive_sum(0, head, sizeof head);
  fwrite(title, 1, sizeof title, file.stream);
  fwrite(head, 1, sizeof head, file.stream);
  list_arrays(&copy, split->order, arrays);
  for (int k = 0; k < ARRAYS; k++) {
    if (!arrays[k].bytes) continue;
    sum = flesh_archive_sum(sum, *arrays[k].place, arrays[k].bytes);
    fwrite(*arrays[k].place, 1, arrays[k].bytes, file.stream);
  }
  fwrite(&sum, 1, sizeof sum, file.stream);
  flesh_split_row *row = &split->rows[part];
  for (int t = 0; t < a->tets; t++) row->own += a->owners[t] == part;
  return flesh_file_commit(&file);
}

/* Checks that the header agrees with the index. */
static int check_head(const flesh_split *split, const char *path, int part, const int64_t head[HEAD_NUMBERS])
{
  int64_t wanted[HEAD_NUMBERS];
  fill_head(split, part, &split->rows[part], wanted);
  if (head[BYTE_ORDER_MARK] != byte_order_mark)
    return flesh_fail(FLESH_ERR_FILE, "%s: its numbers are not in this machine's byte order; split the mesh here", path);
  if (head[MARK] != wanted[MARK] || memcmp(head, wanted, sizeof wanted))
    return flesh_fail(FLESH_ERR_FILE, "%s: the part is not of the split mesh of %s; split the mesh again", path, split->path);
  return FLESH_OK;
}

static int is_rising(const int *numbers, int count, int end)
{
  for (int k = 0; k < count; k++)
    if (numbers[k] < 0 || numbers[k] >= end || (k && numbers[k] <= numbers[k - 1])) return 0;
  return 1;
}

/* Checks the numbers that flesh_mesh_build does not check: owners, nodes in range, rising numbers in the whole. */
static int check_arrays(const flesh_split *split, const char *path, int part, const flesh_split_arrays *a)
{
  int own = 0, inside = 1;
  for (int t = 0; t < a->tets; t++) {
    inside &= a->owners[t] >= 0 && a->owners[t] < split->parts;
    own += a->owners[t] == part;
  }
  for (size_t k = 0; k < 4 * (size_t)a->tets; k++) inside &= a->tet_nodes[k] >= 0 && a->tet_nodes[k] < a->nodes;
  for (size_t k = 0; a->edge_nodes && k < 6 * (size_t)a->tets; k++)
    inside &= a->edge_nodes[k] >= -1 && a->edge_nodes[k] < a->nodes;
  if (inside && own == split->rows[part].own && is_rising(a->node_numbers, a->nodes, split->nodes) &&
      is_rising(a->tet_numbers, a->tets, split->tets))
    return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE, "%s: the part is inconsistent; split the mesh again", path);
}

/* Checks that the file is there and has exactly the size that follows from the index. */
static int check_size(const flesh_split *split, const char *path, int part, size_t *bytes)
{
  flesh_split_arrays counts = {.nodes = split->rows[part].nodes, .tets = split->rows[part].tets,
                               .member_count = split->rows[part].members};
  array arrays[ARRAYS];
  size_t wanted = HEAD_BYTES + SUM_BYTES;
  struct stat info;
  list_arrays(&counts, split->order, arrays);
  for (int k = 0; k < ARRAYS; k++) wanted += arrays[k].bytes;
  if (flesh_path_stat(path, &info))
    return flesh_fail(FLESH_ERR_FILE, "%s: part %d of the split mesh of %s cannot be opened: %s", path, part, split->path,
                      strerror(errno));
  *bytes = wanted;
  return S_ISREG(info.st_mode) && (size_t)info.st_size != wanted
             ? flesh_fail(FLESH_ERR_FILE, "%s: the part has %lld bytes; by the index %s it has %zu", path,
                          (long long)info.st_size, split->path, wanted)
             : FLESH_OK;
}

int flesh_split_check_files(const flesh_split *split)
{
  int status = FLESH_OK;
  for (int part = 0; part < split->parts && !status; part++) {
    size_t bytes;
    char *path = path_of(split, NULL, part);
    status = path ? check_size(split, path, part, &bytes) : flesh_no_memory_for(split->path);
    flesh_free(path);
  }
  return status;
}

static int load(const flesh_split *split, const char *path, int part, char **data)
{
  size_t wanted = 0, size = 0;
  int status = check_size(split, path, part, &wanted);
  if (!status) status = flesh_file_load(path, data, &size);
  if (!status && size != wanted) status = flesh_fail(FLESH_ERR_FILE, "%s: the part has changed while it was read", path);
  return status;
}

/* Fills the arrays from the bytes of a file. */
static int take(const flesh_split *split, const char *path, int part, const char *data, flesh_split_arrays *a)
{
  array arrays[ARRAYS];
  int64_t head[HEAD_NUMBERS];
  uint64_t sum, given;
  if (memcmp(data, title, sizeof title))
    return flesh_fail(FLESH_ERR_FILE, "%s: the file is no part of a split mesh", path);
  memcpy(head, data + sizeof title, sizeof head);
  int status = check_head(split, path, part, head);
  if (!status) status = flesh_split_arrays_take(a, &split->rows[part], split->order);
  if (status) return status;
  const char *at = data + HEAD_BYTES;
  sum = flesh_archive_sum(0, head, sizeof head);
  list_arrays(a, split->order, arrays);
  for (int k = 0; k < ARRAYS; k++) {
    if (!arrays[k].bytes) continue;
    memcpy(*arrays[k].place, at, arrays[k].bytes);
    sum = flesh_archive_sum(sum, *arrays[k].place, arrays[k].bytes);
    at += arrays[k].bytes;
  }
  memcpy(&given, at, sizeof given);
  if (sum != given)
    return flesh_fail(FLESH_ERR_FILE, "%s: the part is damaged (the checksum does not match); split the mesh again",
                      path);
  return check_arrays(split, path, part, a);
}

int flesh_split_load_part(const flesh_split *split, int part, flesh_split_arrays *arrays)
{
  char *path = path_of(split, NULL, part), *data = NULL;
  *arrays = (flesh_split_arrays){0};
  if (!path) return flesh_no_memory_for(split->path);
  int status = load(split, path, part, &data);
  if (!status) status = take(split, path, part, data, arrays);
  free(data);
  flesh_free(path);
  return status;
}
