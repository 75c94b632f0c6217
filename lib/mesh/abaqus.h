/* abaqus.h: shared by the readers of an input deck: its keywords, their parameters, and its sets. */
#ifndef FLESH_MESH_ABAQUS_H
#define FLESH_MESH_ABAQUS_H

#include "base/scan.h"
#include "mesh/draft.h"

typedef struct flesh_deck {
  flesh_scanner *s;
  const char *start; /* beginning of the text */
  flesh_draft *draft;
  flesh_tag_map elements; /* number -> tet; ~k: another element; other_nodes[k] is its node count, then its nodes */
  flesh_members other_nodes;
  flesh_tag_map regions;  /* set that an *ELEMENT names -> its region */
  int nodes, sections;
  int first_surface;      /* index of the first set that is a surface; all later ones are, too */
  int64_t others;         /* number of elements that are not tets */
} flesh_deck;

/* Text of a keyword, from after its '*' to the end of its last line. */
typedef struct flesh_keyword {
  const char *begin, *end;
  int64_t line;
} flesh_keyword;

int flesh_deck_is(const flesh_keyword *k, const char *name);
/* Returns whether the text equals the word, apart from blanks around it, quotes, and case. */
int flesh_deck_is_word(const char *begin, const char *end, const char *word);
/* Returns whether the keyword has the parameter, and its value without blanks around it. */
int flesh_deck_parameter(const flesh_keyword *k, const char *name, const char **value, size_t *length);
int flesh_deck_has(const flesh_keyword *k, const char *name);
/* Returns whether the current keyword has another row. */
int flesh_deck_next_row(flesh_scanner *s);

/* Fails with the line of the keyword. */
#define FLESH_DECK_FAIL(d, k, ...) ((d)->s->line = (k)->line, flesh_scan_fail((d)->s, __VA_ARGS__))

/* Finds the index of the set of that name, ignoring case; if there is none, makes it if `make`, else gives -1.
 * FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
int flesh_deck_find_set(flesh_deck *d, const char *name, size_t length, int make, int *set);
/* Finds or makes the set that the keyword's parameter names and gives its index; -1: there is no such parameter. */
int flesh_deck_take_set(flesh_deck *d, const flesh_keyword *k, const char *parameter, int *set);

/* Read the rows of a keyword, each in a walk of its own after all nodes and elements are known (abaqus_sets.c). */
int flesh_deck_read_sets(flesh_deck *d, const flesh_keyword *k);
int flesh_deck_read_sections(flesh_deck *d, const flesh_keyword *k);
int flesh_deck_read_surfaces(flesh_deck *d, const flesh_keyword *k);
/* Replaces the elements in sets that are not tets by their nodes; until then they stand among a set's tets. */
int flesh_deck_finish_sets(flesh_deck *d);

#endif
