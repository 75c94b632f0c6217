/* curve.c: moves the boundary of a mesh of order 2 onto a surface. */
#include "mesh/curve.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/stop.h"
#include "math/area.h"
#include "math/mat3.h"
#include "math/nearest.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"

static const double tenth_of_an_edge = 0.1, half_an_edge = 0.5; /* as fractions of a face's longest edge */
static const double least_cosine = 0.5;                         /* between the normals of a face and of the surface */
static const int most_rounds = 100;                             /* projections of a node onto surfaces that meet */
static const double tangent = 0.87;                             /* cosine of the angle up to which a plane continues smoothly */

/* Returns the largest distance of a face's corners from the surface, in units of the face's longest edge; infinite if
 * the face is turned away from the surface. */
static double distance_from(const flesh_mesh *mesh, const flesh_nearest_surface *surface, const int corner[3])
{
  const double *x[3];
  double longest = 0, farthest = 0, at[3], normal[3], middle[3] = {0}, own[3];
  for (int k = 0; k < 3; k++) x[k] = mesh->positions + 3 * (size_t)corner[k];
  for (int k = 0; k < 3; k++) longest = fmax(longest, flesh_distance(x[k], x[(k + 1) % 3]));
  for (int k = 0; k < 3; k++) {
    surface->nearest(surface->data, x[k], at, normal);
    farthest = fmax(farthest, flesh_distance(x[k], at) / longest);
    if (!(farthest <= half_an_edge)) return INFINITY;
    for (int c = 0; c < 3; c++) middle[c] += x[k][c] / 3;
  }
  surface->nearest(surface->data, middle, at, normal);
  flesh_area_vector(x[0], x[1], x[2], own);
  return fabs(flesh_vec3_dot(own, normal)) > least_cosine * sqrt(flesh_vec3_dot(own, own)) ? farthest : INFINITY;
}

/* Returns the index of the tet's corner that is not on the face. */
static int opposite(const int tet[4], const int corner[3])
{
  int a = 0;
  while (tet[a] == corner[0] || tet[a] == corner[1] || tet[a] == corner[2]) a++;
  return a;
}

int flesh_mesh_find_curved_faces(const flesh_mesh *mesh, int count, const flesh_nearest_surface *surfaces, int *on,
                                 int *found, int *left)
{
  int status = FLESH_OK;
  memset(on, 0, 4 * (size_t)mesh->tets * sizeof *on);
  for (int s = 0; s < count; s++) found[s] = left[s] = 0;
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) {
    const size_t tet = (size_t)mesh->surface_tets[k];
    if ((status = flesh_stop_ask_at((size_t)k / 4))) break;
    if (flesh_mesh_face_parts(mesh, (int)tet) == 1) continue;
    /* Triangles of a face with corners a, b, c and nodes p, q, r on its edges: (a,p,r), (p,b,q), (r,q,c), (p,q,r). */
    const int *face = mesh->surface + 3 * (size_t)k, corner[3] = {face[0], face[4], face[8]};
    double least = INFINITY;
    int nearest = -1;
    for (int s = 0; s < count; s++) {
      const double off = distance_from(mesh, &surfaces[s], corner);
      if (off < least) least = off, nearest = s;
    }
    if (nearest < 0) continue;
    const int near_enough = least <= tenth_of_an_edge;
    if (near_enough) on[4 * tet + (size_t)opposite(mesh->tet_nodes + 4 * tet, corner)] = 1 + nearest;
    ++*(near_enough ? &found[nearest] : &left[nearest]);
  }
  return status;
}

/* Nodes of the face opposite to each corner of a tet, as indices into its ten nodes. */
static const int face_nodes[4][6] = {{1, 2, 3, 5, 8, 9}, {0, 2, 3, 6, 7, 9}, {0, 1, 3, 4, 7, 8}, {0, 1, 2, 4, 5, 6}};

static int node_of(const flesh_mesh *mesh, size_t tet, int k)
{
  return k < 4 ? mesh->tet_nodes[4 * tet + (size_t)k] : mesh->edge_nodes[6 * tet + (size_t)k - 4];
}

/* Returns whether the child's face opposite to its corner `own` is a part of the tet's face opposite to corner `a`. */
static int is_part(const flesh_mesh *mesh, size_t tet, int a, const int child[4], int own)
{
  for (int b = 0; b < 4; b++) {
    int has = b == own;
    for (int k = 0; k < 6; k++) has |= node_of(mesh, tet, face_nodes[a][k]) == child[b];
    if (!has) return 0;
  }
  return 1;
}

void flesh_mesh_refine_curved_faces(const flesh_mesh *mesh, const int *on, const flesh_mesh *refined, int *finer)
{
  memset(finer, 0, 4 * (size_t)refined->tets * sizeof *finer);
  for (size_t k = 0; k < 4 * (size_t)mesh->tets; k++) {
    if (!on[k]) continue;
    for (size_t child = 8 * (k / 4); child < 8 * (k / 4) + 8; child++)
      for (int own = 0; own < 4; own++)
        if (is_part(mesh, k / 4, (int)(k % 4), refined->tet_nodes + 4 * child, own))
          finer[4 * child + (size_t)own] = on[k];
  }
}

/* The surfaces of each node, as linked lists: the first is links[first[node] - 1]; 0 ends a list. */
typedef struct chains {
  int *first; /* [nodes] */
  int *flat;  /* [nodes] 1 + first triangle of a boundary face on no surface that has this node on an edge; 0: none */
  struct {
    int surface, next;
  } *links;
  int count;
} chains;

static void add_link(chains *c, int node, int surface)
{
  for (int k = c->first[node]; k; k = c->links[k - 1].next)
    if (c->links[k - 1].surface == surface) return;
  c->links[c->count].surface = surface;
  c->links[c->count].next = c->first[node];
  c->first[node] = ++c->count;
}

