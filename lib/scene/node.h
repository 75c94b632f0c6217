/* node.h: a scene's text as a tree of scalars, lists and mappings, each knowing where it stands. */
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
  int quoted;       /* a scalar in quotes or a block: never null */
  int removed;      /* by an override: counts as not given, but its name is still checked */
  int override;     /* 0: stands in the file; i: comes from the i-th override, counted from 1 */
  int line, column; /* from 1 */
  int key_line;     /* of its key in a mapping */
  int key_column;
  int count;                              /* children */
  const char *source;                     /* the file's path, or "--set path=value" */
  const char *key;                        /* its name in a mapping; NULL otherwise */
  const char *text;                       /* a scalar's text */
  struct flesh_node *first, *last, *next; /* children in order; next sibling */
} flesh_node;

/* The source of a text: a file, or the override of that number. */
typedef struct flesh_source {
  const char *name;
  int override;
} flesh_source;

/* Parses YAML (JSON is a part of it) into *root, NULL for an empty text; everything lives in the
 * arena. FLESH_ERR_ARGUMENT with file, line and column for wrong syntax, a key that stands twice,
 * nesting or aliases beyond all use. */
int flesh_yaml_parse(flesh_arena *arena, const char *text, size_t size, const flesh_source *source,
                     flesh_node **root);

/* A new empty node; NULL when there is no memory. */
flesh_node *flesh_node_create(flesh_arena *arena, flesh_node_kind kind, const flesh_source *source);
void flesh_node_append(flesh_node *parent, flesh_node *child);
/* Puts `child` where `old` is; the key stays. */
void flesh_node_replace(flesh_node *parent, const flesh_node *old, flesh_node *child);
void flesh_node_remove(flesh_node *parent, const flesh_node *old);
/* The child of a mapping by key, of a list by index; NULL if none. */
flesh_node *flesh_node_find(const flesh_node *mapping, const char *key);
flesh_node *flesh_node_item(const flesh_node *list, int index);
/* Whether a scalar says nothing: empty, ~ or null without quotes. */
int flesh_node_is_null(const flesh_node *node);

/* Appends the node as YAML on one line; `quoted`: its keys in quotes, as JSON has them. */
void flesh_node_write_flow(const flesh_node *node, int quoted, flesh_text *text);

/* Fails with FLESH_ERR_ARGUMENT and "file:line:column: " or "--set path=value: " before the
 * sentence; `node` may be NULL. _at_key gives the place of the key instead of the value's. */
int flesh_node_fail(const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
int flesh_node_fail_at_key(const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
/* Puts the place before the text of an error that has happened. */
int flesh_node_fail_within(int status, const flesh_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

enum { FLESH_SHOW_SIZE = 96 };
/* A word from a file as a sentence shows it: cut and printable. Returns `text`. */
const char *flesh_word_show(const char *word, char text[FLESH_SHOW_SIZE]);
/* The node's value as a sentence shows it: cut and printable. Returns `text`. */
const char *flesh_node_show(const flesh_node *node, char text[FLESH_SHOW_SIZE]);

#endif
