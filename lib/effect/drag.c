/* drag.c: the resistance of air or water, face by face.
 *
 * A part of the surface with area A and outward normal n moves at v through a fluid that moves at w; the normal
 * component of its relative velocity is s = (v - w).n. If s > 0 the fluid exerts the pressure density/2 coefficient s^2
 * (Newton's law of resistance, Principia II, 34); if s <= 0, on the lee side, nothing acts. A plate normal to the
 * stream has the drag coefficient `coefficient`, a sphere half of that.
 *
 * A and n are lagged. Then r = density coefficient/2 A s^2 n has the convex potential density coefficient/6 A s^3 /
 * shift.v, and r.(x - x_lag)/shift.x if the unknown does not change velocities. */
#include <math.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/effect.h"
#include "effect/face_points.h"
#include "element/body.h"
#include "mesh/mesh.h"

typedef struct drag {
  flesh_faces faces;
  double factor, velocity[3]; /* density coefficient/2, kg/m^3; velocity of the fluid, m/s */
} drag;

static const flesh_cells *drag_cells(const flesh_effect *effect)
{
  const drag *self = effect->data;
  return &self->faces.cells;
}

/* Computes the flow at a point of a face: `factor` times its area, its unit normal, and its speed against the fluid.
 * Returns 0 on the lee side. */
static int stream_at(const drag *self, const flesh_point *point, int face, const flesh_face_point *q, double normal[3],
                     double *factor, double *speed)
{
  const double area = flesh_face_flow(&self->faces, face, q, point, self->velocity, normal, speed);
  *factor = point->load * self->factor * q->weight * area;
  return *speed > 0;
}

static int drag_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const drag *self = effect->data;
  const flesh_face_point *q;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s;
      if (stream_at(self, point, k, q, n, &factor, &s)) flesh_face_add_force(&self->faces, k, q, factor * s * s, n, r);
    }
  return FLESH_OK;
}

/* Adds dr_a/dv_b = 2 factor s N_a N_b n n^T, which is positive semi-definite. */
static int drag_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const drag *self = effect->data;
  const flesh_face_point *q;
  if (shift->v == 0) return FLESH_OK;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s;
      if (stream_at(self, point, k, q, n, &factor, &s))
        flesh_face_add_stiffness(&self->faces, k, q, 2 * shift->v * factor * s, n, K, slots);
    }
  return FLESH_OK;
}

static int drag_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const drag *self = effect->data;
  const flesh_face_point *q;
  double value = 0, size = 0;
  if (shift->v == 0 && shift->x == 0) return FLESH_OK;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s;
      if (!stream_at(self, point, k, q, n, &factor, &s)) continue;
      const double term = shift->v != 0 ? factor * s * s * s / 3 / shift->v
                                        : flesh_face_work(&self->faces, k, q, factor * s * s, n, point) / shift->x;
      value += term;
      size += fabs(term);
    }
  *phi += value;
  *magnitude += size;
  return FLESH_OK;
}

static size_t drag_memory(const flesh_effect *effect)
{
  const drag *self = effect->data;
  return sizeof *self + flesh_faces_memory(&self->faces);
}

static void drag_destroy(void *data)
{
  drag *self = data;
  if (self) flesh_faces_clear(&self->faces);
  flesh_free(self);
}

static int drag_restrict(const flesh_effect *whole, const flesh_rank_part *part, const flesh_body *body,
                         flesh_effect **restricted)
{
  const drag *from = whole->data;
  drag *self = flesh_malloc(sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a drag");
  *self = *from;
  const int status = flesh_faces_restrict(&from->faces, part, body->mesh, &self->faces);
  return flesh_effect_create_after(status, whole->operations, body->mesh, self, restricted);
}

static const flesh_effect_operations drag_operations = {
    .name = "drag",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_FOLLOWER_LOAD,
    .cells = drag_cells,
    .residual = drag_residual,
    .jacobian = drag_jacobian,
    .potential = drag_potential,
    .destroy = drag_destroy,
    .figures = &(const flesh_effect_figures){.memory = drag_memory},
    .library = &(const flesh_effect_private){.ranks = &(const flesh_effect_ranks){.restrict_to_part = drag_restrict}},
};

int flesh_effect_drag(const flesh_body *body, int count, const int *triangles, double density,
                      const double velocity[3], double coefficient, flesh_effect **effect)
{
  FLESH_NEED_BODY({body, "body"}, {triangles, "triangles"}, {velocity, "velocity"});
  if (!(density > 0 && density < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "density is %g kg/m^3; it must be positive", density);
  if (!(coefficient > 0 && coefficient < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "coefficient is %g; it must be positive", coefficient);
  if (!(fabs(velocity[0]) + fabs(velocity[1]) + fabs(velocity[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "velocity is (%g, %g, %g) m/s; it must be finite", velocity[0], velocity[1],
                      velocity[2]);
  if (count < 1 && !body->mesh->split) return flesh_fail(FLESH_ERR_ARGUMENT, "a drag acts on nothing; it must be given at "
                                                                             "least one triangle");
  drag *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a drag");
  self->factor = density * coefficient / 2;
  for (int c = 0; c < 3; c++) self->velocity[c] = velocity[c];
  const int status = flesh_faces_create(body->mesh, count, triangles, &self->faces);
  return flesh_effect_create_after(status, &drag_operations, body->mesh, self, effect);
}
