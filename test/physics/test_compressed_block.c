// TEST full seconds=300
/* test_compressed_block.c: step-44 of deal.II, a nearly incompressible block pressed on a quarter of its top to less
 * than a third of its height, compared with another code with another element (reference/dealii/README.md): hexahedra
 * with quadratic displacements and linear pressures. The form is a user-defined psi. */
#include "body.h"
#include "test.h"

enum { LOADS = 6 };
static const double loads[LOADS] = {5, 20, 40, 60, 80, 100}; /* p/p0, p0 = 4 MPa */

typedef struct block_constants {
  double mu, kappa; /* Pa */
} block_constants;

/* Step-44's: mu/2 (J^(-2/3) I_C - 3) + kappa/4 (J^2 - 1 - 2 log J). */
static int block_psi(double I_C, double J, const flesh_material *material, flesh_psi *psi)
{
  const block_constants *own = material->user;
  if (!(J > 0)) return FLESH_UNDEFINED;
  const double h = own->mu / 2 * pow(J, -2. / 3);
  *psi = (flesh_psi){.value = h * I_C - 1.5 * own->mu + own->kappa / 4 * (J * J - 1 - 2 * log(J)),
                     .I = h,
                     .J = -2. / 3 * h * I_C / J + own->kappa / 2 * (J - 1 / J),
                     .IJ = -2. / 3 * h / J,
                     .JJ = 10. / 9 * h * I_C / (J * J) + own->kappa / 2 * (1 + 1 / (J * J))};
  return FLESH_OK;
}

/* Its volume part over kappa. */
static int block_volume(double J, const flesh_material *material, flesh_volume_part *U)
{
  (void)material;
  if (!(J > 0)) return FLESH_UNDEFINED;
  *U = (flesh_volume_part){
      .value = 0.25 * (J * J - 1 - 2 * log(J)), .J = 0.5 * (J - 1 / J), .JJ = 0.5 * (1 + 1 / (J * J))};
  return FLESH_OK;
}

/* A cube of 1 m; its faces at 0 slide, its top moves only vertically and bears a dead pressure on a quarter. */
static void make(int cells, flesh_element element, const flesh_material *material, test_body *b)
{
  flesh_mesh *mesh = test_box(cells, cells, cells, 1, 1, 1), *raised = NULL;
  const flesh_curve_point way[2] = {{0, 0}, {100, 1}};
  const flesh_amplitude amplitude = {.count = 2, .points = way, .from = -INFINITY, .until = INFINITY};
  flesh_effect *effect = NULL;
  int all, count = 0;
  if (element != FLESH_ELEMENT_TET4) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, *material, 1000, FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  const int *surface = flesh_mesh_surface(mesh, &all);
  int *pressed = malloc(3 * (size_t)all * sizeof *pressed);
  for (int k = 0; k < all; k++) {
    int on = 1;
    for (int a = 0; a < 3; a++) {
      const double *X = flesh_mesh_positions(mesh) + 3 * surface[3 * k + a];
      on &= X[1] == 1 && X[0] < 0.5 + 1e-9 && X[2] < 0.5 + 1e-9;
    }
    if (on) memcpy(pressed + 3 * count++, surface + 3 * k, 3 * sizeof *pressed);
  }
  CHECK_OK(flesh_system_create(mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_traction(&b->body, count, pressed, (double[]){0, -400e6, 0}, &amplitude, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 1, 1, FLESH_AXIS_X | FLESH_AXIS_Z, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  free(pressed);
}

/* Computes the displacement of the corner under the pressure at the first `count` loads, as fractions of the height. */
static void press(int cells, flesh_element element, int count, double down[LOADS])
{
  block_constants own = {.mu = 80.194e6};
  flesh_material material;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-7);
  test_body b;
  own.kappa = 2 * own.mu * (1 + 0.4999) / (3 * (1 - 2 * 0.4999));
  CHECK_OK(flesh_material_from_psi(block_psi, &own, &material));
  material.lambda = own.kappa; /* the volume part that tet10-mean averages */
  material.volume = block_volume;
  make(cells, element, &material, &b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  for (int k = 0; k < count; k++) {
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, loads[k] - b.state.t, &stats));
    down[k] = NAN;
    for (int i = 0; i < b.n / 3; i++) {
      const double *X = flesh_mesh_positions(b.mesh) + 3 * i;
      if (X[0] == 0 && X[1] == 1 && X[2] == 0) down[k] = 1 - b.state.x[3 * i + 1];
    }
    printf("# %s, %d tets, p/p0 %g: %.5f (%d Newton)\n", flesh_element_name(element), flesh_mesh_tet_count(b.mesh),
           loads[k], down[k], stats.newton);
    fflush(stdout);
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Reads the rows `cells load ...` of the other code's finest mesh. */
static void read_reference(double down[LOADS])
{
  char line[256];
  double row[8];
  FILE *file = fopen("reference/dealii/block.txt", "r");
  CHECK(file != NULL);
  for (int k = 0; k < LOADS; k++) down[k] = NAN;
  while (file && fgets(line, sizeof line, file)) {
    if (sscanf(line, "%lf %lf %lf %lf %lf %lf %lf %lf", row, row + 1, row + 2, row + 3, row + 4, row + 5, row + 6,
               row + 7) != 8)
      continue;
    for (int k = 0; k < LOADS; k++)
      if (row[0] == 8 && row[1] == loads[k] && row[2] == 0 && row[3] == 1 && row[4] == 0) down[k] = -row[6];
  }
  if (file) fclose(file);
}

/* 384 tets have the nodes of 4 hexahedra per edge, whose last figure is also off by 1.4 % from that of 8; 1296 and 3072
 * tets are within .3 and .1 %, at the last load .9 and .4 %. The other elements for comparison: tet10 deviates to
 * either side, tet4 hardly deforms. */
static void blocks_are_compressed_as_by_another_code(void)
{
  double expected[LOADS], mean[LOADS], pointwise[LOADS], linear[LOADS], worst = 0;
  read_reference(expected);
  press(4, FLESH_ELEMENT_TET10_MEAN, LOADS, mean);
  press(4, FLESH_ELEMENT_TET10, LOADS - 1, pointwise);
  press(4, FLESH_ELEMENT_TET4, LOADS - 1, linear);
  for (int k = 0; k < LOADS; k++) {
    printf("# p/p0 %g: deal.II %.5f; tet10-mean %+.2f %%\n", loads[k], expected[k], 100 * (mean[k] / expected[k] - 1));
    CHECK_NEAR(mean[k] / expected[k], 1, k < LOADS - 1 ? 0.01 : 0.02);
    if (k == LOADS - 1) break;
    printf("# tet10 %+.2f %%, tet4 %+.2f %%\n", 100 * (pointwise[k] / expected[k] - 1),
           100 * (linear[k] / expected[k] - 1));
    worst = fmax(worst, fabs(pointwise[k] / expected[k] - 1));
    CHECK_BELOW(linear[k], 0.1 * expected[k]);
  }
  CHECK(worst > 0.03);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(blocks_are_compressed_as_by_another_code)); }
