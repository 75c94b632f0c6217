/* spring.c: a spring from a point of the body, or from the body within a radius of it, to a moving target.
 *
 * V = k/2 |p(x) - target|^2, p(x) = sum of w_a x_a: one force at p, distributed by the weights, without a torque about
 * p. At a point the weights are the shape functions of its tet. The displacement under a point force grows without
 * limit as the mesh is refined (Kelvin 1848). With a radius, the weights are those with which all nodes within it carry
 * the point (carried_point.h), with the integrals of spring_weights.h as shares. The Jacobian k w w^T couples all of
 * these nodes. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/carried_point.h"
#include "effect/effect.h"
#include "effect/rank_share.h"
#include "effect/spring_weights.h"
#include "element/body.h"
#include "geometry/motion.h"
#include "math/nearest.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"
#include "skin/locator.h"

typedef struct spring {
  int count;       /* 4 or 10 nodes of a tet, or 3 of a surface triangle; with a radius any number */
  int *nodes;      /* [count] ascending */
  double *weights; /* [count] w_a; they sum to 1 */
  int tet;         /* a tet that contains the point */
  double point[3]; /* m, point in or on the body where the spring is attached */
  double radius;   /* m; 0: attached to a point */
  flesh_cells cells; /* one cell of all nodes */
  double stiffness, from, until;
  flesh_motion target;
} spring;

static const flesh_cells *spring_cells(const flesh_effect *effect)
{
  const spring *self = effect->data;
  return &self->cells;
}

static int active(const spring *self, double t) { return self->from <= t && t < self->until; }

/* Computes p(x) - target(t). */
static void extension(const spring *self, const flesh_point *point, double d[3])
{
  flesh_motion_at(&self->target, point->t, d);
  for (int c = 0; c < 3; c++) {
    double p = 0;
    for (int a = 0; a < self->count; a++) p += self->weights[a] * point->x[3 * self->nodes[a] + c];
    d[c] = p - d[c];
  }
}

static int spring_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const spring *self = effect->data;
  if (!active(self, point->t)) return FLESH_OK;
  double d[3];
  extension(self, point, d);
  for (int a = 0; a < self->count; a++)
    for (int c = 0; c < 3; c++)
      r[3 * self->nodes[a] + c] += point->load * self->stiffness * self->weights[a] * d[c];
  return FLESH_OK;
}

static int spring_jacobian(const flesh_effect *effect, const flesh_point *point,
                         const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  const spring *self = effect->data;
  if (!active(self, point->t)) return FLESH_OK;
  double k = shift->x * point->load * self->stiffness;
  for (int a = 0; a < self->count; a++)
    for (int b = a; b < self->count; b++, slots++)
      for (int c = 0; c < 3; c++)
        K->values[9 * (size_t)*slots + 4 * c] += k * self->weights[a] * self->weights[b];
  return FLESH_OK;
}

static int spring_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const spring *self = effect->data;
  *energy = 0;
  if (!active(self, point->t)) return FLESH_OK;
  double d[3];
  extension(self, point, d);
  *energy = point->load * self->stiffness / 2 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  return FLESH_OK;
}

static int spring_potential(const flesh_effect *effect, const flesh_point *point,
                          const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->x == 0) return FLESH_OK;
  double energy;
  spring_energy(effect, point, &energy);
  *phi += energy / shift->x;
  *magnitude += energy / shift->x;
  return FLESH_OK;
}

static double spring_next_event(const flesh_effect *effect, double t)
{
  const spring *self = effect->data;
  return fmin(flesh_interval_next_event(self->from, self->until, t),
              flesh_motion_next_event(&self->target, t));
}

static size_t spring_memory(const flesh_effect *effect)
{
  const spring *self = effect->data;
  return sizeof *self + (size_t)self->count * (sizeof *self->nodes + sizeof *self->weights) +
         (size_t)self->target.count * sizeof *self->target.keyframes;
}

