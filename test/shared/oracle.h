/* oracle.h: results of independent codes (reference/oracle/README.md) for a body on one rank or on several. Define
 * before including it:
 *
 *   oracle_open(mesh, material, mass, inertia, b)   a body of 1000 kg/m^3 of the mesh, which it takes, to be finished
 *   oracle_finish(b), oracle_close(b)
 *   oracle_nodes(b)                 nodes of the whole body
 *   oracle_whole(b, own)            the whole's vector, borrowed until the next one
 *   oracle_take(b, whole, own)      and back
 *   oracle_dense(b, K)              the whole's matrix as a full one, new */
#ifndef FLESH_TEST_ORACLE_H
#define FLESH_TEST_ORACLE_H

#include <stdlib.h>

#include "body.h"
#include "test.h"

static const char *const oracle_folder = "reference/oracle";

/* Opens a reference file and skips to the line after the one that starts with `mark`. */
static inline FILE *oracle_open_at(const char *name, const char *mark)
{
  char path[256], line[512];
  snprintf(path, sizeof path, "%s/%s", oracle_folder, name);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  while (file && fgets(line, sizeof line, file))
    if (!strncmp(line, mark, strlen(mark))) return file;
  CHECK(!"mark found");
  if (file) fclose(file);
  return NULL;
}

/* Returns the largest distance between x and the positions (first 3 of `columns`) listed after the mark. */
static inline double oracle_distance(const char *name, const char *mark, int columns, const double *x, int nodes)
{
  FILE *file = oracle_open_at(name, mark);
  double worst = 0, row[6];
  for (int i = 0; file && i < nodes; i++) {
    for (int c = 0; c < columns; c++) CHECK(fscanf(file, "%lf", &row[c]) == 1);
    for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(row[c] - x[3 * i + c]));
  }
  if (file) fclose(file);
  return file ? worst : INFINITY;
}

static inline flesh_mesh *oracle_read_mesh(const char *name)
{
  char path[256];
  flesh_mesh *mesh = NULL;
  snprintf(path, sizeof path, "%s/%s", oracle_folder, name);
  CHECK_OK(flesh_mesh_read(path, &mesh));
  return mesh;
}

static inline void oracle_equilibrium(const char *mesh, const char *reference, flesh_energy energy)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, 34000, 306000, &material));
  oracle_open(oracle_read_mesh(mesh), material, FLESH_MASS_LUMPED, 0, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -0.5));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  oracle_finish(&b);
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-11;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  double distance = oracle_distance(reference, "nodes", 3, oracle_whole(&b, b.state.x), oracle_nodes(&b));
  printf("# %s: off by %.3g m after %d Newton, %d PCG iterations, residual %.3g of %.3g N\n", reference,
         distance, stats.newton, stats.linear, stats.residual_last, stats.residual_first);
  CHECK_BELOW(distance, 1e-9);
  flesh_integrator_destroy(&integrator);
  oracle_close(&b);
}

static inline void oracle_equilibria(void)
{
  oracle_equilibrium("bar_8x2x2.mesh", "static_8x2x2_Neo_g0.5.txt", FLESH_ENERGY_NEO);
  oracle_equilibrium("bar_8x2x2.mesh", "static_8x2x2_A_g0.5.txt", FLESH_ENERGY_A);
  oracle_equilibrium("bar_8x2x2.mesh", "static_8x2x2_B_g0.5.txt", FLESH_ENERGY_B);
  oracle_equilibrium("bar_8x2x2.mesh", "static_8x2x2_D_g0.5.txt", FLESH_ENERGY_D);
  oracle_equilibrium("bar_8x2x2.mesh", "static_8x2x2_S_g0.5.txt", FLESH_ENERGY_S);
  oracle_equilibrium("bar_16x4x4.mesh", "static_16x4x4_B_g0.5.txt", FLESH_ENERGY_B);
  oracle_equilibrium("bar_16x4x4.mesh", "static_16x4x4_S_g0.5.txt", FLESH_ENERGY_S);
}

