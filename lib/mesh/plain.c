/* plain.c: the plain list: `nodes N`, N rows `x y z`, `tets T`, T rows of four indices from 0; an
 * optional list `fixed N` after them is left unread. */
#include "mesh/formats.h"

#include "base/error.h"

static int read_header(flesh_scanner *s, const char *word, const char *item, int bytes, int *count)
{
  if (!flesh_scan_next(s))
    return flesh_scan_fail(s, "the file ends where `%s N` is expected", word);
  if (!flesh_scan_word(s, word))
    return flesh_scan_fail(s, "%s stands where `%s N` is expected", flesh_scan_show(s), word);
  s->form = "a count";
  int status = flesh_scan_count(s, item, 1, bytes, count);
  return status ? status : flesh_scan_row_end(s);
}

int flesh_plain_read(flesh_scanner *s, flesh_draft *draft)
{
  int nodes = 0, tets = 0, status = read_header(s, "nodes", "number of nodes", 6, &nodes);
  if (!status) status = flesh_draft_set_nodes(draft, nodes);
  for (int n = 0; n < nodes && !status; n++) {
    s->item = "node", s->index = n, s->form = "x y z";
    flesh_scan_next(s);
    for (int d = 0; d < 3 && !status; d++)
      status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + d]);
    if (!status) status = flesh_scan_row_end(s);
  }
  if (!status) status = read_header(s, "tets", "number of tets", 8, &tets);
  if (!status) status = flesh_draft_reserve_tets(draft, tets);
  for (int t = 0; t < tets && !status; t++) {
    int64_t number;
    int tet[4];
    s->item = "tet", s->index = t, s->form = "a b c d";
    flesh_scan_next(s);
    for (int i = 0; i < 4 && !status; i++) {
      status = flesh_scan_integer(s, &number);
      if (!status && (tet[i] = flesh_draft_node(draft, number)) < 0)
        status = flesh_scan_fail(s, "tet %d uses node %lld; the nodes are 0 to %d", t,
                                 (long long)number, nodes - 1);
    }
    if (!status) status = flesh_scan_row_end(s);
    if (!status) status = flesh_draft_add_tet(draft, tet, 0, s->line, t);
  }
  if (!status && flesh_scan_next(s) && !flesh_scan_word(s, "fixed"))
    status = flesh_scan_fail(s,
                             "%s stands behind the last of %d tets; the file must end there or "
                             "go on with `fixed N`",
                             flesh_scan_show(s), tets);
  return status;
}
