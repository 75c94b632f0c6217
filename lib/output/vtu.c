/* vtu.c: VTK XML files: a header with offsets, then every array as raw bytes behind its length. */
#include "output/vtu.h"

#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"
#include "base/file.h"

enum { VTK_POLYGON = 7, VTK_TETRA = 10, VTK_QUADRATIC_TETRA = 24 };

static const char *byte_order(void)
{
  const uint16_t one = 1;
  return *(const uint8_t *)&one ? "LittleEndian" : "BigEndian";
}

/* Names come from code and scenes; XML's special characters must not break the file. */
static void print_escaped(FILE *stream, const char *text)
{
  for (; *text; text++) {
    switch (*text) {
    case '&':
      fputs("&amp;", stream);
      break;
    case '<':
      fputs("&lt;", stream);
      break;
    case '>':
      fputs("&gt;", stream);
      break;
    case '"':
      fputs("&quot;", stream);
      break;
    default:
      putc(*text, stream);
    }
  }
}

static size_t array_bytes(const flesh_vtu_array *array, int count)
{
  return (size_t)count * array->components * (array->doubles ? sizeof(double) : sizeof(int32_t));
}

/* ComponentName0="..." and so on. */
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

static void print_header(FILE *stream, const char *type, const flesh_vtu_array *array, uint64_t bytes, uint64_t *offset)
{
  fprintf(stream, "        <DataArray type=\"%s\" Name=\"", type);
  print_escaped(stream, array->name);
  fprintf(stream, "\" NumberOfComponents=\"%d\"", array->components);
  print_component_names(stream, array);
  fprintf(stream, " format=\"appended\" offset=\"%llu\"", (unsigned long long)*offset);
  if (array->unit) {
    fputs(">\n          <InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">", stream);
    print_escaped(stream, array->unit);
    fputs("</InformationKey>\n        </DataArray>\n", stream);
  } else fputs("/>\n", stream);
  *offset += sizeof(uint64_t) + bytes;
}

/* Of what the format itself asks for. */
static void print_plain_header(FILE *stream, const char *type, const char *name, int components, uint64_t bytes,
                               uint64_t *offset)
{
  print_header(stream, type, &(flesh_vtu_array){.name = name, .components = components}, bytes, offset);
}

static void print_array_headers(FILE *stream, const char *section, int array_count,
                                const flesh_vtu_array *arrays, int count, uint64_t *offset)
{
  fprintf(stream, "      <%s>\n", section);
  for (int a = 0; a < array_count; a++)
    print_header(stream, arrays[a].doubles ? "Float64" : "Int32", &arrays[a], array_bytes(&arrays[a], count), offset);
  fprintf(stream, "      </%s>\n", section);
}

static void write_block(FILE *stream, const void *values, uint64_t bytes)
{
  fwrite(&bytes, sizeof bytes, 1, stream);
  if (bytes) fwrite(values, 1, bytes, stream);
}

static void write_arrays(FILE *stream, int array_count, const flesh_vtu_array *arrays, int count)
{
  for (int a = 0; a < array_count; a++)
    write_block(stream, arrays[a].doubles ? (const void *)arrays[a].doubles : arrays[a].integers,
                array_bytes(&arrays[a], count));
}

/* The cells' corners, or a tet's four and then its six. */
static void write_connectivity(FILE *stream, const flesh_vtu *content, int64_t count)
{
  const uint64_t bytes = sizeof(int32_t) * (uint64_t)count;
  if (!content->edge_nodes) {
    write_block(stream, content->tet_nodes ? content->tet_nodes : content->corners, bytes);
    return;
  }
  fwrite(&bytes, sizeof bytes, 1, stream);
  for (size_t t = 0; t < (size_t)content->tets; t++) {
    fwrite(content->tet_nodes + 4 * t, sizeof(int32_t), 4, stream);
    if (content->edge_nodes[6 * t] >= 0) fwrite(content->edge_nodes + 6 * t, sizeof(int32_t), 6, stream);
  }
}

/* How many points cell c has. */
static int64_t cell_size(const flesh_vtu *content, int c)
{
  if (!content->tet_nodes) return content->starts[c + 1] - content->starts[c];
  return content->edge_nodes && content->edge_nodes[6 * (size_t)c] >= 0 ? 10 : 4;
}

int flesh_vtu_write(const char *path, const flesh_vtu *content)
{
  _Static_assert(sizeof(int) == sizeof(int32_t), "int arrays are written as Int32");
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  FILE *stream = file.stream;
  int points = content->points, polygons = !content->tet_nodes;
  int cells = polygons ? content->polygons : content->tets;
  int64_t corner_count = 0;
  for (int c = 0; c < cells; c++) corner_count += cell_size(content, c);
  uint64_t offset = 0;
  fprintf(stream,
          "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\""
          " header_type=\"UInt64\">\n"
          "  <UnstructuredGrid>\n"
          "    <Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\">\n",
          byte_order(), points, cells);
  print_array_headers(stream, "PointData", content->point_array_count, content->point_arrays,
                      points, &offset);
  print_array_headers(stream, "CellData", content->cell_array_count, content->cell_arrays, cells,
                      &offset);
  fputs("      <Points>\n", stream);
  print_plain_header(stream, "Float64", "Points", 3, 3 * sizeof(double) * (uint64_t)points, &offset);
  fputs("      </Points>\n      <Cells>\n", stream);
  print_plain_header(stream, "Int32", "connectivity", 1, sizeof(int32_t) * (uint64_t)corner_count,
               &offset);
  print_plain_header(stream, "Int64", "offsets", 1, sizeof(int64_t) * (uint64_t)cells, &offset);
  print_plain_header(stream, "UInt8", "types", 1, (uint64_t)cells, &offset);
  fputs("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n"
        "  <AppendedData encoding=\"raw\">\n_",
        stream);
  write_arrays(stream, content->point_array_count, content->point_arrays, points);
  write_arrays(stream, content->cell_array_count, content->cell_arrays, cells);
  write_block(stream, content->positions, 3 * sizeof(double) * (uint64_t)points);
  write_connectivity(stream, content, corner_count);
  uint64_t bytes = sizeof(int64_t) * (uint64_t)cells;
  fwrite(&bytes, sizeof bytes, 1, stream);
  int64_t end = 0;
  for (int c = 0; c < cells; c++) {
    end += cell_size(content, c);
    fwrite(&end, sizeof end, 1, stream);
  }
  bytes = (uint64_t)cells;
  fwrite(&bytes, sizeof bytes, 1, stream);
  for (int c = 0; c < cells; c++)
    putc(polygons ? VTK_POLYGON : cell_size(content, c) == 10 ? VTK_QUADRATIC_TETRA : VTK_TETRA, stream);
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
          "<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n"
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
    int capacity = pvd->capacity ? 2 * pvd->capacity : 256;
    void *times = realloc(pvd->times, sizeof *pvd->times * (size_t)capacity);
    if (times) pvd->times = times;
    void *names = realloc(pvd->names, sizeof *pvd->names * (size_t)capacity);
    if (names) pvd->names = names;
    void *files = realloc(pvd->files, sizeof *pvd->files * (size_t)capacity);
    if (files) pvd->files = files;
    if (!times || !names || !files)
      return flesh_fail(FLESH_ERR_MEMORY, "out of memory for an index of %d frames", capacity);
    for (int f = 0; f < capacity; f++) pvd->files[f] = pvd->names[f];
    pvd->capacity = capacity;
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
  free(pvd->times);
  free(pvd->names);
  free(pvd->files);
  *pvd = (flesh_pvd){0};
}
