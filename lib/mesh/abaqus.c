/* abaqus.c: the input decks of Abaqus and CalculiX, .inp: keywords after a '*' with parameters, and rows of numbers below
 * them (Abaqus Keywords Reference Guide; CalculiX CrunchiX User's Manual). *NODE, *ELEMENT of the types C3D4 and C3D10,
 * *NSET, *ELSET and *SOLID SECTION are read. A C3D10 has its nodes in VTK's order. Numbers of nodes and elements are
 * free; keywords come in any order, so that the text is walked over once for each kind. */
#include "mesh/formats.h"

#include <limits.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"

typedef struct deck {
  flesh_scanner *s;
  const char *start; /* of the text */
  flesh_draft *draft;
  flesh_tag_map elements; /* number -> tet; -1: another element */
  flesh_tag_map regions;  /* set that an *ELEMENT names -> region */
  int nodes, sections;
  int64_t others; /* elements that are no tets */
} deck;

/* A keyword's text, from behind its '*' to the end of its last line. */
typedef struct keyword {
  const char *begin, *end;
  int64_t line;
} keyword;

static int is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/* Text without blanks at its ends, nor quotes. */
static void trim(const char **begin, const char **end)
{
  while (*begin < *end && is_space(**begin)) ++*begin;
  while (*begin < *end && is_space((*end)[-1])) --*end;
  if (*end - *begin >= 2 && **begin == '"' && (*end)[-1] == '"') ++*begin, --*end;
}

static int is_word(const char *begin, const char *end, const char *word)
{
  trim(&begin, &end);
  return (size_t)(end - begin) == strlen(word) && !strncasecmp(begin, word, strlen(word));
}

/* Goes to the next line that is neither empty nor a comment; 0 at the end of the file. */
static int next_line(flesh_scanner *s)
{
  while (flesh_scan_next(s)) {
    if (s->end - s->at < 2 || s->at[0] != '*' || s->at[1] != '*') return 1;
    flesh_scan_skip_line(s);
  }
  return 0;
}

/* Whether there is another row of the present keyword. */
static int next_row(flesh_scanner *s) { return next_line(s) && *s->at != '*'; }

/* Whether the line that ends at `end` goes on in the next one: it ends with a comma. */
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

/* Goes over the rows of other keywords to the next keyword. */
static int next_keyword(flesh_scanner *s, keyword *k)
{
  while (next_row(s)) flesh_scan_skip_line(s);
  if (s->at >= s->end) return 0;
  *k = (keyword){.begin = s->at + 1, .line = s->line};
  skip_row(s);
  k->end = s->at;
  return 1;
}

/* The keyword's next parameter after `at`, or its name at first. */
static const char *part_end(const keyword *k, const char *at)
{
  int quoted = 0;
  for (; at < k->end && (quoted || *at != ','); at++) quoted ^= *at == '"';
  return at;
}

static int is_keyword(const keyword *k, const char *name) { return is_word(k->begin, part_end(k, k->begin), name); }

/* Whether the keyword has the parameter; its value, without blanks around it, in *value. */
static int find_parameter(const keyword *k, const char *name, const char **value, size_t *length)
{
  for (const char *at = part_end(k, k->begin); at < k->end;) {
    const char *begin = at + 1, *end = part_end(k, begin);
    const char *equals = memchr(begin, '=', (size_t)(end - begin)), *from = equals ? equals + 1 : end;
    at = end;
    if (!is_word(begin, equals ? equals : end, name)) continue;
    trim(&from, &end);
    *value = from;
    *length = (size_t)(end - from);
    return 1;
  }
  return 0;
}

static int has_parameter(const keyword *k, const char *name)
{
  const char *value;
  size_t length;
  return find_parameter(k, name, &value, &length);
}

/* Fails at the keyword's first line. */
#define FAIL_AT(d, k, ...) ((d)->s->line = (k)->line, flesh_scan_fail((d)->s, __VA_ARGS__))

/* The set of that name, which counts upper and lower case as one; made where there is none and `make`, else -1. */
static int find_set(deck *d, const char *name, size_t length, int make, int *set)
{
  flesh_mesh_sets *sets = &d->draft->sets;
  for (*set = 0; *set < sets->count; ++*set)
    if (strlen(sets->sets[*set].name) == length && !strncasecmp(sets->sets[*set].name, name, length)) return FLESH_OK;
  *set = -1;
  return make ? flesh_mesh_sets_take(sets, name, length, set) : FLESH_OK;
}

