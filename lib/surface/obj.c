/* obj.c: reads Wavefront's OBJ (Advanced Visualizer, appendix B1): vertices, texture coordinates and polygons; its
 * other statements are recognised and ignored. */
#include <limits.h>
#include <string.h>

#include "surface/surface.h"

/* Statements that do not affect the shape of polygons. */
static const char *const left_out[] = {
    "vn",     "vp",       "g",      "s",      "o",          "mg",        "usemtl", "mtllib",
    "usemap", "maplib",   "l",      "p",      "deg",        "bmat",      "step",   "cstype",
    "curv",   "curv2",    "surf",   "parm",   "trim",       "hole",      "scrv",   "sp",
    "end",    "con",      "bevel",  "lod",    "c_interp",   "d_interp",  "call",   "csh",
    "ctech",  "stech",    "shadow_obj",       "trace_obj",  "group"};

/* The file's largest index and its line, checked at the end, as vertices may come after the faces that use them. */
typedef struct highest {
  int64_t value, line;
} highest;

/* Joins lines that end in a backslash with the next ones, and moves their line ends after the joined text, so that
 * later lines keep their numbers. Returns the new size. */
static size_t join_lines(char *text, size_t size)
{
  size_t out = 0;
  int owed = 0;
  for (size_t i = 0; i < size; i++) {
    size_t end = i + 1 < size && text[i + 1] == '\r' ? i + 2 : i + 1;
    if (text[i] == '\\' && end < size && text[end] == '\n') {
      text[out++] = ' ';
      owed++;
      i = end;
      continue;
    }
    text[out++] = text[i];
    if (text[i] == '\n')
      for (; owed; owed--) text[out++] = '\n';
  }
  text[out] = 0;
  return out;
}

/* Reads an index and moves *at past it: from 1, or back from the last item when negative. Returns 0 if there is
 * none. */
static int read_index(const char **at, int64_t *value)
{
  const char *c = *at;
  int negative = *c == '-';
  if (negative) c++;
  int64_t sum = 0;
  const char *first = c;
  for (; *c >= '0' && *c <= '9'; c++)
    if (sum < INT_MAX) sum = 10 * sum + (*c - '0');
  if (c == first) return 0;
  *at = c;
  *value = negative ? -sum : sum;
  return 1;
}

/* Finds the index in the arrays, from 0. Fails with a sentence if there is no such item. */
static int resolve(const flesh_scanner *s, const char *what, int64_t index, int count, int *found,
                   highest *seen)
{
  if (!index || index < -count)
    return flesh_scan_fail(s,
                           "face %lld: the %s index is %lld; it counts from 1, or back from -1 "
                           "through the %d before",
                           (long long)s->index, what, (long long)index, count);
  if (index > INT_MAX / 4)
    return flesh_scan_fail(s, "face %lld: the %s index %lld is too large", (long long)s->index,
                           what, (long long)index);
  if (index > seen->value) seen->value = index, seen->line = s->line;
  *found = (int)(index > 0 ? index - 1 : count + index);
  return FLESH_OK;
}

static int read_corner(flesh_scanner *s, flesh_surface_draft *draft, highest seen[2])
{
  const char *at = s->at;
  int64_t v, vt = 0, vn;
  int fine = read_index(&at, &v), vertex = -1, texture = -1, has_texture = 0;
  if (fine && *at == '/') {
    at++;
    has_texture = read_index(&at, &vt);
    if (*at == '/') {
      at++;
      fine = read_index(&at, &vn);
    } else fine = has_texture;
  }
  if (!fine || !(at >= s->end || strchr(" \t\r\n\v\f#", *at)))
    return flesh_scan_fail(s, "face %lld: %s is no corner; it must be v, v/vt, v//vn or v/vt/vn",
                           (long long)s->index, flesh_scan_show(s));
  int status = resolve(s, "vertex", v, draft->vertices, &vertex, &seen[0]);
  if (!status && has_texture)
    status = resolve(s, "texture", vt, draft->textures, &texture, &seen[1]);
  s->at = at;
  return status ? status : flesh_surface_draft_corner(draft, vertex, texture);
}

static int read_face(flesh_scanner *s, flesh_surface_draft *draft, highest seen[2])
{
  s->index = draft->faces + 1;
  int status = FLESH_OK;
  while (!status && flesh_scan_next_in_line(s)) status = read_corner(s, draft, seen);
  int corners = flesh_surface_draft_open_corners(draft);
  if (!status && (corners < 3 || corners > FLESH_SURFACE_MAX_CORNERS))
    return flesh_scan_fail(s, "face %lld has %d corners; it must have 3 to %d", (long long)s->index,
                           corners, FLESH_SURFACE_MAX_CORNERS);
  return status ? status : flesh_surface_draft_face(draft);
}

/* Reads `v x y z`; a weight or a colour may follow. */
static int read_vertex(flesh_scanner *s, flesh_surface_draft *draft)
{
  double position[3], more;
  int status = FLESH_OK;
  s->item = "vertex", s->form = "v x y z", s->index = draft->vertices + 1;
  for (int d = 0; d < 3 && !status; d++) status = flesh_scan_real(s, &position[d]);
  for (int extra = 0; extra < 4 && !status && flesh_scan_next_in_line(s); extra++)
    status = flesh_scan_real(s, &more);
  if (!status) status = flesh_scan_row_end(s);
  return status ? status : flesh_surface_draft_vertex(draft, position);
}

/* Reads `vt u [v [w]]`. */
static int read_texture(flesh_scanner *s, flesh_surface_draft *draft)
{
  double uv[3] = {0, 0, 0};
  s->item = "texture vertex", s->form = "vt u v", s->index = draft->textures + 1;
  int status = flesh_scan_real(s, &uv[0]);
  for (int d = 1; d < 3 && !status && flesh_scan_next_in_line(s); d++)
    status = flesh_scan_real(s, &uv[d]);
  if (!status) status = flesh_scan_row_end(s);
  return status ? status : flesh_surface_draft_texture(draft, uv);
}

static int read_statement(flesh_scanner *s, flesh_surface_draft *draft, highest seen[2])
{
  if (flesh_scan_word(s, "v")) return read_vertex(s, draft);
  if (flesh_scan_word(s, "f") || flesh_scan_word(s, "fo")) return read_face(s, draft, seen);
  if (flesh_scan_word(s, "vt")) return read_texture(s, draft);
  for (size_t k = 0; k < sizeof left_out / sizeof *left_out; k++)
    if (flesh_scan_word(s, left_out[k])) {
      flesh_scan_skip_line(s);
      return FLESH_OK;
    }
  return flesh_scan_fail(s, "%s is no statement of an OBJ; a surface is a Wavefront .obj (`v x y "
                            "z`, `f a b c`), a Stanford .ply (`ply`) or an .stl (`solid`, or binary)",
                         flesh_scan_show(s));
}

int flesh_surface_read_obj(flesh_scanner *s, char *text, flesh_surface_draft *draft)
{
  highest seen[2] = {{0, 0}, {0, 0}};
  int status = FLESH_OK;
  s->end = text + join_lines(text, (size_t)(s->end - text));
  while (!status && flesh_scan_next(s)) status = read_statement(s, draft, seen);
  for (int k = 0; k < 2 && !status; k++) {
    int count = k ? draft->textures : draft->vertices;
    s->line = seen[k].line;
    if (seen[k].value > count)
      status = flesh_scan_fail(s, "a face uses %s %lld; the file has %d of them",
                               k ? "texture vertex" : "vertex", (long long)seen[k].value, count);
  }
  return status;
}
