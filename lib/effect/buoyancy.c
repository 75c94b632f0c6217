/* buoyancy.c: the hydrostatic pressure of a fluid with a free surface (Archimedes).
 *
 * With the depth d = level - e.x below the surface, e the unit vector upwards, the pressure density g d acts where d >
 * 0. Its potential is the weight of the fluid that the body displaces, lifted to the surface: V = density g times the
 * integral of max(d, 0) over the body. As max(d, 0) = div(-max(d, 0)^2/2 e), V is the sum over the faces of
 *
 *   -density g/2 n M,   n = e.(area vector),  M = the mean of max(d, 0)^2 over the face.
 *
 * n depends only on the positions orthogonal to e, M only on the depths of the nodes. On flat triangles M has a closed
 * form, even if the fluid's surface cuts them. On quarters of curved faces both are computed by quadrature, which is
 * exact for faces wholly under water. Residual and Jacobian are the derivatives of that sum. */
#include <math.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/face_points.h"
#include "element/body.h"
#include "math/mat3.h"

enum { NODES = FLESH_FACE_NODES };

typedef struct buoyancy {
  flesh_faces faces;
  double up[3], level, factor; /* e; m; density g, N/m^3 */
} buoyancy;

static const flesh_cells *buoyancy_cells(const flesh_effect *effect)
{
  const buoyancy *self = effect->data;
  return &self->faces.cells;
}

/* The term of a flat face or of a point of a curved one: n with its derivatives by the nodes' positions, and M with its
 * first and second derivatives by their depths. */
typedef struct term {
  const int *node;
  int count; /* number of nodes */
  const flesh_face_point *q;
  double n, by_x[NODES][3], M, by_d[NODES], by_dd[NODES][NODES];
} term;

/* Adds `sign` times the integral of d^2 over the part of a triangle of unit area in which d, linear with the values d[]
 * at its corners, has the sign that only corner i has: d_i^4 / (6 (d_i - d_j) (d_i - d_k)). */
static void add_corner(const double d[3], int i, double sign, term *t)
{
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  const double a = d[i] / (d[i] - d[j]), b = d[i] / (d[i] - d[k]), c = sign * a * b / 6;
  t->M += c * d[i] * d[i];
  t->by_d[i] += c * d[i] * (4 - a - b);
  t->by_d[j] += c * d[i] * a;
  t->by_d[k] += c * d[i] * b;
  t->by_dd[i][i] += c * (12 - 8 * (a + b) + 2 * (a * a + a * b + b * b));
  t->by_dd[j][j] += c * 2 * a * a;
  t->by_dd[k][k] += c * 2 * b * b;
  const double ij = c * a * (4 - 2 * a - b), ik = c * b * (4 - 2 * b - a), jk = c * a * b;
  t->by_dd[i][j] += ij, t->by_dd[j][i] += ij;
  t->by_dd[i][k] += ik, t->by_dd[k][i] += ik;
  t->by_dd[j][k] += jk, t->by_dd[k][j] += jk;
}

static void depths_of_flat(const double d[3], term *t)
{
  const int wet = (d[0] > 0) + (d[1] > 0) + (d[2] > 0);
  if (wet > 1) {
    const double sum = d[0] + d[1] + d[2];
    t->M = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + sum * sum) / 12;
    for (int a = 0; a < 3; a++) t->by_d[a] = (d[a] + sum) / 6;
    for (int a = 0; a < 9; a++) t->by_dd[a / 3][a % 3] = (a % 4 ? 1. : 2.) / 6;
  }
  for (int i = 0; i < 3; i++) {
    if (wet == 1 && d[i] > 0) add_corner(d, i, 1, t);
    if (wet == 2 && d[i] < 0) add_corner(d, i, -1, t);
  }
}

static void depths_at_point(const double *d, term *t)
{
  double depth = 0;
  for (int a = 0; a < t->count; a++) depth += t->q->N[a] * d[a];
  if (!(depth > 0)) return;
  t->M = depth * depth;
  for (int a = 0; a < t->count; a++) {
    t->by_d[a] = 2 * depth * t->q->N[a];
    for (int b = 0; b < t->count; b++) t->by_dd[a][b] = 2 * t->q->N[a] * t->q->N[b];
  }
}

/* Computes the term at a point of a face. A flat face has one term, because the derivatives of its positions are the
 * same at all its points. Returns whether M is positive. */
