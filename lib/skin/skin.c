/* skin.c: binds a surface to tets and moves it with them. */
#include "skin/skin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/shape.h"
#include "skin/locator.h"

/* Hash FNV-1a, 64 bits (Fowler, Noll, Vo), of integers and doubles by their bits, independent of the byte order. */
static uint64_t hash_word(uint64_t hash, uint64_t word)
{
  for (int b = 0; b < 8; b++) hash = (hash ^ (word >> 8 * b & 255)) * 0x100000001b3u;
  return hash;
}

static const uint64_t hash_begin = 0xcbf29ce484222325u;

static uint64_t hash_numbers(uint64_t hash, size_t doubles, const double *x, size_t integers, const int *k)
{
  uint64_t word;
  for (size_t i = 0; i < doubles; i++) {
    double plain = x[i] + 0; /* -0 and 0 hash alike */
    memcpy(&word, &plain, sizeof word);
    hash = hash_word(hash, word);
  }
  for (size_t i = 0; i < integers; i++) hash = hash_word(hash, (uint64_t)k[i]);
  return hash;
}

int flesh_skin_open(const flesh_mesh *mesh, const flesh_surface *surface, flesh_skin **skin)
{
  *skin = NULL;
  flesh_skin *made = calloc(1, sizeof *made);
  if (!made) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a skin");
  flesh_skin_identity *id = &made->identity;
  id->nodes = flesh_mesh_node_count(mesh);
  id->tets = flesh_mesh_tet_count(mesh);
  id->vertices = flesh_surface_vertex_count(surface);
  id->faces = flesh_surface_face_count(surface);
  size_t vertices = (size_t)id->vertices;
  id->mesh_hash = hash_numbers(hash_begin, 3 * (size_t)id->nodes, flesh_mesh_positions(mesh),
                               4 * (size_t)id->tets, flesh_mesh_tets(mesh));
  if (flesh_mesh_order(mesh) == 2)
    id->mesh_hash = hash_numbers(id->mesh_hash, 0, NULL, 6 * (size_t)id->tets, flesh_mesh_tet_edges(mesh));
  id->surface_hash = hash_numbers(hash_begin, 3 * vertices, flesh_surface_positions(surface),
                                  (size_t)flesh_surface_starts(surface)[id->faces],
                                  flesh_surface_corners(surface));
  made->size = flesh_mesh_order(mesh) == 2 ? 10 : 4;
  made->tets = malloc(vertices * sizeof *made->tets);
  made->nodes = malloc(vertices * (size_t)made->size * sizeof *made->nodes);
  made->weights = malloc(vertices * 4 * sizeof *made->weights);
  if (made->size > 4) made->shapes = malloc(vertices * 10 * sizeof *made->shapes);
  made->distances = malloc(vertices * sizeof *made->distances);
  if (!made->tets || !made->nodes || !made->weights || !made->distances ||
      (made->size > 4 && !made->shapes)) {
    flesh_skin_destroy(&made);
    return flesh_fail(FLESH_ERR_MEMORY, "out of memory for a skin of %d vertices", id->vertices);
  }
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  double diagonal = 0;
  for (int d = 0; d < 3; d++) diagonal += pow(info.high[d] - info.low[d], 2);
  made->inside = 1e-6 * sqrt(diagonal);
  *skin = made;
  return FLESH_OK;
}

void flesh_skin_set(flesh_skin *skin, const flesh_mesh *mesh, int v, int tet,
                    const double weights[4], double distance)
{
  skin->tets[v] = tet;
  skin->distances[v] = distance;
  int *nodes = skin->nodes + skin->size * (size_t)v;
  memcpy(nodes, flesh_mesh_tets(mesh) + 4 * (size_t)tet, 4 * sizeof(int));
  if (skin->size > 4) {
    const int *edges = flesh_mesh_tet_edges(mesh) + 6 * (size_t)tet;
    double *shapes = skin->shapes + 10 * (size_t)v;
    memcpy(nodes + 4, edges, 6 * sizeof(int));
    flesh_tet10_weights(weights, shapes);
    for (int a = 4; a < 10 && edges[0] < 0; a++) nodes[a] = nodes[0], shapes[a] = 0; /* a tet of four nodes */
    if (edges[0] < 0) memcpy(shapes, weights, 4 * sizeof *shapes);
  }
  memcpy(skin->weights + 4 * (size_t)v, weights, 4 * sizeof(double));
}

