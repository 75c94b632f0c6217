/* curve.c: the boundary of a mesh of order 2, put on a surface. */
#include "mesh/curve.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "math/mat3.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"

static const double near_enough = 0.1; /* of the longest edge */
static const double least_cosine = 0.5;

static double distance(const double a[3], const double b[3])
{
  const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return sqrt(flesh_vec3_dot(d, d));
}

/* Whether the face with these corners stands for a part of the surface. */
static int stands_for(const flesh_mesh *mesh, const flesh_nearest_surface *surface, const int corner[3])
{
  const double *x[3];
  double longest = 0, at[3], normal[3], middle[3] = {0}, e[2][3], own[3];
  for (int k = 0; k < 3; k++) x[k] = mesh->positions + 3 * (size_t)corner[k];
  for (int k = 0; k < 3; k++) longest = fmax(longest, distance(x[k], x[(k + 1) % 3]));
  for (int k = 0; k < 3; k++) {
    surface->nearest(surface->data, x[k], at, normal);
    if (!(distance(x[k], at) <= near_enough * longest)) return 0;
    for (int c = 0; c < 3; c++) middle[c] += x[k][c] / 3;
  }
  surface->nearest(surface->data, middle, at, normal);
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) e[k][c] = x[k + 1][c] - x[0][c];
  flesh_vec3_cross(e[0], e[1], own);
  return fabs(flesh_vec3_dot(own, normal)) > least_cosine * sqrt(flesh_vec3_dot(own, own));
}

static void move(const flesh_nearest_surface *surface, double *x)
{
  double at[3], normal[3];
  surface->nearest(surface->data, x, at, normal);
  memcpy(x, at, sizeof at);
}

/* Marks in `on` [nodes] those that are to be on the surface; returns how many faces are. */
static int mark(const flesh_mesh *mesh, const flesh_nearest_surface *surface, uint8_t *on)
{
  int faces = 0;
  for (int k = 0; k < mesh->triangles; k += flesh_mesh_face_parts(mesh, mesh->surface_tets[k])) {
    if (flesh_mesh_face_parts(mesh, mesh->surface_tets[k]) == 1) continue;
    /* (a,p,r), (p,b,q), (r,q,c), (p,q,r) */
    const int *face = mesh->surface + 3 * (size_t)k;
    if (!stands_for(mesh, surface, (int[]){face[0], face[4], face[8]})) continue;
    for (int i = 0; i < 9; i++) on[face[i]] = 1;
    faces++;
  }
  return faces;
}

/* Corners first: nodes on edges keep their place between them, and then go to the surface too. */
static void place(const flesh_mesh *mesh, const flesh_nearest_surface *surface, const uint8_t *on, uint8_t *done,
                  double *x)
{
  const double *X = mesh->positions;
  for (int k = 0; k < 4 * mesh->tets; k++) {
    const int i = mesh->tet_nodes[k];
    if (on[i] && !done[i]) move(surface, x + 3 * (size_t)i);
    done[i] = 1;
  }
  for (int k = 0; k < 6 * mesh->tets; k++) {
    const int i = mesh->edge_nodes[k], *ends = flesh_edge_corners[k % 6];
    if (i < 0 || done[i]) continue;
    for (int e = 0; e < 2; e++) {
      const size_t end = 3 * (size_t)mesh->tet_nodes[4 * (size_t)(k / 6) + (size_t)ends[e]];
      for (int c = 0; c < 3; c++) x[3 * (size_t)i + (size_t)c] += (x[end + (size_t)c] - X[end + (size_t)c]) / 2;
    }
    if (on[i]) move(surface, x + 3 * (size_t)i);
    done[i] = 1;
  }
}

int flesh_mesh_curve(const flesh_mesh *mesh, const flesh_nearest_surface *surface, flesh_mesh **curved, int *faces)
{
  const size_t nodes = (size_t)mesh->nodes;
  *curved = NULL;
  if (!mesh->edge_nodes)
    return flesh_fail(FLESH_ERR_ARGUMENT, "the mesh has four-node tets, whose edges are straight; it must have order 2");
  double *x = flesh_malloc(3 * nodes * sizeof *x);
  uint8_t *on = flesh_calloc(nodes, 1), *done = flesh_calloc(nodes, 1);
  int status = x && on && done ? FLESH_OK : flesh_fail(FLESH_ERR_MEMORY, "out of memory for %d nodes", mesh->nodes);
  if (!status) {
    memcpy(x, mesh->positions, 3 * nodes * sizeof *x);
    *faces = mark(mesh, surface, on);
    place(mesh, surface, on, done, x);
    status = flesh_mesh_build(mesh->nodes, x, mesh->tets, mesh->tet_nodes, mesh->edge_nodes, mesh->regions, NULL,
                              curved);
  }
  if (!status) (*curved)->flipped = mesh->flipped;
  flesh_free(x);
  flesh_free(on);
  flesh_free(done);
  return status;
}
