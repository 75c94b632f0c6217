/* read.c: flesh_mesh_read: loads a file and finds its format by its name or by its content. */
#include <string.h>
#include <strings.h>

#include "base/error.h"
#include "mesh/formats.h"
#include "mesh/split.h"

/* Formats that are recognised by the file's name. */
static const struct {
  const char *suffix;
  int (*read)(flesh_scanner *s, flesh_draft *draft);
} named[] = {{".inp", flesh_abaqus_read}, {".vtu", flesh_vtk_read}, {".veg", flesh_vega_read}};

#define FILL "; Gmsh, TetGen and fTetWild fill it with tets"
/* First bytes of formats that are recognised but not read, and advice for each. */
static const struct {
  const char *begin;
  int bytes;
  const char *advice;
} foreign[] = {
    {"\1\0\0\0", 4, "a binary Medit .meshb; only the ASCII .mesh is read"},
    {"\0\0\0\1", 4, "a binary Medit .meshb; only the ASCII .mesh is read"},
    {"$NOD", 4, "Gmsh's format 1; save it as 2.2 or 4.1"},
    {"# vtk", 5, "VTK's legacy one; save the grid as .vtu"},
    {"<?xml", 5, "XML; VTK's unstructured grids are read from files named .vtu"},
    {"<VTKFile", 8, "VTK's; its unstructured grids are read from files named .vtu"},
    {"solid", 5, "STL, a surface without tets" FILL},
    {"ply", 3, "PLY, a surface without tets" FILL},
    {"*", 1, "one of keywords after a *; Abaqus's and CalculiX's are read from files named .inp, VegaFEM's from .veg"},
};

static int refuse(const flesh_scanner *s)
{
  for (size_t i = 0; i < sizeof foreign / sizeof *foreign; i++) {
    const char *from = *foreign[i].begin == '#' ? s->begin : s->at; /* the scanner skips comments */
    if (s->end - from >= foreign[i].bytes && !memcmp(from, foreign[i].begin, (size_t)foreign[i].bytes))
      return flesh_fail(FLESH_ERR_FILE, "%s: the format is %s", s->path, foreign[i].advice);
  }
  const size_t length = strlen(s->path);
  if (length > 4 && (!strcasecmp(s->path + length - 4, ".stl") || !strcasecmp(s->path + length - 4, ".obj")))
    return flesh_fail(FLESH_ERR_FILE, "%s: this is a surface without tets" FILL, s->path);
  return flesh_scan_fail(s,
                         "%s begins no known mesh format; a mesh is TetGen .node and .ele, Gmsh "
                         ".msh (`$MeshFormat`), Medit .mesh (`MeshVersionFormatted`), Abaqus .inp, "
                         "VTK .vtu, VegaFEM .veg or a plain list (`nodes N`)",
                         flesh_scan_show(s));
}

static int read_format(flesh_scanner *s, flesh_draft *draft)
{
  const size_t length = strlen(s->path);
  for (size_t k = 0; k < sizeof named / sizeof *named; k++)
    if (length > strlen(named[k].suffix) && !strcmp(s->path + length - strlen(named[k].suffix), named[k].suffix))
      return named[k].read(s, draft);
  if (!flesh_scan_next(s)) return flesh_fail(FLESH_ERR_FILE, "%s: the file is empty", s->path);
  if (flesh_scan_word(s, "nodes")) {
    s->at -= strlen("nodes");
    return flesh_plain_read(s, draft);
  }
  if (s->end - s->at >= 11 && !memcmp(s->at, "$MeshFormat", 11)) return flesh_gmsh_read(s, draft);
  if (s->end - s->at >= 20 && !memcmp(s->at, "MeshVersionFormatted", 20))
    return flesh_medit_read(s, draft);
  if ((*s->at >= '0' && *s->at <= '9') || *s->at == '-' || *s->at == '+')
    return flesh_tetgen_read(s, draft);
  return refuse(s);
}

static int read_split(flesh_scanner *s, flesh_mesh **mesh)
{
  flesh_split split;
  int status = flesh_split_read(s, &split);
  if (!status) status = flesh_split_read_whole(&split, mesh);
  flesh_split_close(&split);
  return status;
}

int flesh_mesh_read(const char *path, flesh_mesh **mesh)
{
  FLESH_NEED({mesh, "mesh"});
  *mesh = NULL;
  FLESH_NEED({path, "path"});
  flesh_scanner scanner;
  flesh_draft draft = {.path = path};
  int status = flesh_scan_open(&scanner, path);
  const int split = !status && flesh_split_begins(&scanner);
  if (split) status = read_split(&scanner, mesh);
  else if (!status) status = read_format(&scanner, &draft);
  if (!status && !split) status = flesh_draft_finish(&draft, mesh);
  flesh_draft_clear(&draft);
  flesh_scan_close(&scanner);
  return status;
}
