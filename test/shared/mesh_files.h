/* mesh_files.h: temporary files and small valid meshes for the tests of the mesh formats. */
#ifndef FLESH_MESH_FILES_H
#define FLESH_MESH_FILES_H

#include "temporary.h"

#include <dirent.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "flesh/mesh.h"
#include "test.h"

static char work_folder[512];

static void remove_work_folder(void) { test_folder_remove(work_folder); }

/* Makes a fresh folder, which is removed at the end. */
static int make_work_folder(void)
{
  return !test_folder_make(work_folder, sizeof work_folder) && !atexit(remove_work_folder);
}

static const char *in_work_folder(const char *name)
{
  static char paths[4][600];
  static int next;
  char *path = paths[next++ & 3];
  snprintf(path, sizeof paths[0], "%s/%s", work_folder, name);
  return path;
}

static inline const char *write_bytes(const char *name, const void *bytes, size_t size)
{
  const char *path = in_work_folder(name);
  unlink(path); /* much faster than truncating the old file */
  FILE *file = fopen(path, "wb");
  CHECK(file && fwrite(bytes, 1, size, file) == size);
  if (file) fclose(file);
  return path;
}

static inline const char *write_text(const char *name, const char *text)
{
  return write_bytes(name, text, strlen(text));
}

static inline char *read_bytes(const char *path, size_t *size)
{
  FILE *file = fopen(path, "rb");
  char *bytes = malloc(1 << 20);
  *size = file ? fread(bytes, 1, 1 << 20, file) : 0;
  CHECK(file != NULL);
  if (file) fclose(file);
  return bytes;
}

/* Binary Gmsh files of the two tets of `two_tets`, in this machine's byte order or the other. */
typedef struct byte_writer {
  char bytes[4096];
  size_t size;
  int swap;
} byte_writer;

static inline void put_bytes(byte_writer *w, const void *value, size_t size)
{
  const char *from = value;
  for (size_t i = 0; i < size; i++) w->bytes[w->size++] = from[w->swap ? size - 1 - i : i];
}

static inline void put_text(byte_writer *w, const char *text)
{
  memcpy(w->bytes + w->size, text, strlen(text));
  w->size += strlen(text);
}

static inline void put_ints(byte_writer *w, int count, const int32_t *values)
{
  for (int i = 0; i < count; i++) put_bytes(w, &values[i], sizeof *values);
}

static inline void put_sizes(byte_writer *w, int count, const int64_t *values)
{
  for (int i = 0; i < count; i++) put_bytes(w, &values[i], sizeof *values);
}

#define INTS(...)                                                                                  \
  sizeof((int32_t[]){__VA_ARGS__}) / sizeof(int32_t), (int32_t[]) { __VA_ARGS__ }
#define SIZES(...)                                                                                 \
  sizeof((int64_t[]){__VA_ARGS__}) / sizeof(int64_t), (int64_t[]) { __VA_ARGS__ }

static const double two_positions[15] = {0, 0, 0, 1, 0, 0, 0, 1.5, 0, 0, 0, 1, 0, 0, -0.1};

static inline void make_gmsh22(byte_writer *w, int swap)
{
  static const int32_t tags[5] = {11, 5, 1000000, 7, 8};
  *w = (byte_writer){.swap = swap};
  put_text(w, "$MeshFormat\n2.2 1 8\n");
  put_ints(w, INTS(1));
  put_text(w, "\n$EndMeshFormat\n$Nodes\n5\n");
  for (int n = 0; n < 5; n++) {
    put_ints(w, 1, &tags[n]);
    for (int d = 0; d < 3; d++) put_bytes(w, &two_positions[3 * n + d], sizeof(double));
  }
  put_text(w, "\n$EndNodes\n$Elements\n4\n");
  put_ints(w, INTS(2, 1, 2, 1, 9, 9, 11, 5, 1000000)); /* a triangle */
  put_ints(w, INTS(4, 2, 2, 2, 3, 40, 11, 5, 1000000, 7, 3, 0, 40, 11, 1000000, 5, 8));
  put_ints(w, INTS(15, 1, 0, 4, 8)); /* a point element without tags */
  put_text(w, "\n$EndElements\n");
}

