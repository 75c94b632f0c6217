/* tetgen.c: TetGen's pair of files. `.node`: "points 3 attributes markers", then rows "index x y z attributes...
 * marker"; `.ele`: "tets 4 attributes", then rows "index a b c d attributes...". The first index of the .node file, 0
 * or 1, is the base of all others (TetGen manual, section 5). With -o2 the tets have ten nodes. */
#include "mesh/formats.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"

/* Reads the header row: the number of rows, then up to three more numbers; missing ones are taken from `defaults`. */
static int read_header(flesh_scanner *s, const char *item, const char *form, int bytes,
                       const int64_t defaults[4], int64_t values[4])
{
  s->form = form;
  if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the file is empty; `%s` is expected", form);
  int count, status = flesh_scan_count(s, item, 1, bytes, &count);
  values[0] = count;
  for (int i = 1; i < 4 && !status; i++) {
    values[i] = defaults[i];
    if (!flesh_scan_next_in_line(s)) continue;
    status = flesh_scan_integer(s, &values[i]);
    if (!status && (values[i] < 0 || values[i] > 1000000))
      status = flesh_scan_fail(s, "the header has %lld where `%s` is expected",
                               (long long)values[i], form);
  }
  return status ? status : flesh_scan_row_end(s);
}

static int skip_reals(flesh_scanner *s, int64_t count)
{
  double ignored;
  int status = FLESH_OK;
  for (int64_t i = 0; i < count && !status; i++) status = flesh_scan_real(s, &ignored);
  return status;
}

/* Reads a row's own index, which must be `expected`. */
static int read_index(flesh_scanner *s, int64_t expected)
{
  int64_t index;
  s->index = expected;
  flesh_scan_next(s);
  int status = flesh_scan_integer(s, &index);
  if (!status && index != expected)
    status =
        flesh_scan_fail(s, "%s %lld stands where %s %lld is expected; rows are numbered in order",
                        s->item, (long long)index, s->item, (long long)expected);
  return status;
}

static int read_nodes(flesh_scanner *s, flesh_draft *draft)
{
  static const int64_t defaults[4] = {0, 3, 0, 0};
  int64_t header[4];
  int status = read_header(s, "number of nodes", "nodes 3 attributes markers", 8, defaults, header);
  if (status) return status;
  if (header[1] != 3)
    return flesh_scan_fail(s, "the nodes have dimension %lld; it must be 3", (long long)header[1]);
  if (header[3] > 1)
    return flesh_scan_fail(s, "the number of boundary markers is %lld; it must be 0 or 1",
                           (long long)header[3]);
  int nodes = (int)header[0];
  status = flesh_draft_set_nodes(draft, nodes);
  s->item = "node", s->form = "index x y z attributes marker";
  for (int n = 0; n < nodes && !status; n++) {
    s->index = draft->node_base + (int64_t)n;
    if (!n) {
      flesh_scanner first = *s;
      int64_t index;
      flesh_scan_next(&first);
      if ((status = flesh_scan_integer(&first, &index))) break;
      if (index != 0 && index != 1)
        return flesh_scan_fail(&first, "the first node has index %lld; it must be 0 or 1",
                               (long long)index);
      draft->node_base = (int)index;
    }
    status = read_index(s, draft->node_base + (int64_t)n);
    for (int d = 0; d < 3 && !status; d++)
      status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + d]);
    if (!status) status = skip_reals(s, header[2] + header[3]);
    if (!status) status = flesh_scan_row_end(s);
  }
  if (!status && flesh_scan_next(s))
    status = flesh_scan_fail(s, "%s stands behind the last of %d nodes; the file must end there",
                             flesh_scan_show(s), nodes);
  return status;
}

/* Reads the region attribute: TetGen writes an integer, other programs a real of the same value. */
static int read_region(flesh_scanner *s, int *region)
{
  double value;
  int status = flesh_scan_real(s, &value);
  if (status) return status;
  if (value != floor(value) || fabs(value) > INT_MAX)
    return flesh_scan_fail(s,
                           "tet %lld has the region attribute %.17g; it must be an integer of 32 "
                           "bits",
                           (long long)s->index, value);
  *region = (int)value;
  return FLESH_OK;
}

static int read_tets(flesh_scanner *s, flesh_draft *draft)
{
  static const int64_t defaults[4] = {0, 4, 0, 0};
  int64_t header[4];
  int status = read_header(s, "number of tets", "tets 4 attributes", 10, defaults, header);
  if (status) return status;
  if (header[1] != 4 && header[1] != 10)
    return flesh_scan_fail(s, "the tets have %lld nodes; they must have 4 or 10",
                           (long long)header[1]);
  const int tets = (int)header[0], size = (int)header[1];
  status = flesh_draft_reserve_tets(draft, size, tets);
  s->item = "tet", s->form = size == 4 ? "index a b c d region" : "index a b c d cd ad ab bc bd ac region";
  for (int t = 0; t < tets && !status; t++) {
    int tet[10], region = 0;
    int64_t number;
    status = read_index(s, draft->node_base + (int64_t)t);
    for (int i = 0; i < size && !status; i++) {
      status = flesh_scan_integer(s, &number);
      if (!status && (tet[flesh_tetgen_order[i]] = flesh_draft_node(draft, number)) < 0)
        status = flesh_scan_fail(s, "tet %lld uses node %lld; the nodes are %d to %d",
                                 (long long)s->index, (long long)number, draft->node_base,
                                 draft->node_base + draft->nodes - 1);
    }
    if (!status && header[2] > 0) status = read_region(s, &region);
    if (!status) status = skip_reals(s, header[2] - 1);
    if (!status) status = flesh_scan_row_end(s);
    if (!status) status = flesh_draft_add_tet(draft, size, tet, region, s->line, s->index);
  }
  if (!status && flesh_scan_next(s))
    status = flesh_scan_fail(s, "%s stands behind the last of %d tets; the file must end there",
                             flesh_scan_show(s), tets);
  return status;
}

static int ends_with(const char *path, const char *suffix)
{
  size_t length = strlen(path), tail = strlen(suffix);
  return length > tail && !strcmp(path + length - tail, suffix);
}

int flesh_tetgen_read(flesh_scanner *s, flesh_draft *draft)
{
  int given_node = ends_with(s->path, ".node");
  if (!given_node && !ends_with(s->path, ".ele"))
    return flesh_scan_fail(s, "the file begins with a number, as TetGen's do, but is named neither "
                              ".node nor .ele");
  size_t stem = strlen(s->path) - (given_node ? 5 : 4);
  char *partner = malloc(stem + 6);
  if (!partner) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a path");
  memcpy(partner, s->path, stem);
  strcpy(partner + stem, given_node ? ".ele" : ".node");
  flesh_scanner other;
  int status = flesh_scan_open(&other, partner);
  if (status) {
    flesh_fail_within(status, "%s holds only the %s; ", s->path, given_node ? "nodes" : "tets");
    goto done;
  }
  status = read_nodes(given_node ? s : &other, draft);
  if (!status) status = read_tets(given_node ? &other : s, draft);
  if (given_node && !status) {
    /* From here on, errors in tets refer to the .ele file. */
    draft->path = partner;
    draft->owned_path = partner;
    partner = NULL;
  }
done:
  flesh_scan_close(&other);
  free(partner);
  return status;
}
