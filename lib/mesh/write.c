/* write.c: flesh_mesh_write: one mesh in the format of the path's suffix. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/plain_locale.h"
#include "base/file.h"
#include "base/sort.h"
#include "mesh/formats.h"
#include "mesh/gmsh.h"
#include "mesh/inspect.h"
#include "mesh/pieces.h"

static void write_positions(FILE *file, const flesh_mesh *mesh, int node)
{
  const double *x = mesh->positions + 3 * (size_t)node;
  fprintf(file, "%.17g %.17g %.17g", x[0], x[1], x[2]);
}

/* The nodes of a tet as `order` has them (each its place in VTK's order), numbered from 0. Returns
 * their number, 4 or 10. */
static int nodes_in_order(const flesh_mesh *mesh, int tet, const int order[10], int nodes[10])
{
  int vtk[10], size = flesh_mesh_tet_nodes(mesh, tet, vtk);
  for (int i = 0; i < size; i++) nodes[i] = vtk[order[i]];
  return size;
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
    int n[10], size = nodes_in_order(mesh, t, flesh_tetgen_order, n);
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
    int n[10], size = nodes_in_order(mesh, t, (const int[]){0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, n);
    for (int i = 0; i < size; i++) fprintf(file, "%d ", n[i] + 1);
    fprintf(file, "%d\n", mesh->regions[t]);
  }
  fputs("End\n", file);
  return FLESH_OK;
}

static void put_int(FILE *file, int value)
{
  int32_t number = value;
  fwrite(&number, sizeof number, 1, file);
}

static void put_size(FILE *file, int64_t value) { fwrite(&value, sizeof value, 1, file); }

/* Tets of one region in a row are one block, so that their order stays. */
static int run_length(const flesh_mesh *mesh, int first)
{
  int end = first;
  while (end < mesh->tets && mesh->regions[end] == mesh->regions[first]) end++;
  return end - first;
}

static void write_gmsh_tets(FILE *file, const flesh_mesh *mesh, int regions, const int *tags)
{
  int blocks = 0;
  fputs("$Elements\n", file);
  for (int t = 0; t < mesh->tets; t += run_length(mesh, t)) blocks++;
  put_size(file, blocks), put_size(file, mesh->tets), put_size(file, 1), put_size(file, mesh->tets);
  for (int t = 0; t < mesh->tets;) {
    int count = run_length(mesh, t);
    const int *found = bsearch(&mesh->regions[t], tags, (size_t)regions, sizeof *tags, flesh_compare_int);
    put_int(file, 3), put_int(file, (int)(found - tags) + 1);
    put_int(file, mesh->edge_nodes ? FLESH_GMSH_TET10 : FLESH_GMSH_TET4);
    put_size(file, count);
    for (int end = t + count; t < end; t++) {
      int n[10], size = nodes_in_order(mesh, t, flesh_gmsh_order, n);
      put_size(file, t + 1);
      for (int i = 0; i < size; i++) put_size(file, n[i] + 1);
    }
  }
  fputs("\n$EndElements\n", file);
}

/* Gmsh 4.1 in this machine's byte order: one volume with one physical tag for each region. */
static int write_gmsh(FILE *file, const flesh_mesh *mesh)
{
  int *tags, regions = flesh_mesh_region_list(mesh, &tags);
  if (!tags) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the regions of a mesh");
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  fputs("$MeshFormat\n4.1 1 8\n", file);
  put_int(file, 1);
  fputs("\n$EndMeshFormat\n$Entities\n", file);
  for (int d = 0; d < 4; d++) put_size(file, d == 3 ? regions : 0);
  for (int r = 0; r < regions; r++) {
    put_int(file, r + 1);
    fwrite(info.low, sizeof *info.low, 3, file);
    fwrite(info.high, sizeof *info.high, 3, file);
    put_size(file, 1);
    put_int(file, tags[r]);
    put_size(file, 0);
  }
  fputs("\n$EndEntities\n$Nodes\n", file);
  put_size(file, 1), put_size(file, mesh->nodes), put_size(file, 1), put_size(file, mesh->nodes);
  put_int(file, 3), put_int(file, 1), put_int(file, 0), put_size(file, mesh->nodes);
  for (int n = 0; n < mesh->nodes; n++) put_size(file, n + 1);
  fwrite(mesh->positions, sizeof *mesh->positions, 3 * (size_t)mesh->nodes, file);
  fputs("\n$EndNodes\n", file);
  write_gmsh_tets(file, mesh, regions, tags);
  free(tags);
  return FLESH_OK;
}

typedef int (*writer)(FILE *file, const flesh_mesh *mesh);

/* One file per writer. No file gets its name before all are on the disk. */
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

static int write_by_suffix(const flesh_mesh *mesh, const char *path)
{
  if (mesh->linear)
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "%s: the mesh has tets of four nodes and of ten; a file must have the one or the other", path);
  const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
  const char *suffix = strrchr(name, '.');
  if (suffix && suffix > name) {
    if (!strcmp(suffix, ".msh")) return write_files(mesh, 1, &path, (writer[]){write_gmsh});
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