static void spring_destroy(void *data)
{
  spring *self = data;
  if (!self) return;
  flesh_motion_clear(&self->target);
  flesh_free(self->nodes);
  flesh_free(self->weights);
  flesh_free(self);
}

static void sort_nodes(spring *self)
{
  for (int i = 1; i < self->count; i++)
    for (int j = i; j > 0 && self->nodes[j] < self->nodes[j - 1]; j--) {
      int node = self->nodes[j];
      double weight = self->weights[j];
      self->nodes[j] = self->nodes[j - 1], self->weights[j] = self->weights[j - 1];
      self->nodes[j - 1] = node, self->weights[j - 1] = weight;
    }
}

/* Gives the whole spring to the rank that owns its first node. */
static int spring_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                           flesh_effect **restricted)
{
  const spring *from = whole->data;
  const int here = flesh_rank_share_node(part, from->nodes[0]) >= 0;
  spring *self = flesh_calloc(1, sizeof *self);
  if (self) {
    *self = *from;
    self->count = here ? from->count : 0;
    self->stiffness = here ? from->stiffness : 0;
    self->nodes = flesh_malloc(((size_t)self->count + 1) * sizeof *self->nodes);
    self->weights = flesh_malloc(((size_t)self->count + 1) * sizeof *self->weights);
    self->target = (flesh_motion){0};
  }
  int status = self && self->nodes && self->weights ? flesh_motion_copy(&from->target, &self->target)
                                                    : flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring");
  if (status) {
    spring_destroy(self);
    return status;
  }
  for (int k = 0; k < self->count; k++) {
    self->nodes[k] = flesh_rank_part_find(part, from->nodes[k]);
    self->weights[k] = from->weights[k];
  }
  sort_nodes(self);
  self->cells = (flesh_cells){.count = here, .nodes_per_cell = here ? self->count : 1, .nodes = self->nodes};
  return flesh_effect_create(whole->operations, body->mesh, self, restricted);
}

static const flesh_cells *cells_of_ranks(const flesh_effect *whole, int *everywhere)
{
  (void)everywhere;
  return spring_cells(whole);
}

static const flesh_effect_ranks spring_ranks = {.restrict_to_part = spring_restrict, .cells = cells_of_ranks};
static const flesh_effect_time times = {.next_event = spring_next_event};
static const flesh_effect_figures figures = {.memory = spring_memory};

static const flesh_effect_operations spring_operations = {
    .name = "spring",
    .role = FLESH_ROLE_LOAD,
    .cells = spring_cells,
    .residual = spring_residual,
    .jacobian = spring_jacobian,
    .potential = spring_potential,
    .energy = spring_energy,
    .destroy = spring_destroy,
    .time = &times,
    .figures = &figures,
    .library = &(const flesh_effect_private){.ranks = &spring_ranks},
};

/* Computes the barycentric weights of p in the tet with the corners X[0] to X[3]. */
static void barycentric(const double *X[4], const double p[3], double weights[4])
{
  double e[3][3], d[3];
  for (int c = 0; c < 3; c++) {
    for (int a = 0; a < 3; a++) e[a][c] = X[a + 1][c] - X[0][c];
    d[c] = p[c] - X[0][c];
  }
#define DET(u, v, w)                                                                               \
  ((u)[0] * ((v)[1] * (w)[2] - (v)[2] * (w)[1]) + (u)[1] * ((v)[2] * (w)[0] - (v)[0] * (w)[2]) +   \
   (u)[2] * ((v)[0] * (w)[1] - (v)[1] * (w)[0]))
  double volume = DET(e[0], e[1], e[2]);
  weights[1] = DET(d, e[1], e[2]) / volume;
  weights[2] = DET(e[0], d, e[2]) / volume;
  weights[3] = DET(e[0], e[1], d) / volume;
  weights[0] = 1 - weights[1] - weights[2] - weights[3];
#undef DET
}

