/* inertia.c: r = M a with the lumped or the consistent mass of linear tets. */
#include <math.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"

typedef struct inertia {
  int nodes;
  double *lumped;   /* [nodes] kg; NULL: consistent */
  flesh_cells cells; /* consistent only */
  double *cell_mass; /* [cells] rho V/20, consistent only */
} inertia;

static const flesh_cells *inertia_cells(const flesh_effect *effect)
{
  const inertia *self = effect->data;
  return self->lumped ? NULL : &self->cells;
}

/* y += scale M x. */
static void mass_times(const inertia *self, double scale, const double *x, double *y)
{
  if (self->lumped) {
    for (int i = 0; i < self->nodes; i++)
      for (int c = 0; c < 3; c++) y[3 * i + c] += scale * self->lumped[i] * x[3 * i + c];
    return;
  }
  for (int e = 0; e < self->cells.count; e++) {
    const int *node = self->cells.nodes + 4 * e;
    double m = scale * self->cell_mass[e];
    for (int c = 0; c < 3; c++) {
      double sum = 0;
      for (int a = 0; a < 4; a++) sum += x[3 * node[a] + c];
      for (int a = 0; a < 4; a++) y[3 * node[a] + c] += m * (sum + x[3 * node[a] + c]);
    }
  }
}

/* x.M x / 2. */
static double half_square(const inertia *self, const double *x)
{
  double total = 0;
  if (self->lumped) {
    for (int i = 0; i < self->nodes; i++)
      for (int c = 0; c < 3; c++) total += self->lumped[i] * x[3 * i + c] * x[3 * i + c];
    return total / 2;
  }
  for (int e = 0; e < self->cells.count; e++) {
    const int *node = self->cells.nodes + 4 * e;
    for (int c = 0; c < 3; c++) {
      double sum = 0, squares = 0;
      for (int a = 0; a < 4; a++) {
        double value = x[3 * node[a] + c];
        sum += value;
        squares += value * value;
      }
      total += self->cell_mass[e] * (sum * sum + squares);
    }
  }
  return total / 2;
}

static int inertia_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  mass_times(effect->data, 1, point->a, r);
  return FLESH_OK;
}

static int inertia_jacobian(const flesh_effect *effect, const flesh_point *point,
                            const flesh_shift *shift, flesh_block_matrix *K, const int *slots)
{
  (void)point;
  const inertia *self = effect->data;
  if (shift->a == 0) return FLESH_OK;
  if (self->lumped) {
    for (int i = 0; i < self->nodes; i++) {
      double *block = K->values + 9 * (size_t)K->row_start[i];
      for (int c = 0; c < 3; c++) block[4 * c] += shift->a * self->lumped[i];
    }
    return FLESH_OK;
  }
  for (int e = 0; e < self->cells.count; e++) {
    double m = shift->a * self->cell_mass[e];
    const int *slot = slots + 10 * (size_t)e;
    for (int a = 0; a < 4; a++)
      for (int b = a; b < 4; b++, slot++) {
        double *block = K->values + 9 * (size_t)*slot;
        for (int c = 0; c < 3; c++) block[4 * c] += a == b ? 2 * m : m;
      }
  }
  return FLESH_OK;
}

static int inertia_potential(const flesh_effect *effect, const flesh_point *point,
                             const flesh_shift *shift, double *phi, double *magnitude)
{
  if (shift->a == 0) return FLESH_OK;
  double value = half_square(effect->data, point->a) / shift->a;
  *phi += value;
  *magnitude += value;
  return FLESH_OK;
}

static int inertia_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  *energy = half_square(effect->data, point->v);
  return FLESH_OK;
}

static void inertia_destroy(void *data)
{
  inertia *self = data;
  if (!self) return;
  free(self->lumped);
  free(self->cell_mass);
  flesh_cells_clear(&self->cells);
  free(self);
}

static const flesh_effect_operations inertia_operations = {
    .name = "inertia",
    .cells = inertia_cells,
    .residual = inertia_residual,
    .jacobian = inertia_jacobian,
    .potential = inertia_potential,
    .energy = inertia_energy,
    .destroy = inertia_destroy,
};

int flesh_effect_inertia(const flesh_body *body, flesh_effect **effect)
{
  int nodes = flesh_mesh_node_count(body->mesh), tets = flesh_mesh_tet_count(body->mesh);
  int status = flesh_body_check_density(body);
  if (status) return status;
  inertia *self = calloc(1, sizeof *self);
  if (!self) return flesh_fail(FLESH_ERR_MEMORY, "no memory for the inertia effect");
  self->nodes = nodes;
  if (body->mass == FLESH_MASS_LUMPED) {
    self->lumped = calloc((size_t)nodes, sizeof *self->lumped);
    if (self->lumped) flesh_mesh_lumped_mass(body->mesh, body->density, self->lumped);
  } else {
    self->cell_mass = malloc((size_t)tets * sizeof *self->cell_mass);
    if (self->cell_mass) {
      const double *volumes = flesh_mesh_tet_volumes(body->mesh);
      for (int e = 0; e < tets; e++) self->cell_mass[e] = body->density[e] * volumes[e] / 20;
      status = flesh_cells_of_tets(body->mesh, &self->cells);
      if (status) {
        inertia_destroy(self);
        return status;
      }
    }
  }
  if (!self->lumped && !self->cell_mass) {
    inertia_destroy(self);
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the masses of %d nodes", nodes);
  }
  return flesh_effect_create(&inertia_operations, self, effect);
}
