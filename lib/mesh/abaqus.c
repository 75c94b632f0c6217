/* abaqus.c: reads input decks of Abaqus and CalculiX, .inp: keywords after a '*' with parameters, and rows of numbers
 * below them (Abaqus Keywords Reference Guide; CalculiX CrunchiX User's Manual). Reads *NODE, *ELEMENT of the types
 * C3D4 and C3D10, *NSET, *ELSET, *SOLID SECTION and *SURFACE. A C3D10 has its nodes in VTK's order. Nodes and elements
 * may have any numbers, and keywords come in any order; hence the reader walks over the text once for each kind of
 * keyword. */
#include "mesh/formats.h"

#include <limits.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "base/memory.h"
#include "mesh/abaqus.h"

static int is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/* Trims blanks at both ends of the text, then quotes. */
static void trim(const char **begin, const char **end)
{
  while (*begin < *end && is_space(**begin)) ++*begin;
  while (*begin < *end && is_space((*end)[-1])) --*end;
  if (*end - *begin >= 2 && **begin == '"' && (*end)[-1] == '"') ++*begin, --*end;
}

int flesh_deck_is_word(const char *begin, const char *end, const char *word)
{
  trim(&begin, &end);
  return (size_t)(end - begin) == strlen(word) && !strncasecmp(begin, word, strlen(word));
}

/* Moves to the next line that is neither empty nor a comment; returns 0 at the end of the file. */
static int next_line(flesh_scanner *s)
{
  while (flesh_scan_next(s)) {
    if (s->end - s->at < 2 || s->at[0] != '*' || s->at[1] != '*') return 1;
    flesh_scan_skip_line(s);
  }
  return 0;
}

int flesh_deck_next_row(flesh_scanner *s) { return next_line(s) && *s->at != '*'; }

