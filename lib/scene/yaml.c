/* yaml.c: makes a tree of libfyaml's events, with limits on depth and size so that no text can exhaust the memory. */
#include "scene/node.h"

#include <libfyaml.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/letter.h"
#include "base/text.h"

enum { MAX_DEPTH = 48, MAX_NODES = 1000000, MAX_KEYS = 1000 };

/* An open list or mapping, and the key whose value is expected. */
typedef struct frame {
  flesh_node *node;
  const char *anchor, *key;
  int key_line, key_column;
} frame;

typedef struct anchor {
  const char *name;
  const flesh_node *node;
  struct anchor *before;
} anchor;

typedef struct builder {
  flesh_arena *arena;
  const flesh_source *source;
  const char *text; /* text as libfyaml has it */
  size_t size, behind; /* size of the text, and the place in it after the last token */
  flesh_node *root;
  anchor *anchors;
  int depth, nodes, documents;
  frame stack[MAX_DEPTH];
} builder;

static int fail_at(const builder *b, int line, int column, const char *sentence)
{
  if (b->source->override)
    return flesh_fail(FLESH_ERR_ARGUMENT, "%s: %s", b->source->name, sentence);
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s:%d:%d: %s", b->source->name, line, column, sentence);
}

/* Finds bytes that are not UTF-8, and control characters, before the parser sees them. */
static int check_text(const builder *b, const unsigned char *text, size_t size)
{
  int line = 1, column = 1;
  for (size_t i = 0; i < size; column++) {
    unsigned code = 0;
    size_t bytes = flesh_letter_at(text + i, size - i, &code);
    int blank = code == '\n' || code == '\r' || code == '\t';
    if (!bytes || (code < 32 && !blank) || (code >= 127 && code < 160)) {
      char sentence[96];
      snprintf(sentence, sizeof sentence,
               "byte 0x%02x is not text; a scene is YAML or JSON in UTF-8", text[i]);
      return fail_at(b, line, column, sentence);
    }
    if (code == '\n') line++, column = 0;
    i += bytes;
  }
  return FLESH_OK;
}

static void token_place(struct fy_token *token, int quoted, int *line, int *column)
{
  const struct fy_mark *mark = token ? fy_token_start_mark(token) : NULL;
  if (!mark) return;
  *line = mark->line + 1;
  *column = mark->column + 1 - (quoted && mark->column > 0); /* the mark is after the quote */
}

/* Returns whether the text between the token's marks has only blanks, line ends and the escapes of these. */
static int is_blank(const builder *b, struct fy_token *token)
{
  const struct fy_mark *from = fy_token_start_mark(token), *to = fy_token_end_mark(token);
  if (!from || !to || to->input_pos > b->size) return 1;
  for (size_t at = from->input_pos; at < to->input_pos; at++)
    if (!strchr(" \t\r\n\\", b->text[at])) return 0;
  return 1;
}

/* Copies the text of a scalar or key. Escapes in quotes ("\0", "\ud800") may give characters that are not allowed in
 * text. */
static int token_text(const builder *b, struct fy_token *token, const char **copy)
{
  size_t size = 0;
  const char *text = token ? fy_token_get_text(token, &size) : NULL;
  /* When out of memory for a copy, libfyaml returns an empty text. */
  if (token && (!text || (!size && !is_blank(b, token)))) return flesh_no_memory_for(b->source->name);
  for (size_t i = 0, bytes; i < size; i += bytes) {
    unsigned code = 0;
    bytes = flesh_letter_at((const unsigned char *)text + i, size - i, &code);
    if (bytes && code) continue;
    int line = 1, column = 1;
    token_place(token, 1, &line, &column);
    return fail_at(b, line, column, "an escape in these quotes makes a character that no text has");
  }
  *copy = flesh_arena_text(b->arena, text ? text : "", size);
  return *copy ? FLESH_OK : flesh_no_memory_for(b->source->name);
}

/* Writes the path of the innermost mapping and `key`, such as "effects[1].pin.box". */
static void path_of(const builder *b, const char *key, char *path, size_t size)
{
  char shown[FLESH_SHOW_SIZE];
  *path = 0;
  for (int i = 1; i <= b->depth; i++) {
    const flesh_node *above = b->stack[i - 1].node;
    const char *name = i < b->depth ? b->stack[i].node->key : key;
    if (above->kind == FLESH_NODE_LIST) flesh_text_add(path, size, "[%d]", above->count - 1);
    else flesh_text_add(path, size, "%s%s", *path ? "." : "", flesh_word_show(name, shown));
  }
}

