/* incompressible.h: bodies of ten-node tets at Poisson's ratio 1/2, for tests. */
#ifndef FLESH_TEST_INCOMPRESSIBLE_H
#define FLESH_TEST_INCOMPRESSIBLE_H

#include "body.h"
#include "system/system.h"
#include "test.h"

/* Makes a body with elasticity, and with inertia if asked for. Takes the mesh; one of order 1 gets nodes on its
 * edges. */
static inline void make(flesh_mesh *mesh, flesh_material material, int inertia, test_body *b)
{
  flesh_mesh *raised = NULL;
  if (flesh_mesh_order(mesh) == 1) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, material, 1000, inertia ? FLESH_MASS_LUMPED : FLESH_MASS_CONSISTENT, inertia, b));
  b->state.multiplier_count = flesh_mesh_tet_count(mesh);
  b->state.multipliers = calloc((size_t)b->state.multiplier_count, sizeof *b->state.multipliers);
}

static inline void destroy(test_body *b)
{
  free(b->state.multipliers);
  test_body_destroy(b);
}

static inline flesh_integrator *integrator_of(const test_body *b, flesh_method method, double tolerance, int threads)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(tolerance);
  options.threads = threads;
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  return integrator;
}

/* Returns the largest |mean of J - 1| of any tet. */
static inline double largest_gap(const test_body *b)
{
  const int count = flesh_system_multiplier_count(b->system);
  double *gaps = malloc((size_t)count * sizeof *gaps), largest = 0;
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  CHECK(count == flesh_mesh_tet_count(b->mesh));
  CHECK_OK(flesh_system_constraint_gaps(b->system, &point, gaps, NULL));
  for (int k = 0; k < count; k++) largest = fmax(largest, fabs(gaps[k]));
  free(gaps);
  return largest;
}

/* Makes a free block that is thrown, spins and is sheared: v = v0 + A (X - centre) with tr A = 0, so that its volume
 * does not change initially. */
static inline void throw_block(test_body *b)
{
  static const double A[9] = {0.6, -3, 0.5, 3, -0.4, 1, -0.5, 0.7, -0.2};
  make(test_box(4, 2, 2, 1, 0.5, 0.5), test_material(FLESH_ENERGY_S, 0.5), 1, b);
  CHECK_OK(flesh_system_finalize(b->system));
  const double *X = flesh_mesh_positions(b->mesh);
  for (int d = 0; d < b->n; d++) {
    b->state.v[d] = d % 3 - 1;
    for (int j = 0; j < 3; j++) b->state.v[d] += A[3 * (d % 3) + j] * (X[d - d % 3 + j] - (j ? 0.25 : 0.5));
  }
}

#endif
