/* fuzz_mesh.c: meshes in every format; those recognised by their file name are tried if the input begins as they do. An
 * input with a "%%" line is TetGen's .node and .ele, or an index and a part of a split mesh; one that begins with
 * "%split" has the arrays of such a part. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "mesh/split.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

static void check_members(const flesh_members *members, int end)
{
  for (int k = 0; k < members->count; k++) {
    fuzz_expect(members->values[k] >= 0 && members->values[k] < end, "a set's member");
    fuzz_expect(!k || members->values[k] > members->values[k - 1], "members that do not rise");
  }
}

/* Checks the guarantees of flesh.h about a mesh. */
static void check(const flesh_mesh *mesh)
{
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh), triangles;
  const int *tet = flesh_mesh_tets(mesh), *surface = flesh_mesh_surface(mesh, &triangles);
  fuzz_expect(nodes >= 4 && tets >= 1 && triangles >= 4, "a mesh without a body");
  for (int i = 0; i < 4 * tets; i++) fuzz_expect(tet[i] >= 0 && tet[i] < nodes, "a tet's node");
  const int *edges = flesh_mesh_tet_edges(mesh);
  fuzz_expect((flesh_mesh_order(mesh) == 2) == (edges != NULL), "an order without edges");
  for (int i = 0; edges && i < 6 * tets; i++) fuzz_expect(edges[i] >= 0 && edges[i] < nodes, "an edge's node");
  for (int i = 0; i < 3 * triangles; i++)
    fuzz_expect(surface[i] >= 0 && surface[i] < nodes, "a triangle's node");
  for (int t = 0; t < tets; t++)
    fuzz_expect(flesh_mesh_tet_volumes(mesh)[t] > 0, "a volume that is not positive");
  for (int k = 0; k < mesh->sets.count; k++) {
    check_members(&mesh->sets.sets[k].nodes, nodes);
    check_members(&mesh->sets.sets[k].tets, tets);
  }
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  fuzz_expect(flesh_mesh_jacobians(mesh, flesh_mesh_positions(mesh), NULL, NULL, NULL) == 1, "J at rest");
  fuzz_expect(info.volume > 0 && info.worst_tet >= 0 && info.worst_tet < tets, "inspect");
}

static int same(const int *values, int count, const int *others, int other_count)
{
  return count == other_count && (!count || !memcmp(values, others, sizeof *values * (size_t)count));
}

/* Checks that a mesh written in a format is read back unchanged. A .msh refuses names with quotation marks. */
static void check_again(const flesh_mesh *mesh, const char *path)
{
  flesh_mesh *again = NULL;
  for (int k = 0; k < flesh_mesh_set_count(mesh) && flesh_mesh_file_has_sets(path); k++)
    if (strchr(flesh_mesh_set_at(mesh, k).name, '"')) path = "w.mesh";
  int status = flesh_mesh_write(mesh, path);
  if (!status) status = flesh_mesh_read(path, &again);
  fuzz_expect(!status, "a mesh that was written is refused");
  int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  fuzz_expect(nodes == flesh_mesh_node_count(again) && tets == flesh_mesh_tet_count(again) &&
                  !memcmp(flesh_mesh_tets(mesh), flesh_mesh_tets(again), sizeof(int[4]) * (size_t)tets) &&
                  !memcmp(flesh_mesh_regions(mesh), flesh_mesh_regions(again), sizeof(int) * (size_t)tets),
              "another mesh comes back");
  const int *edges = flesh_mesh_tet_edges(mesh), *edges_again = flesh_mesh_tet_edges(again);
  fuzz_expect(!edges == !edges_again && (!edges || !memcmp(edges, edges_again, sizeof(int[6]) * (size_t)tets)),
              "other edges come back");
  for (int i = 0; i < 3 * nodes; i++)
    fuzz_expect(flesh_mesh_positions(mesh)[i] == flesh_mesh_positions(again)[i], "other positions come back");
  const int sets = flesh_mesh_file_has_sets(path) ? flesh_mesh_set_count(mesh) : 0;
  fuzz_expect(flesh_mesh_set_count(again) == sets, "another number of sets comes back");
  for (int k = 0; k < sets; k++) {
    const flesh_named_set one = flesh_mesh_set_at(mesh, k), other = flesh_mesh_set_at(again, k);
    fuzz_expect(!strcmp(one.name, other.name) && same(one.nodes, one.node_count, other.nodes, other.node_count) &&
                    same(one.tets, one.tet_count, other.tets, other.tet_count), "another set comes back");
  }
  flesh_mesh_destroy(&again);
}

