/* winding.c: finds the tangles of a deformed mesh. */
#include "time/recovery/winding.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "math/mat3.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "parallel/shared_edges.h"

struct flesh_winding {
  const flesh_mesh *mesh;
  flesh_mesh_edges edges; /* of the pieces */
  flesh_shared_edges shared; /* edges that other ranks have, too */
  double *rest, *now;  /* [edges] sums of dihedral angles, over all ranks */
  uint8_t *tangled;    /* [pieces] */
};

/* Squared extents tr(F^T F) below which a tet has collapsed: a tenth of its size in the mean. */
static const double collapsed = 0.03;

/* For each edge of a tet, the edge between its other two corners. */
static const int opposite[6] = {5, 3, 4, 1, 2, 0};

/* Returns the angle at edge ab between the faces abc and abd, in [0, pi]. */
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

/* Sets the columns of D to the edges of a tet of four or ten nodes that meet at a corner; a curved edge is replaced by
 * its tangent there. */
static void tangents(const double *x, const int *node, int count, int corner, double D[9])
{
  for (int k = 0, column = 0; k < 6; k++) {
    const int *ends = flesh_edge_corners[k];
    if (ends[0] != corner && ends[1] != corner) continue;
    const int far = ends[0] == corner ? ends[1] : ends[0];
    for (int c = 0; c < 3; c++) {
      const double along = x[3 * node[far] + c] - x[3 * node[corner] + c];
      const double half = count == 10 ? x[3 * node[4 + k] + c] - x[3 * node[corner] + c] : along / 2;
      D[3 * c + column] = 4 * half - along;
    }
    column++;
  }
}

/* Marks the pieces of inverted tets alone as tangled. A thin tet of ten nodes that bends has inverted pieces, though J
 * is positive in all of it. */
static void mark_inverted(flesh_winding *self, const double *x)
{
  for (int p = 0, own; p < flesh_mesh_piece_count(self->mesh); p += own) {
    const int t = flesh_mesh_piece_tet(self->mesh, p);
    own = flesh_mesh_is_quadratic(self->mesh, t) ? 8 : 1;
    memset(self->tangled + p, !(flesh_mesh_tet_jacobian_bound(self->mesh, x, t) > 0), (size_t)own);
  }
}

/* Sums the angles at the edges; `tangled` marks the pieces of inverted tets. */
static void sum_angles(const flesh_winding *self, const double *x, double *sums)
{
  memset(sums, 0, sizeof(double) * (size_t)self->edges.count);
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    int node[4];
    double D[9];
    flesh_mesh_piece(self->mesh, t, node);
    tangents(x, node, 4, 0, D);
    /* An inverted tet winds backwards. */
    const double sign = self->tangled[t] && flesh_mat3_determinant(D) < 0 ? -1 : 1;
    for (int k = 0; k < 6; k++) {
      const int *at = flesh_edge_corners[k], *other = flesh_edge_corners[opposite[k]];
      sums[self->edges.tet_edges[6 * (size_t)t + k]] +=
          sign * dihedral(x, node[at[0]], node[at[1]], node[other[0]], node[other[1]]);
    }
  }
  flesh_shared_edges_sum(&self->shared, sums);
}

/* Bytes for the edges of every tet and for finding them, and three numbers for each edge, of which a tet has six. */
size_t flesh_winding_room(const flesh_mesh *mesh, const flesh_team *team, double *work)
{
  const size_t pieces = (size_t)flesh_mesh_piece_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  return 4096 + 304 * pieces + 8 * nodes + flesh_shared_edges_room(team, mesh, work);
}

/* Finds the edges of the pieces, and makes room for their sums. */
static int find_edges(flesh_winding *self)
{
  const int pieces = flesh_mesh_piece_count(self->mesh);
  int *nodes = flesh_malloc(4 * (size_t)pieces * sizeof *nodes);
  for (int t = 0; t < pieces && nodes; t++) flesh_mesh_piece(self->mesh, t, nodes + 4 * (size_t)t);
  const int enough = nodes && flesh_mesh_edges_find(flesh_mesh_node_count(self->mesh), pieces, nodes, &self->edges);
  flesh_free(nodes);
  const size_t edges = (size_t)self->edges.count;
  self->tangled = flesh_calloc((size_t)pieces, 1);
  self->rest = flesh_malloc(2 * edges * sizeof *self->rest + 1);
  self->now = self->rest ? self->rest + edges : NULL;
  return enough && self->tangled && self->rest ? FLESH_OK : FLESH_ERR_MEMORY;
}

