/* xml.c: tags and attributes of an XML file, limited to the XML that VTK's files use. */
#include <string.h>

#include "mesh/vtk.h"

static int is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/* Moves to `to`, and counts the lines before it. */
static void go_to(flesh_scanner *s, const char *to)
{
  for (const char *at = s->at; (at = memchr(at, '\n', (size_t)(to - at))); at++) s->line++;
  s->at = to;
}

/* Returns the place after the next `text`, or the end of the file. */
static const char *behind(const flesh_scanner *s, const char *at, const char *text)
{
  const size_t length = strlen(text);
  for (; (at = memchr(at, *text, (size_t)(s->end - at))); at++)
    if ((size_t)(s->end - at) >= length && !memcmp(at, text, length)) return at + length;
  return s->end;
}

int flesh_xml_next(flesh_scanner *s, flesh_xml_tag *tag)
{
  for (;;) {
    const char *at = memchr(s->at, '<', (size_t)(s->end - s->at));
    go_to(s, at ? at : s->end);
    if (!at || s->end - at < 3) return 0;
    if (!memcmp(at, "<!-", 3)) go_to(s, behind(s, at, "-->"));
    else if (at[1] == '?' || at[1] == '!') go_to(s, behind(s, at, ">"));
    else break;
  }
  char quote = 0;
  *tag = (flesh_xml_tag){.name = s->at + 1, .line = s->line};
  tag->closes = *tag->name == '/';
  tag->name += tag->closes;
  const char *end = tag->name;
  while (end < s->end && !is_blank(*end) && *end != '>' && *end != '/') end++;
  tag->length = (size_t)(end - tag->name);
  for (; end < s->end && (quote || *end != '>'); end++)
    if (quote ? *end == quote : *end == '"' || *end == '\'') quote = quote ? 0 : *end;
  tag->end = end;
  go_to(s, end < s->end ? end + 1 : end);
  return 1;
}

int flesh_xml_is(const flesh_xml_tag *tag, const char *name)
{
  return strlen(name) == tag->length && !memcmp(tag->name, name, tag->length);
}

int flesh_xml_attribute(const flesh_xml_tag *tag, const char *name, const char **value, size_t *length)
{
  const size_t wanted = strlen(name);
  for (const char *at = tag->name + tag->length; at < tag->end;) {
    while (at < tag->end && (is_blank(*at) || *at == '/')) at++;
    const char *key = at;
    while (at < tag->end && !is_blank(*at) && *at != '=') at++;
    const size_t key_length = (size_t)(at - key);
    while (at < tag->end && *at != '"' && *at != '\'') at++;
    const char *close = at < tag->end ? memchr(at + 1, *at, (size_t)(tag->end - at - 1)) : NULL;
    if (!close) return 0;
    if (key_length == wanted && !memcmp(key, name, wanted)) {
      *value = at + 1;
      *length = (size_t)(close - at - 1);
      return 1;
    }
    at = close + 1;
  }
  return 0;
}

int flesh_xml_attribute_is(const flesh_xml_tag *tag, const char *name, const char *value)
{
  const char *text;
  size_t length;
  return flesh_xml_attribute(tag, name, &text, &length) && length == strlen(value) && !memcmp(text, value, length);
}

int64_t flesh_xml_number(const flesh_xml_tag *tag, const char *attribute, int64_t missing)
{
  const char *text;
  size_t length;
  int64_t number = 0;
  if (!flesh_xml_attribute(tag, attribute, &text, &length)) return missing;
  for (size_t k = 0; k < length; k++) {
    if (text[k] < '0' || text[k] > '9' || number > INT64_MAX / 20) return -1;
    number = 10 * number + (text[k] - '0');
  }
  return length ? number : -1;
}
