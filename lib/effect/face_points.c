/* face_points.c: faces of the surface and the quadrature points on them. */
#include "effect/face_points.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/rank_share.h"
#include "math/mat3.h"

/* Barycentric coordinates and weight of a point. The rules have degree 2 and degree 6 (Dunavant 1985). */
typedef struct rule_point {
  double L[3], weight;
} rule_point;

static const rule_point flat_rule[FLESH_FLAT_POINTS] = {{{2. / 3, 1. / 6, 1. / 6}, 1. / 3},
                                                        {{1. / 6, 2. / 3, 1. / 6}, 1. / 3},
                                                        {{1. / 6, 1. / 6, 2. / 3}, 1. / 3}};

#define WEIGHT_A .11678627572637937
#define WEIGHT_B .05084490637020682
#define WEIGHT_C .08285107561837358
#define C0 .05314504984481695
#define C1 .31035245103378440
#define C2 .63650249912139865
static const rule_point curved_rule[FLESH_FACE_POINTS] = {
    {{.50142650965817914, .24928674517091042, .24928674517091042}, WEIGHT_A},
    {{.24928674517091042, .50142650965817914, .24928674517091042}, WEIGHT_A},
    {{.24928674517091042, .24928674517091042, .50142650965817914}, WEIGHT_A},
    {{.87382197101699554, .06308901449150223, .06308901449150223}, WEIGHT_B},
    {{.06308901449150223, .87382197101699554, .06308901449150223}, WEIGHT_B},
    {{.06308901449150223, .06308901449150223, .87382197101699554}, WEIGHT_B},
    {{C0, C1, C2}, WEIGHT_C},
    {{C0, C2, C1}, WEIGHT_C},
    {{C1, C0, C2}, WEIGHT_C},
    {{C1, C2, C0}, WEIGHT_C},
    {{C2, C0, C1}, WEIGHT_C},
    {{C2, C1, C0}, WEIGHT_C}};

double flesh_face_rule(int flat, int q, const double corners[9], double at[3])
{
  if (q >= (flat ? FLESH_FLAT_POINTS : FLESH_FACE_POINTS)) return 0;
  const rule_point *p = (flat ? flat_rule : curved_rule) + q;
  for (int i = 0; i < 3; i++) at[i] = p->L[0] * corners[i] + p->L[1] * corners[3 + i] + p->L[2] * corners[6 + i];
  return p->weight;
}

static void make_points(int quarter, flesh_face_point points[FLESH_FACE_POINTS])
{
  const int flat = quarter == FLESH_FACE_FLAT;
  const rule_point *rule = flat ? flat_rule : curved_rule;
  for (int q = 0; q < (flat ? FLESH_FLAT_POINTS : FLESH_FACE_POINTS); q++) {
    double by_L[FLESH_FACE_NODES][3];
    flesh_face_shapes(quarter, rule[q].L, points[q].N, by_L);
    for (int a = 0; a < FLESH_FACE_NODES; a++)
      for (int k = 0; k < 2; k++) points[q].by[k][a] = by_L[a][k + 1] - by_L[a][0];
    points[q].weight = rule[q].weight / (flat ? 2 : 8);
  }
}

/* Sorts the nodes of a face into its cell, ascending and padded with the last one. */
static void make_cell(int own, int size, const int *node, int *cell, signed char *rank)
{
  for (int a = 0; a < own; a++) {
    int before = 0;
    for (int b = 0; b < own; b++) before += node[b] < node[a];
    rank[a] = (signed char)before;
    cell[before] = node[a];
  }
  for (int a = own; a < size; a++) cell[a] = cell[own - 1];
}

int flesh_faces_create(const flesh_mesh *mesh, int count, const int *triangles, flesh_faces *faces)
{
  const int quadratic = flesh_mesh_order(mesh) == 2, size = quadratic ? FLESH_FACE_NODES : 3;
  *faces = (flesh_faces){.count = count};
  int *cells = flesh_malloc(((size_t)count + 1) * (size_t)size * sizeof *cells);
  faces->cells = (flesh_cells){.count = count, .nodes_per_cell = size, .nodes = cells, .padded = quadratic};
  faces->faces = flesh_malloc(((size_t)count + 1) * sizeof *faces->faces);
  faces->rank = flesh_malloc(((size_t)count + 1) * FLESH_FACE_NODES);
  if (!cells || !faces->faces || !faces->rank)
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  const int status = flesh_face_quarters(mesh, count, triangles, faces->faces);
  for (int k = 0; !status && k < count; k++)
    make_cell(flesh_face_nodes(faces, k), size, faces->faces[k].node, cells + (size_t)size * (size_t)k,
              faces->rank + FLESH_FACE_NODES * (size_t)k);
  for (int kind = 0; kind < FLESH_FACE_KINDS; kind++) make_points(kind, faces->points[kind]);
  return status;
}

