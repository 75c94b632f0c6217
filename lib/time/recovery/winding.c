/* winding.c: finds the tangles of a deformed mesh, and where its nodes lie without them. */
#include "time/recovery/winding.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "math/mat3.h"
#include "math/svd3.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "mesh/rigid_fit.h"

struct flesh_winding {
  const flesh_mesh *mesh;
  int edges;
  int *edge_nodes;     /* [2*edges] */
  int *tet_edges;      /* [6*pieces] */
  double *rest, *now;  /* [edges] sums of dihedral angles */
  double *weight;      /* [edges] 1 / rest length */
  uint8_t *tangled;    /* [pieces] */
  int *body;           /* [nodes] connected part of the mesh, numbered from 1 */
  int *moved;          /* [nodes] connected group of moved nodes, numbered from 1; 0: not moved */
};

/* A tet whose extents have shrunk below a tenth in the mean: tr(F^T F) of what has collapsed. */
static const double collapsed = 0.03;
/* The least stretch of what has been crushed. */
static const double crushed = 0.05;

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
}

static int root(int *parent, int i)
{
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/* Numbers the parts of the nodes with part[i] != 0 that edges between such nodes connect, from 1 in
 * the order of their first nodes, into part [nodes]. Returns their number, or -1: no memory. */
static int number_parts(const flesh_winding *self, int *part)
{
  int nodes = flesh_mesh_node_count(self->mesh), count = 0;
  int *parent = flesh_malloc(sizeof *parent * (size_t)nodes);
  if (!parent) return -1;
  for (int i = 0; i < nodes; i++) parent[i] = i;
  for (int e = 0; e < self->edges; e++) {
    int a = self->edge_nodes[2 * e], b = self->edge_nodes[2 * e + 1];
    if (!part[a] || !part[b]) continue;
    a = root(parent, a), b = root(parent, b);
    parent[a > b ? a : b] = a > b ? b : a; /* a root is its part's first node */
  }
  for (int i = 0; i < nodes; i++)
    if (part[i]) part[i] = parent[i] == i ? ++count : part[root(parent, i)];
  flesh_free(parent);
  return count;
}

/* Twelve lists by edge, of which a tet has six at most, or by tet, with as much again for sorting; 54 numbers and a fit
 * by node. */
size_t flesh_winding_room(const flesh_mesh *mesh)
{
  const size_t tets = (size_t)flesh_mesh_piece_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  return 4096 + 512 * tets + (256 + sizeof(flesh_rigid_fit)) * nodes;
}

int flesh_winding_create(const flesh_mesh *mesh, flesh_winding **winding)
{
  flesh_winding *self = flesh_calloc(1, sizeof *self);
  *winding = self;
  size_t tets = (size_t)flesh_mesh_piece_count(mesh), nodes = (size_t)flesh_mesh_node_count(mesh);
  int(*all)[3] = flesh_malloc(sizeof *all * 6 * tets);
  if (self) {
    self->mesh = mesh;
    self->tet_edges = flesh_malloc(sizeof(int) * 6 * tets);
    self->tangled = flesh_calloc(tets, 1);
    self->moved = flesh_calloc(nodes, sizeof(int));
    self->body = flesh_malloc(sizeof(int) * nodes);
  }
  if (!self || !all || !self->tet_edges || !self->tangled || !self->moved || !self->body)
    goto no_memory;
  for (size_t t = 0; t < tets; t++)
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
  flesh_sort(all, 6 * tets, sizeof *all, compare_edges);
  for (size_t k = 0; k < 6 * tets; k++) {
    self->edges += !k || compare_edges(all[k], all[k - 1]);
    self->tet_edges[all[k][2]] = self->edges - 1;
  }
  size_t edges = (size_t)self->edges;
  self->edge_nodes = flesh_malloc(sizeof(int) * 2 * edges);
  self->rest = flesh_malloc(sizeof(double) * edges);
  self->now = flesh_malloc(sizeof(double) * edges);
  self->weight = flesh_malloc(sizeof(double) * edges);
  if (!self->edge_nodes || !self->rest || !self->now || !self->weight) goto no_memory;
  const double *X = flesh_mesh_positions(mesh);
  for (size_t k = 0; k < 6 * tets; k++) {
    int e = self->tet_edges[all[k][2]];
    double square = 0;
    for (int c = 0; c < 2; c++) self->edge_nodes[2 * e + c] = all[k][c];
    for (int c = 0; c < 3; c++) {
      double d = X[3 * all[k][0] + c] - X[3 * all[k][1] + c];
      square += d * d;
    }
    self->weight[e] = 1 / sqrt(square);
  }
  for (size_t i = 0; i < nodes; i++) self->body[i] = 1;
  if (number_parts(self, self->body) < 0) goto no_memory;
  flesh_free(all);
  sum_angles(self, X, self->rest);
  return FLESH_OK;
no_memory:
  flesh_free(all);
  flesh_winding_destroy(winding);
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for the edges of %zu tets", tets);
}

void flesh_winding_destroy(flesh_winding **winding)
{
  if (!winding || !*winding) return;
  flesh_winding *self = *winding;
  flesh_free(self->edge_nodes);
  flesh_free(self->tet_edges);
  flesh_free(self->rest);
  flesh_free(self->now);
  flesh_free(self->weight);
  flesh_free(self->tangled);
  flesh_free(self->body);
  flesh_free(self->moved);
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
    if (!(flesh_mesh_tet_jacobian(mesh, x, t) > 0)) return 1;
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
    if (flesh_mesh_tet_jacobian(self->mesh, x, t) <= 0) memset(self->tangled + p, 1, (size_t)own);
    p += own;
  }
  for (int t = 0; t < pieces; t++) count += self->tangled[t];
  *tangled = self->tangled;
  return count;
}