/* Attaches the spring to the four-node tet that contains p; to none if p lies outside the body. */
static void attach_inside(const flesh_mesh *mesh, const double p[3], spring *self)
{
  const double *X = flesh_mesh_positions(mesh), *corner[4];
  const int *tets = flesh_mesh_tets(mesh);
  for (int e = 0; e < flesh_mesh_tet_count(mesh) && !self->count; e++) {
    double w[4];
    for (int a = 0; a < 4; a++) corner[a] = X + 3 * tets[4 * e + a];
    barycentric(corner, p, w);
    if (!(fmin(fmin(w[0], w[1]), fmin(w[2], w[3])) >= 0)) continue;
    self->count = 4;
    self->tet = e;
    memcpy(self->nodes, tets + 4 * e, 4 * sizeof *tets);
    memcpy(self->weights, w, sizeof w);
  }
}

/* Attaches the spring to the point of the surface nearest to p, and to its triangle. */
static void attach_surface(const flesh_mesh *mesh, const double p[3], spring *self)
{
  const double *X = flesh_mesh_positions(mesh), *corner[3];
  int triangles;
  const int *surface = flesh_mesh_surface(mesh, &triangles);
  double best = INFINITY;
  for (int k = 0; k < triangles; k++) {
    double w[3];
    for (int a = 0; a < 3; a++) corner[a] = X + 3 * surface[3 * k + a];
    double distance = flesh_nearest_on_triangle(corner, p, w);
    if (!(distance < best)) continue;
    best = distance;
    self->count = 3;
    self->tet = flesh_mesh_surface_tets(mesh)[k];
    memcpy(self->nodes, surface + 3 * k, 3 * sizeof *surface);
    memcpy(self->weights, w, sizeof w);
    for (int c = 0; c < 3; c++) self->point[c] = w[0] * corner[0][c] + w[1] * corner[1][c] + w[2] * corner[2][c];
  }
}

/* Attaches the spring to a point of a mesh of ten-node tets: the point moves with their quadratic map. */
static int attach_quadratic(const flesh_mesh *mesh, const double p[3], spring *self)
{
  flesh_locator *locator;
  flesh_place place;
  int status = flesh_locator_create(mesh, &locator);
  if (status) return status;
  flesh_locator_find(locator, p, -1, &place);
  if (!(place.distance == 0)) {
    attach_surface(mesh, p, self);
    flesh_locator_find(locator, self->point, -1, &place);
  }
  if (place.tet >= 0) {
    self->tet = place.tet;
    self->count = flesh_mesh_tet_nodes(mesh, place.tet, self->nodes);
    if (self->count == 4) memcpy(self->weights, place.weights, sizeof place.weights);
    else flesh_tet10_weights(place.weights, self->weights);
  }
  flesh_locator_destroy(&locator);
  return FLESH_OK;
}

/* Attaches the spring to the tet that contains p or, if p lies outside the body, to the nearest point of its
 * surface. */
static int attach(const flesh_mesh *mesh, const double p[3], spring *self)
{
  int status = FLESH_OK;
  memcpy(self->point, p, sizeof self->point);
  self->nodes = flesh_calloc(10, sizeof *self->nodes);
  self->weights = flesh_calloc(10, sizeof *self->weights);
  if (!self->nodes || !self->weights) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring");
  if (flesh_mesh_order(mesh) == 2) status = attach_quadratic(mesh, p, self);
  else attach_inside(mesh, p, self);
  if (!status && !self->count) attach_surface(mesh, p, self);
  sort_nodes(self);
  return status;
}

/* Computes the shares [nodes] of the nodes within the radius, and in *count the number of non-zero ones. If
 * `may_shrink`, the radius is reduced until they are at most FLESH_SPRING_NODES. */
