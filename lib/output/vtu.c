/* vtu.c: writes VTK XML files: a header with offsets, then every array as raw bytes after its length.
 *
 * The arrays stand in the reverse order of their headers, so that offsets descend; VTK accepts any order. meshio
 * replaces the offsets in the header by those of base64 one at a time, beginning with the first array, and finds each
 * array by its offset among replaced and other ones. It takes the first header with that offset, which is the right one
 * only in this order. */
#include "output/vtu.h"

#include <stdint.h>

#include "base/error.h"
#include "base/file.h"
#include "base/memory.h"

enum { VTK_POLYGON = 7, VTK_TETRA = 10, VTK_QUADRATIC_TETRA = 24 };

static const char *byte_order(void)
{
  const uint16_t one = 1;
  return *(const uint8_t *)&one ? "LittleEndian" : "BigEndian";
}

/* Prints text with XML's special characters escaped, as names may come from scenes. */
static void print_escaped(FILE *stream, const char *text)
{
  for (; *text; text++) {
    switch (*text) {
    case '&': fputs("&amp;", stream); break;
    case '<': fputs("&lt;", stream); break;
    case '>': fputs("&gt;", stream); break;
    case '"': fputs("&quot;", stream); break;
    default:
      putc(*text, stream);
    }
  }
}

static size_t array_bytes(const flesh_vtu_array *array, int count)
{
  return (size_t)count * array->components * (array->doubles ? sizeof(double) : sizeof(int32_t));
}

/* Prints ComponentName0="..." and so on. */
static void print_component_names(FILE *stream, const flesh_vtu_array *array)
{
  const int groups = array->groups > 1 ? array->groups : 1, each = array->components / groups;
  for (int c = 0; c < array->components && (array->component_names || groups > 1); c++) {
    fprintf(stream, " ComponentName%d=\"", c);
    if (array->component_names) print_escaped(stream, array->component_names[c % each]);
    if (groups > 1) fprintf(stream, "%s%d", array->component_names ? "_" : "", c / each + 1);
    putc('"', stream);
  }
}

/* A file being written: bytes of a block's length (4 or 8), and the offset of the block whose header was printed last. */
typedef struct writer {
  FILE *stream;
  size_t length_size;
  uint64_t offset;
} writer;

