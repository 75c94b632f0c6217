/* face_shares.c: integrals of shape functions over flat triangles and over quarters of the curved faces of ten-node
 * tets. */
#include "effect/face_shares.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "math/area.h"
#include "math/mat3.h"
#include "mesh/mesh.h"

static void add_flat(const double *X, const int n[3], double *shares)
{
  double normal[3];
  flesh_area_vector_at(X, n, normal);
  for (int a = 0; a < 3; a++) shares[n[a]] += sqrt(flesh_vec3_dot(normal, normal)) / 6;
}

/* Quadrature rule of seven points, exact for degree 5 (Radon 1948): barycentric coordinates and weights. */
enum { RULE = 7 };
static const double rule[RULE][4] = {
    {1. / 3, 1. / 3, 1. / 3, 0.225},
    {.05971587178976982, .47014206410511505, .47014206410511505, .13239415278850618},
    {.47014206410511505, .05971587178976982, .47014206410511505, .13239415278850618},
    {.47014206410511505, .47014206410511505, .05971587178976982, .13239415278850618},
    {.79742698535308732, .10128650732345634, .10128650732345634, .12593918054482715},
    {.10128650732345634, .79742698535308732, .10128650732345634, .12593918054482715},
    {.10128650732345634, .10128650732345634, .79742698535308732, .12593918054482715}};

/* Barycentric coordinates, within a face, of the corners of its quarters (the three at its corners, then the one
 * between its edge nodes), and of the face itself. */
static const double quarters[FLESH_FACE_KINDS][3][3] = {{{1, 0, 0}, {.5, .5, 0}, {.5, 0, .5}},
                                         {{.5, .5, 0}, {0, 1, 0}, {0, .5, .5}},
                                         {{.5, 0, .5}, {0, .5, .5}, {0, 0, 1}},
                                         {{.5, .5, 0}, {0, .5, .5}, {.5, 0, .5}},
                                         {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

/* Computes the shape functions at the face's coordinates L. */
static void shapes(int quarter, const double L[3], double N[6], double by_L[6][3])
{
  if (quarter == FLESH_FACE_FLAT) {
    memset(N, 0, 6 * sizeof *N);
    memset(by_L, 0, 6 * sizeof *by_L);
    for (int a = 0; a < 3; a++) N[a] = L[a], by_L[a][a] = 1;
    return;
  }
  for (int a = 0; a < 3; a++) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    N[a] = L[a] * (2 * L[a] - 1);
    by_L[a][a] = 4 * L[a] - 1;
    by_L[a][b] = by_L[a][c] = 0;
    N[3 + a] = 4 * L[a] * L[b];
    by_L[3 + a][a] = 4 * L[b];
    by_L[3 + a][b] = 4 * L[a];
    by_L[3 + a][c] = 0;
  }
}

void flesh_face_shapes(int quarter, const double at[3], double N[6], double by_L[6][3])
{
  double L[3] = {0};
  for (int k = 0; k < 9; k++) L[k % 3] += at[k / 3] * quarters[quarter][k / 3][k % 3];
  shapes(quarter, L, N, by_L);
}

static void add_quarter(const double *X, const int node[6], int quarter, double *shares)
{
  for (int q = 0; q < RULE; q++) {
    double L[3] = {0}, N[6], by_L[6][3], along[2][3] = {{0}}, normal[3];
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < 3; i++) L[i] += rule[q][k] * quarters[quarter][k][i];
    shapes(quarter, L, N, by_L);
    for (int a = 0; a < 6; a++)
      for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
          along[k][i] += (by_L[a][k + 1] - by_L[a][0]) * (X[3 * node[a] + i] - X[3 * node[0] + i]);
    flesh_vec3_cross(along[0], along[1], normal);
    const double area = rule[q][3] * sqrt(flesh_vec3_dot(normal, normal)) / 8;
    for (int a = 0; a < 6; a++) shares[node[a]] += area * N[a];
  }
}

/* A triangle as it is searched for: rotated so that its lowest node comes first, with the winding kept. */
typedef struct entry {
  int node[3], number;
} entry;

static entry entry_of(const int n[3], int number)
{
  const int first = n[0] < n[1] ? (n[0] < n[2] ? 0 : 2) : (n[1] < n[2] ? 1 : 2);
  return (entry){{n[first], n[(first + 1) % 3], n[(first + 2) % 3]}, number};
}

