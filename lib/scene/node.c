/* node.c: the tree of a scene's text: makes, finds and changes nodes, and names their places in errors. */
#include "scene/node.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"

flesh_node *flesh_node_create(flesh_arena *arena, flesh_node_kind kind, const flesh_source *source)
{
  flesh_node *node = flesh_arena_take(arena, sizeof *node);
  if (!node) return NULL;
  node->kind = kind;
  node->source = source->name;
  node->override = source->override;
  node->text = "";
  return node;
}

void flesh_node_append(flesh_node *parent, flesh_node *child)
{
  child->next = NULL;
  if (parent->last) parent->last->next = child;
  else parent->first = child;
  parent->last = child;
  parent->count++;
}

/* Returns the link that points to `child`, and the sibling before it in *before. */
static flesh_node **link_to(flesh_node *parent, const flesh_node *child, flesh_node **before)
{
  flesh_node **link = &parent->first;
  *before = NULL;
  while (*link && *link != child) {
    *before = *link;
    link = &(*link)->next;
  }
  return link;
}

void flesh_node_replace(flesh_node *parent, const flesh_node *old, flesh_node *child)
{
  flesh_node *before, **link = link_to(parent, old, &before);
  child->key = old->key;
  child->next = old->next;
  *link = child;
  if (parent->last == old) parent->last = child;
}

void flesh_node_remove(flesh_node *parent, const flesh_node *old)
{
  flesh_node *before, **link = link_to(parent, old, &before);
  *link = old->next;
  if (parent->last == old) parent->last = before;
  parent->count--;
}

flesh_node *flesh_node_find(const flesh_node *mapping, const char *key)
{
  if (!mapping || mapping->kind != FLESH_NODE_MAPPING) return NULL;
  for (flesh_node *child = mapping->first; child; child = child->next)
    if (!strcmp(child->key, key)) return child;
  return NULL;
}

flesh_node *flesh_node_item(const flesh_node *list, int index)
{
  flesh_node *child = list->first;
  while (child && index-- > 0) child = child->next;
  return child;
}

int flesh_node_is_null(const flesh_node *node)
{
  static const char *const nulls[] = {"", "~", "null", "Null", "NULL"};
  if (node->kind != FLESH_NODE_SCALAR || node->quoted) return 0;
  for (size_t i = 0; i < sizeof nulls / sizeof *nulls; i++)
    if (!strcmp(node->text, nulls[i])) return 1;
  return 0;
}

void flesh_node_write_flow(const flesh_node *node, int quoted, flesh_text *text)
{
  if (node->kind == FLESH_NODE_SCALAR) {
    const int plain = !node->quoted && !strpbrk(node->text, ",[]{}:#\"'\n");
    if (plain) flesh_text_append(text, node->text, strlen(node->text));
    else flesh_text_quote(text, node->text);
    return;
  }
  const int mapping = node->kind == FLESH_NODE_MAPPING;
  flesh_text_print(text, mapping ? "{" : "[");
  for (const flesh_node *child = node->first; child; child = child->next) {
    if (mapping && quoted) flesh_text_quote(text, child->key);
    else if (mapping) flesh_text_append(text, child->key, strlen(child->key));
    if (mapping) flesh_text_print(text, ": ");
    flesh_node_write_flow(child, quoted, text);
    if (child->next) flesh_text_print(text, ", ");
  }
  flesh_text_print(text, mapping ? "}" : "]");
}

static int fail_at(int status, const flesh_node *node, int line, int column)
{
  if (!node) return status;
  if (node->override || !line) return flesh_fail_within(status, "%s: ", node->source);
  return flesh_fail_within(status, "%s:%d:%d: ", node->source, line, column);
}

/* Returns the value of that key in a mapping or in the mappings below it; NULL: it is not there. */
static const flesh_node *find_below(const flesh_node *mapping, const char *key, size_t size)
{
  if (mapping->kind != FLESH_NODE_MAPPING) return NULL;
  for (const flesh_node *child = mapping->first; child; child = child->next)
    if (!child->removed && !strncmp(child->key, key, size) && !child->key[size]) return child;
  const flesh_node *found = NULL;
  for (const flesh_node *child = mapping->first; child && !found; child = child->next)
    if (!child->removed) found = find_below(child, key, size);
  return found;
}

/* Returns the node that a sentence about a mapping refers to: that of the last key in the mapping with which one of the
 * sentence's parts begins, as in "effects[0].pin: axes is ..." or "time.gamma is ..."; without any, the mapping. */
