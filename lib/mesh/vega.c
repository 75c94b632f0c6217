/* vega.c: VegaFEM's text files, .veg: *VERTICES, "vertices 3 0 0" and rows "index x y z"; *ELEMENTS, TET, "tets 4 0"
 * and rows "index a b c d"; then in any order *MATERIAL NAME with a row, *REGION with a row "set, material" and *SET
 * NAME with the numbers of tets (VegaFEM, library volumetricMesh). Numbers begin with 0 or 1, separately for vertices
 * and elements, as the first row of each says. A comma separates as a blank does. */
#include "mesh/formats.h"

#include <string.h>

#include "base/error.h"

typedef struct vega {
  flesh_scanner *s;
  flesh_draft *draft;
  int tet_base; /* number of the first tet */
  int regions;
} vega;

static int fail_expected(flesh_scanner *s, const char *expected)
{
  if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the file ends where %s is expected", expected);
  return flesh_scan_fail(s, "%s stands where %s is expected", flesh_scan_show(s), expected);
}

/* Reads a row that begins with a count; the rest of the row is ignored. */
static int read_count(flesh_scanner *s, const char *item, const char *form, int bytes, int *count)
{
  s->form = form;
  flesh_scan_next(s);
  const int status = flesh_scan_count(s, item, 1, bytes, count);
  flesh_scan_skip_line(s);
  return status;
}

/* Reads a row's own number, which is 0 or 1 in the first row and rises by one. */
static int read_number(flesh_scanner *s, int row, int *base)
{
  int64_t number;
  s->index = row ? row + *base : -1;
  flesh_scan_next(s);
  const int status = flesh_scan_integer(s, &number);
  if (status) return status;
  if (!row && number != 0 && number != 1)
    return flesh_scan_fail(s, "the first %s has number %lld; it must be 0 or 1", s->item, (long long)number);
  if (!row) *base = (int)number;
  if (number != row + *base)
    return flesh_scan_fail(s, "%s %lld stands where %s %d is expected; rows are numbered in order", s->item,
                           (long long)number, s->item, row + *base);
  s->index = number;
  return FLESH_OK;
}

static int read_vertices(flesh_scanner *s, flesh_draft *draft)
{
  int count;
  int status = read_count(s, "number of vertices", "vertices 3 0 0", 8, &count);
  if (!status) status = flesh_draft_set_nodes(draft, count);
  for (int n = 0; n < count && !status; n++) {
    s->item = "vertex", s->form = "number x y z";
    status = read_number(s, n, &draft->node_base);
    for (int c = 0; c < 3 && !status; c++) status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + (size_t)c]);
    if (!status) status = flesh_scan_row_end(s);
  }
  return status;
}

static int read_tet(vega *v, int t)
{
  flesh_scanner *s = v->s;
  int tet[4];
  s->item = "tet", s->form = "number a b c d";
  int status = read_number(s, t, &v->tet_base);
  for (int a = 0; a < 4 && !status; a++) {
    int64_t number;
    status = flesh_scan_integer(s, &number);
    if (!status && (tet[a] = flesh_draft_node(v->draft, number)) < 0)
      status = flesh_scan_fail(s, "tet %lld uses vertex %lld; the vertices are %d to %d", (long long)s->index,
                               (long long)number, v->draft->node_base, v->draft->node_base + v->draft->nodes - 1);
  }
  if (!status) status = flesh_scan_row_end(s);
  return status ? status : flesh_draft_add_tet(v->draft, 4, tet, 0, s->line, t + v->tet_base);
}

static int read_elements(vega *v)
{
  flesh_scanner *s = v->s;
  int count;
  if (!flesh_scan_next(s) || !(flesh_scan_word(s, "TET") || flesh_scan_word(s, "TETS")))
    return fail_expected(s, "the kind of elements TET (no other is read)");
  int status = read_count(s, "number of tets", "tets 4 0", 10, &count);
  if (!status) status = flesh_draft_reserve_tets(v->draft, 4, count);
  for (int t = 0; t < count && !status; t++) status = read_tet(v, t);
  return status;
}

