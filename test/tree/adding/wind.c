/* wind.c: the pressure of moving air on surface triangles. A triangle of area A and outward normal n that goes at v,
 * the mean of its nodes, meets the air that goes at w with s = (v - w).n, and with the force 1/2 density coefficient A
 * |s| s against n, a third to each node. A and n are lagged; then the force has the potential 1/6 density coefficient
 * A |s|^3 / shift.v in v, and r . x / shift.x where velocities do not move. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/amplitude.h"
#include "effect/wind.h"
#include "math/mat3.h"

typedef struct wind {
  int *triangles;    /* [3*cells.count] wound outwards */
  flesh_cells cells; /* the triangles, nodes ascending */
  double velocity[3], factor; /* m/s; density times coefficient over 2, kg/m^3 */
  flesh_amplitude_copy amplitude;
} wind;

/* A triangle at a point: lagged area and normal, and the speed s. */
typedef struct panel {
  const int *node;
  double area, normal[3], speed;
} panel;

static const flesh_cells *wind_cells(const flesh_effect *effect)
{
  const wind *self = effect->data;
  return &self->cells;
}

static void panel_at(const wind *self, const flesh_point *point, double amplitude, int k, panel *p)
{
  double e[2][3];
  p->node = self->triangles + 3 * (size_t)k;
  for (int a = 0; a < 2; a++)
    for (int c = 0; c < 3; c++)
      e[a][c] = point->lagged.x[3 * p->node[a + 1] + c] - point->lagged.x[3 * p->node[0] + c];
  flesh_vec3_cross(e[0], e[1], p->normal);
  double twice = sqrt(flesh_vec3_dot(p->normal, p->normal));
  p->area = twice / 2;
  p->speed = 0;
  for (int c = 0; c < 3; c++) {
    double v = 0;
    p->normal[c] = twice > 0 ? p->normal[c] / twice : 0;
    for (int a = 0; a < 3; a++) v += point->v[3 * p->node[a] + c] / 3;
    p->speed += (v - amplitude * self->velocity[c]) * p->normal[c];
  }
}

static int wind_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const wind *self = effect->data;
  double amplitude = flesh_amplitude_at(&self->amplitude, point->t);
  for (int k = 0; k < self->cells.count; k++) {
    panel p;
    panel_at(self, point, amplitude, k, &p);
    double f = point->load * self->factor * p.area * fabs(p.speed) * p.speed / 3;
    for (int a = 0; a < 3; a++)
      for (int c = 0; c < 3; c++) r[3 * p.node[a] + c] += f * p.normal[c];
  }
  return FLESH_OK;
}

/* dr_a/dv_b = 2 factor A |s| n n^T / 9 for all pairs of its nodes: positive semidefinite as it is. */
static int wind_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const wind *self = effect->data;
  if (shift->v == 0) return FLESH_OK;
  double amplitude = flesh_amplitude_at(&self->amplitude, point->t);
  for (int k = 0; k < self->cells.count; k++) {
    panel p;
    panel_at(self, point, amplitude, k, &p);
    double f = shift->v * point->load * self->factor * p.area * fabs(p.speed) * 2 / 9;
    for (int pair = 0; pair < 6; pair++, slots++)
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) K->values[9 * (size_t)*slots + 3 * i + j] += f * p.normal[i] * p.normal[j];
  }
  return FLESH_OK;
}

static int wind_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const wind *self = effect->data;
  if (shift->v == 0 && shift->x == 0) return FLESH_OK;
  double amplitude = flesh_amplitude_at(&self->amplitude, point->t), value = 0, size = 0;
  for (int k = 0; k < self->cells.count; k++) {
    panel p;
    panel_at(self, point, amplitude, k, &p);
    double s = fabs(p.speed), f = point->load * self->factor * p.area;
    if (shift->v != 0) {
      value += f * s * s * s / 3 / shift->v;
      size += f * s * s * s / 3 / shift->v;
      continue;
    }
    for (int a = 0; a < 3; a++)
      for (int c = 0; c < 3; c++) {
        double term = f * s * p.speed / 3 * p.normal[c] *
                      (point->x[3 * p.node[a] + c] - point->lagged.x[3 * p.node[a] + c]) / shift->x;
        value += term;
        size += fabs(term);
      }
  }
  *phi += value;
  *magnitude += size;
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
  return sizeof *self + (size_t)self->cells.count * 6 * sizeof *self->triangles +
         flesh_amplitude_memory(&self->amplitude);
}

static void wind_destroy(void *data)
{
  wind *self = data;
  if (!self) return;
  flesh_cells_clear(&self->cells);
  free(self->triangles);
  flesh_amplitude_clear(&self->amplitude);
  free(self);
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

static int take_triangles(wind *self, const flesh_mesh *mesh, int count, const int *triangles)
{
  int total = flesh_mesh_node_count(mesh), *cells = malloc((size_t)count * 3 * sizeof *cells);
  self->triangles = malloc((size_t)count * 3 * sizeof *self->triangles);
  self->cells = (flesh_cells){.count = count, .nodes_per_cell = 3, .nodes = cells};
  if (!cells || !self->triangles) return flesh_fail(FLESH_ERR_MEMORY, "no memory for %d triangles", count);
  memcpy(self->triangles, triangles, (size_t)count * 3 * sizeof *triangles);
  for (int k = 0; k < count; k++) {
    const int *n = triangles + 3 * (size_t)k;
    for (int a = 0; a < 3; a++) {
      if (n[a] < 0 || n[a] >= total)
        return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d; the mesh has the nodes 0 to %d", k, n[a],
                          total - 1);
      if (n[a] == n[(a + 1) % 3])
        return flesh_fail(FLESH_ERR_ARGUMENT, "triangle %d has node %d twice", k, n[a]);
      int rank = (n[a] > n[(a + 1) % 3]) + (n[a] > n[(a + 2) % 3]);
      cells[3 * k + rank] = n[a];
    }
  }
  return FLESH_OK;
}

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
  if (count < 1) return flesh_fail(FLESH_ERR_ARGUMENT, "a wind needs a triangle that it acts on");
  wind *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for a wind");
  for (int c = 0; c < 3; c++) self->velocity[c] = velocity[c];
  self->factor = density * coefficient / 2;
  int status = take_triangles(self, body->mesh, count, triangles);
  if (!status) status = flesh_amplitude_take(amplitude, &self->amplitude);
  if (status) {
    wind_destroy(self);
    return status;
  }
  return flesh_effect_create(&wind_operations, body->mesh, self, effect);
}
