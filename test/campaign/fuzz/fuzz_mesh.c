/* fuzz_mesh.c: meshes of every format; an input with a "%%" line is TetGen's .node and .ele. */
#define _GNU_SOURCE
#include "fuzz.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  return 0;
}

/* What flesh.h promises of a mesh. */
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
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  fuzz_expect(flesh_mesh_jacobians(mesh, flesh_mesh_positions(mesh), NULL, NULL, NULL) == 1, "J at rest");
  fuzz_expect(info.volume > 0 && info.worst_tet >= 0 && info.worst_tet < tets, "inspect");
}

/* What is written in a format is the same mesh when it is read. */
static void check_again(const flesh_mesh *mesh, const char *path)
{
  flesh_mesh *again = NULL;
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
  flesh_mesh_destroy(&again);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  static const char *const written[] = {"w.node", "w.msh", "w.mesh"};
  const uint8_t *second = data;
  size_t left = size, first = fuzz_part(&second, &left);
  int pair = second != data + first;
  fuzz_write(pair ? "m.node" : "m", data, first);
  if (pair) fuzz_write("m.ele", second, left);
  flesh_mesh *mesh = NULL;
  int status = flesh_mesh_read(pair ? first % 2 ? "m.node" : "m.ele" : "m", &mesh);
  fuzz_status(status);
  fuzz_expect(!status == (mesh != NULL), "a status that is not what was returned");
  if (status) return 0;
  check(mesh);
  if (fuzz_chosen(data, size, 64)) check_again(mesh, written[size % 3]);
  flesh_mesh_destroy(&mesh);
  return 0;
}
