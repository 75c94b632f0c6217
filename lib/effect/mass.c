/* mass.c: the lumped and the consistent mass of linear tets. */
#include "effect/mass.h"

#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"
#include "effect/effect.h"

int flesh_mass_matrix_create(const flesh_body *body, flesh_mass_matrix *mass)
{
  int nodes = flesh_mesh_node_count(body->mesh), tets = flesh_mesh_tet_count(body->mesh);
  *mass = (flesh_mass_matrix){.nodes = nodes};
  int status = flesh_body_check_density(body);
  if (status) return status;
  if (body->mass == FLESH_MASS_LUMPED) {
    mass->lumped = calloc((size_t)nodes, sizeof *mass->lumped);
    if (mass->lumped) flesh_mesh_lumped_mass(body->mesh, body->density, mass->lumped);
  } else {
    mass->cell_mass = malloc((size_t)tets * sizeof *mass->cell_mass);
    if (mass->cell_mass) {
      const double *volumes = flesh_mesh_tet_volumes(body->mesh);
      for (int e = 0; e < tets; e++) mass->cell_mass[e] = body->density[e] * volumes[e] / 20;
      status = flesh_cells_of_tets(body->mesh, &mass->cells);
    }
  }
  if (!status && !mass->lumped && !mass->cell_mass)
    status = flesh_fail(FLESH_ERR_MEMORY, "no memory for the masses of %d nodes", nodes);
  if (status) flesh_mass_matrix_clear(mass);
  return status;
}

void flesh_mass_matrix_clear(flesh_mass_matrix *mass)
{
  free(mass->lumped);
  free(mass->cell_mass);
  flesh_cells_clear(&mass->cells);
  *mass = (flesh_mass_matrix){0};
}

void flesh_mass_matrix_times(const flesh_mass_matrix *self, double scale, const double *x, double *y)
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

double flesh_mass_matrix_half_square(const flesh_mass_matrix *self, const double *x)
{
  double total = 0;
  if (self->lumped) {
    for (int i = 0; i < self->nodes; i++) {
      const double *at = x + 3 * (size_t)i;
      total += self->lumped[i] * (at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
    }
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

/* Lumped masses onto the diagonal, a part of the nodes by each task. */
typedef struct addition {
  const flesh_mass_matrix *mass;
  double scale;
  const flesh_block_matrix *K;
} addition;

enum { PARTS = 64 };

static void add_part(void *data, int task)
{
  const addition *a = data;
  int nodes = a->mass->nodes;
  int from = (int)((int64_t)nodes * task / PARTS);
  int until = (int)((int64_t)nodes * (task + 1) / PARTS);
  for (int i = from; i < until; i++) {
    double *block = a->K->values + 9 * (size_t)a->K->row_start[i];
    for (int c = 0; c < 3; c++) block[4 * c] += a->scale * a->mass->lumped[i];
  }
}

void flesh_mass_matrix_add(const flesh_mass_matrix *self, double scale, flesh_threads *threads,
                           flesh_block_matrix *K, const int *slots)
{
  if (self->lumped) {
    addition a = {self, scale, K};
    flesh_threads_run(threads, PARTS, add_part, &a);
    return;
  }
  for (int e = 0; e < self->cells.count; e++) {
    double m = scale * self->cell_mass[e];
    const int *slot = slots + 10 * (size_t)e;
    for (int a = 0; a < 4; a++)
      for (int b = a; b < 4; b++, slot++) {
        double *block = K->values + 9 * (size_t)*slot;
        for (int c = 0; c < 3; c++) block[4 * c] += a == b ? 2 * m : m;
      }
  }
}

size_t flesh_mass_matrix_memory(const flesh_mass_matrix *self)
{
  if (self->lumped) return (size_t)self->nodes * sizeof *self->lumped;
  return (size_t)self->cells.count * (sizeof *self->cell_mass + 4 * sizeof(int));
}
