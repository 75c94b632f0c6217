/* vtk.c: reads VTK's XML files of unstructured grids, .vtu: one piece, its cells VTK_TETRA and VTK_QUADRATIC_TETRA;
 * other cells are ignored (VTK File Formats, "XML File Formats"; vtkCellType.h). */
#include "mesh/vtk.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/formats.h"

enum { VTK_TETRA = 10, VTK_QUADRATIC_TETRA = 24 };

/* Names of cell arrays that are taken as regions, by falling priority; without any, the only array of integers is
 * taken. */
static const char *const region_names[] = {"region", "regions", "MaterialIds", "gmsh:physical", "medit:ref"};
enum { REGION_NAMES = sizeof region_names / sizeof *region_names };

typedef struct grid {
  flesh_vtk_file file;
  flesh_draft *draft;
  int64_t points, cells; /* -1: no piece yet */
  flesh_vtk_array positions, connectivity, offsets, types;
  flesh_vtk_array region;
  int region_rank; /* place of its name in region_names; REGION_NAMES: another name; larger: no array */
  int others;      /* number of integer arrays with other names */
} grid;

static int read_head(grid *g, const flesh_xml_tag *tag)
{
  const uint16_t one = 1;
  const int big = flesh_xml_attribute_is(tag, "byte_order", "BigEndian"), big_machine = !*(const uint8_t *)&one;
  const char *compressor;
  size_t length = 0;
  g->file.swap = big != big_machine;
  g->file.header_size = flesh_xml_attribute_is(tag, "header_type", "UInt64") ? 8 : 4;
  g->file.compressed = flesh_xml_attribute(tag, "compressor", &compressor, &length) && length;
  if (!flesh_xml_attribute_is(tag, "type", "UnstructuredGrid"))
    return flesh_vtk_fail(&g->file, tag->line, "the file's type is not UnstructuredGrid, which has the tets");
  if (g->file.compressed && !flesh_xml_attribute_is(tag, "compressor", "vtkZLibDataCompressor"))
    return flesh_vtk_fail(&g->file, tag->line, "the data are compressed by something else than vtkZLibDataCompressor; save "
                                               "them with that, or uncompressed");
  return FLESH_OK;
}

static int read_piece(grid *g, const flesh_xml_tag *tag)
{
  if (g->points >= 0)
    return flesh_vtk_fail(&g->file, tag->line, "a second <Piece>; there must be one: merge the pieces");
  g->points = flesh_xml_number(tag, "NumberOfPoints", -1);
  g->cells = flesh_xml_number(tag, "NumberOfCells", -1);
  if (g->points >= 1 && g->points <= INT_MAX / 4 && g->cells >= 1 && g->cells <= INT_MAX / 4) return FLESH_OK;
  return flesh_vtk_fail(&g->file, tag->line, "NumberOfPoints or NumberOfCells of the piece is missing or wrong; it must be "
                                             "a number from 1 to %d",
                        INT_MAX / 4);
}

/* Records an array of cell data if it may be the regions. */
static int note_region(grid *g, const flesh_xml_tag *tag)
{
  const char *name, *type;
  size_t length, type_length;
  int rank = 0;
  flesh_vtk_array array;
  if (!flesh_xml_attribute(tag, "Name", &name, &length) || !flesh_xml_attribute(tag, "type", &type, &type_length))
    return FLESH_OK;
  while (rank < REGION_NAMES && !flesh_xml_attribute_is(tag, "Name", region_names[rank])) rank++;
  if (rank == REGION_NAMES && (!memchr(type, 'I', type_length) || (length > 2 && !memcmp(name, "vtk", 3)))) return FLESH_OK;
  const int status = flesh_vtk_array_read(&g->file, tag, rank < REGION_NAMES ? region_names[rank] : "of regions", &array);
  if (status || array.components != 1) return status;
  g->others += rank == REGION_NAMES;
  if (rank < g->region_rank) g->region = array, g->region_rank = rank;
  return FLESH_OK;
}