static void print_header(writer *w, const char *type, const flesh_vtu_array *array, uint64_t bytes)
{
  FILE *stream = w->stream;
  w->offset -= w->length_size + bytes;
  fprintf(stream, "        <DataArray type=\"%s\" Name=\"", type);
  print_escaped(stream, array->name);
  fprintf(stream, "\" NumberOfComponents=\"%d\"", array->components);
  print_component_names(stream, array);
  fprintf(stream, " format=\"appended\" offset=\"%llu\"", (unsigned long long)w->offset);
  if (array->unit) {
    fputs(">\n          <InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">", stream);
    print_escaped(stream, array->unit);
    fputs("</InformationKey>\n        </DataArray>\n", stream);
  } else fputs("/>\n", stream);
}

/* Prints the header of an array that the format requires, without units or names of components. */
static void print_plain_header(writer *w, const char *type, const char *name, int components, uint64_t bytes)
{
  print_header(w, type, &(flesh_vtu_array){.name = name, .components = components}, bytes);
}

static void print_array_headers(writer *w, const char *section, int array_count, const flesh_vtu_array *arrays, int count)
{
  fprintf(w->stream, "      <%s>\n", section);
  for (int a = 0; a < array_count; a++)
    print_header(w, arrays[a].doubles ? "Float64" : "Int32", &arrays[a], array_bytes(&arrays[a], count));
  fprintf(w->stream, "      </%s>\n", section);
}

static void write_length(const writer *w, uint64_t bytes)
{
  const uint32_t narrow = (uint32_t)bytes;
  fwrite(w->length_size == sizeof narrow ? (const void *)&narrow : &bytes, w->length_size, 1, w->stream);
}

static void write_block(const writer *w, const void *values, uint64_t bytes)
{
  write_length(w, bytes);
  if (bytes) fwrite(values, 1, bytes, w->stream);
}

static void write_arrays(const writer *w, int array_count, const flesh_vtu_array *arrays, int count)
{
  for (int a = array_count - 1; a >= 0; a--)
    write_block(w, arrays[a].doubles ? (const void *)arrays[a].doubles : arrays[a].integers,
                array_bytes(&arrays[a], count));
}

/* Writes the points of all cells: corners, or a tet's four corners and then its six nodes on edges. */
static void write_connectivity(const writer *w, const flesh_vtu *content, int64_t count)
{
  const uint64_t bytes = sizeof(int32_t) * (uint64_t)count;
  if (!content->edge_nodes) {
    write_block(w, content->tet_nodes ? content->tet_nodes : content->corners, bytes);
    return;
  }
  write_length(w, bytes);
  for (size_t t = 0; t < (size_t)content->tets; t++) {
    fwrite(content->tet_nodes + 4 * t, sizeof(int32_t), 4, w->stream);
    if (content->edge_nodes[6 * t] >= 0) fwrite(content->edge_nodes + 6 * t, sizeof(int32_t), 6, w->stream);
  }
}

/* Returns the number of points of cell c. */
static int64_t cell_size(const flesh_vtu *content, int c)
{
  if (!content->tet_nodes) return content->starts[c + 1] - content->starts[c];
  return content->edge_nodes && content->edge_nodes[6 * (size_t)c] >= 0 ? 10 : 4;
}

static int cell_count(const flesh_vtu *content) { return content->tet_nodes ? content->tets : content->polygons; }

static int64_t corner_count(const flesh_vtu *content)
{
  int64_t count = 0;
  for (int c = 0; c < cell_count(content); c++) count += cell_size(content, c);
  return count;
}

size_t flesh_vtu_length_size(const flesh_vtu *content)
{
  const int cells = cell_count(content);
  uint64_t most = sizeof(int32_t) * (uint64_t)corner_count(content);
  if (most < sizeof(int64_t) * (uint64_t)cells) most = sizeof(int64_t) * (uint64_t)cells;
  if (most < 3 * sizeof(double) * (uint64_t)content->points) most = 3 * sizeof(double) * (uint64_t)content->points;
  for (int a = 0; a < content->point_array_count; a++)
    if (most < array_bytes(&content->point_arrays[a], content->points))
      most = array_bytes(&content->point_arrays[a], content->points);
  for (int a = 0; a < content->cell_array_count; a++)
    if (most < array_bytes(&content->cell_arrays[a], cells)) most = array_bytes(&content->cell_arrays[a], cells);
  return most <= UINT32_MAX ? sizeof(uint32_t) : sizeof(uint64_t);
}

/* Returns the bytes of all blocks. */
static uint64_t bytes_of_all(const writer *w, const flesh_vtu *content)
{
  const uint64_t cells = (uint64_t)cell_count(content);
  const uint64_t arrays = (uint64_t)content->point_array_count + (uint64_t)content->cell_array_count;
  uint64_t bytes = 3 * sizeof(double) * (uint64_t)content->points + sizeof(int32_t) * (uint64_t)corner_count(content) +
                   (sizeof(int64_t) + 1) * cells + (arrays + 4) * w->length_size;
  for (int a = 0; a < content->point_array_count; a++) bytes += array_bytes(&content->point_arrays[a], content->points);
  for (int a = 0; a < content->cell_array_count; a++) bytes += array_bytes(&content->cell_arrays[a], (int)cells);
  return bytes;
}

/* Writes the end of each cell in the connectivity. */
static void write_cell_ends(const writer *w, const flesh_vtu *content, int cells)
{
  int64_t end = 0;
  write_length(w, sizeof(int64_t) * (uint64_t)cells);
  for (int c = 0; c < cells; c++) {
    end += cell_size(content, c);
    fwrite(&end, sizeof end, 1, w->stream);
  }
}

static void write_cell_types(const writer *w, const flesh_vtu *content, int cells)
{
  write_length(w, (uint64_t)cells);
  for (int c = 0; c < cells; c++)
    putc(!content->tet_nodes ? VTK_POLYGON : cell_size(content, c) == 10 ? VTK_QUADRATIC_TETRA : VTK_TETRA, w->stream);
}

int flesh_vtu_write(const char *path, const flesh_vtu *content)
{
  _Static_assert(sizeof(int) == sizeof(int32_t), "int arrays are written as Int32");
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  FILE *stream = file.stream;
  writer w = {.stream = stream, .length_size = flesh_vtu_length_size(content)};
  w.offset = bytes_of_all(&w, content);
  const int points = content->points, cells = cell_count(content);
  const int64_t corners = corner_count(content);
  fprintf(stream,
          "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\""
          " header_type=\"UInt%d\">\n"
          "  <UnstructuredGrid>\n"
          "    <Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\">\n",
          byte_order(), 8 * (int)w.length_size, points, cells);
  print_array_headers(&w, "PointData", content->point_array_count, content->point_arrays, points);
  print_array_headers(&w, "CellData", content->cell_array_count, content->cell_arrays, cells);
  fputs("      <Points>\n", stream);
  print_plain_header(&w, "Float64", "Points", 3, 3 * sizeof(double) * (uint64_t)points);
  fputs("      </Points>\n      <Cells>\n", stream);
  print_plain_header(&w, "Int32", "connectivity", 1, sizeof(int32_t) * (uint64_t)corners);
  print_plain_header(&w, "Int64", "offsets", 1, sizeof(int64_t) * (uint64_t)cells);
  print_plain_header(&w, "UInt8", "types", 1, (uint64_t)cells);
  fputs("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n"
        "  <AppendedData encoding=\"raw\">\n_",
        stream);
  write_cell_types(&w, content, cells);
  write_cell_ends(&w, content, cells);
  write_connectivity(&w, content, corners);
  write_block(&w, content->positions, 3 * sizeof(double) * (uint64_t)points);
  write_arrays(&w, content->cell_array_count, content->cell_arrays, cells);
  write_arrays(&w, content->point_array_count, content->point_arrays, points);
  fputs("\n  </AppendedData>\n</VTKFile>\n", stream);
  return flesh_file_commit(&file);
}

static void print_part_arrays(FILE *stream, const char *section, int count, const flesh_vtu_array *arrays)
{
  fprintf(stream, "    <%s>\n", section);
  for (int a = 0; a < count; a++) {
    fprintf(stream, "      <PDataArray type=\"%s\" Name=\"", arrays[a].doubles ? "Float64" : "Int32");
    print_escaped(stream, arrays[a].name);
    fprintf(stream, "\" NumberOfComponents=\"%d\"", arrays[a].components);
    print_component_names(stream, &arrays[a]);
    fputs("/>\n", stream);
  }
  fprintf(stream, "    </%s>\n", section);
}

int flesh_pvtu_write(const char *path, const flesh_vtu *content, const char *stem, int parts)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  fprintf(file.stream,
          "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"%s\">\n"
          "  <PUnstructuredGrid GhostLevel=\"0\">\n",
          byte_order());
  print_part_arrays(file.stream, "PPointData", content->point_array_count, content->point_arrays);
  print_part_arrays(file.stream, "PCellData", content->cell_array_count, content->cell_arrays);
  fputs("    <PPoints>\n      <PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n"
        "    </PPoints>\n", file.stream);
  for (int part = 0; part < parts; part++) {
    fputs("    <Piece Source=\"", file.stream);
    print_escaped(file.stream, stem);
    fprintf(file.stream, "_%05d.vtu\"/>\n", part);
  }
  fputs("  </PUnstructuredGrid>\n</VTKFile>\n", file.stream);
  return flesh_file_commit(&file);
}

