/* body.h: bodies and systems for tests, made in one call and freed in one. */
#ifndef FLESH_TEST_BODY_H
#define FLESH_TEST_BODY_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "flesh/flesh.h"
#include "system/position_potential.h"

typedef struct test_body {
  flesh_mesh *mesh;
  int n; /* unknowns */
  double *density;
  flesh_material material;
  flesh_body body;
  flesh_system *system;
  flesh_state state;
} test_body;

/* Returns the default options, except for the tolerance of Newton's iteration. */
static inline flesh_solver_options test_options(double tolerance)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = tolerance;
  return options;
}

/* Returns a material with Young's modulus 1e5 Pa; D has E's constants. Stops the program if it cannot be made. */
static inline flesh_material test_material(flesh_energy energy, double poisson)
{
  flesh_material material;
  flesh_constants constants = energy == FLESH_ENERGY_D ? FLESH_CONSTANTS_AS_E : FLESH_CONSTANTS_MATCHED;
  if (flesh_material_from_young(energy, constants, 1e5, poisson, &material)) abort();
  return material;
}

/* Computes residual and potential in one pass. */
static inline int test_evaluate(const flesh_system *system, const flesh_point *point, const flesh_shift *shift, double *r,
                                double *phi, double *magnitude)
{
  flesh_position_potential by_position = {0};
  return flesh_system_evaluate_by_position(system, point, shift, &by_position, r, phi, magnitude);
}

/* Makes a body with inertia and elasticity; takes the mesh, copies the material. The caller adds the rest and finishes
 * it. */
static inline int test_body_create(flesh_mesh *mesh, flesh_material material, double density,
                                   flesh_mass mass, int inertia, test_body *b)
{
  memset(b, 0, sizeof *b);
  int tets = flesh_mesh_tet_count(mesh);
  b->mesh = mesh;
  b->n = 3 * flesh_mesh_node_count(mesh);
  b->material = material;
  b->density = malloc((size_t)tets * sizeof *b->density);
  for (int e = 0; e < tets; e++) b->density[e] = density;
  b->body = (flesh_body){.mesh = b->mesh, .density = b->density, .materials = &b->material, .mass = mass};
  b->state.x = malloc((size_t)b->n * sizeof *b->state.x);
  b->state.v = calloc((size_t)b->n, sizeof *b->state.v);
  memcpy(b->state.x, flesh_mesh_positions(mesh), (size_t)b->n * sizeof *b->state.x);
  flesh_effect *effect = NULL;
  int status = flesh_system_create(mesh, &b->system);
  if (!status && inertia) {
    status = flesh_effect_inertia(&b->body, &effect);
    if (!status) status = flesh_system_add_effect(b->system, &effect);
  }
  if (!status) status = flesh_effect_elasticity(&b->body, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  return status;
}

static inline int test_body_gravity(test_body *b, double gx, double gy, double gz)
{
  flesh_effect *effect = NULL;
  int status = flesh_effect_gravity(&b->body, (double[]){gx, gy, gz}, &effect);
  return status ? status : flesh_system_add_effect(b->system, &effect);
}

/* Pins the nodes with X <= x. */
static inline int test_body_clamp(test_body *b, double x)
{
  int *nodes = malloc((size_t)b->n * sizeof *nodes), count = 0;
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] <= x) nodes[count++] = i;
  int status = flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY);
  free(nodes);
  return status;
}

/* Makes a grid of boxes from the origin; stops the program if that fails. */
static inline flesh_mesh *test_box(int nx, int ny, int nz, double lx, double ly, double lz)
{
  flesh_mesh *mesh = NULL;
  if (flesh_mesh_box((int[]){nx, ny, nz}, (double[]){lx, ly, lz}, (double[]){0, 0, 0}, &mesh)) abort();
  return mesh;
}