/* Records a <DataArray> in <Points>, <Cells> or <CellData>. */
static int note_array(grid *g, const flesh_xml_tag *tag, const char *section)
{
  if (!strcmp(section, "Points")) return flesh_vtk_array_read(&g->file, tag, "of points", &g->positions);
  if (!strcmp(section, "CellData")) return note_region(g, tag);
  if (flesh_xml_attribute_is(tag, "Name", "connectivity"))
    return flesh_vtk_array_read(&g->file, tag, "connectivity", &g->connectivity);
  if (flesh_xml_attribute_is(tag, "Name", "offsets")) return flesh_vtk_array_read(&g->file, tag, "offsets", &g->offsets);
  if (flesh_xml_attribute_is(tag, "Name", "types")) return flesh_vtk_array_read(&g->file, tag, "types", &g->types);
  return FLESH_OK;
}

/* Records <AppendedData>: the data begin after the next '_'. */
static int note_appended(grid *g, const flesh_xml_tag *tag)
{
  const flesh_scanner *s = g->file.s;
  const char *mark = memchr(s->at, '_', (size_t)(s->end - s->at));
  g->file.appended_base64 = flesh_xml_attribute_is(tag, "encoding", "base64");
  if (!mark || (!g->file.appended_base64 && !flesh_xml_attribute_is(tag, "encoding", "raw")))
    return flesh_vtk_fail(&g->file, tag->line, "<AppendedData> has no known encoding or no _ before its data; "
                                               "encoding=\"raw\" or \"base64\" is expected");
  g->file.appended = mark + 1;
  return FLESH_OK;
}

/* Records the places of all arrays. */
static int find_arrays(grid *g)
{
  static const char *const sections[] = {"Points", "Cells", "CellData"};
  const char *section = NULL;
  flesh_xml_tag tag;
  int status = FLESH_OK, begun = 0;
  while (!status && flesh_xml_next(g->file.s, &tag)) {
    for (int k = 0; k < 3; k++)
      if (flesh_xml_is(&tag, sections[k])) section = tag.closes || tag.end[-1] == '/' ? NULL : sections[k];
    if (tag.closes) continue;
    if (flesh_xml_is(&tag, "VTKFile")) begun = 1, status = read_head(g, &tag);
    else if (!begun) return flesh_vtk_fail(&g->file, tag.line, "the file does not begin with <VTKFile>");
    else if (flesh_xml_is(&tag, "Piece")) status = read_piece(g, &tag);
    else if (section && flesh_xml_is(&tag, "DataArray")) status = note_array(g, &tag, section);
    else if (flesh_xml_is(&tag, "AppendedData")) return note_appended(g, &tag);
  }
  if (!status && !begun) return flesh_vtk_fail(&g->file, 1, "the file does not begin with <VTKFile>");
  return status;
}

static int check_arrays(const grid *g)
{
  const char *missing = !g->positions.name ? "<DataArray> in <Points>"
                        : !g->connectivity.name ? "array connectivity in <Cells>"
                        : !g->offsets.name ? "array offsets in <Cells>"
                        : !g->types.name ? "array types in <Cells>" : NULL;
  if (g->points < 0) missing = "<Piece>";
  if (missing) return flesh_fail(FLESH_ERR_FILE, "%s: there is no %s", g->file.s->path, missing);
  if (g->positions.components != 3)
    return flesh_vtk_fail(&g->file, g->positions.line, "the points have %d coordinates; they must have 3",
                          g->positions.components);
  return FLESH_OK;
}

static int read_points(grid *g)
{
  double *x;
  int status = flesh_vtk_reals(&g->file, &g->positions, 3 * g->points, &x);
  for (int64_t k = 0; k < 3 * g->points && !status; k++)
    if (!isfinite(x[k]))
      status = flesh_vtk_fail(&g->file, g->positions.line, "a coordinate of point %lld is %g; it must be finite",
                              (long long)(k / 3), x[k]);
  if (!status) status = flesh_draft_set_nodes(g->draft, (int)g->points);
  if (!status) memcpy(g->draft->positions, x, 3 * (size_t)g->points * sizeof *x);
  free(x);
  return status;
}

