// TEST full seconds=300
/* test_cook.c: Cook's membrane as a slab (cook.h) of form B at a Poisson's ratio of .4999, whose end a dead traction of
 * 6 MPa lifts by half of its height, against another code's hexahedra with quadratic displacements and linear pressures
 * (reference/dealii/README.md) and against refined meshes of our own; and how even its pressures are. */
#include "cook.h"
#include "pressure_field.h"

static const double mu = 80.194e6, kappa = 2 * 80.194e6 * (1 + 0.4999) / (3 * (1 - 2 * 0.4999));

/* Computes the displacements of the middle and the upper edge of the end in the slab's middle plane, m, and the noise
 * of the pressures. */
static void lift(const int cells[3], flesh_element element, double up[2], double *noise)
{
  flesh_material material;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-7);
  flesh_solve_stats stats = {0};
  test_body b;
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, mu, kappa, &material));
  cook_make(cells, element, material, 6e6, &b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  for (int k = 0; k < 2; k++) {
    const double Y = k ? 0.06 : 0.052;
    const int node = test_node_at(b.mesh, 0.048, Y, 0.005);
    up[k] = node < 0 ? NAN : b.state.x[3 * node + 1] - Y;
  }
  *noise = pressure_noise(b.mesh, b.state.x, kappa, mu);
  printf("# %s, %d tets: middle %.4f mm, edge %.4f mm, noise %.3f (%d Newton)\n", flesh_element_name(element),
         flesh_mesh_tet_count(b.mesh), 1e3 * up[0], 1e3 * up[1], *noise, stats.newton);
  fflush(stdout);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* The other code's results on its finest two meshes [coarse, fine], m. */
static void read_reference(double up[2][2])
{
  char line[256];
  double row[7], finest = 0;
  FILE *file = fopen("reference/dealii/cook.txt", "r");
  CHECK(file != NULL);
  while (file && fgets(line, sizeof line, file)) { /* from coarse to fine */
    if (sscanf(line, "%lf %lf %lf %lf %lf %lf %lf", row, row + 1, row + 2, row + 3, row + 4, row + 5, row + 6) != 7)
      continue;
    if (row[0] != finest) memcpy(up[0], up[1], sizeof up[0]);
    finest = row[0];
    for (int k = 0; k < 2; k++)
      if (row[2] == (k ? 60 : 52) && row[3] == 0) up[1][k] = 1e-3 * row[5];
  }
  if (file) fclose(file);
}

static const int coarse[3] = {8, 4, 1}, fine[3] = {16, 8, 1}; /* 192 and 768 tets */
/* For tet4, which has no node in the middle of a single cell. */
static const int coarse_linear[3] = {8, 4, 2}, fine_linear[3] = {16, 8, 2};

static void slab_is_lifted_as_by_another_code(void)
{
  double other[2][2] = {{NAN, NAN}, {NAN, NAN}}, up[2], noise;
  read_reference(other);
  lift(fine, FLESH_ELEMENT_TET10_MEAN, up, &noise);
  /* The limit is extrapolated with the first power: stresses are singular where the clamped end meets the sides. */
  for (int k = 0; k < 2; k++) {
    const double limit = 2 * other[1][k] - other[0][k];
    printf("# %s: deal.II %.4f and %.4f mm, in the limit %.4f; tet10-mean %+.2f %%\n", k ? "edge" : "middle",
           1e3 * other[0][k], 1e3 * other[1][k], 1e3 * limit, 100 * (up[k] / limit - 1));
    CHECK_NEAR(up[k] / limit, 1, 0.01);
  }
}

/* The limit of refinement agrees with the other code's; the other elements have not converged yet. */
static void slab_converges(void)
{
  double other[2][2] = {{NAN, NAN}, {NAN, NAN}}, at[2], half[2], up[2], noise;
  read_reference(other);
  lift(coarse, FLESH_ELEMENT_TET10_MEAN, half, &noise);
  lift(fine, FLESH_ELEMENT_TET10_MEAN, at, &noise);
  for (int k = 0; k < 2; k++) { /* between the first power of the size of the tets and the second */
    const double second = (4 * at[k] - half[k]) / 3, first = 2 * at[k] - half[k];
    printf("# %s in the limit: %.4f mm by the second power, %.4f by the first\n", k ? "edge" : "middle", 1e3 * second,
           1e3 * first);
    CHECK(second < 1.003 * other[1][k] && first > 0.997 * other[1][k]);
  }
  lift(fine, FLESH_ELEMENT_TET10, up, &noise);
  CHECK(up[0] < 0.98 * other[1][0] && up[0] > 0.9 * other[1][0]);
  lift(fine_linear, FLESH_ELEMENT_TET4, up, &noise);
  CHECK(up[0] < 0.5 * other[1][0]);
}

/* The pressures of tet10-mean converge under refinement; those of tet4 get noisier. */
static void pressures_are_no_checkerboard(void)
{
  double up[2], wide, narrow, pointwise, linear, finer;
  lift(coarse, FLESH_ELEMENT_TET10_MEAN, up, &wide);
  lift(fine, FLESH_ELEMENT_TET10_MEAN, up, &narrow);
  lift(fine, FLESH_ELEMENT_TET10, up, &pointwise);
  lift(coarse_linear, FLESH_ELEMENT_TET4, up, &linear);
  lift(fine_linear, FLESH_ELEMENT_TET4, up, &finer);
  CHECK_BELOW(narrow, 0.015);
  CHECK_BELOW(narrow, 0.8 * wide);
  CHECK(pointwise > 0.03);
  CHECK(finer > 0.2 && finer > linear);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(slab_is_lifted_as_by_another_code), TEST(slab_converges),
                   TEST(pressures_are_no_checkerboard));
}
