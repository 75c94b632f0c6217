/* stl.c: reads 3D Systems' STL (1989), text or binary: triangles, each with corners of its own; corners at the same
 * place become one vertex. */
#include <math.h>
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "surface/surface.h"

/* Bytes of a binary file: an arbitrary header, a count, and facets: a normal, three corners and two more bytes. */
enum { HEADER = 80, BEGIN = HEADER + 4, NORMAL = 12, FACET = NORMAL + 36 + 2 };

static uint32_t read_word(const char *bytes)
{
  const unsigned char *b = (const unsigned char *)bytes;
  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Returns the size of a binary file with the count of facets that this one has; 0 if the file is too short for a
 * count. */
static int64_t binary_size(const flesh_scanner *s)
{
  return s->end - s->begin < BEGIN ? 0 : BEGIN + FACET * (int64_t)read_word(s->begin + HEADER);
}

/* Reads the word at the current place, ignoring case; returns whether it was there. */
static int read_keyword(flesh_scanner *s, const char *word)
{
  const char *token, *before = s->at;
  if (flesh_scan_token(s, &token) == strlen(word) && !strncasecmp(token, word, strlen(word))) return 1;
  s->at = before;
  return 0;
}

int flesh_surface_is_stl(const flesh_scanner *s)
{
  const size_t length = strlen(s->path);
  const int named = length > 4 && !strcasecmp(s->path + length - 4, ".stl");
  flesh_scanner copy = *s;
  const int64_t size = binary_size(s);
  return named || (size > BEGIN && size == s->end - s->begin) || (flesh_scan_next(&copy) && read_keyword(&copy, "solid"));
}

static int add_corner(flesh_surface_draft *draft, const double x[3])
{
  const int status = flesh_surface_draft_vertex(draft, x);
  return status ? status : flesh_surface_draft_corner(draft, draft->vertices - 1, -1);
}

static int read_binary(flesh_scanner *s, flesh_surface_draft *draft)
{
  int status = FLESH_OK;
  for (const char *facet = s->begin + BEGIN; facet < s->end && !status; facet += FACET) {
    for (int corner = 0; corner < 3 && !status; corner++) {
      double x[3];
      for (int d = 0; d < 3; d++) {
        const char *at = facet + NORMAL + 12 * corner + 4 * d;
        const uint32_t word = read_word(at);
        float single;
        memcpy(&single, &word, 4);
        x[d] = single;
        if (!isfinite(single))
          return flesh_fail(FLESH_ERR_FILE, "%s: byte %lld: facet %d has a coordinate that is not finite", s->path,
                            (long long)(at - s->begin), draft->faces + 1);
      }
      status = add_corner(draft, x);
    }
    if (!status) status = flesh_surface_draft_face(draft);
  }
  return status;
}

/* Reads the word that must come next. */
static int expect(flesh_scanner *s, const char *word)
{
  if (!flesh_scan_next(s))
    return flesh_scan_fail(s, "facet %lld: the file ends too early; `%s` is expected", (long long)s->index, word);
  if (read_keyword(s, word)) return FLESH_OK;
  return flesh_scan_fail(s, "facet %lld: %s stands where `%s` is expected", (long long)s->index, flesh_scan_show(s), word);
}

/* Reads the rest of a facet after its first word. Ignores its normal, which may be nan, as it follows from the
 * corners. */
static int read_facet(flesh_scanner *s, flesh_surface_draft *draft)
{
  const char *token;
  int status = expect(s, "normal");
  for (int d = 0; d < 3 && !status; d++)
    if (flesh_scan_next_in_line(s)) flesh_scan_token(s, &token);
  if (!status) status = expect(s, "outer");
  if (!status) status = expect(s, "loop");
  for (int corner = 0; corner < 3 && !status; corner++) {
    double x[3];
    status = expect(s, "vertex");
    for (int d = 0; d < 3 && !status; d++) status = flesh_scan_real(s, &x[d]);
    if (!status) status = add_corner(draft, x);
  }
  if (!status) status = expect(s, "endloop");
  if (!status) status = expect(s, "endfacet");
  return status ? status : flesh_surface_draft_face(draft);
}

/* Reads a text file, which may have several solids, one after the other. */
static int read_text(flesh_scanner *s, flesh_surface_draft *draft)
{
  int status = FLESH_OK, inside = 0;
  s->comment = 0; /* a solid's name may contain a # */
  s->item = "facet", s->form = "vertex x y z";
  while (!status && flesh_scan_next(s)) {
    s->index = draft->faces + 1;
    if (inside && read_keyword(s, "facet")) status = read_facet(s, draft);
    else if (read_keyword(s, inside ? "endsolid" : "solid")) flesh_scan_skip_line(s), inside = !inside;
    else
      return flesh_scan_fail(s, "%s stands where `%s` is expected", flesh_scan_show(s), inside ? "facet` or `endsolid" : "solid");
  }
  if (!status && inside) status = flesh_scan_fail(s, "the file ends too early; `endsolid` is expected");
  return status;
}

/* Merges vertices at the same place into the first of them. */
static int merge(flesh_surface_draft *draft)
{
  const int count = draft->vertices;
  /* So far corner v has vertex v. */
  const int status = flesh_surface_first_vertices(count, draft->positions, draft->vertex_of);
  if (status) return status;
  draft->vertices = 0;
  for (int v = 0; v < count; v++) {
    const int first = draft->vertex_of[v];
    if (first < v) {
      draft->vertex_of[v] = draft->vertex_of[first];
      continue;
    }
    draft->vertex_of[v] = draft->vertices;
    memmove(draft->positions + 3 * (size_t)draft->vertices++, draft->positions + 3 * (size_t)v, 3 * sizeof(double));
  }
  return FLESH_OK;
}

int flesh_surface_read_stl(flesh_scanner *s, flesh_surface_draft *draft)
{
  const int64_t size = s->end - s->begin, expected = binary_size(s);
  flesh_scanner copy = *s;
  const int is_binary = size == expected || memchr(s->begin, 0, (size_t)size) ||
                        !(flesh_scan_next(&copy) && read_keyword(&copy, "solid"));
  if (is_binary && !expected)
    return flesh_fail(FLESH_ERR_FILE, "%s: an STL begins with `solid` or, if it is binary, has %d bytes or more; this has %lld",
                      s->path, BEGIN, (long long)size);
  if (is_binary && size != expected)
    return flesh_fail(FLESH_ERR_FILE, "%s: a binary STL of %lu facets has %lld bytes; this file has %lld", s->path,
                      (unsigned long)read_word(s->begin + HEADER), (long long)expected, (long long)size);
  const int status = is_binary ? read_binary(s, draft) : read_text(s, draft);
  return status ? status : merge(draft);
}
