/* gmsh.c: Gmsh's .msh: the header, the sections, and numbers in ASCII or in binary of either byte order (Gmsh reference
 * manual, "MSH file format"). */
#include "mesh/gmsh.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/formats.h"

int64_t flesh_gmsh_where(const flesh_gmsh *g)
{
  return g->binary ? g->s->at - g->s->begin : g->s->line;
}

int flesh_gmsh_fail(const flesh_gmsh *g, const char *format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return flesh_fail(FLESH_ERR_FILE, g->binary ? "%s: byte %lld: %s" : "%s:%lld: %s", g->s->path,
                    (long long)flesh_gmsh_where(g), text);
}

/* Copies the next binary number of `bytes` bytes, in this machine's byte order. */
static int take(flesh_gmsh *g, void *value, size_t bytes)
{
  unsigned char *to = value;
  if ((size_t)(g->s->end - g->s->at) < bytes)
    return flesh_gmsh_fail(g, "the file ends inside %s %lld", g->s->item, (long long)g->s->index);
  for (size_t i = 0; i < bytes; i++) to[g->swap ? bytes - 1 - i : i] = (unsigned char)g->s->at[i];
  g->s->at += bytes;
  return FLESH_OK;
}

int flesh_gmsh_int(flesh_gmsh *g, int64_t *value)
{
  if (!g->binary) return flesh_scan_integer(g->s, value);
  int32_t number = 0;
  int status = take(g, &number, sizeof number);
  *value = number;
  return status;
}

int flesh_gmsh_size(flesh_gmsh *g, int64_t *value)
{
  return g->binary ? take(g, value, sizeof *value) : flesh_scan_integer(g->s, value);
}

int flesh_gmsh_real(flesh_gmsh *g, double *value)
{
  if (!g->binary) return flesh_scan_real(g->s, value);
  int status = take(g, value, sizeof *value);
  if (!status && !isfinite(*value))
    status = flesh_gmsh_fail(g, "%s %lld: a number before here is %g; it must be finite",
                             g->s->item, (long long)g->s->index, *value);
  return status;
}

int flesh_gmsh_check_count(const flesh_gmsh *g, const char *item, int64_t count, int64_t least,
                           int ascii_bytes, int binary_bytes)
{
  int64_t left = g->s->end - g->s->at, bytes = g->binary ? binary_bytes : ascii_bytes;
  if (count < least || count > INT_MAX / 4)
    return flesh_gmsh_fail(g, "the number of %s is %lld; it must be %lld to %d", item,
                           (long long)count, (long long)least, INT_MAX / 4);
  if (count > left / bytes + !g->binary)
    return flesh_gmsh_fail(g,
                           "the number of %s is %lld, but only %lld bytes of the file are left, "
                           "enough for %lld",
                           item, (long long)count, (long long)left, (long long)(left / bytes));
  return FLESH_OK;
}

void flesh_gmsh_skip_bytes(flesh_gmsh *g, int64_t bytes) { g->s->at += bytes; }

void flesh_gmsh_row(flesh_gmsh *g, const char *item, int64_t index, const char *form)
{
  g->s->item = item;
  g->s->index = index;
  g->s->form = form;
  if (!g->binary) flesh_scan_next(g->s);
}

int flesh_gmsh_row_end(flesh_gmsh *g) { return g->binary ? FLESH_OK : flesh_scan_row_end(g->s); }

int flesh_gmsh_add_node(flesh_gmsh *g, int index, int64_t tag)
{
  int there = flesh_draft_tag_node(g->draft, index, tag);
  return there > 0 ? flesh_gmsh_fail(g, "node %lld is given twice", (long long)tag) : there;
}