static int no_more_sets(const flesh_scanner *s, int status)
{
  return flesh_fail_within(status, "%s:%lld: ", s->path, (long long)s->line);
}

/* Reads *SET NAME and the numbers of its tets, on any number of lines. */
static int read_set(vega *v)
{
  flesh_scanner *s = v->s;
  const char *name;
  int set;
  if (!flesh_scan_next_in_line(s)) return fail_expected(s, "the set's name (*SET NAME)");
  const size_t length = flesh_scan_token(s, &name);
  int status = flesh_mesh_sets_take(&v->draft->sets, name, length, &set);
  if (status) return no_more_sets(s, status);
  s->item = "set", s->index = -1, s->form = "numbers of tets";
  flesh_members *members = &v->draft->sets.sets[set].tets;
  while (!status && flesh_scan_next(s) && *s->at != '*') {
    int64_t number;
    status = flesh_scan_integer(s, &number);
    if (!status && (number < v->tet_base || number - v->tet_base >= v->draft->tets))
      status = flesh_scan_fail(s, "the set has tet %lld; the tets are %d to %d", (long long)number, v->tet_base,
                               v->tet_base + v->draft->tets - 1);
    if (!status) status = flesh_members_add(members, (int)(number - v->tet_base));
  }
  return status;
}

/* Reads the row "set, material" of *REGION number `v->regions`. The set allElements always exists. */
static int read_region(vega *v)
{
  static const char all[] = "allElements";
  flesh_scanner *s = v->s;
  const char *name;
  if (!flesh_scan_next(s) || *s->at == '*') return fail_expected(s, "the region's row `set, material`");
  const char *at = s->at;
  const size_t length = flesh_scan_token(s, &name);
  const int set = flesh_mesh_sets_find(&v->draft->sets, name, length), region = ++v->regions;
  const flesh_members *tets = set >= 0 ? &v->draft->sets.sets[set].tets : NULL;
  if (!tets && !(length == sizeof all - 1 && !memcmp(name, all, length))) {
    s->at = at;
    return flesh_scan_fail(s, "the region names the set %s, which is not in the file; %s", flesh_scan_show(s),
                           flesh_mesh_sets_text(&v->draft->sets));
  }
  for (int k = 0, count = tets ? tets->count : v->draft->tets; k < count; k++)
    v->draft->regions[tets ? tets->values[k] : k] = region;
  return FLESH_OK;
}

/* Reads the keywords after the elements: the sets, or, in a second walk, the regions, which may stand before their
 * sets. */
static int read_rest(vega *v, int regions)
{
  flesh_scanner *s = v->s;
  int status = FLESH_OK;
  while (!status && flesh_scan_next(s)) {
    if (flesh_scan_word(s, "*VERTICES") || flesh_scan_word(s, "*ELEMENTS"))
      return flesh_scan_fail(s, "a second list of vertices or elements; there must be one of each");
    if (flesh_scan_word(s, "*INCLUDE")) return flesh_scan_fail(s, "*INCLUDE is not supported; write what it includes here");
    if (!regions && flesh_scan_word(s, "*SET")) status = read_set(v);
    else if (regions && flesh_scan_word(s, "*REGION")) status = read_region(v);
    else flesh_scan_skip_line(s);
  }
  return status;
}

int flesh_vega_read(flesh_scanner *s, flesh_draft *draft)
{
  vega v = {.s = s, .draft = draft};
  s->commas = 1;
  if (!flesh_scan_next(s) || !flesh_scan_word(s, "*VERTICES")) return fail_expected(s, "*VERTICES");
  int status = read_vertices(s, draft);
  if (!status && (!flesh_scan_next(s) || !flesh_scan_word(s, "*ELEMENTS"))) return fail_expected(s, "*ELEMENTS");
  if (!status) status = read_elements(&v);
  flesh_scanner rest = *s;
  if (!status) status = read_rest(&v, 0);
  v.s = &rest;
  return status ? status : read_rest(&v, 1);
}