static int term_at(const buoyancy *self, const double *x, int face, const flesh_face_point *q, term *t)
{
  double along[2][3] = {{0}}, across[2][3], d[NODES];
  const double *e = self->up;
  const int flat = flesh_face_is_flat(&self->faces, face);
  *t = (term){.node = self->faces.faces[face].node, .count = flesh_face_nodes(&self->faces, face), .q = q};
  for (int a = 0; a < t->count; a++) {
    const double *y = x + 3 * (size_t)t->node[a];
    d[a] = self->level - flesh_vec3_dot(e, y);
    for (int k = 0; k < 6; k++) along[k / 3][k % 3] += q->by[k / 3][a] * y[k % 3];
  }
  if (flat) depths_of_flat(d, t);
  else depths_at_point(d, t);
  const double weight = flat ? 0.5 : q->weight;
  flesh_vec3_cross(along[1], e, across[0]);
  flesh_vec3_cross(e, along[0], across[1]);
  t->n = weight * flesh_vec3_dot(along[0], across[0]);
  for (int a = 0; a < t->count; a++)
    for (int c = 0; c < 3; c++) t->by_x[a][c] = weight * (q->by[0][a] * across[0][c] + q->by[1][a] * across[1][c]);
  return t->M > 0;
}

static int terms_of(const buoyancy *self, int face, const flesh_face_point **q)
{
  const int points = flesh_face_points(&self->faces, face, q);
  return flesh_face_is_flat(&self->faces, face) ? 1 : points;
}

static int buoyancy_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const buoyancy *self = effect->data;
  const double f = -point->load * self->factor / 2;
  const flesh_face_point *q;
  for (int k = 0; k < self->faces.count; k++)
    for (int terms = terms_of(self, k, &q); terms > 0; terms--, q++) {
      term t;
      if (!term_at(self, point->x, k, q, &t)) continue;
      for (int a = 0; a < t.count; a++)
        for (int c = 0; c < 3; c++)
          r[3 * (size_t)t.node[a] + (size_t)c] += f * (t.M * t.by_x[a][c] - t.n * t.by_d[a] * self->up[c]);
    }
  return FLESH_OK;
}

/* A term's second derivatives are the sum of three parts, with a factor f < 0:
 *
 *   f n M_ab e e^T             vertical motion of the nodes
 *   -f (p m^T + m p^T)         with p_a = M_a e and m_a = dn/dx_a, so p.m = 0
 *   f (M - gauge) w k_ab S     with k = u v^T - v u^T for the coordinates u, v along the face, and S = -[e]x
 *
 * Over a closed surface the sum of k_ab is 0 for every pair of nodes, so `gauge` is arbitrary. Choosing the mean of M
 * makes the faces' parts, which cancel each other, small before they are made positive. Each part X becomes (1 - s) X +
 * s |X|, with s = `size` = 1/2 if negative eigenvalues are clamped and 1 if their absolute values are taken. */
typedef struct parts {
  double size, f, gauge;
  double S[9], across[9];      /* `across` is I - e e^T */
  double p_over_m, m_over_p;   /* ratios of lengths: |p m^T + m p^T| = (|m|/|p|) p p^T + (|p|/|m|) m m^T */
  double skew, uu, uv, vv;     /* skew is f (M - gauge) w; |k| = uu u u^T + uv (u v^T + v u^T) + vv v v^T */
} parts;

static void measure(const term *t, parts *s)
{
  double p = 0, m = 0, uu = 0, uv = 0, vv = 0;
  const double *u = t->q->by[0], *v = t->q->by[1];
  for (int a = 0; a < t->count; a++) {
    p += t->by_d[a] * t->by_d[a];
    m += flesh_vec3_dot(t->by_x[a], t->by_x[a]);
    uu += u[a] * u[a], uv += u[a] * v[a], vv += v[a] * v[a];
  }
  const int crossed = p > 0 && m > 0;
  s->p_over_m = crossed ? sqrt(p / m) : 0;
  s->m_over_p = crossed ? sqrt(m / p) : 0;
  const double k = sqrt(fmax(uu * vv - uv * uv, 0));
  s->skew = s->f * (t->M - s->gauge) * (t->count == 3 ? 0.5 : t->q->weight);
  s->uu = k > 0 ? vv / k : 0;
  s->uv = k > 0 ? -uv / k : 0;
  s->vv = k > 0 ? uu / k : 0;
}

static void block_of(const buoyancy *self, const term *t, const parts *s, int a, int b, double B[9])
{
  const double *e = self->up, *u = t->q->by[0], *v = t->q->by[1], keep = 1 - s->size;
  const double heave = (keep * s->f * t->n + s->size * fabs(s->f * t->n)) * t->by_dd[a][b];
  const double cross = -keep * s->f, both = s->size * fabs(s->f);
  const double k = keep * s->skew * (u[a] * v[b] - v[a] * u[b]);
  const double size = s->size * fabs(s->skew) *
                      (s->uu * u[a] * u[b] + s->uv * (u[a] * v[b] + v[a] * u[b]) + s->vv * v[a] * v[b]);
  for (int i = 0; i < 9; i++) {
    const int r = i / 3, c = i % 3;
    const double pa = t->by_d[a] * e[r], pb = t->by_d[b] * e[c], ma = t->by_x[a][r], mb = t->by_x[b][c];
    B[i] = heave * e[r] * e[c] + cross * (pa * mb + ma * pb) +
           both * (s->m_over_p * pa * pb + s->p_over_m * ma * mb) + k * s->S[i] + size * s->across[i];
  }
}

