/* welded.h: two bodies with non-matching meshes, tied by a weld. Include after body.h and test.h. */
#ifndef FLESH_TEST_WELDED_H
#define FLESH_TEST_WELDED_H

#include <stdlib.h>

#include "body.h"
#include "test.h"

/* Joins two meshes of four-node tets. */
static inline flesh_mesh *joined(flesh_mesh *first, flesh_mesh *second)
{
  const int n = flesh_mesh_node_count(first), m = flesh_mesh_node_count(second);
  const int e = flesh_mesh_tet_count(first), f = flesh_mesh_tet_count(second);
  double *X = malloc(3 * (size_t)(n + m) * sizeof *X);
  int *tets = malloc(4 * (size_t)(e + f) * sizeof *tets), *regions = calloc((size_t)(e + f), sizeof *regions);
  flesh_mesh *mesh = NULL;
  memcpy(X, flesh_mesh_positions(first), 3 * (size_t)n * sizeof *X);
  memcpy(X + 3 * n, flesh_mesh_positions(second), 3 * (size_t)m * sizeof *X);
  for (int k = 0; k < 4 * e; k++) tets[k] = flesh_mesh_tets(first)[k];
  for (int k = 0; k < 4 * f; k++) tets[4 * e + k] = n + flesh_mesh_tets(second)[k];
  for (int k = e; k < e + f; k++) regions[k] = 1;
  CHECK_OK(flesh_mesh_create(n + m, X, e + f, tets, regions, &mesh));
  free(X);
  free(tets);
  free(regions);
  flesh_mesh_destroy(&first);
  flesh_mesh_destroy(&second);
  return mesh;
}

static inline flesh_mesh *box(const int cells[3], const double size[3], const double origin[3])
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box(cells, size, origin, &mesh));
  return mesh;
}

/* Copies the mesh with moved nodes. */
static inline flesh_mesh *moved(flesh_mesh *mesh, void (*move)(double *x))
{
  const int n = flesh_mesh_node_count(mesh), e = flesh_mesh_tet_count(mesh);
  double *X = malloc(3 * (size_t)n * sizeof *X);
  flesh_mesh *result = NULL;
  memcpy(X, flesh_mesh_positions(mesh), 3 * (size_t)n * sizeof *X);
  for (int i = 0; i < n; i++) move(X + 3 * i);
  CHECK_OK(flesh_mesh_create(n, X, e, flesh_mesh_tets(mesh), flesh_mesh_regions(mesh), &result));
  free(X);
  flesh_mesh_destroy(&mesh);
  return result;
}

static inline flesh_mesh *of_order(int order, flesh_mesh *mesh)
{
  flesh_mesh *raised = NULL;
  if (order == 1) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  return raised;
}

/* Lists surface triangles of the region: all, or those with all nodes chosen. */
static inline int triangles_of(const flesh_mesh *mesh, int region, int (*so)(const double *X), int *triangles)
{
  int all, count = 0;
  const int *surface = flesh_mesh_surface(mesh, &all), *tet = flesh_mesh_surface_tets(mesh);
  const double *X = flesh_mesh_positions(mesh);
  for (int k = 0; k < all; k++) {
    const int *n = surface + 3 * (size_t)k;
    if (flesh_mesh_regions(mesh)[tet[k]] != region) continue;
    if (so && !(so(X + 3 * n[0]) && so(X + 3 * n[1]) && so(X + 3 * n[2]))) continue;
    memcpy(triangles + 3 * (size_t)count++, n, 3 * sizeof *n);
  }
  return count;
}

/* Ties all of region 0's surface to all of region 1's, wherever they lie on each other. */
static inline flesh_effect *welded(const test_body *b, double distance, double stiffness, double breaks_at)
{
  int all;
  flesh_effect *effect = NULL;
  flesh_mesh_surface(b->mesh, &all);
  int *triangles[2] = {malloc(3 * (size_t)all * sizeof(int)), malloc(3 * (size_t)all * sizeof(int))}, count[2];
  for (int s = 0; s < 2; s++) count[s] = triangles_of(b->mesh, s, NULL, triangles[s]);
  const flesh_triangles sides[2] = {{count[0], triangles[0]}, {count[1], triangles[1]}};
  CHECK_OK(flesh_effect_weld(&b->body, sides[0], sides[1], distance, stiffness, breaks_at, &effect));
  free(triangles[0]);
  free(triangles[1]);
  return effect;
}

/* Returns the stiffness of a weld times the area that it ties, N/m: its force if region 1 is displaced by 1 m. */
static inline double force_per_metre(const test_body *b, const flesh_effect *weld)
{
  const double *X = flesh_mesh_positions(b->mesh);
  double *x = malloc((size_t)b->n * sizeof *x), *r = calloc((size_t)b->n, sizeof *r), force = 0;
  flesh_point point = flesh_point_at(0, x, NULL, NULL);
  point.internal = b->state.internal;
  memcpy(x, X, (size_t)b->n * sizeof *x);
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++)
    for (int a = 0; a < (flesh_mesh_order(b->mesh) == 2 ? 10 : 4) && flesh_mesh_regions(b->mesh)[e]; a++) {
      const int i = a < 4 ? flesh_mesh_tets(b->mesh)[4 * e + a] : flesh_mesh_tet_edges(b->mesh)[6 * e + a - 4];
      x[3 * i + 2] = X[3 * i + 2] + 1;
    }
  CHECK_OK(weld->operations->residual(weld, &point, r));
  for (int d = 2; d < b->n; d += 3) force += x[d] > X[d] ? r[d] : 0;
  free(x);
  free(r);
  return force;
}

#endif