/* Moves every coordinate of x by up to +-amplitude. */
static inline void test_jitter(int n, double amplitude, unsigned long long seed, double *x)
{
  for (int d = 0; d < n; d++) {
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    x[d] += amplitude * ((double)(seed >> 11) * 0x1p-52 - 1);
  }
}

/* Constrains `axes` of the nodes whose rest coordinate `c` is `at`: pins them, or makes them follow the motion. */
static inline int test_body_hold(test_body *b, int c, double at, unsigned axes, const flesh_motion *motion,
                                 double from, double until)
{
  int *nodes = malloc((size_t)b->n * sizeof *nodes), count = 0;
  for (int i = 0; i < b->n / 3; i++)
    if (fabs(flesh_mesh_positions(b->mesh)[3 * i + c] - at) < 1e-9) nodes[count++] = i;
  int status = motion ? flesh_system_add_prescribed_motion(b->system, count, nodes, axes, motion, from, until)
                      : flesh_system_add_pin(b->system, count, nodes, axes, from, until);
  free(nodes);
  return status;
}

/* Computes y = M x with the body's mass. */
static inline void test_body_mass_times(const test_body *b, const double *x, double *y)
{
  if (b->body.mass == FLESH_MASS_CONSISTENT) {
    flesh_mesh_consistent_mass_times(b->mesh, b->density, x, y);
    return;
  }
  double *mass = malloc((size_t)b->n * sizeof *mass);
  flesh_mesh_lumped_mass(b->mesh, b->density, mass);
  for (int d = 0; d < b->n; d++) y[d] = mass[d / 3] * x[d];
  free(mass);
}

/* Adds up forces at the nodes, or momenta: three sums and three moments about the origin. Returns the sum of the
 * absolute values of all forces. */
static inline double test_sums(const test_body *b, const double *force, double sums[6])
{
  double size = 0;
  memset(sums, 0, 6 * sizeof *sums);
  for (int i = 0; i < b->n; i += 3)
    for (int c = 0; c < 3; c++) {
      const double *x = b->state.x + i, *f = force + i;
      sums[c] += f[c];
      sums[3 + c] += x[(c + 1) % 3] * f[(c + 2) % 3] - x[(c + 2) % 3] * f[(c + 1) % 3];
      size += fabs(f[c]);
    }
  return size;
}

/* Computes momentum, and angular momentum about the origin. Returns the sum of all nodes' absolute momenta. */
static inline double test_momenta(const test_body *b, double sums[6])
{
  double *p = malloc((size_t)b->n * sizeof *p);
  test_body_mass_times(b, b->state.v, p);
  const double size = test_sums(b, p, sums);
  free(p);
  return size;
}

/* Returns the block matrix as a full one, H[row*n+column], to be freed by the caller. */
static inline double *test_dense(const flesh_block_matrix *K)
{
  int n = 3 * K->rows;
  double *H = calloc((size_t)n * n, sizeof *H);
  for (int i = 0; i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int p = 0; p < 9; p++) {
        int row = 3 * i + p / 3, column = 3 * K->column[k] + p % 3;
        H[row * n + column] = K->values[9 * k + p];
        if (K->column[k] != i) H[column * n + row] = K->values[9 * k + p];
      }
  return H;
}

static inline double test_norm(int n, const double *x)
{
  double sum = 0;
  for (int d = 0; d < n; d++) sum += x[d] * x[d];
  return sqrt(sum);
}

static inline double test_distance(int n, const double *x, const double *y)
{
  double worst = 0;
  for (int d = 0; d < n; d++) worst = fabs(x[d] - y[d]) > worst ? fabs(x[d] - y[d]) : worst;
  return worst;
}

static inline int test_all_finite(int n, const double *x)
{
  for (int d = 0; d < n; d++)
    if (!isfinite(x[d])) return 0;
  return 1;
}

static inline void test_body_destroy(test_body *b)
{
  flesh_system_destroy(&b->system);
  free(b->density);
  free(b->state.x);
  free(b->state.v);
  flesh_mesh_destroy(&b->mesh);
}

#endif
