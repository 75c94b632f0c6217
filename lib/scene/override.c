/* override.c: applies "path.to.key=value" to a scene's tree before it is read; finds values by such paths. */
#include "scene/override.h"

#include <string.h>

#include "base/error.h"
#include "scene/effect_list.h"

enum { MAX_SEGMENTS = 24 };

/* One step of a path: a name or an index. */
typedef struct segment {
  const char *name; /* NULL for an index */
  int index;        /* -1 for a name */
  int end;          /* end of the step in the path, for messages */
} segment;

typedef struct change {
  flesh_arena *arena;
  flesh_source source;
  const flesh_key *keys;
  const char *path;
  segment segments[MAX_SEGMENTS];
  int count;
  flesh_node *value; /* a removed node: remove the key */
} change;

static int bad_path(const change *c)
{
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%s: the path is not of the form body.material.young, body.regions[0].density, "
                    "effects.gravity.acceleration or effects.pin[1].until",
                    c->source.name);
}

/* Returns the decimal index, or -1. */
static int index_of(const char *digits, size_t size)
{
  int value = 0;
  if (!size || size > 7) return -1;
  for (size_t i = 0; i < size; i++) {
    if (digits[i] < '0' || digits[i] > '9') return -1;
    value = 10 * value + (digits[i] - '0');
  }
  return value;
}

static int split_path(change *c)
{
  const char *at = c->path;
  while (*at) {
    if (c->count == MAX_SEGMENTS) return bad_path(c);
    segment *s = &c->segments[c->count++];
    if (*at == '[') {
      size_t size = strcspn(at + 1, "]");
      *s = (segment){.index = index_of(at + 1, size)};
      if (s->index < 0 || at[1 + size] != ']' || c->count == 1) return bad_path(c);
      at += size + 2;
    } else {
      if (c->count > 1 && *at++ != '.') return bad_path(c);
      size_t size = strcspn(at, ".[]");
      if (!size) return bad_path(c);
      *s = (segment){.name = flesh_arena_text(c->arena, at, size), .index = -1};
      if (!s->name) return flesh_no_memory();
      int index = index_of(at, size);
      if (index >= 0) *s = (segment){.index = index}; /* regions.0 */
      at += size;
    }
    s->end = (int)(at - c->path);
  }
  return c->count ? FLESH_OK : bad_path(c);
}

/* Returns the key to which the steps before `depth` lead; NULL: none. */
static const flesh_key *key_at(const change *c, int depth)
{
  const flesh_key *keys = c->keys, *key = NULL;
  for (int k = 0; k < depth; k++) {
    const char *name = c->segments[k].name;
    if (!name) continue;
    const flesh_effect_row *row = key && key->type == FLESH_KEY_EFFECTS ? flesh_effect_row_named(name) : NULL;
    key = keys ? flesh_key_named(keys, name) : NULL;
    keys = row ? row->keys : key ? key->children : NULL;
  }
  return key;
}

/* Returns whether the step before `depth` leads to the list of effects, whose items have names. */
static int names_items(const change *c, int depth)
{
  const flesh_key *key = key_at(c, depth);
  return depth == 1 && key && key->type == FLESH_KEY_EFFECTS;
}

/* Turns a null or removed node into the list or mapping that step `depth` needs; a list begins with the key's
 * default. */
static int open_node(const change *c, flesh_node *node, int depth)
{
  const segment *s = &c->segments[depth];
  flesh_node_kind kind = s->name && !names_items(c, depth) ? FLESH_NODE_MAPPING : FLESH_NODE_LIST;
  if (flesh_node_is_null(node) || (node->removed && node->kind == FLESH_NODE_SCALAR)) {
    const flesh_key *key = kind == FLESH_NODE_LIST ? key_at(c, depth) : NULL;
    flesh_node *usual = NULL;
    node->kind = kind;
    const char *text = key && key->default_value ? key->default_value : "";
    const int status = flesh_yaml_parse(c->arena, text, strlen(text), &c->source, &usual);
    if (status) return status;
    if (usual && usual->kind == kind) node->first = usual->first, node->last = usual->last, node->count = usual->count;
  }
  if (!c->value->removed) node->removed = 0;
  if (node->kind == kind) return FLESH_OK;
  char shown[FLESH_SHOW_SIZE];
  int end = c->segments[depth ? depth - 1 : 0].end;
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s: %.*s is %s; nothing below it can be set by %s",
                    c->source.name, end, c->path, flesh_node_show(node, shown),
                    s->name ? "name" : "index");
}

static int no_such_item(const change *c, int depth, int items, const char *name)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s: %.*s does not exist; there %s %d%s%s, counted from 0",
                    c->source.name, c->segments[depth].end, c->path, items == 1 ? "is" : "are",
                    items, name ? " named " : "", name ? name : "");
}