static int share_out(const flesh_mesh *mesh, spring *self, int may_shrink, double *shares, int *count)
{
  const int nodes = flesh_mesh_node_count(mesh);
  for (;;) {
    const int status = flesh_spring_weights(mesh, self->tet, self->point, self->radius, shares);
    if (status) return status;
    *count = 0;
    for (int i = 0; i < nodes; i++) *count += shares[i] > 0;
    if (*count <= FLESH_SPRING_NODES) return FLESH_OK;
    if (!may_shrink)
      return flesh_fail(FLESH_ERR_ARGUMENT, "radius is %g m, which holds %d nodes; it must hold at most %d", self->radius,
                        *count, FLESH_SPRING_NODES);
    self->radius *= 0.95 * cbrt((double)FLESH_SPRING_NODES / *count);
    memset(shares, 0, (size_t)nodes * sizeof *shares);
  }
}

/* Attaches the spring to all nodes with a share within the radius, with the weights that carry the point. */
static int widen(const flesh_mesh *mesh, int may_shrink, spring *self)
{
  const int nodes = flesh_mesh_node_count(mesh);
  double *shares = flesh_calloc((size_t)nodes, sizeof *shares), *weights = NULL;
  int *chosen = NULL, count = 0;
  int status = shares ? share_out(mesh, self, may_shrink, shares, &count)
                      : flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring");
  if (!status) {
    chosen = flesh_malloc((size_t)count * sizeof *chosen);
    weights = flesh_malloc((size_t)count * sizeof *weights);
    if (!chosen || !weights) status = flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring on %d nodes", count);
  }
  count = 0;
  for (int i = 0; !status && i < nodes; i++)
    if (shares[i] > 0) chosen[count] = i, shares[count++] = shares[i];
  if (!status) status = flesh_carried_weights(mesh, count, chosen, shares, self->point, 1, weights);
  flesh_free(shares);
  if (status) {
    flesh_free(chosen);
    flesh_free(weights);
    return status;
  }
  flesh_free(self->nodes);
  flesh_free(self->weights);
  self->nodes = chosen;
  self->weights = weights;
  self->count = count;
  return FLESH_OK;
}

static int check(const double point[3], double radius, double stiffness, double from, double until)
{
  if (!(stiffness > 0 && stiffness <= DBL_MAX))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g N/m; it must be positive", stiffness);
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until,
                      from);
  if (!(fabs(point[0]) + fabs(point[1]) + fabs(point[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "point is (%g, %g, %g); it must be finite", point[0],
                      point[1], point[2]);
  if (!(isnan(radius) || (radius >= 0 && radius <= DBL_MAX)))
    return flesh_fail(FLESH_ERR_ARGUMENT, "radius is %g m; it must be 0, for a spring at the point alone, or positive",
                      radius);
  return FLESH_OK;
}

int flesh_effect_spring_within(const flesh_body *body, const double point[3], double radius, double stiffness,
                               const flesh_motion *target, double from, double until, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {point, "point"}, {target, "target"});
  int status = check(point, radius, stiffness, from, until);
  if (status) return status;
  spring *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a spring");
  self->stiffness = stiffness;
  self->from = from;
  self->until = until;
  status = flesh_motion_copy(target, &self->target);
  if (!status) status = attach(body->mesh, point, self);
  self->radius = isnan(radius) ? flesh_spring_radius(body, self->tet) : radius;
  if (!status && self->radius > 0) status = widen(body->mesh, isnan(radius), self);
  self->cells = (flesh_cells){.count = 1, .nodes_per_cell = self->count, .nodes = self->nodes};
  return flesh_effect_create_after(status, &spring_operations, body->mesh, self, effect);
}

int flesh_effect_spring(const flesh_body *body, const double point[3], double stiffness,
                      const flesh_motion *target, double from, double until, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {point, "point"}, {target, "target"});
  return flesh_effect_spring_within(body, point, 0, stiffness, target, from, until, effect);
}

double flesh_effect_spring_radius(const flesh_effect *effect, double point[3])
{
  if (effect->operations != &spring_operations) return NAN;
  const spring *self = effect->data;
  for (int c = 0; point && c < 3; c++) point[c] = self->point[c];
  return self->radius;
}
