/* winding.c: finds the tangles of a deformed mesh. */
#include "time/recovery/winding.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "math/mat3.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"

struct flesh_winding {
  const flesh_mesh *mesh;
  const flesh_shared_edges *shared;
  int edges;
  int *tet_edges;      /* [6*pieces] */
  int *shared_edges;   /* [shared->count] which of the edges they are */
  double *between;     /* [shared->count] sums of theirs */
  double *rest, *now;  /* [edges] sums of dihedral angles, of all ranks */
  uint8_t *tangled;    /* [pieces] */
};

/* A tet whose extents have shrunk below a tenth in the mean: tr(F^T F) of what has collapsed. */
static const double collapsed = 0.03;

/* The edge (0,1) and the other two corners of a tet, for each of its six edges. */
static const int edge_corners[6][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2},
                                       {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};

/* The angle at edge ab between the faces abc and abd, in [0, pi]. */
static double dihedral(const double *x, int a, int b, int c, int d)
{
  double e[3], u[3], w[3], n[3], m[3], cross[3];
  for (int k = 0; k < 3; k++) {
    e[k] = x[3 * b + k] - x[3 * a + k];
    u[k] = x[3 * c + k] - x[3 * a + k];
    w[k] = x[3 * d + k] - x[3 * a + k];
  }
  flesh_vec3_cross(e, u, n);
  flesh_vec3_cross(e, w, m);
  flesh_vec3_cross(n, m, cross);
  return atan2(sqrt(flesh_vec3_dot(cross, cross)), flesh_vec3_dot(n, m));
}

static int compare_edges(const void *a, const void *b)
{
  const int *p = a, *q = b;
  return p[0] != q[0] ? (p[0] > q[0]) - (p[0] < q[0]) : (p[1] > q[1]) - (p[1] < q[1]);
}

/* Adds up the sums of all ranks. */
static void sum_ranks(const flesh_winding *self, double *sums)
{
  for (int k = 0; k < self->shared->count; k++) self->between[k] = sums[self->shared_edges[k]];
  flesh_shared_edges_sum(self->shared, self->between);
  for (int k = 0; k < self->shared->count; k++) sums[self->shared_edges[k]] = self->between[k];
}

static void sum_angles(const flesh_winding *self, const double *x, double *sums)
{
  memset(sums, 0, sizeof(double) * (size_t)self->edges);
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    int node[4];
    double D[9];
    flesh_mesh_piece(self->mesh, t, node);
    for (int c = 0; c < 3; c++)
      for (int a = 0; a < 3; a++) D[3 * c + a] = x[3 * node[a + 1] + c] - x[3 * node[0] + c];
    /* An inverted tet winds backwards. */
    double sign = flesh_mat3_determinant(D) < 0 ? -1 : 1;
    for (int k = 0; k < 6; k++) {
      const int *corner = edge_corners[k];
      sums[self->tet_edges[6 * (size_t)t + k]] +=
          sign * dihedral(x, node[corner[0]], node[corner[1]], node[corner[2]], node[corner[3]]);
    }
  }
  if (self->shared) sum_ranks(self, sums);
}

/* The edges of every tet with as much again for sorting them, and four numbers by edge, of which a tet has six. */
size_t flesh_winding_room(const flesh_mesh *mesh, const flesh_shared_edges *shared)
{
  return 4096 + 384 * (size_t)flesh_mesh_piece_count(mesh) + (shared ? 16 * (size_t)shared->count : 0);
}

/* Every edge of every piece, by its nodes, sorted, with its place in tet_edges. */
static void list_edges(const flesh_mesh *mesh, int (*all)[3])
{
  const size_t pieces = (size_t)flesh_mesh_piece_count(mesh);
  for (size_t t = 0; t < pieces; t++)
    for (int k = 0; k < 6; k++) {
      int node[4];
      flesh_mesh_piece(mesh, (int)t, node);
      int a = node[edge_corners[k][0]];
      int b = node[edge_corners[k][1]];
      int *row = all[6 * t + k];
      row[0] = a < b ? a : b;
      row[1] = a < b ? b : a;
      row[2] = (int)(6 * t) + k;
    }
  flesh_sort(all, 6 * pieces, sizeof *all, compare_edges);
}