int flesh_winding_find_crushed(flesh_winding *self, const double *x, const uint8_t **tangled)
{
  int count = 0;
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    double F[9], U[9], sigma[3], V[9];
    deformation(self->mesh, x, t, F);
    flesh_svd3(F, U, sigma, V);
    count += self->tangled[t] = !tells_nothing(self->mesh, t) && sigma[2] < crushed;
  }
  *tangled = self->tangled;
  return count;
}

/* Marks in `moved` the nodes of the tangled tets and of `rings` layers around them. */
static int grow(flesh_winding *self, int rings)
{
  int nodes = flesh_mesh_node_count(self->mesh), count = 0;
  memset(self->moved, 0, sizeof(int) * (size_t)nodes);
  for (int t = 0; t < flesh_mesh_piece_count(self->mesh); t++) {
    int node[4];
    flesh_mesh_piece(self->mesh, t, node);
    for (int a = 0; self->tangled[t] && a < 4; a++) self->moved[node[a]] = 1;
  }
  /* 2 is a mark of this layer, so that one pass grows by one. */
  for (int ring = 0; ring < rings; ring++) {
    for (int e = 0; e < self->edges; e++) {
      int *a = &self->moved[self->edge_nodes[2 * e]], *b = &self->moved[self->edge_nodes[2 * e + 1]];
      if (*a == 1 && !*b) *b = 2;
      if (*b == 1 && !*a) *a = 2;
    }
    for (int i = 0; i < nodes; i++) self->moved[i] = self->moved[i] != 0;
  }
  for (int i = 0; i < nodes; i++) count += self->moved[i];
  return count;
}

/* y = L x over the given edges, L the weighted graph Laplacian. */
static void laplacian(const flesh_winding *self, int count, const int *active, const double *x, double *y)
{
  memset(y, 0, sizeof(double) * 3 * (size_t)flesh_mesh_node_count(self->mesh));
  for (int k = 0; k < count; k++) {
    int e = active[k], a = self->edge_nodes[2 * e], b = self->edge_nodes[2 * e + 1];
    for (int c = 0; c < 3; c++) {
      double flow = self->weight[e] * (x[3 * a + c] - x[3 * b + c]);
      y[3 * a + c] += flow;
      y[3 * b + c] -= flow;
    }
  }
}

/* Conjugate gradients with Jacobi's preconditioner on the free components for L d = r; the exact answer is not needed,
 * the elastic solver goes on from there. */
static void relax(const flesh_winding *self, int count, const int *active, const uint8_t *free_dof, int n,
                  double *d, double *r, double *p, double *q, const double *diagonal)
{
  double rz = 0, first = 0;
  memset(d, 0, sizeof(double) * (size_t)n);
  for (int k = 0; k < n; k++) {
    p[k] = free_dof[k] ? r[k] / diagonal[k] : 0;
    rz += free_dof[k] ? r[k] * p[k] : 0;
  }
  first = rz;
  for (int i = 0; i < 2000 && rz > 1e-16 * first; i++) {
    laplacian(self, count, active, p, q);
    double curvature = 0, next = 0;
    for (int k = 0; k < n; k++) curvature += p[k] * q[k];
    if (!(curvature > 0)) return;
    for (int k = 0; k < n; k++) {
      if (!free_dof[k]) continue;
      d[k] += rz / curvature * p[k];
      r[k] -= rz / curvature * q[k];
      next += r[k] * r[k] / diagonal[k];
    }
    for (int k = 0; k < n; k++)
      if (free_dof[k]) p[k] = r[k] / diagonal[k] + next / rz * p[k];
    rz = next;
  }
}

/* The group of moved nodes that an edge belongs to; 0: none. Nodes of two groups share no edge. */
static int group_of(const flesh_winding *self, int edge)
{
  int a = self->moved[self->edge_nodes[2 * edge]], b = self->moved[self->edge_nodes[2 * edge + 1]];
  return a ? a : b;
}