/* Finds the place of an empty key, which has no token: that of the next ? or : after the last token. */
static void empty_key_place(const builder *b, int *line, int *column)
{
  size_t at = b->behind, start = 0;
  for (; at < b->size && b->text[at] != ':' && b->text[at] != '?'; at++)
    if (b->text[at] == '#') /* a comment */
      while (at + 1 < b->size && b->text[at + 1] != '\n') at++;
  *line = 1;
  for (size_t k = 0; k < at && k < b->size; k++)
    if (b->text[k] == '\n') (*line)++, start = k + 1;
  *column = (int)(at - start) + 1;
}

/* Takes a scalar that is a key of the innermost mapping. */
static int take_key(builder *b, struct fy_token *token, int quoted)
{
  frame *top = &b->stack[b->depth - 1];
  int status = token_text(b, token, &top->key);
  if (status) return status;
  top->key_line = top->node->line;
  top->key_column = top->node->column;
  token_place(token, quoted, &top->key_line, &top->key_column);
  if (!*top->key && !quoted) empty_key_place(b, &top->key_line, &top->key_column);
  if (!*top->key)
    return fail_at(b, top->key_line, top->key_column, "a key of this mapping is empty; keys are words");
  const flesh_node *twin = flesh_node_find(top->node, top->key);
  char path[256], sentence[400];
  if (twin) {
    path_of(b, top->key, path, sizeof path);
    snprintf(sentence, sizeof sentence, "%s stands twice, first in line %d; a key stands once",
             path, twin->key_line);
    return fail_at(b, top->key_line, top->key_column, sentence);
  }
  if (top->node->count >= MAX_KEYS) {
    snprintf(sentence, sizeof sentence,
             "a mapping of more than %d keys; a mapping of a scene has at most as many", MAX_KEYS);
    return fail_at(b, top->key_line, top->key_column, sentence);
  }
  return FLESH_OK;
}

static int count_node(builder *b, int line, int column)
{
  char sentence[200];
  if (++b->nodes <= MAX_NODES) return FLESH_OK;
  snprintf(sentence, sizeof sentence,
           "more than %d values, aliases written out; a scene has at most that many", MAX_NODES);
  return fail_at(b, line, column, sentence);
}

/* Adds a node to the innermost list or mapping. */
static int place_node(builder *b, flesh_node *node)
{
  if (!b->depth) {
    b->root = node;
    return FLESH_OK;
  }
  frame *top = &b->stack[b->depth - 1];
  node->key = NULL;
  if (top->node->kind == FLESH_NODE_MAPPING) {
    node->key = top->key;
    node->key_line = top->key_line;
    node->key_column = top->key_column;
    top->key = NULL;
  }
  flesh_node_append(top->node, node);
  return FLESH_OK;
}

static int set_anchor(builder *b, const char *name, const flesh_node *node)
{
  if (!name) return FLESH_OK;
  anchor *entry = flesh_arena_take(b->arena, sizeof *entry);
  if (!entry) return flesh_no_memory_for(b->source->name);
  *entry = (anchor){name, node, b->anchors};
  b->anchors = entry;
  return FLESH_OK;
}

static int copy_node(builder *b, const flesh_node *from, flesh_node **copy)
{
  int status = count_node(b, from->line, from->column);
  if (status) return status;
  *copy = flesh_arena_take(b->arena, sizeof **copy);
  if (!*copy) return flesh_no_memory_for(b->source->name);
  **copy = *from;
  (*copy)->first = (*copy)->last = (*copy)->next = NULL;
  (*copy)->count = 0;
  for (const flesh_node *child = from->first; child; child = child->next) {
    flesh_node *twin = NULL;
    if ((status = copy_node(b, child, &twin))) return status;
    flesh_node_append(*copy, twin);
  }
  return FLESH_OK;
}

/* Returns the height of a tree; the recursion is bounded, as every tree is at most MAX_DEPTH high. */
static int height(const flesh_node *node)
{
  int most = 0;
  for (const flesh_node *child = node->first; child; child = child->next) {
    int h = height(child);
    if (h > most) most = h;
  }
  return most + 1;
}

static int too_deep(const builder *b, int line, int column)
{
  char sentence[96];
  snprintf(sentence, sizeof sentence, "nested deeper than %d levels; a scene has at most as many", MAX_DEPTH);
  return fail_at(b, line, column, sentence);
}

