/* abaqus_sets.c: reads the sets, sections and surfaces of a deck whose nodes and elements are known. */
#include "mesh/abaqus.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"

static int add_number(flesh_deck *d, flesh_members *members, int tets, int64_t number)
{
  int index;
  if (flesh_tag_map_find(tets ? &d->elements : &d->draft->tags, number, &index)) return flesh_members_add(members, index);
  return flesh_scan_fail(d->s, "%s %lld is not in the deck", tets ? "element" : "node", (long long)number);
}

/* Adds the numbers first, first + step, ... up to `last`; skips those of no node or element. */
static int generate(flesh_deck *d, flesh_members *members, int tets)
{
  flesh_scanner *s = d->s;
  const flesh_tag_map *there = tets ? &d->elements : &d->draft->tags;
  int64_t range[3] = {0, 0, 1};
  s->form = "first, last, step";
  int status = flesh_scan_integer(s, &range[0]);
  if (!status) status = flesh_scan_integer(s, &range[1]);
  if (!status && flesh_scan_next_in_line(s)) status = flesh_scan_integer(s, &range[2]);
  if (!status) status = flesh_scan_row_end(s);
  if (!status && (range[0] < 0 || range[1] < range[0] || range[2] < 1))
    status = flesh_scan_fail(s, "the range %lld, %lld, %lld is empty; 0 <= first <= last and step >= 1 are expected",
                             (long long)range[0], (long long)range[1], (long long)range[2]);
  for (size_t k = 0; k < there->buckets && !status; k++)
    if (there->taken[k] && there->tags[k] >= range[0] && there->tags[k] <= range[1] && (there->tags[k] - range[0]) % range[2] == 0)
      status = flesh_members_add(members, there->values[k]);
  return status;
}

