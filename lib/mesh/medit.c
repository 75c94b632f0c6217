/* medit.c: Medit's ASCII .mesh (Frey, INRIA RT-0253): keywords, each with its own list; line breaks may stand anywhere.
 * Reads Vertices and either Tetrahedra or TetrahedraP2 and ignores the other lists. TetrahedraP2 have their edges in
 * VTK's order, as Gmsh writes them, or as the list TetrahedraP2Ordering of libMeshb says: for each of the ten nodes
 * twice its barycentric coordinates. */
#include "mesh/formats.h"

#include <ctype.h>
#include <limits.h>
#include <string.h>

#include "base/error.h"
#include "mesh/edges.h"

static int is_letter(char c) { return isalpha((unsigned char)c) != 0; }

/* Places of the keywords in the file, so that the lists can come in any order. */
typedef struct places {
  flesh_scanner vertices, tets, p2, order;
  int have_vertices, have_tets, have_p2, have_order;
} places;

static int note_place(const flesh_scanner *s, const char *word, flesh_scanner *place, int *have)
{
  if (*have) return flesh_scan_fail(s, "a second list of %s; there must be one", word);
  *have = 1;
  *place = *s;
  return FLESH_OK;
}

static int read_small_integer(flesh_scanner *s, const char *word, int64_t *value)
{
  s->item = word, s->index = -1, s->form = "an integer";
  return flesh_scan_integer(s, value);
}

static int find_lists(flesh_scanner *s, flesh_draft *draft, places *found)
{
  int status = FLESH_OK;
  int64_t value;
  while (!status && flesh_scan_next(s)) {
    if (!is_letter(*s->at)) { /* a number of an ignored list */
      while (s->at < s->end && !isspace((unsigned char)*s->at) && *s->at != '#') s->at++;
      continue;
    }
    if (flesh_scan_word(s, "Vertices"))
      status = note_place(s, "Vertices", &found->vertices, &found->have_vertices);
    else if (flesh_scan_word(s, "Tetrahedra"))
      status = note_place(s, "Tetrahedra", &found->tets, &found->have_tets);
    else if (flesh_scan_word(s, "MeshVersionFormatted"))
      status = read_small_integer(s, "MeshVersionFormatted", &value);
    else if (flesh_scan_word(s, "Dimension")) {
      status = read_small_integer(s, "Dimension", &value);
      if (!status && value != 3)
        status = flesh_scan_fail(s, "Dimension is %lld; it must be 3", (long long)value);
    } else if (flesh_scan_word(s, "TetrahedraP2"))
      status = note_place(s, "TetrahedraP2", &found->p2, &found->have_p2);
    else if (flesh_scan_word(s, "Hexahedra") || flesh_scan_word(s, "Prisms") || flesh_scan_word(s, "Pyramids")) {
      if (!(status = read_small_integer(s, "count", &value))) draft->solids += value;
    } else if (flesh_scan_word(s, "TetrahedraP2Ordering"))
      status = note_place(s, "TetrahedraP2Ordering", &found->order, &found->have_order);
    else if (flesh_scan_word(s, "End")) return FLESH_OK;
    else
      while (s->at < s->end && !isspace((unsigned char)*s->at) && *s->at != '#') s->at++;
  }
  return status;
}

/* Reads a reference, an integer of 32 bits. */
static int read_reference(flesh_scanner *s, int *reference)
{
  int64_t value;
  int status = flesh_scan_integer(s, &value);
  if (!status && (value < INT_MIN || value > INT_MAX))
    status = flesh_scan_fail(s, "%s %lld: the reference %lld does not fit into 32 bits", s->item,
                             (long long)s->index, (long long)value);
  *reference = status ? 0 : (int)value;
  return status;
}

/* Checks that the list ends at a keyword or at the end of the file: more numbers mean a wrong count. */
static int check_list_end(flesh_scanner *s, const char *word, int count)
{
  if (!flesh_scan_next(s) || is_letter(*s->at)) return FLESH_OK;
  return flesh_scan_fail(s, "%s stands behind the last of %d %s; a keyword is expected",
                         flesh_scan_show(s), count, word);
}

