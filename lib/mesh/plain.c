/* plain.c: the plain list: `nodes N`, N rows `x y z`, `tets T`, T rows of four indices from 0, or `tets10 T`, T rows of
 * ten with the edges in VTK's order; an optional list `fixed N` after them is ignored. */
#include "mesh/formats.h"

static int read_count(flesh_scanner *s, const char *item, int bytes, int *count)
{
  s->form = "a count";
  int status = flesh_scan_count(s, item, 1, bytes, count);
  return status ? status : flesh_scan_row_end(s);
}

static int expect(flesh_scanner *s, const char *word)
{
  if (!flesh_scan_next(s))
    return flesh_scan_fail(s, "the file ends where `%s N` is expected", word);
  return FLESH_OK;
}

static int not_expected(flesh_scanner *s, const char *word)
{
  return flesh_scan_fail(s, "%s stands where `%s N` is expected", flesh_scan_show(s), word);
}

/* Reads the row `tets T` or `tets10 T`. */
static int read_tet_header(flesh_scanner *s, int *size, int *tets)
{
  int status = expect(s, "tets");
  if (status) return status;
  *size = flesh_scan_word(s, "tets10") ? 10 : 4;
  if (*size == 4 && !flesh_scan_word(s, "tets")) return not_expected(s, "tets");
  return read_count(s, "number of tets", 2 * *size, tets);
}

static int read_tet(flesh_scanner *s, flesh_draft *draft, int size, int t)
{
  int64_t number;
  int tet[10], status = FLESH_OK;
  s->item = "tet", s->index = t, s->form = size == 4 ? "a b c d" : "a b c d ab bc ac ad bd cd";
  flesh_scan_next(s);
  for (int i = 0; i < size && !status; i++) {
    status = flesh_scan_integer(s, &number);
    if (!status && (tet[i] = flesh_draft_node(draft, number)) < 0)
      status = flesh_scan_fail(s, "tet %d uses node %lld; the nodes are 0 to %d", t,
                               (long long)number, draft->nodes - 1);
  }
  if (!status) status = flesh_scan_row_end(s);
  return status ? status : flesh_draft_add_tet(draft, size, tet, 0, s->line, t);
}

int flesh_plain_read(flesh_scanner *s, flesh_draft *draft)
{
  int nodes = 0, tets = 0, size = 4, status = expect(s, "nodes");
  if (!status && !flesh_scan_word(s, "nodes")) status = not_expected(s, "nodes");
  if (!status) status = read_count(s, "number of nodes", 6, &nodes);
  if (!status) status = flesh_draft_set_nodes(draft, nodes);
  for (int n = 0; n < nodes && !status; n++) {
    s->item = "node", s->index = n, s->form = "x y z";
    flesh_scan_next(s);
    for (int d = 0; d < 3 && !status; d++)
      status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + d]);
    if (!status) status = flesh_scan_row_end(s);
  }
  if (!status) status = read_tet_header(s, &size, &tets);
  if (!status) status = flesh_draft_reserve_tets(draft, size, tets);
  for (int t = 0; t < tets && !status; t++) status = read_tet(s, draft, size, t);
  if (!status && flesh_scan_next(s) && !flesh_scan_word(s, "fixed"))
    status = flesh_scan_fail(s,
                             "%s stands behind the last of %d tets; the file must end there or "
                             "go on with `fixed N`",
                             flesh_scan_show(s), tets);
  return status;
}
