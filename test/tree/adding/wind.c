/* wind.c: the pressure of moving air on surface triangles. A point of the surface with the outward normal n that moves
 * at v in air that moves at w has the relative speed s = (v - w).n and, per area, the force 1/2 density coefficient |s|
 * s against n. Area and n are lagged; then the force has the potential 1/6 density coefficient |s|^3 / shift.v in v,
 * and r . x / shift.x if velocities do not change. */
#include "effect/wind.h"

#include <math.h>

#include "base/error.h"
#include "base/memory.h"
#include "effect/amplitude.h"
#include "effect/face_points.h"

typedef struct wind {
  flesh_faces faces;
  double velocity[3], factor; /* m/s; density times coefficient over 2, kg/m^3 */
  flesh_amplitude_copy amplitude;
} wind;

static const flesh_cells *wind_cells(const flesh_effect *effect)
{
  const wind *self = effect->data;
  return &self->faces.cells;
}

/* Computes the speed of a point of a face against the air, its normal, and the factor times its area. */
static double speed_at(const wind *self, const flesh_point *point, int face, const flesh_face_point *q, double normal[3],
                       double *factor)
{
  const double amplitude = flesh_amplitude_at(&self->amplitude, point->t);
  double w[3], speed;
  for (int c = 0; c < 3; c++) w[c] = amplitude * self->velocity[c];
  *factor = point->load * self->factor * q->weight * flesh_face_flow(&self->faces, face, q, point, w, normal, &speed);
  return speed;
}

static int wind_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const wind *self = effect->data;
  const flesh_face_point *q;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s = speed_at(self, point, k, q, n, &factor);
      flesh_face_add_force(&self->faces, k, q, factor * fabs(s) * s, n, r);
    }
  return FLESH_OK;
}

/* Adds dr_a/dv_b = 2 factor |s| N_a N_b n n^T, which is positive semidefinite. */
static int wind_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const wind *self = effect->data;
  const flesh_face_point *q;
  if (shift->v == 0) return FLESH_OK;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s = speed_at(self, point, k, q, n, &factor);
      flesh_face_add_stiffness(&self->faces, k, q, 2 * shift->v * factor * fabs(s), n, K, slots);
    }
  return FLESH_OK;
}

static int wind_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const wind *self = effect->data;
  const flesh_face_point *q;
  if (shift->v == 0 && shift->x == 0) return FLESH_OK;
  for (int k = 0; k < self->faces.count; k++)
    for (int points = flesh_face_points(&self->faces, k, &q); points > 0; points--, q++) {
      double n[3], factor, s = speed_at(self, point, k, q, n, &factor);
      const double term = shift->v != 0 ? factor * fabs(s) * s * s / 3 / shift->v
                                        : flesh_face_work(&self->faces, k, q, factor * fabs(s) * s, n, point) / shift->x;
      *phi += term;
      *magnitude += fabs(term);
    }
  return FLESH_OK;
}

static double wind_next_event(const flesh_effect *effect, double t)
{
  const wind *self = effect->data;
  return flesh_amplitude_next_event(&self->amplitude, t);
}

static size_t wind_memory(const flesh_effect *effect)
{
  const wind *self = effect->data;
  return sizeof *self + flesh_faces_memory(&self->faces) + flesh_amplitude_memory(&self->amplitude);
}

static void wind_destroy(void *data)
{
  wind *self = data;
  if (!self) return;
  flesh_faces_clear(&self->faces);
  flesh_amplitude_clear(&self->amplitude);
  flesh_free(self);
}

static const flesh_effect_operations wind_operations = {
    .name = "wind",
    .role = FLESH_ROLE_LOAD,
    .traits = FLESH_IS_FOLLOWER_LOAD,
    .cells = wind_cells,
    .residual = wind_residual,
    .jacobian = wind_jacobian,
    .potential = wind_potential,
    .destroy = wind_destroy,
    .time = &(const flesh_effect_time){.next_event = wind_next_event},
    .figures = &(const flesh_effect_figures){.memory = wind_memory},
};

int flesh_effect_wind(const flesh_body *body, int count, const int *triangles, const double velocity[3],
                      double density, double coefficient, const flesh_amplitude *amplitude, flesh_effect **effect)
{
  FLESH_NEED({effect, "effect"});
  *effect = NULL;
  FLESH_NEED({body, "body"}, {triangles, "triangles"}, {velocity, "velocity"});
  if (!(fabs(velocity[0]) + fabs(velocity[1]) + fabs(velocity[2]) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "velocity is (%g, %g, %g) m/s; it must be finite", velocity[0], velocity[1],
                      velocity[2]);
  if (!(density > 0 && density < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "density is %g kg/m^3; it must be positive", density);
  if (!(coefficient > 0 && coefficient < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT, "coefficient is %g; it must be positive", coefficient);
  if (count < 1) return flesh_fail(FLESH_ERR_ARGUMENT, "a wind acts on nothing; it must be given at least one triangle");
  wind *self = flesh_calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a wind");
  for (int c = 0; c < 3; c++) self->velocity[c] = velocity[c];
  self->factor = density * coefficient / 2;
  int status = flesh_faces_create(body->mesh, count, triangles, &self->faces);
  if (!status) status = flesh_amplitude_take(amplitude, &self->amplitude);
  if (status) {
    wind_destroy(self);
    return status;
  }
  return flesh_effect_create(&wind_operations, body->mesh, self, effect);
}