/* Numbers the edges, and finds those that other ranks have, too. */
static int number_edges(flesh_winding *self)
{
  const size_t pieces = (size_t)flesh_mesh_piece_count(self->mesh), shared = self->shared ? (size_t)self->shared->count : 0;
  int(*all)[3] = flesh_malloc(sizeof *all * 6 * pieces);
  self->tet_edges = flesh_malloc(sizeof(int) * 6 * pieces);
  self->tangled = flesh_calloc(pieces, 1);
  self->shared_edges = flesh_malloc((shared + 1) * sizeof *self->shared_edges);
  self->between = flesh_malloc((shared + 1) * sizeof *self->between);
  const int failed = !all || !self->tet_edges || !self->tangled || !self->shared_edges || !self->between;
  if (!failed) {
    list_edges(self->mesh, all);
    for (size_t k = 0; k < 6 * pieces; k++) {
      self->edges += !k || compare_edges(all[k], all[k - 1]);
      self->tet_edges[all[k][2]] = self->edges - 1;
    }
    for (size_t k = 0; k < shared; k++) {
      const int *found = bsearch(self->shared->nodes + 2 * k, all, 6 * pieces, sizeof *all, compare_edges);
      self->shared_edges[k] = self->tet_edges[found[2]];
    }
  }
  flesh_free(all);
  if (failed) return FLESH_ERR_MEMORY;
  self->rest = flesh_malloc(sizeof(double) * (size_t)self->edges);
  self->now = flesh_malloc(sizeof(double) * (size_t)self->edges);
  return self->rest && self->now ? FLESH_OK : FLESH_ERR_MEMORY;
}

int flesh_winding_create(const flesh_mesh *mesh, const flesh_shared_edges *shared, flesh_winding **winding)
{
  flesh_winding *self = *winding = flesh_calloc(1, sizeof *self);
  int status = self ? FLESH_OK : FLESH_ERR_MEMORY;
  if (self) {
    *self = (flesh_winding){.mesh = mesh, .shared = shared};
    status = number_edges(self);
  }
  if (status) flesh_fail(status, "no memory for the edges of %d tets", flesh_mesh_piece_count(mesh));
  if (shared) status = flesh_team_agree(shared->team, status);
  if (status) flesh_winding_destroy(winding);
  else sum_angles(self, flesh_mesh_positions(mesh), self->rest);
  return status;
}

void flesh_winding_destroy(flesh_winding **winding)
{
  if (!winding || !*winding) return;
  flesh_winding *self = *winding;
  flesh_free(self->tet_edges);
  flesh_free(self->shared_edges);
  flesh_free(self->between);
  flesh_free(self->rest);
  flesh_free(self->now);
  flesh_free(self->tangled);
  flesh_free(self);
  *winding = NULL;
}

static void deformation(const flesh_mesh *mesh, const double *x, int t, double F[9])
{
  const double *X = flesh_mesh_positions(mesh);
  int node[4];
  double D[9], d[9], inverse[9];
  flesh_mesh_piece(mesh, t, node);
  for (int c = 0; c < 3; c++)
    for (int a = 0; a < 3; a++) {
      D[3 * c + a] = X[3 * node[a + 1] + c] - X[3 * node[0] + c];
      d[3 * c + a] = x[3 * node[a + 1] + c] - x[3 * node[0] + c];
    }
  flesh_mat3_inverse(D, inverse);
  flesh_mat3_multiply(d, inverse, F);
}

/* Between the nodes of a curved tet a piece can be flat or inverted at rest, and then says nothing. */
static int tells_nothing(const flesh_mesh *mesh, int piece)
{
  int node[4];
  if (!flesh_mesh_is_quadratic(mesh, flesh_mesh_piece_tet(mesh, piece))) return 0;
  flesh_mesh_piece(mesh, piece, node);
  return !(flesh_tet_volume(flesh_mesh_positions(mesh), node) >
           1e-3 * flesh_mesh_tet_volumes(mesh)[flesh_mesh_piece_tet(mesh, piece)]);
}