int flesh_face_numbers(const flesh_mesh *mesh, int count, const int *triangles, int *numbers)
{
  int all;
  const int *surface = flesh_mesh_surface(mesh, &all);
  entry *entries = flesh_malloc(((size_t)all + 1) * sizeof *entries);
  if (!entries) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a surface of %d triangles", all);
  for (int k = 0; k < all; k++) entries[k] = entry_of(surface + 3 * (size_t)k, k);
  qsort(entries, (size_t)all, sizeof *entries, flesh_compare_three_ints);
  int status = FLESH_OK;
  for (int k = 0; !status && k < count; k++) {
    const int *n = triangles + 3 * (size_t)k;
    const entry wanted = entry_of(n, 0);
    const entry *found = bsearch(&wanted, entries, (size_t)all, sizeof *entries, flesh_compare_three_ints);
    if (found) numbers[k] = found->number;
    else status = flesh_fail(FLESH_ERR_ARGUMENT, "the triangle (%d, %d, %d) is not one of the mesh's surface, on which "
                             "a weld, and a load on a mesh of order 2, must be", n[0], n[1], n[2]);
  }
  flesh_free(entries);
  return status;
}

/* Finds the face that triangle `number` of the surface belongs to. */
static flesh_face_quarter quarter_of(const flesh_mesh *mesh, const int n[3], int number)
{
  int all, first = number, last = number;
  const int *surface = flesh_mesh_surface(mesh, &all);
  if (flesh_mesh_face_parts(mesh, mesh->surface_tets[number]) == 1)
    return (flesh_face_quarter){{n[0], n[1], n[2], n[0], n[0], n[0]}, FLESH_FACE_FLAT};
  /* The triangles of a face are (a,p,r), (p,b,q), (r,q,c), (p,q,r). */
  while (first > 0 && mesh->surface_tets[first - 1] == mesh->surface_tets[first]) first--;
  first += (last - first) / 4 * 4; /* a tet's faces are consecutive */
  const int *face = surface + 3 * (size_t)first;
  return (flesh_face_quarter){{face[0], face[4], face[8], face[1], face[5], face[2]}, last - first};
}

static int quarters_of_curved(const flesh_mesh *mesh, int count, const int *triangles, flesh_face_quarter *quarters_of)
{
  int *numbers = flesh_malloc(((size_t)count + 1) * sizeof *numbers);
  int status = numbers ? flesh_face_numbers(mesh, count, triangles, numbers)
                       : flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  for (int k = 0; !status && k < count; k++) quarters_of[k] = quarter_of(mesh, triangles + 3 * (size_t)k, numbers[k]);
  flesh_free(numbers);
  return status;
}

static int check_triangles(const flesh_mesh *mesh, int count, const int *triangles)
{
  const int nodes = flesh_mesh_node_count(mesh);
  for (int k = 0; k < 3 * count; k++) {
    const int next = triangles[k % 3 == 2 ? k - 2 : k + 1];
    if (triangles[k] < 0 || triangles[k] >= nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d; the mesh has the nodes 0 to %d", k / 3,
                        triangles[k], nodes - 1);
    if (triangles[k] == next) return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d twice", k / 3, next);
  }
  return FLESH_OK;
}

int flesh_face_quarters(const flesh_mesh *mesh, int count, const int *triangles, flesh_face_quarter *quarters_of)
{
  int status = check_triangles(mesh, count, triangles);
  if (!status && flesh_mesh_order(mesh) == 2) return quarters_of_curved(mesh, count, triangles, quarters_of);
  for (int k = 0; !status && k < count; k++) {
    const int *n = triangles + 3 * (size_t)k;
    quarters_of[k] = (flesh_face_quarter){{n[0], n[1], n[2], n[0], n[0], n[0]}, FLESH_FACE_FLAT};
  }
  return status;
}

static int add_quadratic(const flesh_mesh *mesh, int count, const int *triangles, double *shares)
{
  flesh_face_quarter *found = flesh_malloc(((size_t)count + 1) * sizeof *found);
  if (!found) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a load on %d triangles", count);
  int status = flesh_face_quarters(mesh, count, triangles, found);
  for (int k = 0; !status && k < count; k++) {
    if (found[k].quarter == FLESH_FACE_FLAT) add_flat(flesh_mesh_positions(mesh), found[k].node, shares);
    else add_quarter(flesh_mesh_positions(mesh), found[k].node, found[k].quarter, shares);
  }
  flesh_free(found);
  return status;
}

