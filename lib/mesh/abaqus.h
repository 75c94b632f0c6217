/* abaqus.h: what the readers of an input deck share: its keywords, their parameters, and its sets. */
#ifndef FLESH_MESH_ABAQUS_H
#define FLESH_MESH_ABAQUS_H

#include "base/scan.h"
#include "mesh/draft.h"

typedef struct flesh_deck {
  flesh_scanner *s;
  const char *start; /* of the text */
  flesh_draft *draft;
  flesh_tag_map elements; /* number -> tet; ~k: another element, whose nodes are at k of other_nodes: their count, then they */
  flesh_members other_nodes;
  flesh_tag_map regions;  /* set that an *ELEMENT names -> region */
  int nodes, sections;
  int first_surface;      /* sets from here on are surfaces */
  int64_t others;         /* elements that are no tets */
} flesh_deck;

/* A keyword's text, from behind its '*' to the end of its last line. */
typedef struct flesh_keyword {
  const char *begin, *end;
  int64_t line;
} flesh_keyword;

int flesh_deck_is(const flesh_keyword *k, const char *name);
/* Whether the text, but for blanks around it and quotes, is the word; upper and lower case count as one. */
int flesh_deck_is_word(const char *begin, const char *end, const char *word);
/* Whether the keyword has the parameter; its value, without blanks around it, in *value. */
int flesh_deck_parameter(const flesh_keyword *k, const char *name, const char **value, size_t *length);
int flesh_deck_has(const flesh_keyword *k, const char *name);
/* Whether there is another row of the present keyword. */
int flesh_deck_next_row(flesh_scanner *s);

/* Fails at the keyword's first line. */
#define FLESH_DECK_FAIL(d, k, ...) ((d)->s->line = (k)->line, flesh_scan_fail((d)->s, __VA_ARGS__))

/* The set of that name, which counts upper and lower case as one; made where there is none and `make`, else -1. */
int flesh_deck_find_set(flesh_deck *d, const char *name, size_t length, int make, int *set);
/* The set that the keyword's parameter names, by its index; -1: it has no such parameter. */
int flesh_deck_take_set(flesh_deck *d, const flesh_keyword *k, const char *parameter, int *set);

/* A keyword's rows, each in a walk of its own once all nodes and elements are known (abaqus_sets.c). */
int flesh_deck_read_sets(flesh_deck *d, const flesh_keyword *k);
int flesh_deck_read_sections(flesh_deck *d, const flesh_keyword *k);
int flesh_deck_read_surfaces(flesh_deck *d, const flesh_keyword *k);
/* Elements that are no tets stand among a set's tets until then, and become their nodes. */
int flesh_deck_finish_sets(flesh_deck *d);

#endif
