/* vtu.c: VTK XML files: a header with offsets, then every array as raw bytes behind its length. */
#include "io/vtu.h"

#include <stdint.h>

#include "base/error.h"
#include "io/file.h"

enum { VTK_TETRA = 10 };

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

static void print_header(FILE *stream, const char *type, const char *name, int components,
                         uint64_t bytes, uint64_t *offset)
{
  fprintf(stream, "        <DataArray type=\"%s\" Name=\"", type);
  print_escaped(stream, name);
  fprintf(stream, "\" NumberOfComponents=\"%d\" format=\"appended\" offset=\"%llu\"/>\n",
          components, (unsigned long long)*offset);
  *offset += sizeof(uint64_t) + bytes;
}

static void print_array_headers(FILE *stream, const char *section, int array_count,
                                const flesh_vtu_array *arrays, int count, uint64_t *offset)
{
  fprintf(stream, "      <%s>\n", section);
  for (int a = 0; a < array_count; a++)
    print_header(stream, arrays[a].doubles ? "Float64" : "Int32", arrays[a].name,
                 arrays[a].components, array_bytes(&arrays[a], count), offset);
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

int flesh_vtu_write(const char *path, const flesh_vtu *content)
{
  _Static_assert(sizeof(int) == sizeof(int32_t), "int arrays are written as Int32");
  flesh_file file;
  int status = flesh_file_open(path, &file);
  if (status) return status;
  FILE *stream = file.stream;
  int points = content->points, tets = content->tets;
  uint64_t offset = 0;
  fprintf(stream,
          "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"%s\""
          " header_type=\"UInt64\">\n"
          "  <UnstructuredGrid>\n"
          "    <Piece NumberOfPoints=\"%d\" NumberOfCells=\"%d\">\n",
          byte_order(), points, tets);
  print_array_headers(stream, "PointData", content->point_array_count, content->point_arrays,
                      points, &offset);
  print_array_headers(stream, "CellData", content->cell_array_count, content->cell_arrays, tets,
                      &offset);
  fputs("      <Points>\n", stream);
  print_header(stream, "Float64", "Points", 3, 3 * sizeof(double) * (uint64_t)points, &offset);
  fputs("      </Points>\n      <Cells>\n", stream);
  print_header(stream, "Int32", "connectivity", 1, 4 * sizeof(int32_t) * (uint64_t)tets, &offset);
  print_header(stream, "Int64", "offsets", 1, sizeof(int64_t) * (uint64_t)tets, &offset);
  print_header(stream, "UInt8", "types", 1, (uint64_t)tets, &offset);
  fputs("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n"
        "  <AppendedData encoding=\"raw\">\n_",
        stream);
  write_arrays(stream, content->point_array_count, content->point_arrays, points);
  write_arrays(stream, content->cell_array_count, content->cell_arrays, tets);
  write_block(stream, content->positions, 3 * sizeof(double) * (uint64_t)points);
  write_block(stream, content->tet_nodes, 4 * sizeof(int32_t) * (uint64_t)tets);
  uint64_t bytes = sizeof(int64_t) * (uint64_t)tets;
  fwrite(&bytes, sizeof bytes, 1, stream);
  for (int64_t end = 4; end <= 4 * (int64_t)tets; end += 4) fwrite(&end, sizeof end, 1, stream);
  bytes = (uint64_t)tets;
  fwrite(&bytes, sizeof bytes, 1, stream);
  for (int t = 0; t < tets; t++) putc(VTK_TETRA, stream);
  fputs("\n  </AppendedData>\n</VTKFile>\n", stream);
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