const signed char flesh_face_pair[FLESH_FACE_PAIRS][2] = {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5}, {1, 2}, {1, 3}, {1, 4},
                                                          {1, 5}, {2, 3}, {2, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}};
const signed char flesh_face_triple[FLESH_FACE_TRIPLES][3] = {
    {0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 5}, {0, 2, 3}, {0, 2, 4}, {0, 2, 5}, {0, 3, 4}, {0, 3, 5}, {0, 4, 5},
    {1, 2, 3}, {1, 2, 4}, {1, 2, 5}, {1, 3, 4}, {1, 3, 5}, {1, 4, 5}, {2, 3, 4}, {2, 3, 5}, {2, 4, 5}, {3, 4, 5}};

/* Computes the volume's coefficients; the integrand has degree 4, for which the rule is exact. */
static void volume_form(int quarter, double volume[FLESH_FACE_TRIPLES])
{
  memset(volume, 0, FLESH_FACE_TRIPLES * sizeof *volume);
  for (int q = 0; q < RULE; q++) {
    double L[3] = {0}, N[6], by_L[6][3];
    for (int k = 0; k < 9; k++) L[k % 3] += rule[q][k / 3] * quarters[quarter][k / 3][k % 3];
    shapes(quarter, L, N, by_L);
    for (int t = 0; t < FLESH_FACE_TRIPLES; t++) {
      double D[9];
      for (int i = 0; i < 3; i++) {
        const int a = flesh_face_triple[t][i];
        D[3 * i] = N[a], D[3 * i + 1] = by_L[a][1] - by_L[a][0], D[3 * i + 2] = by_L[a][2] - by_L[a][0];
      }
      volume[t] += rule[q][3] / (quarter == FLESH_FACE_FLAT ? 6 : 24) * flesh_mat3_determinant(D);
    }
  }
}

/* Computes the rim's coefficients, side by side; the integrand has degree 5, for which three Gauss points are exact. */
static void rim_form(int quarter, double rim[6][FLESH_FACE_PAIRS])
{
  static const double at[3] = {.11270166537925831, .5, .88729833462074169}, weight[3] = {5. / 18, 8. / 18, 5. / 18};
  memset(rim, 0, 6 * sizeof *rim);
  for (int side = 0; side < 3; side++)
    for (int g = 0; g < 3; g++) {
      const double *from = quarters[quarter][side], *to = quarters[quarter][(side + 1) % 3];
      double L[3], N[6], by_L[6][3], dN[6] = {0};
      for (int i = 0; i < 3; i++) L[i] = from[i] + at[g] * (to[i] - from[i]);
      shapes(quarter, L, N, by_L);
      for (int a = 0; a < 6; a++)
        for (int i = 0; i < 3; i++) dN[a] += by_L[a][i] * (to[i] - from[i]);
      for (int k = 0; k < 6; k++)
        for (int p = 0; p < FLESH_FACE_PAIRS; p++) {
          const int a = flesh_face_pair[p][0], b = flesh_face_pair[p][1];
          rim[k][p] += weight[g] / 3 * N[k] * (N[a] * dN[b] - N[b] * dN[a]);
        }
    }
}

void flesh_face_forms(int quarter, double volume[FLESH_FACE_TRIPLES], double rim[6][FLESH_FACE_PAIRS])
{
  volume_form(quarter, volume);
  rim_form(quarter, rim);
}

int flesh_face_shares(const flesh_mesh *mesh, int count, const int *triangles, double *shares)
{
  const int nodes = flesh_mesh_node_count(mesh);
  for (int k = 0; k < 3 * count; k++)
    if (triangles[k] < 0 || triangles[k] >= nodes)
      return flesh_fail(FLESH_ERR_ARGUMENT, "node %d is loaded; the mesh has the nodes 0 to %d", triangles[k], nodes - 1);
  if (flesh_mesh_order(mesh) == 2) return add_quadratic(mesh, count, triangles, shares);
  for (int k = 0; k < count; k++) add_flat(flesh_mesh_positions(mesh), triangles + 3 * (size_t)k, shares);
  return FLESH_OK;
}
