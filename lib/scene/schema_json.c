/* schema_json.c: the keys as JSON Schema, draft 2020-12, for editors and other programs. */
#include <stdlib.h>
#include <string.h>

#include "flesh/version.h"
#include "scene/effect_list.h"
#include "scene/schema.h"
#include "scene/words.h"

/* The bounds of numbers as keywords of JSON Schema, with a leading comma, in the order of flesh_key_range. */
static const char *const bounds[] = {"", ", \"exclusiveMinimum\": 0", ", \"minimum\": 0",
                                     ", \"exclusiveMinimum\": 0, \"exclusiveMaximum\": 1",
                                     ", \"exclusiveMinimum\": -1, \"maximum\": 0.5"};

/* Returns whether the text is valid in JSON without quotes: true, false, or a number without a + sign or a point at an
 * end. */
static int is_json_word(const char *word)
{
  if (!strcmp(word, "true") || !strcmp(word, "false")) return 1;
  double value;
  const char *digits = word + (*word == '-');
  size_t whole = strspn(digits, "0123456789");
  if (!whole || (whole > 1 && *digits == '0') || strpbrk(word, "/ ") ||
      !flesh_number_parse(word, &value))
    return 0;
  return digits[whole] != '.' || (digits[whole + 1] >= '0' && digits[whole + 1] <= '9');
}

static void write_node(const flesh_node *node, flesh_text *text)
{
  if (node->kind == FLESH_NODE_SCALAR) {
    if (is_json_word(node->text)) flesh_text_print(text, "%s", node->text);
    else flesh_text_quote(text, node->text);
    return;
  }
  int list = node->kind == FLESH_NODE_LIST;
  flesh_text_print(text, list ? "[" : "{");
  for (const flesh_node *child = node->first; child; child = child->next) {
    if (!list) {
      flesh_text_quote(text, child->key);
      flesh_text_print(text, ": ");
    }
    write_node(child, text);
    if (child->next) flesh_text_print(text, ", ");
  }
  flesh_text_print(text, list ? "]" : "}");
}

static void new_line(int indent, flesh_text *text) { flesh_text_print(text, "\n%*s", indent, ""); }

static void write_number(const flesh_key *key, flesh_text *text)
{
  flesh_text_print(text,
                   "\"anyOf\": [{\"type\": \"number\"%s}, {\"$ref\": \"#/$defs/fraction\"}%s]",
                   bounds[key->range],
                   flesh_key_takes_infinity(key) ? ", {\"$ref\": \"#/$defs/infinity\"}" : "");
}

static void write_choices(const flesh_key *key, flesh_text *text)
{
  flesh_text_print(text, "\"enum\": [");
  for (const char *const *choice = key->choices; *choice; choice++) {
    if (choice != key->choices) flesh_text_print(text, ", ");
    flesh_text_quote(text, *choice);
  }
  if (key->may_be_all) flesh_text_print(text, ", \"all\"");
  for (const char *const *choice = key->choices; key->may_be_all && *choice; choice++)
    flesh_text_print(text, ", \"-%s\"", *choice);
  for (const char *const *alias = key->aliases; alias && *alias; alias++) {
    flesh_text_print(text, ", ");
    flesh_text_quote(text, *alias);
  }
  flesh_text_print(text, "]");
}

static void write_three(const flesh_key *key, flesh_text *text)
{
  flesh_text_print(text, "\"type\": \"array\", \"minItems\": 3, \"maxItems\": 3, \"items\": {");
  write_number(key, text);
  flesh_text_print(text, "}");
}

static void write_key(flesh_arena *arena, const flesh_key *key, int indent, flesh_text *text);

/* Writes "type": "object" and its properties, without the braces around. */
static void write_object(flesh_arena *arena, const flesh_key *keys, int may_be_null, int indent,
                         flesh_text *text)
{
  flesh_text_print(text, "\"type\": %s, \"additionalProperties\": false,",
                   may_be_null ? "[\"object\", \"null\"]" : "\"object\"");
  const char *separator = "";
  for (const flesh_key *key = keys; key->name; key++) {
    if (key->default_value) continue;
    if (!*separator) {
      new_line(indent, text);
      flesh_text_print(text, "\"required\": [");
    }
    flesh_text_print(text, "%s", separator);
    flesh_text_quote(text, key->name);
    separator = ", ";
  }
  if (*separator) flesh_text_print(text, "],");
  new_line(indent, text);
  flesh_text_print(text, "\"properties\": {");
  for (const flesh_key *key = keys; key->name; key++) {
    new_line(indent + 2, text);
    flesh_text_quote(text, key->name);
    flesh_text_print(text, ": {");
    write_key(arena, key, indent + 4, text);
    flesh_text_print(text, key[1].name ? "}," : "}");
  }
  flesh_text_print(text, "}");
}

