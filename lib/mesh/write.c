/* write.c: flesh_mesh_write: writes a mesh in the format of the path's suffix. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "base/file.h"
#include "mesh/formats.h"

static void write_positions(FILE *file, const flesh_mesh *mesh, int node)
{
  const double *x = mesh->positions + 3 * (size_t)node;
  fprintf(file, "%.17g %.17g %.17g", x[0], x[1], x[2]);
}

static int write_tetgen_nodes(FILE *file, const flesh_mesh *mesh)
{
  fprintf(file, "%d 3 0 0\n", mesh->nodes);
  for (int n = 0; n < mesh->nodes; n++) {
    fprintf(file, "%d ", n);
    write_positions(file, mesh, n);
    putc('\n', file);
  }
  return FLESH_OK;
}

static int write_tetgen_tets(FILE *file, const flesh_mesh *mesh)
{
  fprintf(file, "%d %d 1\n", mesh->tets, mesh->edge_nodes ? 10 : 4);
  for (int t = 0; t < mesh->tets; t++) {
    int n[10], size = flesh_mesh_nodes_in_order(mesh, t, flesh_tetgen_order, n);
    fprintf(file, "%d", t);
    for (int i = 0; i < size; i++) fprintf(file, " %d", n[i]);
    fprintf(file, " %d\n", mesh->regions[t]);
  }
  return FLESH_OK;
}

static int write_medit(FILE *file, const flesh_mesh *mesh)
{
  fprintf(file, "MeshVersionFormatted 2\nDimension 3\nVertices\n%d\n", mesh->nodes);
  for (int n = 0; n < mesh->nodes; n++) {
    write_positions(file, mesh, n);
    fputs(" 0\n", file);
  }
  fprintf(file, "%s\n%d\n", mesh->edge_nodes ? "TetrahedraP2" : "Tetrahedra", mesh->tets);
  for (int t = 0; t < mesh->tets; t++) {
    int n[10], size = flesh_mesh_nodes_in_order(mesh, t, (const int[]){0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, n);
    for (int i = 0; i < size; i++) fprintf(file, "%d ", n[i] + 1);
    fprintf(file, "%d\n", mesh->regions[t]);
  }
  fputs("End\n", file);
  return FLESH_OK;
}

typedef int (*writer)(FILE *file, const flesh_mesh *mesh);

/* Writes one file for each writer. No file gets its name before all are on the disk. */
static int write_files(const flesh_mesh *mesh, int count, const char *const *paths,
                       const writer *writers)
{
  flesh_file files[2] = {{0}, {0}};
  int status = FLESH_OK;
  for (int f = 0; f < count && !status; f++) {
    status = flesh_file_open(paths[f], &files[f]);
    if (!status) status = writers[f](files[f].stream, mesh);
    if (!status && (fflush(files[f].stream) || ferror(files[f].stream)))
      status = flesh_fail(FLESH_ERR_FILE, "%s: could not be written completely: %s", paths[f],
                          strerror(errno));
  }
  for (int f = 0; f < count && !status; f++) status = flesh_file_commit(&files[f]);
  for (int f = 0; f < count; f++) flesh_file_abandon(&files[f]);
  return status;
}

/* Returns the suffix of a path, from the last dot on; NULL: there is none, or nothing before it. */
static const char *suffix_of(const char *path)
{
  const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path, *suffix = strrchr(name, '.');
  return suffix > name ? suffix : NULL;
}

int flesh_mesh_file_has_sets(const char *path)
{
  const char *suffix = suffix_of(path);
  return suffix && !strcmp(suffix, ".msh");
}

static int write_by_suffix(const flesh_mesh *mesh, const char *path)
{
  if (mesh->linear)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: the mesh has tets of four nodes and of ten; a file must have the one or the other", path);
  const char *suffix = suffix_of(path);
  if (suffix) {
    if (flesh_mesh_file_has_sets(path)) return write_files(mesh, 1, &path, (writer[]){flesh_gmsh_write});
    if (!strcmp(suffix, ".mesh")) return write_files(mesh, 1, &path, (writer[]){write_medit});
    if (!strcmp(suffix, ".node") || !strcmp(suffix, ".ele")) {
      size_t stem = (size_t)(suffix - path);
      char *both = malloc(2 * stem + 16);
      if (!both) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a path");
      char *nodes = both, *tets = both + stem + 6;
      sprintf(nodes, "%.*s.node", (int)stem, path);
      sprintf(tets, "%.*s.ele", (int)stem, path);
      int status = write_files(mesh, 2, (const char *[]){nodes, tets},
                               (writer[]){write_tetgen_nodes, write_tetgen_tets});
      free(both);
      return status;
    }
  }
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "%s: the suffix %s%s%s names no mesh format; it must be "
                    ".node or .ele (TetGen), .msh (Gmsh) or .mesh (Medit)",
                    path, suffix ? "'" : "", suffix ? suffix : "(none)", suffix ? "'" : "");
}

int flesh_mesh_write(const flesh_mesh *mesh, const char *path)
{
  FLESH_NEED({mesh, "mesh"}, {path, "path"});
  flesh_plain_locale locale;
  int status = flesh_plain_locale_begin(&locale);
  if (status) return status;
  status = write_by_suffix(mesh, path);
  flesh_plain_locale_end(&locale);
  return status;
}