static inline void make_gmsh41(byte_writer *w, int swap)
{
  static const double box[6] = {0, 0, -0.1, 1, 1.5, 1};
  *w = (byte_writer){.swap = swap};
  put_text(w, "$MeshFormat\n4.1 1 8\n");
  put_ints(w, INTS(1));
  put_text(w, "\n$EndMeshFormat\n$Entities\n");
  put_sizes(w, SIZES(1, 0, 0, 2));
  put_ints(w, INTS(6));
  for (int d = 0; d < 3; d++) put_bytes(w, &box[d], sizeof(double));
  put_sizes(w, SIZES(0));
  for (int v = 0; v < 2; v++) {
    put_ints(w, INTS(4 + 36 * v));
    for (int d = 0; d < 6; d++) put_bytes(w, &box[d], sizeof(double));
    put_sizes(w, SIZES(2 * !v));
    if (!v) put_ints(w, INTS(3, 12)); /* two physical tags: the first counts */
    put_sizes(w, SIZES(1));
    put_ints(w, INTS(-6));
  }
  put_text(w, "\n$EndEntities\n$Nodes\n");
  put_sizes(w, SIZES(2, 5, 5, 1000000));
  put_ints(w, INTS(1, 1, 1)); /* with one parameter each */
  put_sizes(w, SIZES(2, 11, 5));
  for (int n = 0; n < 2; n++) {
    for (int d = 0; d < 3; d++) put_bytes(w, &two_positions[3 * n + d], sizeof(double));
    put_bytes(w, &box[n], sizeof(double));
  }
  put_ints(w, INTS(3, 4, 0));
  put_sizes(w, SIZES(3, 1000000, 7, 8));
  for (int i = 6; i < 15; i++) put_bytes(w, &two_positions[i], sizeof(double));
  put_text(w, "\n$EndNodes\n$Elements\n");
  put_sizes(w, SIZES(3, 3, 1, 9));
  put_ints(w, INTS(2, 1, 2));
  put_sizes(w, SIZES(1, 1, 11, 5, 1000000));
  put_ints(w, INTS(3, 4, 4));
  put_sizes(w, SIZES(1, 2, 11, 5, 1000000, 7));
  put_ints(w, INTS(3, 40, 4));
  put_sizes(w, SIZES(1, 9, 11, 1000000, 5, 8));
  put_text(w, "\n$EndElements\n");
}

/* Texts of the same two tets (regions 3 and `second`). */
static const char plain_text[] = "# two tets\nnodes 5\n0 0 0\n1 0 0\n0 1.5 0\n0 0 1\n0 0 -0.1\n"
                                 "tets 2\n0 1 2 3\n0 2 1 4\nfixed 1\n0\n";
static const char node_text[] = "# two tets\n5 3 1 1\n1 0 0 0 0.5 1\n2 1 0 0 0.5 0\n"
                                "3 0 1.5 0 0.5 0 # third\n\n4 0 0 1 0.5 0\n5 0 0 -1e-1 0.5 0\n"
                                "# Generated by tetgen\n";
static const char ele_text[] = "2 4 1\n1 1 2 3 4 3\n2 1 3 2 5 40.0\n# Generated by tetgen\n";
static const char medit_text[] =
    "MeshVersionFormatted 2\nDimension\n3\n# spread over lines\nTetrahedra 2\n1 2 3 4 3\n1 3\n2 5 "
    "40\n"
    "Corners\n1\n1\nVertices\n5\n0 0 0 0\n1 0 0 0\n0 1.5 0 7\n0 0 1 0\n0 0 -0.1 0\nTriangles\n1\n"
    "1 2 3 4\nEnd\n";
static const char gmsh22_text[] =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 3 \"a $Nodes\"\n$EndPhysicalNames\n"
    "$Nodes\n5\n11 0 0 0\n5 1 0 0\n1000000 0 1.5 0\n7 0 0 1\n8 0 0 -.1\n$EndNodes\n$Elements\n4\n"
    "1 2 2 9 9 11 5 1000000\n2 4 2 3 40 11 5 1000000 7\n3 4 2 0 40 11 1000000 5 8\n4 15 0 8\n"
    "$EndElements\n";
static const char gmsh41_text[] =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 2\n4 0 0 0 1 1 1 1 3 0\n"
    "40 0 0 0 1 1 1 0 0\n$EndEntities\n$Comments\nno numbers\n$EndComments\n$Nodes\n2 5 5 1000000\n"
    "1 1 1 2\n11\n5\n0 0 0 0\n1 0 0 0.5\n3 4 0 3\n1000000\n7\n8\n0 1.5 0\n0 0 1\n0 0 "
    "-0.1\n$EndNodes\n"
    "$Elements\n3 3 1 9\n2 1 2 1\n1 11 5 1000000\n3 4 4 1\n2 11 5 1000000 7\n3 40 4 1\n"
    "9 11 1000000 5 8\n$EndElements\n";

#endif