/* The rotation that fits what stays around a group best, or its body where too little stays. Returns
 * whether anything stays at all. `chosen` [nodes] is scratch. */
static int fit_group(const flesh_winding *self, int group, const uint8_t *fixed, const double *x,
                     uint8_t *chosen, flesh_rigid_fit *fit)
{
  int nodes = flesh_mesh_node_count(self->mesh), anchors = 0, held = 0, body = 0;
  memset(chosen, 0, (size_t)nodes);
  for (int e = 0; e < self->edges; e++)
    for (int k = 0; k < 2 && group_of(self, e) == group; k++) {
      int i = self->edge_nodes[2 * e + k];
      chosen[i] |= !self->moved[i] || (fixed[3 * i] && fixed[3 * i + 1] && fixed[3 * i + 2]);
      body = self->body[i];
    }
  for (int i = 0; i < nodes; i++) {
    anchors += chosen[i];
    held |= self->moved[i] == group && (fixed[3 * i] || fixed[3 * i + 1] || fixed[3 * i + 2]);
  }
  for (int i = 0; i < nodes && anchors < 4; i++) chosen[i] = self->body[i] == body;
  flesh_rigid_fit_find(nodes, flesh_mesh_positions(self->mesh), x, chosen, fit);
  return anchors || held;
}

/* Minus the gradient of the sum of squares at x, and its diagonal, over the `count` edges. */
static void pull(const flesh_winding *self, int count, const int *active, const flesh_rigid_fit *fits,
                 const double *x, double *r, double *diagonal)
{
  const double *X = flesh_mesh_positions(self->mesh);
  for (int k = 0; k < count; k++) {
    int e = active[k], a = self->edge_nodes[2 * e], b = self->edge_nodes[2 * e + 1];
    double D[3], wanted[3];
    for (int c = 0; c < 3; c++) D[c] = X[3 * a + c] - X[3 * b + c];
    flesh_mat3_times(fits[group_of(self, e)].R, D, wanted);
    for (int c = 0; c < 3; c++) {
      double flow = self->weight[e] * (wanted[c] - (x[3 * a + c] - x[3 * b + c]));
      r[3 * a + c] += flow;
      r[3 * b + c] -= flow;
      diagonal[3 * a + c] += self->weight[e];
      diagonal[3 * b + c] += self->weight[e];
    }
  }
}

int flesh_winding_embed(flesh_winding *self, int rings, const uint8_t *fixed, double *x)
{
  const double *X = flesh_mesh_positions(self->mesh);
  int n = 3 * flesh_mesh_node_count(self->mesh), moving = grow(self, rings), count = 0;
  int groups = number_parts(self, self->moved), size = groups < 0 ? 1 : groups + 1;
  flesh_rigid_fit *fits = flesh_calloc((size_t)size, sizeof *fits);
  uint8_t *loose = flesh_calloc((size_t)size, 1); /* [groups+1] around which nothing stays */
  int *active = flesh_malloc(sizeof(int) * (size_t)(self->edges + 1));
  uint8_t *marks = flesh_calloc(2 * (size_t)n + 1, 1), *chosen = marks, *free_dof = marks + n;
  double *work = flesh_calloc(5 * (size_t)n + 1, sizeof *work);
  if (groups < 0 || !fits || !loose || !active || !marks || !work) {
    moving = flesh_fail(FLESH_ERR_MEMORY, "no memory to untangle %d nodes", moving);
    goto done;
  }
  double *d = work, *r = work + n, *p = work + 2 * (size_t)n, *q = work + 3 * (size_t)n,
         *diagonal = work + 4 * (size_t)n;
  for (int g = 1; g <= groups; g++)
    loose[g] = !fit_group(self, g, fixed, x, chosen, &fits[g]);
  for (int e = 0; e < self->edges; e++)
    if (group_of(self, e) && !loose[group_of(self, e)]) active[count++] = e;
  pull(self, count, active, fits, x, r, diagonal);
  for (int k = 0; k < n; k++)
    free_dof[k] = self->moved[k / 3] && !loose[self->moved[k / 3]] && !fixed[k];
  relax(self, count, active, free_dof, n, d, r, p, q, diagonal);
  for (int k = 0; k < n; k++) x[k] += d[k];
  /* Of a free body as a whole the least is zero, at the rest shape itself. */
  for (int i = 0; i < n / 3; i++)
    if (loose[self->moved[i]]) flesh_rigid_fit_apply(&fits[self->moved[i]], X + 3 * i, x + 3 * i);
done:
  flesh_free(fits), flesh_free(loose), flesh_free(active), flesh_free(marks), flesh_free(work);
  return moving;
}

const int *flesh_winding_moved(const flesh_winding *self) { return self->moved; }