int flesh_skin_bind(const flesh_mesh *mesh, const flesh_surface *surface, flesh_skin **skin)
{
  FLESH_NEED({skin, "skin"});
  *skin = NULL;
  FLESH_NEED({mesh, "mesh"}, {surface, "surface"});
  flesh_locator *locator;
  int status = flesh_skin_open(mesh, surface, skin);
  if (status) return status;
  if ((status = flesh_locator_create(mesh, &locator))) {
    flesh_skin_destroy(skin);
    return status;
  }
  flesh_place place = {.tet = -1};
  for (int v = 0; v < (*skin)->identity.vertices; v++) { /* the last vertex's tet is a good guess */
    flesh_locator_find(locator, flesh_surface_positions(surface) + 3 * (size_t)v, place.tet,
                       &place);
    if (place.tet < 0 || !isfinite(place.distance)) {
      status = flesh_fail(FLESH_ERR_FILE,
                          "vertex %d of the skin is too far outside the body for %s to be continued there; move it nearer%s", v,
                          place.tet < 0 ? "its curved tets" : "its tets",
                          place.tet < 0 ? ", or use a mesh with straight edges" : "");
      break;
    }
    flesh_skin_set(*skin, mesh, v, place.tet, place.weights, place.distance);
  }
  flesh_locator_destroy(&locator);
  if (status) flesh_skin_destroy(skin);
  return status;
}

void flesh_skin_destroy(flesh_skin **skin)
{
  if (!skin || !*skin) return;
  free((*skin)->tets);
  free((*skin)->nodes);
  free((*skin)->weights);
  free((*skin)->shapes);
  free((*skin)->distances);
  free(*skin);
  *skin = NULL;
}

void flesh_skin_inspect(const flesh_skin *skin, flesh_skin_info *info)
{
  *info = (flesh_skin_info){.vertices = skin->identity.vertices, .farthest = -1, .weight_min = 1};
  for (int v = 0; v < info->vertices; v++) {
    for (int i = 0; i < 4; i++)
      info->weight_min = fmin(info->weight_min, skin->weights[4 * (size_t)v + (size_t)i]);
    if (skin->distances[v] <= skin->inside) continue;
    info->outside++;
    if (skin->distances[v] <= info->distance_max) continue;
    info->distance_max = skin->distances[v];
    info->farthest = v;
  }
}

const int *flesh_skin_tets(const flesh_skin *skin) { return skin->tets; }
const double *flesh_skin_weights(const flesh_skin *skin) { return skin->weights; }

static void clamp_weights(const double *weights, double clamped[4])
{
  double sum = 0;
  for (int i = 0; i < 4; i++) sum += clamped[i] = fmax(weights[i], 0);
  for (int i = 0; i < 4; i++) clamped[i] /= sum;
}

/* Interpolates from ten nodes; with `clamp`, a value stays between those of the nodes. */
static void apply_quadratic(const flesh_skin *skin, size_t m, int clamp, const double *nodal, double *skinned)
{
  for (int v = 0; v < skin->identity.vertices; v++, skinned += m) {
    const int *n = skin->nodes + 10 * (size_t)v;
    const double *w = skin->shapes + 10 * (size_t)v, *o = nodal + m * (size_t)n[0];
    for (size_t d = 0; d < m; d++) {
      double sum = 0, low = o[d], high = o[d];
      for (int a = 1; a < 10; a++) {
        const double value = nodal[m * (size_t)n[a] + d];
        sum += w[a] * (value - o[d]);
        low = fmin(low, value), high = fmax(high, value);
      }
      skinned[d] = o[d] + sum;
      if (clamp) skinned[d] = fmin(fmax(skinned[d], low), high);
    }
  }
}

/* Interpolates differences from the tet's first node, so that no digits are lost far from the origin. */
void flesh_skin_apply(const flesh_skin *skin, int components, int clamp, const double *nodal,
                      double *skinned)
{
  size_t m = (size_t)components;
  if (skin->size > 4) {
    apply_quadratic(skin, m, clamp, nodal, skinned);
    return;
  }
  for (int v = 0; v < skin->identity.vertices; v++, skinned += m) {
    const int *n = skin->nodes + 4 * (size_t)v;
    const double *w = skin->weights + 4 * (size_t)v, *o = nodal + m * (size_t)n[0];
    const double *a = nodal + m * (size_t)n[1], *b = nodal + m * (size_t)n[2];
    const double *c = nodal + m * (size_t)n[3];
    double clamped[4];
    if (clamp) {
      clamp_weights(w, clamped);
      w = clamped;
    }
    for (size_t d = 0; d < m; d++)
      skinned[d] = o[d] + w[1] * (a[d] - o[d]) + w[2] * (b[d] - o[d]) + w[3] * (c[d] - o[d]);
  }
}
