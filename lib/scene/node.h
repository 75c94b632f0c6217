/* node.h: a scene's text as a tree of scalars, lists and mappings, each with its place in the text. */
#ifndef FLESH_SCENE_NODE_H
#define FLESH_SCENE_NODE_H

#include "scene/arena.h"

typedef enum flesh_node_kind {
  FLESH_NODE_SCALAR,
  FLESH_NODE_LIST,
  FLESH_NODE_MAPPING
} flesh_node_kind;

typedef struct flesh_node {
  flesh_node_kind kind;
  int quoted;       /* 1: a scalar in quotes or a block, which is never null */
  int removed;      /* 1: an override removed it; it counts as not given, but its name is still checked */
  int override;     /* 0: from the file; i: from the i-th override, counted from 1 */
  int line, column; /* from 1 */
  int key_line;     /* line of its key in a mapping */
  int key_column;
  int count;                              /* children */
  const char *source;                     /* the file's path, or "--set path=value" */
  const char *key;                        /* its name in a mapping; NULL otherwise */
  const char *text;                       /* a scalar's text */
  struct flesh_node *first, *last, *next; /* children in order; next sibling */
} flesh_node;

/* The source of a text: a file, or the override with that number. */
typedef struct flesh_source {
  const char *name;
  int override;
} flesh_source;

/* Parses YAML (which includes JSON) into *root, NULL for an empty text; everything lives in the arena.
 * FLESH_ERR_ARGUMENT with file, line and column for wrong syntax, a repeated key, and too deep nesting or too many
 * aliases; FLESH_ERR_MEMORY. */
int flesh_yaml_parse(flesh_arena *arena, const char *text, size_t size, const flesh_source *source,
                     flesh_node **root);

/* Returns a new empty node; NULL when there is no memory. */
flesh_node *flesh_node_create(flesh_arena *arena, flesh_node_kind kind, const flesh_source *source);
void flesh_node_append(flesh_node *parent, flesh_node *child);
/* Puts `child` in the place of `old` and keeps the key. */
void flesh_node_replace(flesh_node *parent, const flesh_node *old, flesh_node *child);
void flesh_node_remove(flesh_node *parent, const flesh_node *old);
/* Return the child of a mapping by key, or of a list by index; NULL: none. */
flesh_node *flesh_node_find(const flesh_node *mapping, const char *key);
flesh_node *flesh_node_item(const flesh_node *list, int index);
/* Returns whether a scalar has no value: empty, ~ or null, without quotes. */
int flesh_node_is_null(const flesh_node *node);

/* Appends the node as YAML on one line; with `quoted`, its keys are in quotes, as in JSON. */
void flesh_node_write_flow(const flesh_node *node, int quoted, flesh_text *text);

/* Fail with FLESH_ERR_ARGUMENT and "file:line:column: " or "--set path=value: " before the sentence; `node` may be
 * NULL. _at_key gives the place of the key, not of the value. */
int flesh_node_fail(const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
int flesh_node_fail_at_key(const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Puts the place and the text before the text of an earlier error; returns `status`. */
int flesh_node_fail_within(int status, const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

enum { FLESH_SHOW_SIZE = 96 };
/* Makes a word from a file fit for a sentence: short and printable. Returns `text`. */
const char *flesh_word_show(const char *word, char text[FLESH_SHOW_SIZE]);
/* Makes the node's value fit for a sentence: short and printable. Returns `text`. */
const char *flesh_node_show(const flesh_node *node, char text[FLESH_SHOW_SIZE]);

#endif