static const flesh_node *subject(const flesh_node *node, const char *sentence)
{
  const flesh_node *best = node;
  for (const char *part = sentence; node && part; part = strstr(part, ": ")) {
    if (part != sentence) part += 2;
    const size_t size = strcspn(part, " :");
    size_t start = size;
    while (start && part[start - 1] != '.') start--;
    const flesh_node *found = find_below(node, part + start, strcspn(part + start, "[ :"));
    if (found && strncmp(part + size, " is missing", strlen(" is missing"))) best = found;
  }
  return best;
}

/* Bytes, more than any error text that is kept. */
enum { SENTENCE_SIZE = 2048 };

#define READ_SENTENCE(sentence)                                                                    \
  char sentence[SENTENCE_SIZE];                                                                    \
  va_list args;                                                                                    \
  va_start(args, format);                                                                          \
  vsnprintf(sentence, sizeof sentence, format, args);                                              \
  va_end(args)

int flesh_node_fail(const flesh_node *node, const char *format, ...)
{
  READ_SENTENCE(sentence);
  flesh_fail(FLESH_ERR_ARGUMENT, "%s", sentence);
  node = subject(node, sentence);
  return fail_at(FLESH_ERR_ARGUMENT, node, node ? node->line : 0, node ? node->column : 0);
}

int flesh_node_fail_at_key(const flesh_node *node, const char *format, ...)
{
  READ_SENTENCE(sentence);
  flesh_fail(FLESH_ERR_ARGUMENT, "%s", sentence);
  int has_key = node->key && node->key_line;
  return fail_at(FLESH_ERR_ARGUMENT, node, has_key ? node->key_line : node->line,
                 has_key ? node->key_column : node->column);
}

int flesh_node_fail_within(int status, const flesh_node *node, const char *format, ...)
{
  READ_SENTENCE(sentence);
  flesh_fail_within(status, "%s", sentence);
  node = subject(node, flesh_error_text());
  return fail_at(status, node, node ? node->line : 0, node ? node->column : 0);
}

const char *flesh_word_show(const char *word, char text[FLESH_SHOW_SIZE])
{
  enum { CUT = 60 };
  size_t cut = strlen(word), size = cut;
  if (cut > CUT) {
    cut = CUT;
    while (cut > 0 && ((unsigned char)word[cut] & 0xc0) == 0x80) cut--; /* cut at a whole letter */
  }
  snprintf(text, FLESH_SHOW_SIZE, "%.*s%s", (int)cut, word, cut < size ? "..." : "");
  for (unsigned char *c = (unsigned char *)text; *c; c++) {
    if (*c < 32 || *c == 127) *c = '?';
    if (c[0] == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0) c[0] = c[1] = '?'; /* U+0080 to U+009F */
  }
  return text;
}

/* Appends a scalar, or a list as "[0, [1, a]]"; returns whether it fits and contains no mapping. */
static int show_value(const flesh_node *node, char text[FLESH_SHOW_SIZE])
{
  char word[FLESH_SHOW_SIZE];
  if (node->kind == FLESH_NODE_MAPPING) return 0;
  if (node->kind != FLESH_NODE_LIST)
    return flesh_text_add(text, FLESH_SHOW_SIZE, node->quoted ? "\"%s\"" : "%s", flesh_word_show(node->text, word));
  int fits = flesh_text_add(text, FLESH_SHOW_SIZE, node->count ? "[" : "[]");
  for (const flesh_node *child = node->first; child && fits; child = child->next)
    fits = show_value(child, text) && flesh_text_add(text, FLESH_SHOW_SIZE, child->next ? ", " : "]");
  return fits;
}

const char *flesh_node_show(const flesh_node *node, char text[FLESH_SHOW_SIZE])
{
  if (node->kind == FLESH_NODE_MAPPING) snprintf(text, FLESH_SHOW_SIZE, "a mapping");
  else if (node->kind == FLESH_NODE_LIST && !node->count)
    snprintf(text, FLESH_SHOW_SIZE, "an empty list");
  else if (!*node->text && node->kind == FLESH_NODE_SCALAR)
    snprintf(text, FLESH_SHOW_SIZE, "empty");
  else if (*text = 0, !show_value(node, text) && node->kind == FLESH_NODE_LIST)
    snprintf(text, FLESH_SHOW_SIZE, "a list of %d", node->count);
  return text;
}
