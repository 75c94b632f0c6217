/* test_oracle.c: agreement with independent codes (reference/oracle/README.md): element quantities, equilibria,
 * backward Euler. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static const char *const folder = "reference/oracle";

/* Opens a reference file and skips to the line after the one that starts with `mark`. */
static FILE *open_at(const char *name, const char *mark)
{
  char path[256], line[512];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  while (file && fgets(line, sizeof line, file))
    if (!strncmp(line, mark, strlen(mark))) return file;
  CHECK(!"mark found");
  if (file) fclose(file);
  return NULL;
}

/* Largest distance between x and the positions (first 3 of `columns`) listed after the mark. */
static double distance_to(const char *name, const char *mark, int columns, const double *x, int nodes)
{
  FILE *file = open_at(name, mark);
  double worst = 0, row[6];
  for (int i = 0; file && i < nodes; i++) {
    for (int c = 0; c < columns; c++) CHECK(fscanf(file, "%lf", &row[c]) == 1);
    for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(row[c] - x[3 * i + c]));
  }
  if (file) fclose(file);
  return file ? worst : INFINITY;
}

static flesh_mesh *read_mesh(const char *name)
{
  char path[256];
  flesh_mesh *mesh = NULL;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  CHECK_OK(flesh_mesh_read(path, &mesh));
  return mesh;
}

static void check_equilibrium(const char *mesh, const char *reference, flesh_energy energy)
{
  test_body b;
  flesh_material material;
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, 34000, 306000, &material));
  CHECK_OK(test_body_create(read_mesh(mesh), material, 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -0.5));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-11;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  double distance = distance_to(reference, "nodes", 3, b.state.x, b.n / 3);
  printf("# %s: off by %.3g m after %d Newton, %d PCG iterations, residual %.3g of %.3g N\n", reference,
         distance, stats.newton, stats.linear, stats.residual_last, stats.residual_first);
  CHECK_BELOW(distance, 1e-9);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void equilibria(void)
{
  check_equilibrium("bar_8x2x2.mesh", "static_8x2x2_Neo_g0.5.txt", FLESH_ENERGY_NEO);
  check_equilibrium("bar_8x2x2.mesh", "static_8x2x2_A_g0.5.txt", FLESH_ENERGY_A);
  check_equilibrium("bar_8x2x2.mesh", "static_8x2x2_B_g0.5.txt", FLESH_ENERGY_B);
  check_equilibrium("bar_8x2x2.mesh", "static_8x2x2_D_g0.5.txt", FLESH_ENERGY_D);
  check_equilibrium("bar_8x2x2.mesh", "static_8x2x2_S_g0.5.txt", FLESH_ENERGY_S);
  check_equilibrium("bar_16x4x4.mesh", "static_16x4x4_B_g0.5.txt", FLESH_ENERGY_B);
  check_equilibrium("bar_16x4x4.mesh", "static_16x4x4_S_g0.5.txt", FLESH_ENERGY_S);
}

/* Steps a clamped bar under gravity with backward Euler and a tight Newton tolerance. */
static int run_bar(test_body *b, double h, int steps, flesh_linear_solver linear)
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

static void make_bar(const char *mesh, flesh_material material, flesh_mass mass, const double g[3],
                     test_body *b)
{
  CHECK_OK(test_body_create(read_mesh(mesh), material, 1000, mass, 1, b));
  CHECK_OK(test_body_gravity(b, g[0], g[1], g[2]));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
}

static void check_swing(const char *name, flesh_energy energy, flesh_mass mass)
{
  char reference[128];
  test_body b;
  flesh_material material;
  CHECK_OK(flesh_material_from_lame(energy, FLESH_CONSTANTS_RAW, 34000, 306000, &material));
  make_bar("bar_8x2x2.mesh", material, mass, (double[]){0, 0, -9.81}, &b);
  for (int steps = 1; steps <= 60; steps += 59) {
    CHECK_OK(run_bar(&b, 1. / 60, steps == 1 ? 1 : 59, FLESH_LINEAR_PCG));
    snprintf(reference, sizeof reference, "dyn_8x2x2_%s_g9.81_step%d.txt", name, steps);
    double distance = distance_to(reference, "nodes", 3, b.state.x, b.n / 3);
    printf("# %s: off by %.3g m\n", reference, distance);
    CHECK_BELOW(distance, 1e-8);
  }
  test_body_destroy(&b);
}

static void backward_euler(void)
{
  check_swing("B_lumped", FLESH_ENERGY_B, FLESH_MASS_LUMPED);
  check_swing("B_consistent", FLESH_ENERGY_B, FLESH_MASS_CONSISTENT);
  check_swing("D_lumped", FLESH_ENERGY_D, FLESH_MASS_LUMPED);
  check_swing("D_consistent", FLESH_ENERGY_D, FLESH_MASS_CONSISTENT);
}