/* Steps a clamped bar under gravity with backward Euler and a tight Newton tolerance. */
static inline int oracle_run_bar(test_body *b, double h, int steps, flesh_linear_solver linear)
{
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-10;
  options.linear_solver = linear;
  int status = flesh_integrator_create(b->system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator);
  for (int k = 0; k < steps && !status; k++) status = flesh_integrator_step(integrator, &b->state, h, NULL);
  flesh_integrator_destroy(&integrator);
  return status;
}

static inline void oracle_make_bar(const char *mesh, flesh_material material, flesh_mass mass, const double g[3],
                     test_body *b)
{
  oracle_open(oracle_read_mesh(mesh), material, mass, 1, b);
  CHECK_OK(test_body_gravity(b, g[0], g[1], g[2]));
  CHECK_OK(test_body_clamp(b, 1e-9));
  oracle_finish(b);
}

static inline void oracle_swing(const char *name, flesh_energy energy, flesh_mass mass)
{
  char reference[128];
  test_body b;
  flesh_material material;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, 34000, 306000, &material));
  oracle_make_bar("bar_8x2x2.mesh", material, mass, (double[]){0, 0, -9.81}, &b);
  for (int steps = 1; steps <= 60; steps += 59) {
    CHECK_OK(oracle_run_bar(&b, 1. / 60, steps == 1 ? 1 : 59, FLESH_LINEAR_PCG));
    snprintf(reference, sizeof reference, "dyn_8x2x2_%s_g9.81_step%d.txt", name, steps);
    double distance = oracle_distance(reference, "nodes", 3, oracle_whole(&b, b.state.x), oracle_nodes(&b));
    printf("# %s: off by %.3g m\n", reference, distance);
    CHECK_BELOW(distance, 1e-8);
  }
  oracle_close(&b);
}

static inline void oracle_backward_euler(void)
{
  oracle_swing("B_lumped", FLESH_ENERGY_B, FLESH_MASS_LUMPED);
  oracle_swing("B_consistent", FLESH_ENERGY_B, FLESH_MASS_CONSISTENT);
  oracle_swing("D_lumped", FLESH_ENERGY_D, FLESH_MASS_LUMPED);
  oracle_swing("D_consistent", FLESH_ENERGY_D, FLESH_MASS_CONSISTENT);
}

/* Compares with another code's trajectory with a stiffer material, every 0.1 s. */
static inline void oracle_trajectory(const char *reference, flesh_mass mass, double h, flesh_linear_solver linear)
{
  test_body b;
  flesh_material material;
  char mark[32];
  double worst = 0;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
  oracle_make_bar("bar_8x2x2.mesh", material, mass, (double[]){0, 0, -9.8}, &b);
  for (int k = 1; k <= 10; k++) {
    CHECK_OK(oracle_run_bar(&b, h, (int)lround(0.1 / h), linear));
    snprintf(mark, sizeof mark, "t %.2g", 0.1 * k);
    worst = fmax(worst, oracle_distance(reference, mark, 6, oracle_whole(&b, b.state.x), oracle_nodes(&b)));
  }
  printf("# %s: off by %.3g m\n", reference, worst);
  CHECK_BELOW(worst, 1e-8);
  oracle_close(&b);
}