/* Returns whether the line that ends at `end` is continued in the next one, that is, ends with a comma. */
static int goes_on(const flesh_scanner *s, const char *end)
{
  while (end > s->begin && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r')) end--;
  return end > s->begin && end[-1] == ',';
}

static void skip_row(flesh_scanner *s)
{
  const char *end;
  do {
    end = memchr(s->at, '\n', (size_t)(s->end - s->at));
    flesh_scan_skip_line(s);
  } while (end && goes_on(s, end));
}

/* Moves to the next keyword, over the rows of the one before. */
static int next_keyword(flesh_scanner *s, flesh_keyword *k)
{
  while (flesh_deck_next_row(s)) flesh_scan_skip_line(s);
  if (s->at >= s->end) return 0;
  *k = (flesh_keyword){.begin = s->at + 1, .line = s->line};
  skip_row(s);
  k->end = s->at;
  return 1;
}

/* Returns the end of the keyword's part that begins at `at`: its name, or a parameter. */
static const char *part_end(const flesh_keyword *k, const char *at)
{
  int quoted = 0;
  for (; at < k->end && (quoted || *at != ','); at++) quoted ^= *at == '"';
  return at;
}

int flesh_deck_is(const flesh_keyword *k, const char *name)
{
  return flesh_deck_is_word(k->begin, part_end(k, k->begin), name);
}

int flesh_deck_parameter(const flesh_keyword *k, const char *name, const char **value, size_t *length)
{
  for (const char *at = part_end(k, k->begin); at < k->end;) {
    const char *begin = at + 1, *end = part_end(k, begin);
    const char *equals = memchr(begin, '=', (size_t)(end - begin)), *from = equals ? equals + 1 : end;
    at = end;
    if (!flesh_deck_is_word(begin, equals ? equals : end, name)) continue;
    trim(&from, &end);
    *value = from;
    *length = (size_t)(end - from);
    return 1;
  }
  return 0;
}

int flesh_deck_has(const flesh_keyword *k, const char *name)
{
  const char *value;
  size_t length;
  return flesh_deck_parameter(k, name, &value, &length);
}

int flesh_deck_find_set(flesh_deck *d, const char *name, size_t length, int make, int *set)
{
  flesh_mesh_sets *sets = &d->draft->sets;
  for (*set = 0; *set < sets->count; ++*set)
    if (strlen(sets->sets[*set].name) == length && !strncasecmp(sets->sets[*set].name, name, length)) return FLESH_OK;
  *set = -1;
  return make ? flesh_mesh_sets_take(sets, name, length, set) : FLESH_OK;
}

int flesh_deck_take_set(flesh_deck *d, const flesh_keyword *k, const char *parameter, int *set)
{
  const char *name;
  size_t length = 0;
  *set = -1;
  if (!flesh_deck_parameter(k, parameter, &name, &length)) return FLESH_OK;
  if (!length) return FLESH_DECK_FAIL(d, k, "%s names no set; `%s=NAME` is expected", parameter, parameter);
  const int status = flesh_deck_find_set(d, name, length, 1, set);
  return status ? flesh_fail_within(status, "%s:%lld: ", d->s->path, (long long)k->line) : FLESH_OK;
}

/* Fails for keywords that generate or move nodes and elements, as without them the mesh would be wrong. */
static int refuse(flesh_deck *d, const flesh_keyword *k)
{
  static const char *const names[] = {"INCLUDE", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (flesh_deck_is(k, names[i]))
      return FLESH_DECK_FAIL(d, k, "*%s is not supported; a deck that has all its nodes and elements itself is expected",
                             names[i]);
  if (flesh_deck_is(k, "NODE") && flesh_deck_has(k, "SYSTEM"))
    return FLESH_DECK_FAIL(d, k, "*NODE has the parameter SYSTEM; coordinates x, y, z in the global system are expected");
  if (flesh_deck_is(k, "INSTANCE") && flesh_deck_next_row(d->s))
    return FLESH_DECK_FAIL(d, k, "*INSTANCE moves its part; a part where it stands, or a deck without parts, is expected");
  return FLESH_OK;
}

/* First walk: counts the nodes. */
static int count_nodes(flesh_deck *d, const flesh_keyword *k)
{
  const int status = refuse(d, k);
  for (int more = !status && flesh_deck_is(k, "NODE"); more && flesh_deck_next_row(d->s); flesh_scan_skip_line(d->s))
    d->nodes++;
  if (d->nodes > INT_MAX / 4) return FLESH_DECK_FAIL(d, k, "there are more than %d nodes", INT_MAX / 4);
  return status;
}

/* Fails for two commas in a row: the row's next number would be taken for the missing one. */
static int check_fields(const flesh_scanner *s)
{
  int comma = 0;
  for (const char *at = s->at; at < s->end && *at != '\n'; at++) {
    if (comma && *at == ',') return flesh_scan_fail(s, "a number is left out between two commas; write it (0)");
    if (!is_space(*at)) comma = *at == ',';
  }
  return FLESH_OK;
}

/* Second walk: reads the nodes. A normal that follows the coordinates is ignored. */
static int read_nodes(flesh_deck *d, const flesh_keyword *k)
{
  flesh_scanner *s = d->s;
  flesh_draft *draft = d->draft;
  int set, status = FLESH_OK;
  if (!flesh_deck_is(k, "NODE")) return FLESH_OK;
  status = flesh_deck_take_set(d, k, "NSET", &set);
  for (; !status && flesh_deck_next_row(s); flesh_scan_skip_line(s)) {
    const int n = d->nodes++;
    int64_t tag = 0;
    s->item = "node", s->index = -1, s->form = "number, x, y, z";
    status = check_fields(s);
    if (!status) status = flesh_scan_integer(s, &tag);
    s->index = tag;
    for (int c = 0; c < 3 && !status; c++) status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + (size_t)c]);
    const int there = status ? status : flesh_draft_tag_node(draft, n, tag);
    if (there > 0)
      return flesh_scan_fail(s, "node %lld is given twice; each must have its own number (merge the parts of an assembly "
                                "into one)",
                             (long long)tag);
    status = there;
    if (!status && set >= 0) status = flesh_members_add(&draft->sets.sets[set].nodes, n);
  }
  return status;
}

/* Returns the number of nodes of the element type: 4 or 10 for C3D4, C3D10 and their variants with trailing letters,
 * else 0. */
static int size_of_type(const char *type, size_t length)
{
  const int size = length >= 5 && !strncasecmp(type, "C3D10", 5) ? 10 : length >= 4 && !strncasecmp(type, "C3D4", 4) ? 4 : 0;
  const size_t digits = size == 10 ? 5 : 4;
  return size && (length == digits || (type[digits] | 32) >= 'a') ? size : 0;
}

/* Reads an integer of a row that may continue after a comma at the line's end. */
static int read_integer(flesh_scanner *s, int64_t *value)
{
  if (!flesh_scan_next_in_line(s) && goes_on(s, s->at)) flesh_scan_next(s);
  return flesh_scan_integer(s, value);
}

/* Reads the nodes of an element that is not a tet into d->other_nodes: at *first their count, then the nodes. Rows of
 * solids may continue. */
static int read_other(flesh_deck *d, int solid, int *first)
{
  flesh_scanner *s = d->s;
  flesh_members *others = &d->other_nodes;
  *first = others->count;
  int status = flesh_members_add(others, 0);
  while (!status && (flesh_scan_next_in_line(s) || (solid && goes_on(s, s->at) && flesh_deck_next_row(s)))) {
    int64_t number;
    int node;
    status = flesh_scan_integer(s, &number);
    if (!status && flesh_tag_map_find(&d->draft->tags, number, &node)) status = flesh_members_add(others, node);
  }
  if (!status) others->values[*first] = others->count - *first - 1;
  return status;
}