/* Another code's trajectory with a stiffer material, every 0.1 s. */
static void check_trajectory(const char *reference, flesh_mass mass, double h, flesh_linear_solver linear)
{
  test_body b;
  flesh_material material;
  char mark[32];
  double worst = 0;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
  make_bar("bar_8x2x2.mesh", material, mass, (double[]){0, 0, -9.8}, &b);
  for (int k = 1; k <= 10; k++) {
    CHECK_OK(run_bar(&b, h, (int)lround(0.1 / h), linear));
    snprintf(mark, sizeof mark, "t %.2g", 0.1 * k);
    worst = fmax(worst, distance_to(reference, mark, 6, b.state.x, b.n / 3));
  }
  printf("# %s: off by %.3g m\n", reference, worst);
  CHECK_BELOW(worst, 1e-8);
  test_body_destroy(&b);
}

static void trajectories(void)
{
  check_trajectory("grav_lumped_be_h0.01_states.txt", FLESH_MASS_LUMPED, 0.01, FLESH_LINEAR_PCG);
  check_trajectory("grav_lumped_be_h0.01_states.txt", FLESH_MASS_LUMPED, 0.01, FLESH_LINEAR_KLU);
  check_trajectory("grav_consistent_be_h0.005_states.txt", FLESH_MASS_CONSISTENT, 0.005, FLESH_LINEAR_PCG);
}

/* Energy, gradient and Hessian at given positions, relative to the largest entry. */
static void check_element_quantities(const char *mesh, const char *positions, const char *reference)
{
  test_body b;
  flesh_material material;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 1e5, 4e5, &material));
  CHECK_OK(test_body_create(read_mesh(mesh), material, 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  int n = b.n;
  char path[256];
  snprintf(path, sizeof path, "%s/%s", folder, positions);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  for (int d = 0; file && d < n; d++) CHECK(fscanf(file, "%lf", &b.state.x[d]) == 1);
  if (file) fclose(file);

  flesh_point point = {.load = 1, .x = b.state.x, .v = b.state.v, .a = b.state.v};
  double energy, *r = calloc((size_t)n, sizeof *r), *H = calloc((size_t)n * n, sizeof *H);
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_energies(b.system, &point, &energy));
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  CHECK_OK(flesh_system_matrix_create(b.system, &K));
  CHECK_OK(flesh_system_jacobian(b.system, &point, &(flesh_shift){.x = 1}, K));
  for (int i = 0; i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int p = 0; p < 9; p++) {
        int row = 3 * i + p / 3, column = 3 * K->column[k] + p % 3;
        H[row * n + column] = H[column * n + row] = K->values[9 * k + p];
      }

  double expected, row[6], largest = 0, worst = 0;
  file = open_at(reference, "# energy");
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
  for (int k = 0; k < n * n; k++) worst = fmax(worst, fabs(H[k])); /* what the other code does not have */
  printf("# %s: Hessian off by %.3g of the largest entry\n", reference, worst / largest);
  CHECK_BELOW(worst, 1e-12 * largest);
  fclose(file);
  free(r);
  free(H);
  flesh_block_matrix_destroy(&K);
  test_body_destroy(&b);
}

static void element_quantities(void)
{
  check_element_quantities("mesh_1tet.txt", "static_x_1tet.txt", "static_1tet.txt");
  check_element_quantities("mesh_8x2x2.txt", "static_x_jitter.txt", "static_jitter.txt");
}

/* Scalars of a third code: Psi_E with matched constants, 20 lumped backward-Euler steps. */
static void check_scalars(double poisson, double h, double lowest, double norm)
{
  test_body b;
  flesh_material material;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box((int[]){16, 4, 4}, (double[]){1, .25, .25}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_E, FLESH_CONSTANTS_MATCHED, 1e5, poisson, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, -9.81, 0));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(run_bar(&b, h, 20, FLESH_LINEAR_PCG));
  const double *X = flesh_mesh_positions(b.mesh);
  double low = 0, sum = 0;
  for (int d = 0; d < b.n; d++) {
    double u = b.state.x[d] - X[d];
    if (d % 3 == 1) low = fmin(low, u);
    sum += u * u;
  }
  CHECK_NEAR(low, lowest, 1e-8 * fabs(lowest));
  CHECK_NEAR(sqrt(sum), norm, 1e-8 * norm);
  test_body_destroy(&b);
}

static void scalars_of_e(void)
{
  check_scalars(.45, 1. / 60, -0.7126492055, 8.0880491505);
  check_scalars(.49, 1. / 60, -0.6675269987, 7.6659140145);
  check_scalars(.45, 1. / 30, -1.2157056405, 17.0209474498);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(element_quantities), TEST(equilibria), TEST(backward_euler),
                   TEST(trajectories), TEST(scalars_of_e));
}