static int take_alias(builder *b, struct fy_token *token)
{
  int line = 1, column = 1;
  token_place(token, 1, &line, &column);
  const char *name;
  int status = token_text(b, token, &name);
  if (status) return status;
  const anchor *entry = b->anchors;
  while (entry && strcmp(entry->name, name)) entry = entry->before;
  char sentence[200];
  if (!entry) {
    snprintf(sentence, sizeof sentence, "*%.60s names no anchor that stands before it (&%.60s)",
             name, name);
    return fail_at(b, line, column, sentence);
  }
  if (b->depth + height(entry->node) > MAX_DEPTH) return too_deep(b, line, column);
  flesh_node *copy = NULL;
  status = copy_node(b, entry->node, &copy);
  return status ? status : place_node(b, copy);
}

/* Takes a scalar value, or the opening of a list or mapping. */
static int take_value(builder *b, flesh_node_kind kind, struct fy_token *token,
                      struct fy_token *name, int quoted)
{
  flesh_node *node = flesh_node_create(b->arena, kind, b->source);
  if (!node) return flesh_no_memory_for(b->source->name);
  const frame *top = b->depth ? &b->stack[b->depth - 1] : NULL;
  node->line = top && top->key ? top->key_line : top ? top->node->line : 1;
  node->column = top && top->key ? top->key_column : top ? top->node->column : 1;
  node->quoted = quoted;
  token_place(token, quoted, &node->line, &node->column);
  int status = count_node(b, node->line, node->column);
  if (status) return status;
  const char *anchor_name = NULL;
  if (kind == FLESH_NODE_SCALAR) status = token_text(b, token, &node->text);
  if (!status && name) status = token_text(b, name, &anchor_name);
  if (status) return status;
  if ((status = place_node(b, node))) return status;
  if (kind == FLESH_NODE_SCALAR) return set_anchor(b, anchor_name, node);
  if (b->depth == MAX_DEPTH) return too_deep(b, node->line, node->column);
  b->stack[b->depth++] = (frame){.node = node, .anchor = anchor_name};
  return FLESH_OK;
}

/* Returns the token of an event (NULL: none) and its tag. */
static struct fy_token *token_of(struct fy_event *event, struct fy_token **tag)
{
  *tag = NULL;
  switch (event->type) {
  case FYET_SCALAR: *tag = event->scalar.tag; return event->scalar.value;
  case FYET_MAPPING_START: *tag = event->mapping_start.tag; return event->mapping_start.mapping_start;
  case FYET_SEQUENCE_START: *tag = event->sequence_start.tag; return event->sequence_start.sequence_start;
  case FYET_ALIAS: return event->alias.anchor;
  default: return NULL;
  }
}

/* Records the place after the event's token; after an empty value, the place after the colon of its key. */
static void note_place(builder *b, const struct fy_event *event, struct fy_token *token, int key_expected)
{
  const struct fy_mark *end = token ? fy_token_end_mark(token) : NULL;
  if (end && end->input_pos > b->behind) b->behind = end->input_pos;
  else if (event->type == FYET_SCALAR && !key_expected)
    while (b->behind < b->size && b->text[b->behind++] != ':') {}
}

static int refuse_tag(const builder *b, struct fy_token *tag)
{
  int line = 1, column = 1;
  token_place(tag, 0, &line, &column);
  return fail_at(b, line, column, "a tag of YAML (!name), which means nothing in a scene; leave it out");
}

static int take_event(builder *b, struct fy_event *event)
{
  int in_mapping = b->depth && b->stack[b->depth - 1].node->kind == FLESH_NODE_MAPPING;
  int key_expected = in_mapping && !b->stack[b->depth - 1].key;
  struct fy_token *tag, *token = token_of(event, &tag);
  if (tag) return refuse_tag(b, tag);
  switch (event->type) {
  case FYET_DOCUMENT_START:
    return b->documents++ ? fail_at(b, 1, 1, "more than one YAML document (---); a scene is one")
                          : FLESH_OK;
  case FYET_SCALAR: {
    enum fy_scalar_style style = token ? fy_token_scalar_style(token) : FYSS_PLAIN;
    if (key_expected) {
      int status = take_key(b, token, style == FYSS_SINGLE_QUOTED || style == FYSS_DOUBLE_QUOTED);
      note_place(b, event, token, key_expected);
      return status;
    }
    note_place(b, event, token, key_expected);
    return take_value(b, FLESH_NODE_SCALAR, token, event->scalar.anchor,
                      token && style != FYSS_PLAIN);
  }
  case FYET_MAPPING_START:
  case FYET_SEQUENCE_START: {
    int mapping = event->type == FYET_MAPPING_START;
    if (key_expected) {
      int line = 1, column = 1;
      token_place(token, 0, &line, &column);
      return fail_at(b, line, column, "a key is a list or mapping; keys are words");
    }
    note_place(b, event, token, key_expected);
    return take_value(b, mapping ? FLESH_NODE_MAPPING : FLESH_NODE_LIST, token,
                      mapping ? event->mapping_start.anchor : event->sequence_start.anchor, 0);
  }
  case FYET_ALIAS:
    note_place(b, event, token, key_expected);
    if (!key_expected) return take_alias(b, token);
    return fail_at(b, b->stack[b->depth - 1].node->line, b->stack[b->depth - 1].node->column,
                   "a key of this mapping is an alias; keys are words");
  case FYET_MAPPING_END:
  case FYET_SEQUENCE_END:
    if (!b->depth) return FLESH_OK;
    b->depth--;
    return set_anchor(b, b->stack[b->depth].anchor, b->stack[b->depth].node);
  default:
    return FLESH_OK;
  }
}