int flesh_winding_create(const flesh_mesh *mesh, const flesh_team *team, flesh_winding **winding)
{
  flesh_winding *self = *winding = flesh_calloc(1, sizeof *self);
  flesh_shared_edges shared = {0};
  int status = FLESH_ERR_MEMORY;
  if (self) {
    self->mesh = mesh;
    status = find_edges(self);
  }
  status = flesh_shared_edges_create(team, self ? &self->edges : NULL, status, &shared);
  if (self) self->shared = shared;
  if (!status) {
    sum_angles(self, flesh_mesh_positions(mesh), self->rest);
    return FLESH_OK;
  }
  flesh_winding_destroy(winding);
  return flesh_fail(status, "no memory for the edges of %d tets", flesh_mesh_piece_count(mesh));
}

void flesh_winding_destroy(flesh_winding **winding)
{
  if (!winding || !*winding) return;
  flesh_winding *self = *winding;
  flesh_mesh_edges_clear(&self->edges);
  flesh_shared_edges_clear(&self->shared);
  flesh_free(self->rest); /* and now */
  flesh_free(self->tangled);
  flesh_free(self);
  *winding = NULL;
}

/* Sets F to the deformation gradient at a corner of a tet with these nodes. */
static void deformation(const flesh_mesh *mesh, const double *x, const int *node, int count, int corner, double F[9])
{
  double D[9], d[9], inverse[9];
  tangents(flesh_mesh_positions(mesh), node, count, corner, D);
  tangents(x, node, count, corner, d);
  flesh_mat3_inverse(D, inverse);
  flesh_mat3_multiply(d, inverse, F);
}

static void piece_deformation(const flesh_mesh *mesh, const double *x, int piece, double F[9])
{
  int node[4];
  flesh_mesh_piece(mesh, piece, node);
  deformation(mesh, x, node, 4, 0, F);
}

/* A piece between the nodes of a curved tet can be flat or inverted at rest, and then tells nothing. */
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
  /* If F, with kappa the ratio of its largest to its least singular value, takes an angle theta to theta', then
   * tan(theta'/2) <= kappa tan(theta/2). An edge that winds once more has a tet whose angle at its end at least doubles,
   * hence kappa >= 2; among all F of that ratio tr(F^T F) / J^(2/3) is least, 7.5 / 10^(1/3), for (2, sqrt 2.5, 1). */
  const double least = 7.5 / cbrt(10);
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int node[10];
    const int count = flesh_mesh_tet_nodes(mesh, t, node);
    for (int corner = 0; corner < (count == 10 ? 4 : 1); corner++) {
      double F[9];
      deformation(mesh, x, node, count, corner, F);
      const double J = flesh_mat3_determinant(F), I_C = flesh_mat3_norm2(F);
      if (!(J > 0) || !(I_C * I_C * I_C < least * least * least * J * J) || I_C < collapsed) return 1;
    }
    if (count == 10 && !(flesh_mesh_tet_jacobian_bound(mesh, x, t) > 0)) return 1;
  }
  return 0;
}

int flesh_body_may_be_tangled(const flesh_mesh *mesh, const flesh_team *team, const double *x)
{
  return flesh_team_any(team, flesh_mesh_may_be_tangled(mesh, x));
}

int flesh_mesh_is_flat(const flesh_mesh *mesh, const double *x)
{
  for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
    double F[9], C[9];
    if (tells_nothing(mesh, t)) continue;
    piece_deformation(mesh, x, t, F);
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
  mark_inverted(self, x);
  sum_angles(self, x, self->now);
  for (int t = 0; t < pieces; t++) {
    double F[9];
    piece_deformation(self->mesh, x, t, F);
    if (!tells_nothing(self->mesh, t) && flesh_mat3_norm2(F) < collapsed) self->tangled[t] = 1;
    for (int k = 0; k < 6; k++) {
      const int e = self->edges.tet_edges[6 * (size_t)t + k];
      if (fabs(self->now[e] - self->rest[e]) > pi) self->tangled[t] = 1;
    }
  }
  for (int t = 0; t < pieces; t++) count += self->tangled[t];
  *tangled = self->tangled;
  return count;
}

int flesh_winding_find_far(const flesh_mesh *mesh, const flesh_team *team, const uint8_t *tangled, double *work,
                           uint8_t *far)
{
  enum { AROUND = 2 };
  const int n = 3 * flesh_mesh_node_count(mesh), own = 3 * flesh_team_own(team, n / 3);
  int count = 0;
  memset(far, 1, (size_t)n);
  for (int depth = 0; depth <= AROUND; depth++) {
    memset(work, 0, (size_t)n / 3 * sizeof *work);
    for (int t = 0; t < flesh_mesh_piece_count(mesh); t++) {
      int node[4], reached = depth == 0 && tangled[t];
      flesh_mesh_piece(mesh, t, node);
      for (int a = 0; a < 4; a++) reached |= !far[3 * node[a]];
      for (int a = 0; a < 4 && reached; a++) work[node[a]] = 1;
    }
    flesh_team_sum_nodes(team, 1, work); /* nodes that other ranks have reached are reached here, too */
    for (int d = 0; d < n; d++) far[d] &= work[d / 3] == 0;
  }
  for (int d = 0; d < own; d++) count += far[d];
  return count;
}