/* Cell arrays in memory. */
typedef struct cells {
  int64_t *connectivity, *offsets, *types;
  double *regions; /* NULL: none */
} cells;

/* Cell types of solids: voxels, hexahedra, wedges, pyramids, other prisms and polyhedra, also the quadratic and
 * Lagrange ones. */
static const unsigned char solids[] = {11, 12, 13, 14, 15, 16, 25, 26, 27, 29, 31, 32, 33, 37, 42, 72, 73, 74};

static int read_cell(grid *g, const cells *c, int64_t e)
{
  const int64_t first = e ? c->offsets[e - 1] : 0, *point = c->connectivity + first;
  const int size = c->types[e] == VTK_TETRA ? 4 : c->types[e] == VTK_QUADRATIC_TETRA ? 10 : 0;
  const double region = c->regions ? c->regions[e] : 0;
  int nodes[10];
  if (!size) {
    g->draft->solids += c->types[e] > 0 && c->types[e] < 256 && memchr(solids, (int)c->types[e], sizeof solids) != NULL;
    return FLESH_OK;
  }
  if (c->offsets[e] - first != size)
    return flesh_vtk_fail(&g->file, g->offsets.line, "cell %lld has %lld points; its type %d has %d", (long long)e,
                          (long long)(c->offsets[e] - first), (int)c->types[e], size);
  for (int a = 0; a < size; a++)
    if ((nodes[a] = flesh_draft_node(g->draft, point[a])) < 0)
      return flesh_vtk_fail(&g->file, g->connectivity.line, "cell %lld uses point %lld; the points are 0 to %d", (long long)e,
                            (long long)point[a], g->draft->nodes - 1);
  if (!(region == floor(region) && fabs(region) <= INT_MAX))
    return flesh_vtk_fail(&g->file, g->region.line, "cell %lld has the region %g; it must be an integer of 32 bits",
                          (long long)e, region);
  return flesh_draft_add_tet(g->draft, size, nodes, (int)region, g->connectivity.line, e);
}

/* Checks that offsets do not fall and are in range. */
static int check_offsets(const grid *g, const int64_t *offsets)
{
  for (int64_t e = 0; e < g->cells; e++)
    if (offsets[e] < (e ? offsets[e - 1] : 0) || offsets[e] > INT_MAX)
      return flesh_vtk_fail(&g->file, g->offsets.line, "offset %lld is %lld; offsets must rise from 0 to %d", (long long)e,
                            (long long)offsets[e], INT_MAX);
  return FLESH_OK;
}

static int read_cells(grid *g)
{
  cells c = {0};
  int status = flesh_vtk_integers(&g->file, &g->offsets, g->cells, &c.offsets);
  if (!status) status = check_offsets(g, c.offsets);
  if (!status) status = flesh_vtk_integers(&g->file, &g->types, g->cells, &c.types);
  if (!status) status = flesh_vtk_integers(&g->file, &g->connectivity, c.offsets[g->cells - 1], &c.connectivity);
  const int has_region = g->region_rank < REGION_NAMES || (g->region_rank == REGION_NAMES && g->others == 1);
  if (!status && has_region) status = flesh_vtk_reals(&g->file, &g->region, g->cells, &c.regions);
  for (int64_t e = 0; e < g->cells && !status; e++) status = read_cell(g, &c, e);
  free(c.connectivity);
  free(c.offsets);
  free(c.types);
  free(c.regions);
  if (!status && !g->draft->tets)
    status = flesh_fail(FLESH_ERR_FILE, "%s: there are no tets (VTK_TETRA or VTK_QUADRATIC_TETRA) among its %lld cells",
                        g->file.s->path, (long long)g->cells);
  return status;
}

int flesh_vtk_read(flesh_scanner *s, flesh_draft *draft)
{
  grid g = {.file = {.s = s}, .draft = draft, .points = -1, .cells = -1, .region_rank = REGION_NAMES + 1};
  int status = find_arrays(&g);
  if (!status) status = check_arrays(&g);
  if (!status) status = read_points(&g);
  return status ? status : read_cells(&g);
}
