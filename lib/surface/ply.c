/* ply.c: reads Stanford's PLY 1.0 (Turk 1994): a header that describes elements and their
 * properties, then their values, as text or binary in either byte order. */
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "surface/surface.h"

enum { NAME_SIZE = 32, MAX_PROPERTIES = 64, MAX_ELEMENTS = 16 };

typedef enum form { FORM_ASCII, FORM_LITTLE, FORM_BIG } form;
typedef enum kind { KIND_NONE, KIND_SIGNED, KIND_UNSIGNED, KIND_REAL } kind;

typedef struct scalar_type {
  const char *name, *other_name;
  kind kind;
  int bytes;
} scalar_type;

static const scalar_type types[] = {
    {"char", "int8", KIND_SIGNED, 1},       {"uchar", "uint8", KIND_UNSIGNED, 1},
    {"short", "int16", KIND_SIGNED, 2},     {"ushort", "uint16", KIND_UNSIGNED, 2},
    {"int", "int32", KIND_SIGNED, 4},       {"uint", "uint32", KIND_UNSIGNED, 4},
    {"float", "float32", KIND_REAL, 4},     {"double", "float64", KIND_REAL, 8}};

typedef struct property {
  char name[NAME_SIZE];
  const scalar_type *type, *count; /* count: type of a list's length; NULL: not a list */
} property;

typedef struct element {
  char name[NAME_SIZE];
  int count, property_count;
  property properties[MAX_PROPERTIES];
} element;

typedef struct ply {
  flesh_scanner *s;
  form form;
  int element_count;
  element elements[MAX_ELEMENTS];
} ply;

/* Fails with the place that is read: a line, or a byte in binary files. */
#define FAIL(p, ...)                                                                              \
  ((p)->form == FORM_ASCII ? flesh_scan_fail((p)->s, __VA_ARGS__) : fail_at_byte(p, __VA_ARGS__))