/* Compares energy, gradient and Hessian at given positions, relative to the largest entry. */
static inline void oracle_element_quantities(const char *mesh, const char *positions, const char *reference)
{
  test_body b;
  flesh_material material;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 1e5, 4e5, &material));
  oracle_open(oracle_read_mesh(mesh), material, FLESH_MASS_LUMPED, 0, &b);
  oracle_finish(&b);
  const int n = 3 * oracle_nodes(&b);
  char path[256];
  double *x = calloc((size_t)n, sizeof *x), *own = calloc((size_t)b.n, sizeof *own);
  snprintf(path, sizeof path, "%s/%s", oracle_folder, positions);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  for (int d = 0; file && d < n; d++) CHECK(fscanf(file, "%lf", &x[d]) == 1);
  if (file) fclose(file);
  oracle_take(&b, x, b.state.x);

  flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  double energy;
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_energies(b.system, &point, &energy));
  CHECK_OK(flesh_system_residual(b.system, &point, own));
  CHECK_OK(flesh_system_matrix_create(b.system, &K));
  CHECK_OK(flesh_system_jacobian(b.system, &point, &(flesh_shift){.x = 1}, K));
  const double *r = oracle_whole(&b, own);
  double *H = oracle_dense(&b, K);

  double expected, row[6], largest = 0, worst = 0;
  file = oracle_open_at(reference, "# energy");
  CHECK(fscanf(file, " energy %lf nodes %*d", &expected) == 1);
  CHECK_NEAR(energy, expected, 1e-12 * fabs(expected));
  for (int i = 0; i < n / 3; i++) {
    for (int c = 0; c < 6; c++) CHECK(fscanf(file, "%lf", &row[c]) == 1);
    for (int c = 0; c < 3; c++) {
      largest = fmax(largest, fabs(row[3 + c]));
      worst = fmax(worst, fabs(row[3 + c] - r[3 * i + c]));
    }
  }
  printf("# %s: gradient off by %.3g of the largest entry\n", reference, worst / largest);
  CHECK_BELOW(worst, 1e-12 * largest);
  int entries, i, j, seen = 0;
  CHECK(fscanf(file, " hessian %d", &entries) == 1);
  for (largest = worst = 0; fscanf(file, "%d %d %lf", &i, &j, &expected) == 3; seen++) {
    largest = fmax(largest, fabs(expected));
    worst = fmax(worst, fabs(expected - H[i * n + j]));
    H[i * n + j] = 0;
  }
  CHECK(seen == entries);
  for (int k = 0; k < n * n; k++) worst = fmax(worst, fabs(H[k])); /* missing in the other code */
  printf("# %s: Hessian off by %.3g of the largest entry\n", reference, worst / largest);
  CHECK_BELOW(worst, 1e-12 * largest);
  fclose(file);
  free(x);
  free(own);
  free(H);
  flesh_block_matrix_destroy(&K);
  oracle_close(&b);
}

/* Compares scalars of a third code: Psi_E with matched constants, 20 lumped backward-Euler steps. */
static inline void oracle_scalars(double poisson, double h, double lowest, double norm)
{
  test_body b;
  flesh_material material;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){16, 4, 4}, (double[]){1, .25, .25}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  oracle_open(mesh, material, FLESH_MASS_LUMPED, 1, &b);
  CHECK_OK(test_body_gravity(&b, 0, -9.81, 0));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  oracle_finish(&b);
  CHECK_OK(oracle_run_bar(&b, h, 20, FLESH_LINEAR_PCG));
  double *u_own = malloc((size_t)b.n * sizeof *u_own), low = 0, sum = 0;
  for (int d = 0; d < b.n; d++) u_own[d] = b.state.x[d] - flesh_mesh_positions(b.mesh)[d];
  const double *u_whole = oracle_whole(&b, u_own);
  for (int d = 0; d < 3 * oracle_nodes(&b); d++) {
    const double u = u_whole[d];
    if (d % 3 == 1) low = fmin(low, u);
    sum += u * u;
  }
  CHECK_NEAR(low, lowest, 1e-8 * fabs(lowest));
  CHECK_NEAR(sqrt(sum), norm, 1e-8 * norm);
  free(u_own);
  oracle_close(&b);
}

static inline void oracle_scalars_of_e(void)
{
  oracle_scalars(.45, 1. / 60, -0.7126492055, 8.0880491505);
  oracle_scalars(.49, 1. / 60, -0.6675269987, 7.6659140145);
  oracle_scalars(.45, 1. / 30, -1.2157056405, 17.0209474498);
}

#endif
