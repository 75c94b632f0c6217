/* spring.c: a spring from a point of the body to a moving target: the mouse pull. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "geometry/motion.h"
#include "math/nearest.h"
#include "mesh/pieces.h"
#include "mesh/shape.h"
#include "skin/locator.h"

typedef struct drag {
  int count;          /* 4 or 10 nodes of a tet, or 3 of a surface triangle */
  int nodes[10];      /* ascending */
  double weights[10]; /* sum 1: p(x) = sum weights x */
  flesh_cells cells;
  double stiffness, from, until;
  flesh_motion target;
} drag;

static const flesh_cells *drag_cells(const flesh_effect *effect)
{
  const drag *self = effect->data;
  return &self->cells;
}

static int active(const drag *self, double t) { return self->from <= t && t < self->until; }

/* p(x) - target(t). */
static void extension(const drag *self, const flesh_point *point, double d[3])
{
  flesh_motion_at(&self->target, point->t, d);
  for (int c = 0; c < 3; c++) {
    double p = 0;
    for (int a = 0; a < self->count; a++) p += self->weights[a] * point->x[3 * self->nodes[a] + c];
    d[c] = p - d[c];
  }
}

static int drag_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const drag *self = effect->data;
  if (!active(self, point->t)) return FLESH_OK;
  double d[3];
  extension(self, point, d);
  for (int a = 0; a < self->count; a++)
    for (int c = 0; c < 3; c++)
      r[3 * self->nodes[a] + c] += point->load * self->stiffness * self->weights[a] * d[c];
  return FLESH_OK;
}

static int drag_jacobian(const flesh_effect *effect, const flesh_point *point,
                         const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  const drag *self = effect->data;
  if (!active(self, point->t)) return FLESH_OK;
  double k = shift->x * point->load * self->stiffness;
  for (int a = 0; a < self->count; a++)
    for (int b = a; b < self->count; b++, slots++)
      for (int c = 0; c < 3; c++)
        K->values[9 * (size_t)*slots + 4 * c] += k * self->weights[a] * self->weights[b];
  return FLESH_OK;
}

static int drag_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const drag *self = effect->data;
  *energy = 0;
  if (!active(self, point->t)) return FLESH_OK;
  double d[3];
  extension(self, point, d);
  *energy = point->load * self->stiffness / 2 * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  return FLESH_OK;
}

static int drag_potential(const flesh_effect *effect, const flesh_point *point,
                          const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->x == 0) return FLESH_OK;
  double energy;
  drag_energy(effect, point, &energy);
  *phi += energy / shift->x;
  *magnitude += energy / shift->x;
  return FLESH_OK;
}

static double drag_next_event(const flesh_effect *effect, double t)
{
  const drag *self = effect->data;
  return fmin(flesh_interval_next_event(self->from, self->until, t),
              flesh_motion_next_event(&self->target, t));
}

static size_t drag_memory(const flesh_effect *effect)
{
  const drag *self = effect->data;
  return sizeof *self + (size_t)self->target.count * sizeof *self->target.keyframes;
}

static void drag_destroy(void *data)
{
  drag *self = data;
  if (!self) return;
  flesh_motion_clear(&self->target);
  flesh_free(self);
}

static const flesh_effect_operations drag_operations = {
    .name = "spring",
    .role = FLESH_ROLE_LOAD,
    .cells = drag_cells,
    .residual = drag_residual,
    .jacobian = drag_jacobian,
    .potential = drag_potential,
    .energy = drag_energy,
    .destroy = drag_destroy,
    .time = &(const flesh_effect_time){.next_event = drag_next_event},
    .figures = &(const flesh_effect_figures){.memory = drag_memory},
};

/* Barycentric weights of p in the tet with corners X0..X3. */
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