static int read_tet(flesh_deck *d, int size, int region, int64_t tag, int64_t line)
{
  flesh_scanner *s = d->s;
  int nodes[10], status = FLESH_OK;
  for (int a = 0; a < size && !status; a++) {
    int64_t number;
    status = read_integer(s, &number);
    if (!status && !flesh_tag_map_find(&d->draft->tags, number, &nodes[a]))
      status = flesh_scan_fail(s, "tet %lld uses node %lld, which is not among the %d of *NODE", (long long)tag,
                               (long long)number, d->draft->nodes);
  }
  if (!status) status = flesh_scan_row_end(s);
  return status ? status : flesh_draft_add_tet(d->draft, size, nodes, region, line, tag);
}

/* Finds the region of the tets of an *ELEMENT that names the set: the sets' regions are numbered from 1 in the order of
 * first use. */
static int region_of(flesh_deck *d, int set, int *region)
{
  *region = 0;
  if (set < 0 || flesh_tag_map_find(&d->regions, set, region)) return FLESH_OK;
  *region = (int)d->regions.count + 1;
  return flesh_tag_map_set(&d->regions, set, *region) < 0 ? FLESH_ERR_MEMORY : FLESH_OK;
}

/* Third walk: reads the elements. */
static int read_elements(flesh_deck *d, const flesh_keyword *k)
{
  flesh_scanner *s = d->s;
  const char *type = NULL;
  size_t length = 0;
  int set, region = 0;
  if (!flesh_deck_is(k, "ELEMENT")) return FLESH_OK;
  if (!flesh_deck_parameter(k, "TYPE", &type, &length))
    return FLESH_DECK_FAIL(d, k, "*ELEMENT has no TYPE; `*ELEMENT, TYPE=C3D4` or C3D10 is expected");
  const int size = size_of_type(type, length);
  const int solid = length >= 3 && !strncasecmp(type, "C3D", 3);
  int status = flesh_deck_take_set(d, k, "ELSET", &set);
  if (!status && size) status = region_of(d, set, &region);
  while (!status && flesh_deck_next_row(s)) {
    const int64_t line = s->line;
    int64_t tag = 0;
    s->item = "element", s->index = -1, s->form = size == 10 ? "number, a, b, c, d, ab, bc, ac, ad, bd, cd" : "number, a, "
                                                                                                              "b, c, d";
    status = flesh_scan_integer(s, &tag);
    s->index = tag;
    int element = d->draft->tets;
    if (!status && !size) status = read_other(d, solid, &element);
    if (!status && !size) element = ~element;
    const int there = status ? status : flesh_tag_map_set(&d->elements, tag, element);
    if (there > 0)
      return flesh_scan_fail(s, "element %lld is given twice; each must have its own number (merge the parts of an assembly "
                                "into one)",
                             (long long)tag);
    status = there;
    if (!status && set >= 0) status = flesh_members_add(&d->draft->sets.sets[set].tets, element);
    if (!status && size) status = read_tet(d, size, region, tag, line);
    d->others += !size;
    d->draft->solids += !size && solid;
    flesh_scan_skip_line(s);
  }
  return status;
}

static int walk(flesh_deck *d, int (*take)(flesh_deck *d, const flesh_keyword *k))
{
  flesh_keyword k;
  int status = FLESH_OK;
  d->s->at = d->start;
  d->s->line = 1;
  while (!status && next_keyword(d->s, &k)) status = take(d, &k);
  return status;
}

static int read_deck(flesh_deck *d)
{
  int status = walk(d, count_nodes);
  if (!status && !d->nodes) return flesh_fail(FLESH_ERR_FILE, "%s: there are no nodes; *NODE with rows is expected", d->s->path);
  if (!status) status = flesh_draft_set_tagged_nodes(d->draft, d->nodes);
  d->nodes = 0;
  if (!status) status = walk(d, read_nodes);
  if (!status) status = walk(d, read_elements);
  if (!status && !d->draft->tets)
    return flesh_fail(FLESH_ERR_FILE, "%s: there are no tets beside %lld other elements; *ELEMENT with TYPE=C3D4 or C3D10 is "
                      "expected", d->s->path, (long long)d->others);
  if (!status) status = walk(d, flesh_deck_read_sets);
  if (!status) status = walk(d, flesh_deck_read_sections);
  d->first_surface = d->draft->sets.count;
  if (!status) status = walk(d, flesh_deck_read_surfaces);
  return status ? status : flesh_deck_finish_sets(d);
}

int flesh_abaqus_read(flesh_scanner *s, flesh_draft *draft)
{
  flesh_deck d = {.s = s, .start = s->at, .draft = draft};
  s->commas = 1;
  s->comment = 0;
  const int status = read_deck(&d);
  flesh_tag_map_clear(&d.elements);
  flesh_tag_map_clear(&d.regions);
  flesh_free(d.other_nodes.values);
  return status;
}