/* The set that the keyword's parameter names, by its index; -1: it has no such parameter. */
static int take_set(deck *d, const keyword *k, const char *parameter, int *set)
{
  const char *name;
  size_t length = 0;
  *set = -1;
  if (!find_parameter(k, parameter, &name, &length)) return FLESH_OK;
  if (!length) return FAIL_AT(d, k, "%s names no set; `%s=NAME` is expected", parameter, parameter);
  const int status = find_set(d, name, length, 1, set);
  return status ? flesh_fail_within(status, "%s:%lld: ", d->s->path, (long long)k->line) : FLESH_OK;
}

/* Keywords that make or move nodes and elements, without which the mesh would be another. */
static int refuse(deck *d, const keyword *k)
{
  static const char *const names[] = {"INCLUDE", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (is_keyword(k, names[i]))
      return FAIL_AT(d, k, "*%s is not supported; a deck that has all its nodes and elements itself is expected", names[i]);
  if (is_keyword(k, "NODE") && has_parameter(k, "SYSTEM"))
    return FAIL_AT(d, k, "*NODE has the parameter SYSTEM; coordinates x, y, z in the global system are expected");
  if (is_keyword(k, "INSTANCE") && next_row(d->s))
    return FAIL_AT(d, k, "*INSTANCE moves its part; a part where it stands, or a deck without parts, is expected");
  return FLESH_OK;
}

/* First walk: counts the nodes. */
static int count_nodes(deck *d, const keyword *k)
{
  const int status = refuse(d, k);
  for (int more = !status && is_keyword(k, "NODE"); more && next_row(d->s); flesh_scan_skip_line(d->s)) d->nodes++;
  if (d->nodes > INT_MAX / 4) return FAIL_AT(d, k, "there are more than %d nodes", INT_MAX / 4);
  return status;
}

/* Fails where a comma follows another: the row's next number would be taken for one that is left out. */
static int check_fields(const flesh_scanner *s)
{
  int comma = 0;
  for (const char *at = s->at; at < s->end && *at != '\n'; at++) {
    if (comma && *at == ',') return flesh_scan_fail(s, "a number is left out between two commas; write it (0)");
    if (!is_space(*at)) comma = *at == ',';
  }
  return FLESH_OK;
}

/* Second walk. A row may go on with a normal, which is left out. */
static int read_nodes(deck *d, const keyword *k)
{
  flesh_scanner *s = d->s;
  flesh_draft *draft = d->draft;
  int set, status = FLESH_OK;
  if (!is_keyword(k, "NODE")) return FLESH_OK;
  status = take_set(d, k, "NSET", &set);
  for (; !status && next_row(s); flesh_scan_skip_line(s)) {
    const int n = d->nodes++;
    int64_t tag = 0;
    s->item = "node", s->index = -1, s->form = "number, x, y, z";
    status = check_fields(s);
    if (!status) status = flesh_scan_integer(s, &tag);
    s->index = tag;
    for (int c = 0; c < 3 && !status; c++) status = flesh_scan_real(s, &draft->positions[3 * (size_t)n + (size_t)c]);
    const int there = status ? status : flesh_draft_tag_node(draft, n, tag);
    if (there > 0)
      return flesh_scan_fail(s, "node %lld is given twice; each needs a number of its own (parts have to be one part)",
                             (long long)tag);
    status = there;
    if (!status && set >= 0) status = flesh_members_add(&draft->sets.sets[set].nodes, n);
  }
  return status;
}

/* Nodes of the element type, 4 or 10; 0 where it is no tet: C3D4, C3D10 and variants with letters behind. */
static int size_of_type(const char *type, size_t length)
{
  const int size = length >= 5 && !strncasecmp(type, "C3D10", 5) ? 10 : length >= 4 && !strncasecmp(type, "C3D4", 4) ? 4 : 0;
  const size_t digits = size == 10 ? 5 : 4;
  return size && (length == digits || (type[digits] | 32) >= 'a') ? size : 0;
}

/* Reads an integer of a row that goes on where a line ends with a comma. */
static int read_integer(flesh_scanner *s, int64_t *value)
{
  if (!flesh_scan_next_in_line(s) && goes_on(s, s->at)) flesh_scan_next(s);
  return flesh_scan_integer(s, value);
}

static int read_tet(deck *d, int size, int region, int64_t tag, int64_t line)
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

/* The region of tets of an *ELEMENT that names the set: numbers from 1 in the order of the sets. */
static int region_of(deck *d, int set, int *region)
{
  *region = 0;
  if (set < 0 || flesh_tag_map_find(&d->regions, set, region)) return FLESH_OK;
  *region = (int)d->regions.count + 1;
  return flesh_tag_map_set(&d->regions, set, *region) < 0 ? FLESH_ERR_MEMORY : FLESH_OK;
}

/* Third walk. */
static int read_elements(deck *d, const keyword *k)
{
  flesh_scanner *s = d->s;
  const char *type = NULL;
  size_t length = 0;
  int set, region = 0;
  if (!is_keyword(k, "ELEMENT")) return FLESH_OK;
  if (!find_parameter(k, "TYPE", &type, &length))
    return FAIL_AT(d, k, "*ELEMENT has no TYPE; `*ELEMENT, TYPE=C3D4` or C3D10 is expected");
  const int size = size_of_type(type, length);
  int status = take_set(d, k, "ELSET", &set);
  if (!status && size) status = region_of(d, set, &region);
  while (!status && next_row(s)) {
    const int64_t line = s->line;
    int64_t tag = 0;
    s->item = "element", s->index = -1, s->form = size == 10 ? "number, a, b, c, d, ab, bc, ac, ad, bd, cd" : "number, a, b, c, d";
    status = flesh_scan_integer(s, &tag);
    s->index = tag;
    const int there = status ? status : flesh_tag_map_set(&d->elements, tag, size ? d->draft->tets : -1);
    if (there > 0)
      return flesh_scan_fail(s, "element %lld is given twice; each needs a number of its own (parts have to be one part)",
                             (long long)tag);
    status = there;
    if (!status && size && set >= 0) status = flesh_members_add(&d->draft->sets.sets[set].tets, d->draft->tets);
    if (!status && size) status = read_tet(d, size, region, tag, line);
    d->others += !size;
    if (size) flesh_scan_skip_line(s);
    else skip_row(s);
  }
  return status;
}

/* Adds the element or node of that number; elements that are no tets are left out. */
static int add_number(deck *d, flesh_members *members, int tets, int64_t number)
{
  int index;
  if (!flesh_tag_map_find(tets ? &d->elements : &d->draft->tags, number, &index))
    return flesh_scan_fail(d->s, "the set has %s %lld, which is not in the deck", tets ? "element" : "node", (long long)number);
  return index < 0 ? FLESH_OK : flesh_members_add(members, index);
}

/* Adds the numbers first, first + step ... to `last`; those that are not there are left out. */
static int generate(deck *d, flesh_members *members, int tets)
{
  flesh_scanner *s = d->s;
  const int all = tets ? d->draft->tets : d->draft->nodes;
  const int64_t *tags = tets ? d->draft->tet_tag : d->draft->node_tag;
  int64_t range[3] = {0, 0, 1};
  s->form = "first, last, step";
  int status = flesh_scan_integer(s, &range[0]);
  if (!status) status = flesh_scan_integer(s, &range[1]);
  if (!status && flesh_scan_next_in_line(s)) status = flesh_scan_integer(s, &range[2]);
  if (!status) status = flesh_scan_row_end(s);
  if (!status && (range[0] < 0 || range[1] < range[0] || range[2] < 1))
    status = flesh_scan_fail(s, "the range %lld, %lld, %lld is empty; 0 <= first <= last and step >= 1 are expected",
                             (long long)range[0], (long long)range[1], (long long)range[2]);
  for (int k = 0; k < all && !status; k++)
    if (tags[k] >= range[0] && tags[k] <= range[1] && (tags[k] - range[0]) % range[2] == 0)
      status = flesh_members_add(members, k);
  return status;
}

/* Adds what the set of that name has. */
static int add_set(deck *d, int to, int tets, const char *name, size_t length)
{
  int from;
  find_set(d, name, length, 0, &from);
  if (from < 0) {
    d->s->at = name;
    return flesh_scan_fail(d->s, "%s names no set; so far %s", flesh_scan_show(d->s), flesh_mesh_sets_text(&d->draft->sets));
  }
  flesh_mesh_set *sets = d->draft->sets.sets;
  const flesh_members *other = tets ? &sets[from].tets : &sets[from].nodes;
  int status = FLESH_OK;
  for (int k = 0, count = other->count; k < count && !status; k++)
    status = flesh_members_add(tets ? &sets[to].tets : &sets[to].nodes, other->values[k]);
  return status;
}

/* One row of *NSET or *ELSET: numbers, and names of sets. */
static int read_members(deck *d, int set, int tets)
{
  flesh_scanner *s = d->s;
  int status = FLESH_OK;
  while (!status && flesh_scan_next_in_line(s)) {
    flesh_members *members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    const char *name;
    int64_t number;
    if ((*s->at >= '0' && *s->at <= '9') || *s->at == '-') {
      status = flesh_scan_integer(s, &number);
      if (!status) status = add_number(d, members, tets, number);
      continue;
    }
    const char *quote = *s->at == '"' ? memchr(s->at + 1, '"', (size_t)(s->end - s->at - 1)) : NULL;
    size_t length = flesh_scan_token(s, &name);
    if (quote) name++, length = (size_t)(quote - name), s->at = quote + 1;
    status = add_set(d, set, tets, name, length);
  }
  return status;
}

/* Fourth walk. */
static int read_sets(deck *d, const keyword *k)
{
  const int tets = is_keyword(k, "ELSET");
  const int ranges = has_parameter(k, "GENERATE"), most = tets ? d->draft->tets : d->draft->nodes;
  int set, status = FLESH_OK;
  if (!tets && !is_keyword(k, "NSET")) return FLESH_OK;
  status = take_set(d, k, tets ? "ELSET" : "NSET", &set);
  if (!status && set < 0)
    return FAIL_AT(d, k, "the set has no name; `*%s=NAME` is expected", tets ? "ELSET, ELSET" : "NSET, NSET");
  for (; !status && next_row(d->s); flesh_scan_skip_line(d->s)) {
    d->s->item = "set", d->s->index = -1, d->s->form = "numbers or names of sets";
    flesh_members *members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    status = ranges ? generate(d, members, tets) : read_members(d, set, tets);
    members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    if (members->count / 2 > most) flesh_members_settle(members); /* rows that say the same take no memory */
  }
  return status;
}

/* Fifth walk: with *SOLID SECTION a tet's region is the number of its section, from 1. */
static int read_sections(deck *d, const keyword *k)
{
  const char *name;
  size_t length;
  int set;
  if (!is_keyword(k, "SOLID SECTION") || !find_parameter(k, "ELSET", &name, &length)) return FLESH_OK;
  find_set(d, name, length, 0, &set);
  if (set < 0) {
    d->s->at = name;
    return FAIL_AT(d, k, "*SOLID SECTION is of the set %s, which is not in the deck; %s", flesh_scan_show(d->s),
                   flesh_mesh_sets_text(&d->draft->sets));
  }
  const flesh_members *tets = &d->draft->sets.sets[set].tets;
  if (!d->sections++) memset(d->draft->regions, 0, (size_t)d->draft->tets * sizeof *d->draft->regions);
  for (int t = 0; t < tets->count; t++) d->draft->regions[tets->values[t]] = d->sections;
  return FLESH_OK;
}

static int walk(deck *d, int (*take)(deck *d, const keyword *k))
{
  keyword k;
  int status = FLESH_OK;
  d->s->at = d->start;
  d->s->line = 1;
  while (!status && next_keyword(d->s, &k)) status = take(d, &k);
  return status;
}

static int read_deck(deck *d)
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
  if (!status) status = walk(d, read_sets);
  return status ? status : walk(d, read_sections);
}

int flesh_abaqus_read(flesh_scanner *s, flesh_draft *draft)
{
  deck d = {.s = s, .start = s->at, .draft = draft};
  s->commas = 1;
  s->comment = 0;
  const int status = read_deck(&d);
  flesh_tag_map_clear(&d.elements);
  flesh_tag_map_clear(&d.regions);
  return status;
}