int flesh_faces_restrict(const flesh_faces *whole, const flesh_rank_part *part, const flesh_mesh *mesh,
                         flesh_faces *faces)
{
  /* Corners, in the face's node order, of the triangle of each quarter, and of a flat face. */
  static const int corners[FLESH_FACE_KINDS][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}, {0, 1, 2}};
  int found = 0, *kept = NULL, *local = NULL;
  int *triangles = flesh_malloc((3 * (size_t)whole->count + 1) * sizeof *triangles);
  *faces = (flesh_faces){0};
  if (!triangles) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", whole->count);
  for (size_t k = 0; k < 3 * (size_t)whole->count; k++)
    triangles[k] = whole->faces[k / 3].node[corners[whole->faces[k / 3].quarter][k % 3]];
  int status = flesh_rank_share_faces(part, whole->count, triangles, &found, &kept, &local);
  if (!status) {
    status = flesh_faces_create(mesh, found, local, faces);
    flesh_free(kept);
    flesh_free(local);
  }
  flesh_free(triangles);
  return status;
}

void flesh_faces_clear(flesh_faces *faces)
{
  flesh_free((int *)faces->cells.nodes);
  flesh_free(faces->faces);
  flesh_free(faces->rank);
  *faces = (flesh_faces){0};
}

size_t flesh_faces_memory(const flesh_faces *faces)
{
  return (size_t)faces->count * (sizeof *faces->faces + FLESH_FACE_NODES) +
         (size_t)faces->count * (size_t)faces->cells.nodes_per_cell * sizeof(int);
}

void flesh_face_add_block(const flesh_faces *faces, int face, int a, int b, const double B[9], flesh_block_matrix *K,
                          const int *slots)
{
  const signed char *rank = faces->rank + FLESH_FACE_NODES * (size_t)face;
  const int m = faces->cells.nodes_per_cell, turned = rank[a] > rank[b];
  const int i = turned ? rank[b] : rank[a], j = turned ? rank[a] : rank[b];
  const size_t pair = (size_t)face * (size_t)(m * (m + 1) / 2) + (size_t)(i * m - i * (i - 1) / 2 + j - i);
  double *block = K->values + 9 * (size_t)slots[pair];
  for (int k = 0; k < 9; k++) block[k] += turned ? B[k % 3 * 3 + k / 3] : B[k];
}

double flesh_face_flow(const flesh_faces *faces, int face, const flesh_face_point *q, const flesh_point *point,
                       const double velocity[3], double normal[3], double *speed)
{
  const int *node = faces->faces[face].node, count = flesh_face_nodes(faces, face);
  double along[2][3] = {{0}}, v[3] = {0};
  for (int a = 0; a < count; a++)
    for (int c = 0; c < 3; c++) {
      const size_t d = 3 * (size_t)node[a] + (size_t)c;
      for (int k = 0; k < 2; k++) along[k][c] += q->by[k][a] * point->lagged.x[d];
      v[c] += q->N[a] * point->v[d];
    }
  flesh_vec3_cross(along[0], along[1], normal);
  const double length = sqrt(flesh_vec3_dot(normal, normal));
  *speed = 0;
  for (int c = 0; c < 3; c++) {
    normal[c] = length > 0 ? normal[c] / length : 0;
    *speed += (v[c] - velocity[c]) * normal[c];
  }
  return length;
}

void flesh_face_add_force(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                          double *r)
{
  const int *node = faces->faces[face].node, count = flesh_face_nodes(faces, face);
  for (int a = 0; a < count; a++)
    for (int c = 0; c < 3; c++) r[3 * (size_t)node[a] + (size_t)c] += f * q->N[a] * n[c];
}

double flesh_face_work(const flesh_faces *faces, int face, const flesh_face_point *q, double f, const double n[3],
                       const flesh_point *point)
{
  const int *node = faces->faces[face].node, count = flesh_face_nodes(faces, face);
  double work = 0;
  for (int d = 0; d < 3 * count; d++) {
    const size_t at = 3 * (size_t)node[d / 3] + (size_t)(d % 3);
    work += f * q->N[d / 3] * n[d % 3] * (point->x[at] - point->lagged.x[at]);
  }
  return work;
}

void flesh_face_add_stiffness(const flesh_faces *faces, int face, const flesh_face_point *q, double k, const double n[3],
                              flesh_block_matrix *K, const int *slots)
{
  const int count = flesh_face_nodes(faces, face);
  double B[9];
  for (int a = 0; a < count; a++)
    for (int b = a; b < count; b++) {
      for (int i = 0; i < 9; i++) B[i] = k * q->N[a] * q->N[b] * n[i / 3] * n[i % 3];
      flesh_face_add_block(faces, face, a, b, B, K, slots);
    }
}