/* Adds the members of the set of that name. */
static int add_set(flesh_deck *d, int to, int tets, const char *name, size_t length)
{
  int from;
  flesh_deck_find_set(d, name, length, 0, &from);
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

static int is_number(char c) { return (c >= '0' && c <= '9') || c == '-'; }

/* Reads the next name in the row, without quotes; returns its length. */
static size_t scan_name(flesh_scanner *s, const char **name)
{
  const char *quote = *s->at == '"' ? memchr(s->at + 1, '"', (size_t)(s->end - s->at - 1)) : NULL;
  const size_t length = flesh_scan_token(s, name);
  if (!quote) return length;
  s->at = quote + 1;
  return (size_t)(quote - ++*name);
}

/* Reads one row of *NSET or *ELSET: numbers, and names of sets. */
static int read_members(flesh_deck *d, int set, int tets)
{
  flesh_scanner *s = d->s;
  int status = FLESH_OK;
  while (!status && flesh_scan_next_in_line(s)) {
    flesh_members *members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    const char *name;
    int64_t number;
    if (is_number(*s->at)) {
      status = flesh_scan_integer(s, &number);
      if (!status) status = add_number(d, members, tets, number);
      continue;
    }
    const size_t length = scan_name(s, &name);
    status = add_set(d, set, tets, name, length);
  }
  return status;
}

/* Fourth walk: reads the sets. */
int flesh_deck_read_sets(flesh_deck *d, const flesh_keyword *k)
{
  const int tets = flesh_deck_is(k, "ELSET");
  const int ranges = flesh_deck_has(k, "GENERATE"), most = (int)(tets ? d->elements.count : d->draft->tags.count);
  int set, status = FLESH_OK;
  if (!tets && !flesh_deck_is(k, "NSET")) return FLESH_OK;
  status = flesh_deck_take_set(d, k, tets ? "ELSET" : "NSET", &set);
  if (!status && set < 0)
    return FLESH_DECK_FAIL(d, k, "the set has no name; `*%s=NAME` is expected", tets ? "ELSET, ELSET" : "NSET, NSET");
  for (; !status && flesh_deck_next_row(d->s); flesh_scan_skip_line(d->s)) {
    d->s->item = "set", d->s->index = -1, d->s->form = "numbers or names of sets";
    flesh_members *members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    status = ranges ? generate(d, members, tets) : read_members(d, set, tets);
    members = tets ? &d->draft->sets.sets[set].tets : &d->draft->sets.sets[set].nodes;
    if (members->count / 2 > most) flesh_members_settle(members); /* repeated rows take no memory */
  }
  return status;
}

/* Fifth walk: with *SOLID SECTION, the region of a tet is the number of its section, from 1. */
int flesh_deck_read_sections(flesh_deck *d, const flesh_keyword *k)
{
  const char *name;
  size_t length;
  int set;
  if (!flesh_deck_is(k, "SOLID SECTION") || !flesh_deck_parameter(k, "ELSET", &name, &length)) return FLESH_OK;
  flesh_deck_find_set(d, name, length, 0, &set);
  if (set < 0) {
    d->s->at = name;
    return FLESH_DECK_FAIL(d, k, "*SOLID SECTION is of the set %s, which is not in the deck; %s", flesh_scan_show(d->s),
                           flesh_mesh_sets_text(&d->draft->sets));
  }
  const flesh_members *tets = &d->draft->sets.sets[set].tets;
  if (!d->sections++) memset(d->draft->regions, 0, (size_t)d->draft->tets * sizeof *d->draft->regions);
  for (int t = 0; t < tets->count; t++)
    if (tets->values[t] >= 0) d->draft->regions[tets->values[t]] = d->sections;
  return FLESH_OK;
}

/* Adds the nodes of a tet's face; face 0 to 3 is S1 to S4 of the manuals. */
static int add_face(flesh_deck *d, flesh_members *members, int tet, int face)
{
  static const int corners[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  static const int edges[4][3] = {{0, 1, 2}, {3, 4, 0}, {4, 5, 1}, {5, 3, 2}}; /* indices of the edges in VTK's order */
  int status = FLESH_OK;
  for (int a = 0; a < 3 && !status; a++)
    status = flesh_members_add(members, d->draft->tet_nodes[4 * (size_t)tet + (size_t)corners[face][a]]);
  for (int a = 0; a < 3 && d->draft->edge_nodes && !status; a++)
    status = flesh_members_add(members, d->draft->edge_nodes[6 * (size_t)tet + (size_t)edges[face][a]]);
  return status;
}

/* Puts the elements of a row into `found`; the row names one by number, or an element set. */
static int find_elements(flesh_deck *d, flesh_members *found)
{
  flesh_scanner *s = d->s;
  const char *name;
  int64_t number;
  int set;
  if (is_number(*s->at)) {
    const int status = flesh_scan_integer(s, &number);
    return status ? status : add_number(d, found, 1, number);
  }
  const size_t length = scan_name(s, &name);
  flesh_deck_find_set(d, name, length, 0, &set);
  if (set < 0 || set >= d->first_surface) {
    s->at = name;
    return flesh_scan_fail(s, "%s names no set of elements; %s", flesh_scan_show(s), flesh_mesh_sets_text(&d->draft->sets));
  }
  int status = FLESH_OK;
  for (int k = 0; k < d->draft->sets.sets[set].tets.count && !status; k++)
    status = flesh_members_add(found, d->draft->sets.sets[set].tets.values[k]);
  return status;
}

/* Adds the nodes of an element that is not a tet. */
static int add_other(const flesh_deck *d, flesh_members *nodes, int element)
{
  const int *list = d->other_nodes.values + ~element;
  int status = FLESH_OK;
  for (int a = 1; a <= *list && !status; a++) status = flesh_members_add(nodes, list[a]);
  return status;
}

/* Reads a row `element or set, face` of the surface; of elements that are not tets, only the faces SPOS and SNEG of
 * shells are used. */
static int read_faces(flesh_deck *d, int surface)
{
  flesh_scanner *s = d->s;
  flesh_members found = {0}, *nodes = &d->draft->sets.sets[surface].nodes;
  const char *label = "";
  int status = find_elements(d, &found);
  const size_t length = !status && found.count && flesh_scan_next_in_line(s) ? flesh_scan_token(s, &label) : 0;
  const int face = length == 2 && (label[0] | 32) == 's' ? label[1] - '1' : -1;
  const int shell = flesh_deck_is_word(label, label + length, "SPOS") || flesh_deck_is_word(label, label + length, "SNEG");
  if (length) s->at = label;
  for (int k = 0; k < found.count && !status; k++)
    if (found.values[k] < 0) status = shell ? add_other(d, nodes, found.values[k]) : FLESH_OK;
    else if (face >= 0 && face <= 3) status = add_face(d, nodes, found.values[k], face);
    else
      status = flesh_scan_fail(s, "%s stands where the face of a tet is expected, S1, S2, S3 or S4",
                               length ? flesh_scan_show(s) : "the end of the row");
  flesh_free(found.values);
  return status;
}

/* Reads a row `node or set` of the surface; an area that may follow is ignored. */
static int read_surface_nodes(flesh_deck *d, int surface)
{
  const char *name;
  int64_t number;
  if (is_number(*d->s->at)) {
    const int status = flesh_scan_integer(d->s, &number);
    return status ? status : add_number(d, &d->draft->sets.sets[surface].nodes, 0, number);
  }
  const size_t length = scan_name(d->s, &name);
  return add_set(d, surface, 0, name, length);
}

/* Sixth walk: reads a surface as the set of the nodes of its faces. Surfaces without faces (analytical ones) are
 * ignored. */
int flesh_deck_read_surfaces(flesh_deck *d, const flesh_keyword *k)
{
  const char *type = "ELEMENT";
  size_t length = strlen(type);
  int set, status;
  if (!flesh_deck_is(k, "SURFACE")) return FLESH_OK;
  flesh_deck_parameter(k, "TYPE", &type, &length);
  const int nodes = flesh_deck_is_word(type, type + length, "NODE");
  if (!nodes && !flesh_deck_is_word(type, type + length, "ELEMENT")) return FLESH_OK;
  if (flesh_deck_has(k, "COMBINE"))
    return FLESH_DECK_FAIL(d, k, "*SURFACE has the parameter COMBINE, which is not supported; rows of elements and faces are "
                                 "expected");
  status = flesh_deck_take_set(d, k, "NAME", &set);
  if (!status && set < 0) return FLESH_DECK_FAIL(d, k, "the surface has no name; `*SURFACE, NAME=NAME` is expected");
  if (!status && set < d->first_surface)
    return FLESH_DECK_FAIL(d, k, "the surface '%s' has the name of a set of nodes or elements; another name is expected, as "
                                 "scenes select by names", d->draft->sets.sets[set].name);
  for (; !status && flesh_deck_next_row(d->s); flesh_scan_skip_line(d->s)) {
    d->s->item = "surface", d->s->index = -1, d->s->form = nodes ? "node or set of nodes" : "element or set of elements, face";
    status = nodes ? read_surface_nodes(d, set) : read_faces(d, set);
    flesh_members *members = &d->draft->sets.sets[set].nodes;
    if (members->count / 2 > d->draft->nodes) flesh_members_settle(members);
  }
  return status;
}

int flesh_deck_finish_sets(flesh_deck *d)
{
  int status = FLESH_OK;
  for (int k = 0; k < d->draft->sets.count && !status; k++) {
    flesh_mesh_set *set = &d->draft->sets.sets[k];
    int kept = 0;
    for (int i = 0; i < set->tets.count && !status; i++)
      if (set->tets.values[i] >= 0) set->tets.values[kept++] = set->tets.values[i];
      else status = add_other(d, &set->nodes, set->tets.values[i]);
    set->tets.count = kept;
    flesh_members_settle(&set->nodes); /* drops the repeats of shared nodes at once, to save memory */
  }
  return status;
}