/* The tet that holds p, of four nodes; none where p lies outside. */
static void attach_inside(const flesh_mesh *mesh, const double p[3], drag *self)
{
  const double *X = flesh_mesh_positions(mesh), *corner[4];
  const int *tets = flesh_mesh_tets(mesh);
  for (int e = 0; e < flesh_mesh_tet_count(mesh) && !self->count; e++) {
    double w[4];
    for (int a = 0; a < 4; a++) corner[a] = X + 3 * tets[4 * e + a];
    barycentric(corner, p, w);
    if (!(fmin(fmin(w[0], w[1]), fmin(w[2], w[3])) >= 0)) continue;
    self->count = 4;
    memcpy(self->nodes, tets + 4 * e, 4 * sizeof *tets);
    memcpy(self->weights, w, sizeof w);
  }
}

/* The point of the surface that is nearest to p, and the triangle it is on. */
static void attach_surface(const flesh_mesh *mesh, const double p[3], drag *self, double nearest[3])
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
    memcpy(self->nodes, surface + 3 * k, 3 * sizeof *surface);
    memcpy(self->weights, w, sizeof w);
    for (int c = 0; c < 3; c++) nearest[c] = w[0] * corner[0][c] + w[1] * corner[1][c] + w[2] * corner[2][c];
  }
}

/* The same for tets of ten nodes: the point goes with their quadratic map. */
static int attach_quadratic(const flesh_mesh *mesh, const double p[3], drag *self)
{
  flesh_locator *locator;
  flesh_place place;
  double nearest[3];
  int status = flesh_locator_create(mesh, &locator);
  if (status) return status;
  flesh_locator_find(locator, p, -1, &place);
  if (!(place.distance == 0)) {
    attach_surface(mesh, p, self, nearest);
    flesh_locator_find(locator, nearest, -1, &place);
  }
  if (place.tet >= 0) {
    self->count = flesh_mesh_tet_nodes(mesh, place.tet, self->nodes);
    flesh_tet10_weights(place.weights, self->weights);
  }
  flesh_locator_destroy(&locator);
  return FLESH_OK;
}

/* Attaches to the tet that holds p, or where p lies outside the body to the nearest point of its
 * surface. */
static int attach(const flesh_mesh *mesh, const double p[3], drag *self)
{
  double nearest[3];
  int status = FLESH_OK;
  if (flesh_mesh_order(mesh) == 2) status = attach_quadratic(mesh, p, self);
  else attach_inside(mesh, p, self);
  if (!status && !self->count) attach_surface(mesh, p, self, nearest);
  for (int i = 1; i < self->count; i++)
    for (int j = i; j > 0 && self->nodes[j] < self->nodes[j - 1]; j--) {
      int node = self->nodes[j];
      double weight = self->weights[j];
      self->nodes[j] = self->nodes[j - 1], self->weights[j] = self->weights[j - 1];
      self->nodes[j - 1] = node, self->weights[j - 1] = weight;
    }
  return status;
}

int flesh_effect_spring(const flesh_body *body, const double point[3], double stiffness,
                      const flesh_motion *target, double from, double until, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {point, "point"});
  if (!(stiffness > 0 && stiffness <= DBL_MAX))
    return flesh_fail(FLESH_ERR_ARGUMENT, "stiffness is %g N/m; it must be positive", stiffness);
  if (!(until > from))
    return flesh_fail(FLESH_ERR_ARGUMENT, "until is %g s; it must be after from, %g s", until,
                      from);
  if (!(fabs(point[0]) + fabs(point[1]) + fabs(point[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "point is (%g, %g, %g); it must be finite", point[0],
                      point[1], point[2]);
  drag *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a drag effect");
  int status = flesh_motion_copy(target, &self->target);
  if (status) {
    flesh_free(self);
    return status;
  }
  status = attach(body->mesh, point, self);
  if (status) {
    drag_destroy(self);
    return status;
  }
  self->cells = (flesh_cells){.count = 1, .nodes_per_cell = self->count, .nodes = self->nodes};
  self->stiffness = stiffness;
  self->from = from;
  self->until = until;
  return flesh_effect_create(&drag_operations, self, effect);
}