static int read_vertices(flesh_scanner *s, flesh_draft *draft)
{
  int count, reference;
  s->form = "a count";
  int status = flesh_scan_count(s, "number of Vertices", 1, 8, &count);
  if (!status) status = flesh_draft_set_nodes(draft, count);
  s->item = "vertex", s->form = "x y z reference";
  for (int n = 0; n < count && !status; n++) {
    s->index = n + 1;
    for (int d = 0; d < 3 && !status; d++)
      status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + d]);
    if (!status) status = read_reference(s, &reference);
  }
  return status ? status : check_list_end(s, "Vertices", count);
}

/* Returns the index in VTK's order of a row's k-th node, from its doubled barycentric coordinates L; -1 if they are
 * those of no corner or mid-edge. */
static int place_of(const int64_t L[4])
{
  int corner[2], found = 0;
  for (int i = 0; i < 4; i++) {
    if (L[i] < 0 || L[i] > 2) return -1;
    for (int k = 0; k < L[i]; k++) {
      if (found == 2) return -1;
      corner[found++] = i;
    }
  }
  if (found < 2) return -1;
  return corner[0] == corner[1] ? corner[0] : 4 + flesh_edge_between[corner[0]][corner[1]];
}

static int read_order(flesh_scanner *s, int order[10])
{
  int count, taken = 0;
  s->form = "a count";
  int status = flesh_scan_count(s, "number of TetrahedraP2Ordering", 1, 8, &count);
  if (!status && count != 10)
    status = flesh_scan_fail(s, "TetrahedraP2Ordering has %d rows; it must have 10", count);
  s->item = "row", s->form = "i j k l";
  for (int n = 0; n < 10 && !status; n++) {
    int64_t L[4];
    s->index = n + 1;
    for (int d = 0; d < 4 && !status; d++) status = flesh_scan_integer(s, &L[d]);
    if (status) break;
    order[n] = place_of(L);
    if (order[n] < 0 || taken >> order[n] & 1)
      status = flesh_scan_fail(s,
                               "row %d of TetrahedraP2Ordering names no node of a tet, or one that "
                               "has been named; its numbers must be 0 to 2, with the sum 2",
                               n + 1);
    else taken |= 1 << order[n];
  }
  return status ? status : check_list_end(s, "TetrahedraP2Ordering", 10);
}

/* Reads the list of tets. `order` [size]: index in VTK's order of each node of a row. */
static int read_tets(flesh_scanner *s, flesh_draft *draft, int size, const int *order)
{
  const char *word = size == 4 ? "Tetrahedra" : "TetrahedraP2";
  int count;
  s->form = "a count";
  int status = flesh_scan_count(s, size == 4 ? "number of Tetrahedra" : "number of TetrahedraP2", 1,
                                2 * size + 2, &count);
  if (!status) status = flesh_draft_reserve_tets(draft, size, count);
  s->item = "tet", s->form = size == 4 ? "a b c d reference" : "a b c d ab bc ac ad bd cd reference";
  for (int t = 0; t < count && !status; t++) {
    int tet[10], region = 0;
    int64_t number, line = 0;
    s->index = t + 1;
    for (int i = 0; i < size && !status; i++) {
      status = flesh_scan_integer(s, &number);
      if (!i) line = s->line;
      if (!status && (tet[order[i]] = flesh_draft_node(draft, number)) < 0)
        status = flesh_scan_fail(s, "tet %d uses node %lld; the nodes are 1 to %d", t + 1,
                                 (long long)number, draft->nodes);
    }
    if (!status) status = read_reference(s, &region);
    if (!status) status = flesh_draft_add_tet(draft, size, tet, region, line, t + 1);
  }
  return status ? status : check_list_end(s, word, count);
}

int flesh_medit_read(flesh_scanner *s, flesh_draft *draft)
{
  places found = {.have_vertices = 0};
  int order[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  s->free_rows = 1;
  draft->node_base = 1;
  int status = find_lists(s, draft, &found);
  if (!status && !found.have_vertices)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is no list `Vertices`", s->path);
  if (!status && !found.have_tets && !found.have_p2)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is no list `Tetrahedra` or `TetrahedraP2`", s->path);
  if (!status && found.have_tets && found.have_p2)
    status = flesh_fail(FLESH_ERR_FILE,
                        "%s: there are lists `Tetrahedra` and `TetrahedraP2`; all tets must have the "
                        "same number of nodes",
                        s->path);
  if (!status) status = read_vertices(&found.vertices, draft);
  if (!status && found.have_order) status = read_order(&found.order, order);
  if (status) return status;
  return found.have_p2 ? read_tets(&found.p2, draft, 10, order) : read_tets(&found.tets, draft, 4, order);
}