static int fail_at_byte(const ply *p, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static int fail_at_byte(const ply *p, const char *format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return flesh_fail(FLESH_ERR_FILE, "%s: byte %lld: %s", p->s->path,
                    (long long)(p->s->at - p->s->begin), text);
}

/* Reads the next word of the line, cut to fit; returns 0 if there is none. */
static int next_word(flesh_scanner *s, char word[NAME_SIZE])
{
  if (!flesh_scan_next_in_line(s)) return 0;
  int length = 0;
  for (; s->at < s->end && !strchr(" \t\r\n\v\f#", *s->at); s->at++)
    if (length < NAME_SIZE - 1) word[length++] = *s->at;
  word[length] = 0;
  return 1;
}

static int read_type(flesh_scanner *s, const scalar_type **type)
{
  char word[NAME_SIZE];
  const char *before = s->at;
  int found = next_word(s, word);
  for (size_t k = 0; found && k < sizeof types / sizeof *types; k++)
    if (!strcmp(word, types[k].name) || !strcmp(word, types[k].other_name)) {
      *type = &types[k];
      return FLESH_OK;
    }
  s->at = before;
  flesh_scan_next_in_line(s);
  return flesh_scan_fail(s,
                         "%s is no type of a property; it must be char, uchar, short, ushort, int, "
                         "uint, float or double (or int8 to float64)",
                         flesh_scan_show(s));
}

static int read_property(ply *p)
{
  flesh_scanner *s = p->s;
  if (!p->element_count) return flesh_scan_fail(s, "a property stands before any element");
  element *e = &p->elements[p->element_count - 1];
  if (e->property_count == MAX_PROPERTIES)
    return flesh_scan_fail(s, "element %s has more than %d properties", e->name, MAX_PROPERTIES);
  property *made = &e->properties[e->property_count++];
  *made = (property){.count = NULL};
  flesh_scan_next_in_line(s);
  int list = flesh_scan_word(s, "list"), status = FLESH_OK;
  if (list) status = read_type(s, &made->count);
  if (!status && list && made->count->kind == KIND_REAL)
    return flesh_scan_fail(s, "a list's length is %s; it must be an integer type",
                           made->count->name);
  if (!status) status = read_type(s, &made->type);
  if (!status && !next_word(s, made->name))
    status = flesh_scan_fail(s, "a property has no name; it is `property TYPE NAME`");
  return status;
}

static int read_element(ply *p)
{
  flesh_scanner *s = p->s;
  if (p->element_count == MAX_ELEMENTS)
    return flesh_scan_fail(s, "there are more than %d elements", MAX_ELEMENTS);
  element *e = &p->elements[p->element_count++];
  int64_t count;
  *e = (element){.property_count = 0};
  if (!next_word(s, e->name)) return flesh_scan_fail(s, "an element has no name");
  s->item = e->name, s->index = -1, s->form = "element NAME COUNT";
  int status = flesh_scan_integer(s, &count);
  if (!status && (count < 0 || count > INT_MAX / 4))
    status = flesh_scan_fail(s, "element %s: the count is %lld; it must be 0 to %d", e->name,
                             (long long)count, INT_MAX / 4);
  if (!status) e->count = (int)count;
  return status;
}

static int read_form(ply *p)
{
  char word[NAME_SIZE] = "", version[NAME_SIZE] = "";
  static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  next_word(p->s, word);
  next_word(p->s, version);
  for (int f = FORM_ASCII; f <= FORM_BIG; f++)
    if (!strcmp(word, names[f]) && !strcmp(version, "1.0")) {
      p->form = (form)f;
      return FLESH_OK;
    }
  return flesh_scan_fail(p->s,
                         "the format is '%s %s'; it must be ascii, binary_little_endian or "
                         "binary_big_endian, each 1.0",
                         word, version);
}

/* Reads everything up to `end_header` and its line end. */
static int read_header(ply *p)
{
  flesh_scanner *s = p->s;
  form form = FORM_ASCII;
  int status = flesh_scan_row_end(s), has_form = 0;
  while (!status) {
    if (!flesh_scan_next(s)) return flesh_scan_fail(s, "the header does not end (`end_header`)");
    if (flesh_scan_word(s, "end_header")) break;
    if (flesh_scan_word(s, "comment") || flesh_scan_word(s, "obj_info")) {
      flesh_scan_skip_line(s);
      continue;
    }
    if (flesh_scan_word(s, "format")) {
      status = read_form(p);
      form = p->form, has_form = 1;
      p->form = FORM_ASCII; /* the header is ASCII */
    } else if (flesh_scan_word(s, "element")) status = read_element(p);
    else if (flesh_scan_word(s, "property")) status = read_property(p);
    else
      return flesh_scan_fail(s,
                             "%s begins no line of a header; it must be format, element, property, "
                             "comment, obj_info or end_header",
                             flesh_scan_show(s));
    s->item = "header", s->form = "what is said before", s->index = -1;
    if (!status) status = flesh_scan_row_end(s);
  }
  if (!status && !has_form) return flesh_scan_fail(s, "the header names no format");
  if (!status) flesh_scan_skip_line(s);
  p->form = form;
  return status;
}

static uint64_t read_bytes(ply *p, int count)
{
  uint64_t value = 0;
  const unsigned char *bytes = (const unsigned char *)p->s->at;
  for (int b = 0; b < count; b++)
    value |= (uint64_t)bytes[b] << 8 * (p->form == FORM_LITTLE ? b : count - 1 - b);
  p->s->at += count;
  return value;
}

static int short_file(const ply *p)
{
  return FAIL(p, "%s %lld: the file ends too early", p->s->item, (long long)p->s->index);
}

/* Reads the next value as a real. */
static int read_real(ply *p, const scalar_type *type, double *value)
{
  if (p->form == FORM_ASCII) return flesh_scan_real(p->s, value);
  if (p->s->end - p->s->at < type->bytes) return short_file(p);
  uint64_t bits = read_bytes(p, type->bytes);
  if (type->kind == KIND_REAL && type->bytes == 8) memcpy(value, &bits, 8);
  else if (type->kind == KIND_REAL) {
    uint32_t half = (uint32_t)bits;
    float single;
    memcpy(&single, &half, 4);
    *value = single;
  } else if (type->kind == KIND_SIGNED && bits >> (8 * type->bytes - 1))
    *value = (double)bits - ldexp(1, 8 * type->bytes);
  else *value = (double)bits;
  return FLESH_OK;
}

/* Reads the next value as an integer; fails for a real that is not whole. */
static int read_integer(ply *p, const scalar_type *type, int64_t *value)
{
  if (p->form == FORM_ASCII) return flesh_scan_integer(p->s, value);
  double real;
  int status = read_real(p, type, &real);
  if (status) return status;
  if (!(fabs(real) < 1e15) || real != floor(real))
    return FAIL(p, "%s %lld: %g is not an integer", p->s->item, (long long)p->s->index, real);
  *value = (int64_t)real;
  return FLESH_OK;
}

/* Skips values. */
static int skip_values(ply *p, const scalar_type *type, int64_t count)
{
  flesh_scanner *s = p->s;
  if (p->form != FORM_ASCII) {
    if ((s->end - s->at) / type->bytes < count) return short_file(p);
    s->at += count * type->bytes;
    return FLESH_OK;
  }
  char word[NAME_SIZE];
  for (int64_t k = 0; k < count; k++)
    if (!next_word(s, word))
      return flesh_scan_fail(s, "%s %lld: the row ends too early", s->item, (long long)s->index);
  return FLESH_OK;
}

static int read_length(ply *p, const property *list, int64_t *length)
{
  int status = read_integer(p, list->count, length);
  if (!status && *length < 0)
    status = FAIL(p, "%s %lld: the list %s has %lld items", p->s->item, (long long)p->s->index,
                  list->name, (long long)*length);
  return status;
}

static int read_face(ply *p, const property *list, int vertices, flesh_surface_draft *draft)
{
  int64_t length, index;
  int status = read_length(p, list, &length);
  if (!status && (length < 3 || length > FLESH_SURFACE_MAX_CORNERS))
    return FAIL(p, "face %lld has %lld corners; it must have 3 to %d", (long long)p->s->index,
                (long long)length, FLESH_SURFACE_MAX_CORNERS);
  for (int64_t k = 0; !status && k < length; k++) {
    status = read_integer(p, list->type, &index);
    if (!status && (index < 0 || index >= vertices))
      return FAIL(p, "face %lld uses vertex %lld; the vertices are 0 to %d",
                  (long long)p->s->index, (long long)index, vertices - 1);
    if (!status) status = flesh_surface_draft_corner(draft, (int)index, -1);
  }
  return status ? status : flesh_surface_draft_face(draft);
}

/* Returns 0, 1, 2 for the properties x, y, z; -1 for others. */
static int axis_of(const property *of)
{
  return !of->count && strlen(of->name) == 1 && *of->name >= 'x' && *of->name <= 'z'
             ? *of->name - 'x'
             : -1;
}

/* Reads the rows of an element. `corners`: index of the property that lists a face's vertices, or -1. */
static int read_rows(ply *p, const element *e, int is_vertex, int corners, int vertices,
                     flesh_surface_draft *draft)
{
  flesh_scanner *s = p->s;
  int status = FLESH_OK;
  s->item = e->name, s->form = "its properties in their order";
  if (!e->property_count) return FLESH_OK;
  for (int row = 0; row < e->count && !status; row++) {
    double position[3] = {0, 0, 0};
    int64_t length = 1;
    s->index = row;
    if (p->form == FORM_ASCII && !flesh_scan_next(s)) return short_file(p);
    for (int k = 0; k < e->property_count && !status; k++) {
      const property *of = &e->properties[k];
      int axis = is_vertex ? axis_of(of) : -1;
      if (axis >= 0) status = read_real(p, of->type, &position[axis]);
      else if (k == corners) status = read_face(p, of, vertices, draft);
      else {
        if (of->count) status = read_length(p, of, &length);
        if (!status) status = skip_values(p, of->type, of->count ? length : 1);
      }
    }
    if (!status && p->form == FORM_ASCII) status = flesh_scan_row_end(s);
    for (int d = 0; d < 3 && is_vertex && !status; d++)
      if (!isfinite(position[d]))
        status = FAIL(p, "vertex %d has a coordinate that is not finite", row);
    if (!status && is_vertex) status = flesh_surface_draft_vertex(draft, position);
  }
  return status;
}

/* Checks that an element that is read occurs once; else its properties would be ambiguous. */
static int check_once(const ply *p, int element)
{
  const char *name = p->elements[element].name;
  for (int k = 0; k < element; k++)
    if (!strcmp(p->elements[k].name, name))
      return flesh_fail(FLESH_ERR_FILE, "%s: element %s stands twice; it must stand once", p->s->path, name);
  return FLESH_OK;
}

static int check_vertex(const ply *p, const element *e)
{
  int found = 0;
  for (int k = 0; k < e->property_count; k++) {
    int axis = axis_of(&e->properties[k]);
    if (axis < 0) continue;
    if (found & 1 << axis)
      return flesh_fail(FLESH_ERR_FILE, "%s: element vertex has property %s twice; it must have it once", p->s->path,
                        e->properties[k].name);
    found |= 1 << axis;
  }
  if (found == 7) return FLESH_OK;
  return flesh_fail(FLESH_ERR_FILE,
                    "%s: element vertex has no property %s; it must have x, y and z", p->s->path,
                    !(found & 1)   ? "x"
                    : !(found & 2) ? "y"
                                   : "z");
}

static int corners_of(const element *e)
{
  for (int k = 0; k < e->property_count; k++)
    if (e->properties[k].count && (!strcmp(e->properties[k].name, "vertex_indices") ||
                                   !strcmp(e->properties[k].name, "vertex_index")))
      return k;
  return -1;
}

int flesh_surface_read_ply(flesh_scanner *s, flesh_surface_draft *draft)
{
  ply p = {.s = s};
  s->item = "header", s->form = "ply", s->index = -1;
  int status = read_header(&p), vertices = -1, faces = -1;
  for (int k = 0; k < p.element_count && !status; k++) {
    const element *e = &p.elements[k];
    int is_vertex = !strcmp(e->name, "vertex"), is_face = !strcmp(e->name, "face");
    if (is_vertex || is_face) status = check_once(&p, k);
    if (is_vertex && !status) vertices = e->count, status = check_vertex(&p, e);
    if (is_face) faces = corners_of(e);
  }
  if (status) return status;
  if (vertices < 0) return flesh_fail(FLESH_ERR_FILE, "%s: there is no element vertex", s->path);
  if (faces < 0)
    return flesh_fail(FLESH_ERR_FILE,
                      "%s: there is no element face with a list vertex_indices; triangle strips "
                      "and clouds of points are not read",
                      s->path);
  for (int k = 0; k < p.element_count && !status; k++) {
    const element *e = &p.elements[k];
    int is_face = !strcmp(e->name, "face");
    status = read_rows(&p, e, !strcmp(e->name, "vertex"), is_face ? faces : -1, vertices, draft);
  }
  return status;
}