static int find_chains(const flesh_mesh *mesh, const int *on, chains *c)
{
  size_t faces = 0;
  for (size_t k = 0; k < 4 * (size_t)mesh->tets; k++) faces += on[k] != 0;
  c->first = flesh_calloc((size_t)mesh->nodes, sizeof *c->first);
  c->flat = flesh_calloc((size_t)mesh->nodes, sizeof *c->flat);
  c->links = flesh_malloc((6 * faces + 1) * sizeof *c->links);
  if (!c->first || !c->flat || !c->links) return flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d nodes", mesh->nodes);
  for (size_t k = 0; k < 4 * (size_t)mesh->tets; k++)
    for (int i = 0; on[k] && i < 6; i++) add_link(c, node_of(mesh, k / 4, face_nodes[k % 4][i]), on[k] - 1);
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) {
    const size_t tet = (size_t)mesh->surface_tets[k];
    if (flesh_mesh_face_parts(mesh, (int)tet) == 1) continue;
    const int *face = mesh->surface + 3 * (size_t)k, corner[3] = {face[0], face[4], face[8]};
    if (on[4 * tet + (size_t)opposite(mesh->tet_nodes + 4 * tet, corner)]) continue;
    c->flat[face[1]] = c->flat[face[2]] = c->flat[face[5]] = 1 + k;
  }
  return FLESH_OK;
}

/* Moves a node into the plane of a boundary face, unless the plane smoothly continues the surface with this normal. */
static void flatten(const int *face, const double normal[3], const double *positions, double *x)
{
  const double *X = positions + 3 * (size_t)face[0];
  double own[3], height = 0;
  flesh_area_vector(X, positions + 3 * (size_t)face[4], positions + 3 * (size_t)face[8], own);
  const double square = flesh_vec3_dot(own, own);
  if (!(fabs(flesh_vec3_dot(own, normal)) < tangent * sqrt(square))) return;
  for (int c = 0; c < 3; c++) height += (x[c] - X[c]) * own[c] / square;
  for (int c = 0; c < 3; c++) x[c] -= height * own[c];
}

/* Moves node i to the nearest point of its surface. If it has several, or a flat face beside it, projects onto each in
 * turn until the node is where they meet. */
static void move(const flesh_mesh *mesh, const flesh_nearest_surface *surfaces, const chains *c, int i, double *positions)
{
  const int first = c->first[i], flat = c->flat[i];
  double *x = positions + 3 * (size_t)i;
  for (int round = 0; first && round < (c->links[first - 1].next || flat ? most_rounds : 1); round++) {
    double before[3], at[3], normal[3];
    memcpy(before, x, sizeof before);
    for (int k = first; k; k = c->links[k - 1].next) {
      const flesh_nearest_surface *surface = &surfaces[c->links[k - 1].surface];
      surface->nearest(surface->data, x, at, normal);
      memcpy(x, at, sizeof at);
    }
    if (flat) flatten(mesh->surface + 3 * (size_t)(flat - 1), normal, positions, x);
    if (flesh_distance(before, x) <= 4 * DBL_EPSILON * sqrt(flesh_vec3_dot(x, x))) return;
  }
}

/* Moves the nodes to their surfaces, corners first: nodes on edges move along with the ends, then to the surface.
 * `done` [nodes] is 0. */
static int place(const flesh_mesh *mesh, const flesh_nearest_surface *surfaces, const chains *c, uint8_t *done, double *x)
{
  const double *X = mesh->positions;
  for (size_t k = 0; k < 4 * (size_t)mesh->tets; k++) {
    const int i = mesh->tet_nodes[k], status = flesh_stop_ask_at(k / 4);
    if (status) return status;
    if (!done[i]) move(mesh, surfaces, c, i, x);
    done[i] = 1;
  }
  for (size_t k = 0; k < 6 * (size_t)mesh->tets; k++) {
    const int i = mesh->edge_nodes[k], *ends = flesh_edge_corners[k % 6], status = flesh_stop_ask_at(k / 6);
    if (status) return status;
    if (i < 0 || done[i]) continue;
    for (int e = 0; e < 2; e++) {
      const size_t end = 3 * (size_t)mesh->tet_nodes[4 * (k / 6) + (size_t)ends[e]];
      for (size_t d = 0; d < 3; d++) x[3 * (size_t)i + d] += (x[end + d] - X[end + d]) / 2;
    }
    move(mesh, surfaces, c, i, x);
    done[i] = 1;
  }
  return FLESH_OK;
}

int flesh_mesh_curve(const flesh_mesh *mesh, const flesh_nearest_surface *surfaces, const int *on, flesh_mesh **curved)
{
  const size_t nodes = (size_t)mesh->nodes;
  chains c = {0};
  double *x = flesh_malloc(3 * nodes * sizeof *x);
  uint8_t *done = flesh_calloc(nodes, 1);
  *curved = NULL;
  int status = x && done ? find_chains(mesh, on, &c) : flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d nodes", mesh->nodes);
  if (!status) {
    memcpy(x, mesh->positions, 3 * nodes * sizeof *x);
    status = place(mesh, surfaces, &c, done, x);
  }
  if (!status)
    status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = mesh->nodes, .tets = mesh->tets, .positions = x,
                                                  .tet_nodes = mesh->tet_nodes, .edge_nodes = mesh->edge_nodes,
                                                  .regions = mesh->regions, .ends = mesh->ends, .sets = &mesh->sets}, NULL, curved);
  if (!status) (*curved)->flipped = mesh->flipped;
  flesh_free(x);
  flesh_free(done);
  flesh_free(c.first);
  flesh_free(c.flat);
  flesh_free(c.links);
  return status;
}