/* Returns the mean of M over all terms. */
static double mean_square_depth(const buoyancy *self, const double *x)
{
  double sum = 0;
  long count = 0;
  const flesh_face_point *q;
  for (int k = 0; k < self->faces.count; k++)
    for (int terms = terms_of(self, k, &q); terms > 0; terms--, q++, count++) {
      term t;
      term_at(self, x, k, q, &t);
      sum += t.M;
    }
  return count ? sum / (double)count : 0;
}

static int buoyancy_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                             flesh_block_matrix *K, const int *slots)
{
  const buoyancy *self = effect->data;
  const double *e = self->up;
  const flesh_face_point *q;
  parts s = {.size = shift->filter == FLESH_FILTER_NONE ? 0 : shift->filter == FLESH_FILTER_CLAMP ? 0.5 : 1,
             .f = -shift->x * point->load * self->factor / 2,
             .S = {0, e[2], -e[1], -e[2], 0, e[0], e[1], -e[0], 0}};
  if (s.f == 0) return FLESH_OK;
  for (int i = 0; i < 9; i++) s.across[i] = (i % 4 == 0) - e[i / 3] * e[i % 3];
  if (s.size > 0) s.gauge = mean_square_depth(self, point->x);
  for (int k = 0; k < self->faces.count; k++)
    for (int terms = terms_of(self, k, &q); terms > 0; terms--, q++) {
      term t;
      double B[9];
      if (!term_at(self, point->x, k, q, &t) && s.gauge == 0) continue;
      measure(&t, &s);
      for (int a = 0; a < t.count; a++)
        for (int b = a; b < t.count; b++) {
          block_of(self, &t, &s, a, b, B);
          flesh_face_add_block(&self->faces, k, a, b, B, K, slots);
        }
    }
  return FLESH_OK;
}

static int buoyancy_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                              double *phi, double *magnitude)
{
  const buoyancy *self = effect->data;
  if (shift->x == 0) return FLESH_OK;
  const double f = -point->load * self->factor / 2 / shift->x;
  const flesh_face_point *q;
  double value = 0, size = 0;
  for (int k = 0; k < self->faces.count; k++)
    for (int terms = terms_of(self, k, &q); terms > 0; terms--, q++) {
      term t;
      if (!term_at(self, point->x, k, q, &t)) continue;
      value += t.n * t.M;
      size += fabs(t.n * t.M);
    }
  *phi += f * value;
  *magnitude += fabs(f) * size;
  return FLESH_OK;
}

static int buoyancy_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  double magnitude = 0;
  *energy = 0;
  return buoyancy_potential(effect, point, &(flesh_shift){.x = 1}, energy, &magnitude);
}

static size_t buoyancy_memory(const flesh_effect *effect)
{
  const buoyancy *self = effect->data;
  return sizeof *self + flesh_faces_memory(&self->faces);
}

static void buoyancy_destroy(void *data)
{
  buoyancy *self = data;
  if (self) flesh_faces_clear(&self->faces);
  flesh_free(self);
}

static int buoyancy_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                         flesh_effect **restricted)
{
  const buoyancy *from = whole->data;
  buoyancy *self = flesh_malloc(sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a buoyancy");
  *self = *from;
  const int status = flesh_faces_restrict(&from->faces, part, body->mesh, &self->faces);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_effect_operations buoyancy_operations = {
    .name = "buoyancy",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_PASSIVE,
    .cells = buoyancy_cells,
    .residual = buoyancy_residual,
    .jacobian = buoyancy_jacobian,
    .potential = buoyancy_potential,
    .energy = buoyancy_energy,
    .destroy = buoyancy_destroy,
    .figures = &(const flesh_effect_figures){.memory = buoyancy_memory},
    .library = &(const flesh_effect_private){.ranks = &(const flesh_effect_ranks){.restrict_to_part = buoyancy_restrict}},
};

int flesh_effect_buoyancy(const flesh_body *body, double level, double density, const double acceleration[3],
                          flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {acceleration, "acceleration"});
  const double g = sqrt(flesh_vec3_dot(acceleration, acceleration));
  if (!(density > 0 && density < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "density is %g kg/m^3; it must be positive", density);
  if (!(fabs(level) < INFINITY)) return flesh_fail(FLESH_ERR_ARGUMENT, "level is %g m; it must be finite", level);
  if (!(g > 0 && g < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "acceleration is (%g, %g, %g) m/s^2; it must be finite and not 0",
                      acceleration[0], acceleration[1], acceleration[2]);
  buoyancy *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a buoyancy");
  for (int c = 0; c < 3; c++) self->up[c] = -acceleration[c] / g;
  self->level = level;
  self->factor = density * g;
  int count;
  const int *surface = flesh_mesh_surface(body->mesh, &count);
  const int status = flesh_faces_create(body->mesh, count, surface, &self->faces);
  return flesh_effect_create_after(status, &buoyancy_operations, body->mesh, self, effect);
}