static void write_effects(flesh_arena *arena, int indent, flesh_text *text)
{
  int count;
  const flesh_effect_row *const *rows = flesh_effect_registry(&count);
  flesh_text_print(text, "\"type\": \"array\", \"items\": {\"anyOf\": [");
  new_line(indent, text);
  flesh_text_print(text, "{\"enum\": [");
  for (int i = 0; i < count; i++) {
    if (i) flesh_text_print(text, ", ");
    flesh_text_quote(text, rows[i]->name);
  }
  flesh_text_print(text, "]},");
  new_line(indent, text);
  flesh_text_print(text, "{\"type\": \"object\", \"minProperties\": 1, \"maxProperties\": 1, "
                         "\"additionalProperties\": false, \"properties\": {");
  for (int i = 0; i < count; i++) {
    new_line(indent + 2, text);
    flesh_text_quote(text, rows[i]->name);
    flesh_text_print(text, ": {\"description\": ");
    flesh_text_quote(text, rows[i]->doc);
    flesh_text_print(text, ", ");
    write_object(arena, rows[i]->keys, 1, indent + 4, text);
    flesh_text_print(text, i + 1 < count ? "}," : "}");
  }
  flesh_text_print(text, "}}]}");
}

static void write_description(const flesh_key *key, flesh_text *text)
{
  flesh_text whole = {0};
  flesh_text_print(&whole, "%s", key->doc ? key->doc : "");
  if (key->unit) flesh_text_print(&whole, "%s[%s]", whole.size ? " " : "", key->unit);
  flesh_text_print(text, "\"description\": ");
  flesh_text_quote(text, whole.failed ? "" : whole.data);
  text->failed |= whole.failed;
  free(whole.data);
}

static void write_default(flesh_arena *arena, const flesh_key *key, flesh_text *text)
{
  if (!key->default_value || !*key->default_value) return;
  flesh_node *node = NULL;
  if (flesh_key_default(arena, key, &node) || !node) {
    text->failed = 1;
    return;
  }
  flesh_text_print(text, ", \"default\": ");
  write_node(node, text);
}

static void write_key(flesh_arena *arena, const flesh_key *key, int indent, flesh_text *text)
{
  write_description(key, text);
  write_default(arena, key, text);
  flesh_text_print(text, ", ");
  switch (key->type) {
  case FLESH_KEY_NUMBER: write_number(key, text); break;
  case FLESH_KEY_INTEGER: flesh_text_print(text, "\"type\": \"integer\"%s", bounds[key->range]); break;
  case FLESH_KEY_BOOLEAN: flesh_text_print(text, "\"type\": \"boolean\""); break;
  case FLESH_KEY_CHOICE: write_choices(key, text); break;
  case FLESH_KEY_TEXT:
  case FLESH_KEY_PATH: flesh_text_print(text, "\"type\": \"string\", \"minLength\": 1"); break;
  case FLESH_KEY_VECTOR: write_three(key, text); break;
  case FLESH_KEY_BOX:
    flesh_text_print(text, "\"type\": \"array\", \"minItems\": 2, \"maxItems\": 2, \"items\": {");
    write_three(key, text);
    flesh_text_print(text, "}");
    break;
  case FLESH_KEY_SET:
    flesh_text_print(text, "\"type\": \"array\", \"minItems\": %d, \"items\": {", !key->may_be_all);
    write_choices(key, text);
    flesh_text_print(text, "}");
    break;
  case FLESH_KEY_INTEGERS:
    flesh_text_print(text,
                     "\"type\": \"array\", \"minItems\": 1, \"items\": {\"type\": \"integer\"%s}",
                     bounds[key->range]);
    break;
  case FLESH_KEY_OBJECT: write_object(arena, key->children, 1, indent, text); break;
  case FLESH_KEY_OBJECTS:
    flesh_text_print(text, "\"type\": \"array\", \"items\": {");
    write_object(arena, key->children, 0, indent, text);
    flesh_text_print(text, "}");
    break;
  case FLESH_KEY_EFFECTS: write_effects(arena, indent, text); break;
  case FLESH_KEY_TREE:
    flesh_text_print(text, "\"type\": [\"object\", \"array\", \"string\", \"number\", \"boolean\"]");
    break;
  }
}

void flesh_schema_json(flesh_arena *arena, const flesh_schema_part *part, flesh_text *text)
{
  flesh_text_print(text, "{\"$schema\": \"https://json-schema.org/draft/2020-12/schema\",");
  new_line(2, text);
  flesh_text_print(text, "\"$id\": \"urn:flesh:%s:%s\",", *part->path ? part->path : "scene", FLESH_VERSION_STRING);
  new_line(2, text);
  flesh_text_print(text, "\"title\": ");
  flesh_text_quote(text, *part->path ? part->path : "flesh scene");
  flesh_text_print(text, ",");
  new_line(2, text);
  if (part->keys) {
    flesh_text_print(text, "\"description\": ");
    flesh_text_quote(text, part->doc ? part->doc : "");
    flesh_text_print(text, ", ");
    write_object(arena, part->keys, 0, 2, text);
  } else {
    write_key(arena, part->value, 2, text);
  }
  flesh_text_print(text, ",");
  new_line(2, text);
  flesh_text_print(
      text, "\"$defs\": {\"fraction\": {\"description\": \"a decimal number or a fraction a/b\", "
            "\"type\": \"string\", \"pattern\": \"^[-+0-9.eE]+( */ *[-+0-9.eE]+)?$\"},");
  new_line(4, text);
  flesh_text_print(text, "\"infinity\": {\"enum\": [\".inf\", \"-.inf\"]}}}\n");
}