int flesh_mesh_may_be_tangled(const flesh_mesh *mesh, const double *x)
{
  /* tan(theta'/2) <= kappa tan(theta/2) for an angle theta that F with the singular values' ratio
   * kappa takes to theta'; an edge that winds once more has a tet whose angle at least doubles,
   * hence kappa >= 2, and among all F of that ratio tr(F^T F) / J^(2/3) is least, 7.5 / 10^(1/3),
   * for (2, sqrt 2.5, 1). */
  const double least = 7.5 / cbrt(10);
  for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
    double F[9];
    if (tells_nothing(mesh, t)) continue;
    deformation(mesh, x, t, F);
    double J = flesh_mat3_determinant(F), I_C = flesh_mat3_norm2(F);
    if (!(J > 0) || !(I_C * I_C * I_C < least * least * least * J * J) || I_C < collapsed) return 1;
  }
  for (int t = 0; flesh_mesh_order(mesh) == 2 && t < flesh_mesh_tet_count(mesh); t++)
    if (!(flesh_mesh_tet_jacobian_bound(mesh, x, t) > 0)) return 1;
  return 0;
}

int flesh_mesh_is_flat(const flesh_mesh *mesh, const double *x)
{
  for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
    double F[9], C[9];
    if (tells_nothing(mesh, t)) continue;
    deformation(mesh, x, t, F);
    flesh_mat3_cofactor(F, C);
    double I_C = flesh_mat3_norm2(F);
    if (!(flesh_mat3_norm2(C) <= 1e-18 * I_C * I_C)) return 0;
  }
  return 1;
}

int flesh_winding_find(flesh_winding *self, const double *x, const uint8_t **tangled)
{
  const double pi = 3.14159265358979323846;
  const int pieces = flesh_mesh_piece_count(self->mesh);
  int count = 0;
  sum_angles(self, x, self->now);
  for (int t = 0; t < pieces; t++) {
    double F[9];
    int node[4];
    flesh_mesh_piece(self->mesh, t, node);
    deformation(self->mesh, x, t, F);
    self->tangled[t] = !tells_nothing(self->mesh, t) &&
                       (flesh_tet_volume(x, node) <= 0 || flesh_mat3_norm2(F) < collapsed);
    for (int k = 0; k < 6; k++) {
      int e = self->tet_edges[6 * (size_t)t + k];
      if (fabs(self->now[e] - self->rest[e]) > pi) self->tangled[t] = 1;
    }
  }
  /* Inverted where no piece shows it. */
  for (int p = 0; flesh_mesh_order(self->mesh) == 2 && p < pieces;) {
    const int t = flesh_mesh_piece_tet(self->mesh, p), own = flesh_mesh_is_quadratic(self->mesh, t) ? 8 : 1;
    if (flesh_mesh_tet_jacobian_bound(self->mesh, x, t) <= 0) memset(self->tangled + p, 1, (size_t)own);
    p += own;
  }
  for (int t = 0; t < pieces; t++) count += self->tangled[t];
  *tangled = self->tangled;
  return count;
}

/* Nodes that other ranks have reached are so here, too. */
static void reach_as_others(const flesh_team *team, int reached, int far_away, double *reached_by, uint8_t *far)
{
  for (int i = 0; i < team->nodes; i++) reached_by[i] = far[3 * i] == reached;
  const flesh_team_vector vector = {1, 1, NULL, reached_by, 0};
  team->operations->collect(team->data, &vector);
  team->operations->share(team->data, &vector);
  for (int i = 0; i < team->nodes; i++)
    if (reached_by[i] > 0 && far[3 * i] == far_away) far[3 * i] = (uint8_t)reached;
}

int flesh_winding_find_far(const flesh_mesh *mesh, const flesh_team *team, const uint8_t *tangled, double *work,
                           uint8_t *far)
{
  enum { AROUND = 2, NEAR = 0, FAR, REACHED };
  const int n = 3 * flesh_mesh_node_count(mesh), own = 3 * flesh_team_own(team, n / 3);
  int count = 0;
  memset(far, FAR, (size_t)n);
  for (int depth = 0; depth <= AROUND; depth++) {
    for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
      int node[4], reached = depth == 0 && tangled[t];
      flesh_mesh_piece(mesh, t, node);
      for (int a = 0; a < 4; a++) reached |= far[3 * node[a]] == NEAR;
      for (int a = 0; a < 4 && reached; a++)
        if (far[3 * node[a]] == FAR) far[3 * node[a]] = REACHED;
    }
    if (team) reach_as_others(team, REACHED, FAR, work, far);
    for (int d = 0; d < n; d += 3)
      if (far[d] == REACHED) far[d] = NEAR;
  }
  for (int d = 0; d < n; d++) {
    far[d] = far[d - d % 3];
    if (d < own) count += far[d];
  }
  return count;
}
