/* surface.c: finds the boundary triangles of a mesh by pairing the faces of its tets. */
#include "mesh/mesh.h"
#include "mesh/edges.h"

#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"

/* The face opposite to each node, wound to face outwards from a positive tet. */
static const int outward[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/* Sorts the three nodes; returns 1 for an odd permutation. */
static int sort_face(int f[3])
{
  int odd = 0;
  for (int pass = 0; pass < 3; pass++) {
    int i = pass & 1;
    if (f[i] > f[i + 1]) {
      int swap = f[i];
      f[i] = f[i + 1], f[i + 1] = swap;
      odd ^= 1;
    }
  }
  return odd;
}

static uint64_t hash_face(const int f[3])
{
  uint64_t h = (uint64_t)f[0] * 0x9e3779b97f4a7c15u;
  h = (h ^ (h >> 29) ^ (uint64_t)f[1]) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 32) ^ (uint64_t)f[2]) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

static void face_nodes(const flesh_mesh *mesh, int64_t face, int f[3])
{
  const int *n = mesh->tet_nodes + (face & ~(int64_t)3);
  for (int i = 0; i < 3; i++) f[i] = n[outward[face & 3][i]];
}

/* Gives the four triangles of a face of six nodes: three at its corners, then the one between its edge nodes. */
static void face_triangles(const flesh_mesh *mesh, int64_t face, int triangles[12])
{
  const int *n = mesh->tet_nodes + (face & ~(int64_t)3), *c = outward[face & 3];
  const int *on_edges = mesh->edge_nodes + 6 * (face / 4);
  int m[3];
  for (int i = 0; i < 3; i++) m[i] = on_edges[flesh_edge_between[c[i]][c[(i + 1) % 3]]];
  const int all[12] = {n[c[0]], m[0], m[2], m[0], n[c[1]], m[1], m[2], m[1], n[c[2]], m[0], m[1], m[2]};
  memcpy(triangles, all, sizeof all);
}

static int same_tet(const flesh_mesh *mesh, int64_t face, int64_t other)
{
  const int *n = mesh->tet_nodes + (face & ~(int64_t)3);
  return n[face & 3] == mesh->tet_nodes[other];
}

/* Lists the triangles of the faces that are not inner. */
static int list_triangles(flesh_mesh *mesh, const uint8_t *inner)
{
  int64_t faces = 4 * (int64_t)mesh->tets, outer = 0;
  for (int64_t face = 0; face < faces; face++) outer += flesh_mesh_face_parts(mesh, (int)(face / 4)) * !inner[face];
  mesh->surface = flesh_malloc((size_t)(3 * outer + 1) * sizeof *mesh->surface);
  mesh->surface_tets = flesh_malloc((size_t)(outer + 1) * sizeof *mesh->surface_tets);
  if (!mesh->surface || !mesh->surface_tets)
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a surface of %lld triangles",
                      (long long)outer);
  for (int64_t face = 0; face < faces; face++) {
    if (inner[face]) continue;
    int *triangles = mesh->surface + 3 * (size_t)mesh->triangles;
    const int parts = flesh_mesh_face_parts(mesh, (int)(face / 4));
    if (parts > 1) face_triangles(mesh, face, triangles);
    else face_nodes(mesh, face, triangles);
    for (int k = 0; k < parts; k++) mesh->surface_tets[mesh->triangles++] = (int)(face / 4);
  }
  return FLESH_OK;
}

/* Face k of a tet has the number 4*tet+k. A face is inner if another tet has the same nodes with the opposite winding.
 * The remaining faces form a closed surface: the divergence theorem holds for any set of tets. */
int flesh_mesh_find_surface(flesh_mesh *mesh, const flesh_mesh_origin *origin)
{
  int64_t faces = 4 * (int64_t)mesh->tets, buckets = 16;
  while (buckets < 2 * faces) buckets *= 2;
  int *first = flesh_malloc((size_t)buckets * sizeof *first); /* first face with these nodes, or -1 */
  int *second = flesh_malloc((size_t)faces * sizeof *second); /* partner of a first face, or -1 */
  uint8_t *inner = flesh_calloc((size_t)faces, 1);
  int status = FLESH_OK;
  if (!first || !second || !inner) {
    status = flesh_fail(FLESH_ERR_MEMORY, "out of memory for the surface of %d tets", mesh->tets);
    goto done;
  }
  for (int64_t b = 0; b < buckets; b++) first[b] = -1;
  for (int64_t face = 0; face < faces; face++) {
    int f[3], g[3], odd, odd_found = 0;
    if ((status = flesh_stop_ask_at((size_t)face / 4))) goto done;
    face_nodes(mesh, face, f);
    odd = sort_face(f);
    second[face] = -1;
    int64_t b = (int64_t)(hash_face(f) & (uint64_t)(buckets - 1));
    for (; first[b] >= 0; b = (b + 1) & (buckets - 1)) {
      face_nodes(mesh, first[b], g);
      odd_found = sort_face(g);
      if (g[0] == f[0] && g[1] == f[1] && g[2] == f[2]) break;
    }
    if (first[b] < 0) {
      first[b] = (int)face;
      continue;
    }
    int found = first[b], tet = (int)(face / 4);
    if (same_tet(mesh, face, found)) {
      status = flesh_mesh_fail_at(origin, tet,
                                  "tet %lld has the same nodes as tet %lld; each tet "
                                  "must be given once",
                                  flesh_mesh_tet_label(origin, tet),
                                  flesh_mesh_tet_label(origin, found / 4));
      goto done;
    }
    if (second[found] >= 0) {
      status = flesh_mesh_fail_at(
          origin, tet,
          "the face of nodes %lld %lld %lld belongs to tets "
          "%lld, %lld and %lld; at most two tets can share a face",
          flesh_mesh_node_label(origin, f[0]), flesh_mesh_node_label(origin, f[1]),
          flesh_mesh_node_label(origin, f[2]), flesh_mesh_tet_label(origin, found / 4),
          flesh_mesh_tet_label(origin, second[found] / 4), flesh_mesh_tet_label(origin, tet));
      goto done;
    }
    second[found] = (int)face;
    if (odd != odd_found) inner[face] = inner[found] = 1;
  }
  status = list_triangles(mesh, inner);
done:
  flesh_free(first);
  flesh_free(second);
  flesh_free(inner);
  return status;
}