int flesh_pvd_write(const char *path, int count, const double *times, const char *const *files)
{
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  fprintf(file.stream,
          "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"%s\">\n  <Collection>\n",
          byte_order());
  for (int f = 0; f < count; f++) {
    fputs("    <DataSet timestep=\"", file.stream);
    flesh_number_print(file.stream, times[f]);
    fputs("\" file=\"", file.stream);
    print_escaped(file.stream, files[f]);
    fputs("\"/>\n", file.stream);
  }
  fputs("  </Collection>\n</VTKFile>\n", file.stream);
  return flesh_file_commit(&file);
}

int flesh_pvd_next(flesh_pvd *pvd, char **name)
{
  *name = NULL;
  if (pvd->count == pvd->capacity) {
    int capacity[2] = {pvd->capacity, pvd->capacity};
    if (!flesh_grow(&pvd->times, sizeof *pvd->times, pvd->count, &capacity[0]) ||
        !flesh_grow(&pvd->names, sizeof *pvd->names, pvd->count, &capacity[1]) ||
        !flesh_grow(&pvd->files, sizeof *pvd->files, pvd->count, &pvd->capacity))
      return flesh_fail(FLESH_ERR_MEMORY, "out of memory for an index of %d frames", pvd->count + 1);
    for (int f = 0; f < pvd->capacity; f++) pvd->files[f] = pvd->names[f];
  }
  *name = pvd->names[pvd->count];
  return FLESH_OK;
}

int flesh_pvd_add(flesh_pvd *pvd, const char *path, double time)
{
  pvd->times[pvd->count++] = time;
  return flesh_pvd_write(path, pvd->count, pvd->times, pvd->files);
}

void flesh_pvd_clear(flesh_pvd *pvd)
{
  flesh_free(pvd->times);
  flesh_free(pvd->names);
  flesh_free(pvd->files);
  *pvd = (flesh_pvd){0};
}