/* Returns the input's next number, from 0 to before `end` or slightly outside. */
static int next_number(const uint8_t **data, size_t *size, int end)
{
  if (!*size) return 0;
  const int number = **data;
  (*data)++, (*size)--;
  return number < 250 ? number % end : number - 252;
}

/* Makes a part of a split mesh of two from the arrays in the input, with a correct checksum, and reads it alone, and as
 * the first of the whole with a correct second part. */
static void try_arrays(const uint8_t *data, size_t size)
{
  flesh_split split = {0};
  flesh_split_arrays a = {0};
  flesh_mesh *mesh = NULL;
  const double size3[3] = {2, 1, 1}, origin[3] = {0, 0, 0};
  int status = flesh_split_box((int[]){2, 1, 1}, size3, origin, 2, "split", &split);
  flesh_split_close(&split);
  if (!status) status = flesh_split_open("split/index.txt", &split);
  if (!status) status = flesh_split_load_part(&split, 0, &a);
  fuzz_expect(!status, "a box in two parts is refused");
  int *const arrays[] = {a.node_numbers, a.tet_nodes, a.tet_numbers, a.owners};
  const int counts[] = {a.nodes, 4 * a.tets, a.tets, a.tets}, ends[] = {a.nodes, a.nodes, a.tets, 2};
  while (size > 2) {
    const int k = next_number(&data, &size, 4), at = next_number(&data, &size, counts[k & 3]);
    arrays[k & 3][at < 0 || at >= counts[k & 3] ? 0 : at] = next_number(&data, &size, ends[k & 3]);
  }
  fuzz_expect(!flesh_split_write_part(&split, "split", 0, &a), "a part is not written");
  flesh_split_close(&split);
  fuzz_expect(!flesh_split_open("split/index.txt", &split), "an index is refused");
  status = flesh_split_read_part(&split, 0, &mesh);
  fuzz_status(status);
  fuzz_expect(!status == (mesh != NULL), "a status that is not what was returned");
  if (mesh) check(mesh);
  flesh_mesh_destroy(&mesh);
  status = flesh_mesh_read("split/index.txt", &mesh);
  fuzz_status(status);
  if (mesh) check(mesh);
  flesh_mesh_destroy(&mesh);
  flesh_split_arrays_clear(&a);
  flesh_split_close(&split);
}

/* Returns the name of the file that begins with these bytes. */
static const char *name_of(const uint8_t *data, size_t size)
{
  if (!size || (*data != '<' && *data != '*')) return "m";
  if (*data == '<') return "m.vtu";
  return size > 9 && !memcmp(data, "*VERTICES", 9) ? "m.veg" : "m.inp";
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  static const char *const written[] = {"w.node", "w.msh", "w.mesh"};
  const uint8_t *second = data;
  if (size > 6 && !memcmp(data, "%split", 6)) {
    try_arrays(data + 6, size - 6);
    return 0;
  }
  size_t left = size, first = fuzz_part(&second, &left);
  int pair = second != data + first;
  const char *name = pair ? "m.node" : name_of(data, first);
  fuzz_write(name, data, first);
  if (pair) fuzz_write("m.ele", second, left);
  if (pair) fuzz_write("part_00000.bin", second, left);
  flesh_mesh *mesh = NULL;
  int status = flesh_mesh_read(pair && first % 2 == 0 ? "m.ele" : name, &mesh);
  fuzz_status(status);
  fuzz_expect(!status == (mesh != NULL), "a status that is not what was returned");
  if (status) return 0;
  check(mesh);
  if (fuzz_chosen(data, size, 64)) check_again(mesh, written[size % 3]);
  flesh_mesh_destroy(&mesh);
  return 0;
}