int flesh_gmsh_add_tet(flesh_gmsh *g, int64_t type, int64_t tag, const int64_t *node_tags,
                       int64_t region, int64_t where)
{
  int nodes[10], size = flesh_gmsh_type_nodes(type);
  for (int i = 0; i < size; i++)
    if (!flesh_tag_map_find(&g->draft->tags, node_tags[i], &nodes[flesh_gmsh_order[i]]))
      return flesh_gmsh_fail(g, "tet %lld uses node %lld, which is not among the %d of $Nodes",
                             (long long)tag, (long long)node_tags[i], g->draft->nodes);
  if (region < INT_MIN || region > INT_MAX)
    return flesh_gmsh_fail(g, "tet %lld has the tag %lld; it must fit into 32 bits", (long long)tag,
                           (long long)region);
  return flesh_draft_add_tet(g->draft, size, nodes, (int)region, where, tag);
}

int flesh_gmsh_type_nodes(int64_t type)
{
  static const unsigned char nodes[] = {0,  2,  3,  4,  4, 8, 6,  5,  3,  6, 9,
                                        10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10,
                                        12, 15, 15, 21, 4, 5, 6,  20, 35, 56};
  if (type == 92) return 64;
  if (type == 93) return 125;
  return type > 0 && type < (int64_t)sizeof nodes ? nodes[type] : 0;
}

int flesh_gmsh_type_dimension(int64_t type)
{
  static const char dimensions[] = "01223333122333302333222222111333";
  return type > 0 && type < (int64_t)sizeof dimensions - 1 ? dimensions[type] - '0' : 3;
}

int flesh_gmsh_is_tet(int64_t type)
{
  return type == FLESH_GMSH_TET4 || type == FLESH_GMSH_TET10;
}

int flesh_gmsh_check_type(const flesh_gmsh *g, int64_t type, int64_t tag)
{
  if (type == 29 || type == 30 || type == 31)
    return flesh_gmsh_fail(g,
                           "element %lld is a tet of %d nodes (order 3 or above); only tets of 4 and "
                           "of 10 nodes can be read: run gmsh with -order 1 or 2",
                           (long long)tag, flesh_gmsh_type_nodes(type));
  return FLESH_OK;
}

/* Reads $MeshFormat: version, 0 for ASCII or 1 for binary, size of a real; in binary then the int 1. */
static int read_format(flesh_gmsh *g)
{
  double version;
  int64_t binary, size, one;
  flesh_gmsh_row(g, "$MeshFormat", -1, "version file-type data-size");
  int status = flesh_scan_real(g->s, &version);
  if (!status) status = flesh_scan_integer(g->s, &binary);
  if (!status) status = flesh_scan_integer(g->s, &size);
  if (!status) status = flesh_scan_row_end(g->s);
  if (status) return status;
  g->major = (int)fmin(fmax(version, 0), 9);
  if (g->major != 2 && version != 4.1)
    return flesh_scan_fail(g->s, "the format is Gmsh's %g; 2.2 and 4.1 can be read", version);
  if (binary != 0 && binary != 1)
    return flesh_scan_fail(g->s, "the file type is %lld; it must be 0 (ASCII) or 1 (binary)",
                           (long long)binary);
  if (binary && size != 8)
    return flesh_scan_fail(g->s, "the data size is %lld; it must be 8", (long long)size);
  if (!binary) return FLESH_OK;
  flesh_scanner line = *g->s;
  flesh_scan_skip_line(g->s);
  if (g->s->at[-1] == '\n' && g->s->at[-2] == '\r')
    return flesh_scan_fail(&line, "a binary file's line ends in CR LF, as after a copy that took it for text, which spoils "
                                 "its numbers; it must be copied again as binary");
  g->binary = 1;
  if ((status = flesh_gmsh_int(g, &one))) return status;
  g->swap = one == 0x01000000;
  if (one != 1 && !g->swap)
    return flesh_gmsh_fail(g,
                           "the int that shows the byte order is %lld; it must be 1 in one order "
                           "or the other",
                           (long long)one);
  return FLESH_OK;
}