static flesh_node *new_child(const change *c, flesh_node *parent, const char *key)
{
  flesh_node *child = flesh_node_create(c->arena, FLESH_NODE_SCALAR, &c->source);
  if (!child) return NULL;
  child->key = key;
  child->removed = c->value->removed; /* only there to have its name checked */
  flesh_node_append(parent, child);
  return child;
}

/* Finds the n-th item of the list that is the named effect, the parent of its parameters. Uses the index that may
 * follow the name. */
static int find_effect(const change *c, flesh_node *list, int *depth, flesh_node **item)
{
  const char *name = c->segments[*depth].name;
  int wanted = 0, found = 0;
  if (*depth + 1 < c->count && !c->segments[*depth + 1].name) wanted = c->segments[++*depth].index;
  for (*item = list->first; *item; *item = (*item)->next)
    if (flesh_node_find(*item, name) && found++ == wanted) return FLESH_OK;
  if (found != wanted) return no_such_item(c, *depth, found, name);
  *item = flesh_node_create(c->arena, FLESH_NODE_MAPPING, &c->source);
  if (!*item) return flesh_no_memory();
  flesh_node_append(list, *item);
  return new_child(c, *item, name) ? FLESH_OK : flesh_no_memory();
}

/* Finds the child of `node` by step *depth, and its parent; makes the child if it is missing. *depth moves to the last
 * segment of the step. */
static int step(const change *c, flesh_node *node, int *depth, flesh_node **parent,
                flesh_node **child)
{
  int status = open_node(c, node, *depth);
  if (status) return status;
  const segment *s = &c->segments[*depth];
  *parent = node;
  if (names_items(c, *depth) && s->name) {
    if ((status = find_effect(c, node, depth, parent))) return status;
    *child = flesh_node_find(*parent, s->name);
    return FLESH_OK;
  }
  if (s->name) {
    *child = flesh_node_find(node, s->name);
  } else {
    *child = flesh_node_item(node, s->index);
    if (!*child && (s->index != node->count || c->value->removed))
      return no_such_item(c, *depth, node->count, NULL);
  }
  if (!*child) *child = new_child(c, node, s->name);
  return *child ? FLESH_OK : flesh_no_memory();
}

static int apply(const change *c, flesh_node *root)
{
  flesh_node *node = root, *parent = NULL, *child = NULL;
  for (int depth = 0; depth < c->count; depth++) {
    flesh_node *list = node;
    int by_name = names_items(c, depth) && c->segments[depth].name;
    int status = step(c, node, &depth, &parent, &child);
    if (status) return status;
    if (depth + 1 < c->count) {
      node = child;
      continue;
    }
    if (c->value->removed && by_name && !child->removed)
      flesh_node_remove(list, parent); /* the whole effect */
    else if (c->value->removed && !by_name && parent->kind == FLESH_NODE_LIST)
      flesh_node_remove(parent, child);
    else flesh_node_replace(parent, child, c->value);
  }
  return FLESH_OK;
}

int flesh_override_apply(flesh_arena *arena, const flesh_key *keys, const char *text, int number,
                         flesh_node *root)
{
  change c = {.arena = arena, .keys = keys};
  enum { SHOWN = 200 };
  const char *more = strlen(text) > SHOWN ? "..." : "";
  c.source = (flesh_source){flesh_arena_print(arena, "--set %.*s%s", SHOWN, text, more), number};
  if (!c.source.name) return flesh_no_memory();
  const char *equals = strchr(text, '=');
  if (!equals)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: no = follows the key; it must be KEY=VALUE, as time.step=1/120", c.source.name);
  c.path = flesh_arena_text(arena, text, (size_t)(equals - text));
  if (!c.path) return flesh_no_memory();
  int status = split_path(&c);
  if (!status)
    status = flesh_yaml_parse(arena, equals + 1, strlen(equals + 1), &c.source, &c.value);
  if (status) return status;
  /* An empty text is null; a text that is only a comment or directive of YAML was meant as a value. */
  if (!c.value && equals[1 + strspn(equals + 1, " \t\r\n")])
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: no value follows the =; put a text that begins with # or %% into quotes",
                      c.source.name);
  if (!c.value && !(c.value = flesh_node_create(arena, FLESH_NODE_SCALAR, &c.source)))
    return flesh_no_memory();
  c.value->removed = flesh_node_is_null(c.value);
  return apply(&c, root);
}

int flesh_override_find(flesh_arena *arena, const flesh_key *keys, const char *path, flesh_node *root, flesh_node **node,
                        flesh_node **parent, const flesh_key **key)
{
  change c = {.arena = arena, .source = {path, 0}, .keys = keys, .path = path, .value = &(flesh_node){.removed = 1}};
  int status = split_path(&c);
  *node = root;
  for (int depth = 0; depth < c.count && !status; depth++) status = step(&c, *node, &depth, parent, node);
  if (!status && (*node)->removed) status = flesh_fail(FLESH_ERR_ARGUMENT, "%s does not exist", path);
  if (!status) *key = key_at(&c, c.count);
  return status;
}