static void discard(struct fy_diag *diag, void *user, const char *text, size_t size)
{
  (void)diag, (void)user, (void)text, (void)size;
}

/* Returns the line of the first directive with a version that libfyaml does not read, and the version; 0: none. */
static int unread_version(const builder *b, char version[16])
{
  static const char directive[] = "%YAML";
  static const char *const read[] = {"1.1", "1.2", "1.3"};
  const char *end = b->text + b->size;
  int line = 1;
  for (const char *at = b->text, *next; at < end; at = next, line++) {
    next = memchr(at, '\n', (size_t)(end - at));
    next = next ? next + 1 : end;
    if ((size_t)(next - at) < sizeof directive || memcmp(at, directive, sizeof directive - 1)) continue;
    for (at += sizeof directive - 1; at < next && (*at == ' ' || *at == '\t');) at++;
    size_t length = 0;
    while (at + length < next && strchr("0123456789.", at[length]) && at[length] && length < 15) length++;
    snprintf(version, 16, "%.*s", (int)length, at);
    int known = 0;
    for (int k = 0; k < 3; k++) known |= !strcmp(version, read[k]);
    if (!known) return line;
  }
  return 0;
}

/* Fails with the first error that libfyaml collected. For lack of memory and for versions of YAML it has none. */
static int syntax_error(const builder *b, struct fy_diag *diag)
{
  void *at = NULL;
  const struct fy_diag_error *error = fy_diag_errors_iterate(diag, &at);
  char sentence[400], version[16];
  if (!error || !error->msg) {
    int line = unread_version(b, version);
    if (!line) return flesh_no_memory_for(b->source->name);
    snprintf(sentence, sizeof sentence, "%%YAML %s: versions 1.1 to 1.3 of YAML are read", version);
    return fail_at(b, line, 1, sentence);
  }
  snprintf(sentence, sizeof sentence, "not valid YAML or JSON: %s", error->msg);
  return fail_at(b, error->line > 0 ? error->line : 1, error->column > 0 ? error->column : 1, sentence);
}

static int parse(builder *b, struct fy_diag *diag, const char *text, size_t size)
{
  struct fy_parse_cfg cfg = {.flags = FYPCF_QUIET | FYPCF_DEFAULT_VERSION_1_2, .diag = diag};
  struct fy_parser *parser = fy_parser_create(&cfg);
  if (!parser) return flesh_no_memory_for(b->source->name);
  int status = FLESH_OK;
  if (fy_parser_set_string(parser, text, size)) status = flesh_no_memory_for(b->source->name);
  struct fy_event *event = NULL;
  while (!status && (event = fy_parser_parse(parser))) {
    status = take_event(b, event);
    fy_parser_event_free(parser, event);
  }
  if (!status && (fy_parser_get_stream_error(parser) || fy_diag_got_error(diag)))
    status = syntax_error(b, diag);
  fy_parser_destroy(parser);
  return status;
}

int flesh_yaml_parse(flesh_arena *arena, const char *text, size_t size, const flesh_source *source,
                     flesh_node **root)
{
  builder b = {.arena = arena, .source = source};
  *root = NULL;
  int status = check_text(&b, (const unsigned char *)text, size);
  if (status) return status;
  if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3)) text += 3, size -= 3; /* a byte order mark */
  if (!size) return FLESH_OK;
  b.text = text;
  b.size = size;
  struct fy_diag_cfg cfg;
  fy_diag_cfg_default(&cfg);
  cfg.fp = NULL;
  cfg.output_fn = discard;
  struct fy_diag *diag = fy_diag_create(&cfg);
  if (!diag) return flesh_no_memory_for(b.source->name);
  fy_diag_set_collect_errors(diag, true);
  status = parse(&b, diag, text, size);
  fy_diag_destroy(diag);
  if (!status && b.depth)
    status = fail_at(&b, 1, 1, "not valid YAML or JSON: the text ends too early");
  if (!status) *root = b.root;
  return status;
}