/* Moves past `$End<name>`. */
static int skip_section(flesh_gmsh *g, const char *name, size_t length)
{
  flesh_scanner *s = g->s;
  for (; s->at < s->end; s->at++) {
    const char *dollar = memchr(s->at, '$', (size_t)(s->end - s->at));
    const char *stop = dollar ? dollar : s->end;
    for (; !g->binary && s->at < stop; s->at++) s->line += *s->at == '\n';
    s->at = stop;
    if (dollar && (size_t)(s->end - dollar) >= length + 4 && !memcmp(dollar, "$End", 4) &&
        !memcmp(dollar + 4, name, length)) {
      s->at += length + 4;
      return FLESH_OK;
    }
  }
  return flesh_gmsh_fail(g, "the section $%.*s does not end with $End%.*s", (int)length, name,
                         (int)length, name);
}

static int named(const char *name, size_t length, const char *wanted)
{
  return length == strlen(wanted) && !memcmp(name, wanted, length);
}

static int read_section(flesh_gmsh *g, const char *name, size_t length)
{
  flesh_scanner *s = g->s;
  int wanted = 1, status = FLESH_OK;
  flesh_scan_skip_line(s);
  if (named(name, length, "MeshFormat"))
    status = g->major ? flesh_gmsh_fail(g, "a second $MeshFormat") : read_format(g);
  else if (!g->major) status = flesh_gmsh_fail(g, "$MeshFormat must be the first section");
  else if (named(name, length, "PhysicalNames")) status = flesh_gmsh_physical_names(g);
  else if (named(name, length, "Nodes")) {
    if (g->nodes_read++) return flesh_gmsh_fail(g, "a second section $Nodes; there must be one");
    status = g->major == 2 ? flesh_gmsh2_nodes(g) : flesh_gmsh4_nodes(g);
  } else if (named(name, length, "Elements")) {
    if (!g->nodes_read)
      return flesh_gmsh_fail(g, "$Elements comes before $Nodes; it must follow it");
    if (g->elements_read++)
      return flesh_gmsh_fail(g, "a second section $Elements; there must be one");
    status = g->major == 2 ? flesh_gmsh2_elements(g) : flesh_gmsh4_elements(g);
  } else if (g->major == 4 && named(name, length, "Entities")) status = flesh_gmsh4_entities(g, 0);
  else if (g->major == 4 && named(name, length, "PartitionedEntities"))
    status = flesh_gmsh4_entities(g, 1);
  else wanted = 0;
  if (status) return status;
  if (!wanted) return skip_section(g, name, length);
  char end[32];
  snprintf(end, sizeof end, "$End%.*s", (int)length, name);
  if (!flesh_scan_next(s)) return flesh_gmsh_fail(g, "the file ends where %s is expected", end);
  if (!flesh_scan_word(s, end))
    return flesh_gmsh_fail(g, "%s stands where %s is expected", flesh_scan_show(s), end);
  return FLESH_OK;
}

int flesh_gmsh_read(flesh_scanner *s, flesh_draft *draft)
{
  flesh_gmsh gmsh = {.s = s, .draft = draft}, *g = &gmsh;
  int status = FLESH_OK;
  while (!status && flesh_scan_next(s)) {
    const char *name = s->at + 1;
    if (*s->at != '$') {
      status = flesh_gmsh_fail(g, "%s stands where a section ($Nodes, $Elements ...) is expected",
                               flesh_scan_show(s));
      break;
    }
    size_t length = 0;
    while (name + length < s->end && (unsigned char)name[length] > ' ') length++;
    status = read_section(g, name, length);
  }
  draft->binary = g->binary;
  if (!status && !g->nodes_read)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is no section $Nodes", s->path);
  if (!status && !g->elements_read)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there is no section $Elements", s->path);
  if (!status && !draft->tets && !draft->solids)
    status = flesh_fail(FLESH_ERR_FILE,
                        "%s: there are no tets among its %lld elements; was the "
                        "volume meshed (gmsh -3) and saved (a physical volume, or none at all)?",
                        s->path, (long long)g->others);
  flesh_tag_map_clear(&g->volumes);
  flesh_gmsh_clear_names(g);
  return status;
}
