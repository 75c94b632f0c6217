// TEST quick seconds=120
/* test_tet10_oracle.c: ten-node tets against an independent code (reference/oracle/README.md): equilibria of a bar and
 * of a stretched block, backward Euler with the consistent mass. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static const char *const folder = "reference/oracle/tet10";

static flesh_mesh *read_mesh(const char *name)
{
  char path[256];
  flesh_mesh *mesh = NULL;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  CHECK_OK(flesh_mesh_read(path, &mesh));
  return mesh;
}

static int make(flesh_mesh *mesh, flesh_material material, flesh_element element, int inertia, test_body *b)
{
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_system_create(mesh, &b->system));
  if (inertia) {
    CHECK_OK(flesh_effect_inertia(&b->body, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  return flesh_system_add_effect(b->system, &effect);
}

/* Returns the largest distance from the displacements in a file, of nodes in the mesh's order. */
static double distance_from(const char *name, const test_body *b)
{
  char path[256];
  double worst = 0, u;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  for (int d = 0; file && d < b->n; d++) {
    CHECK(fscanf(file, "%lf", &u) == 1);
    worst = fmax(worst, fabs(b->state.x[d] - flesh_mesh_positions(b->mesh)[d] - u));
  }
  if (file) fclose(file);
  return file ? worst : INFINITY;
}

static flesh_material material_of(flesh_energy energy, double young, double poisson)
{
  flesh_material m;
  CHECK_OK(flesh_material_from_young(energy, FLESH_CONSTANTS_MATCHED, young, poisson, &m));
  return m;
}

static void solve(test_body *b)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(1e-12);
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b->state, 0, &stats));
  printf("# %d Newton, %d linear iterations, residual %.3g of %.3g N\n", stats.newton, stats.linear, stats.residual_last,
         stats.residual_first);
  flesh_integrator_destroy(&integrator);
}

static void bar_bends_under_its_weight(void)
{
  test_body b;
  CHECK_OK(make(read_mesh("bar_S_045.msh"), material_of(FLESH_ENERGY_S, 1e5, 0.45), FLESH_ELEMENT_TET10, 0, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -0.2)); /* 1000 kg/m^3 */
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  solve(&b);
  const double distance = distance_from("bar_S_045.disp", &b);
  printf("# off by %.3g m\n", distance);
  CHECK_BELOW(distance, 1e-10);
  test_body_destroy(&b);
}

/* In four increments, along the reference's path. */
static void block_is_drawn_aside(void)
{
  const flesh_keyframe way[2] = {{.t = 0}, {.t = 4, .translation = {0.06, 0.04, 0.024}}};
  const flesh_motion motion = {.count = 2, .keyframes = way};
  test_body b;
  CHECK_OK(make(read_mesh("block_E_040.msh"), material_of(FLESH_ENERGY_E, 5e4, 0.40), FLESH_ELEMENT_TET10, 0, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(test_body_hold(&b, 0, 0.08, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int k = 1; k <= 4; k++) {
    b.state.t = k;
    solve(&b);
  }
  const double distance = distance_from("block_E_040.disp", &b);
  printf("# off by %.3g m\n", distance);
  CHECK_BELOW(distance, 1e-10);
  test_body_destroy(&b);
}

/* Returns the largest distance from a file's rows X Y Z ux uy uz, of nodes matched by position. */
static double distance_by_place(const char *name, const test_body *b)
{
  char path[256], line[512];
  const double *X = flesh_mesh_positions(b->mesh);
  double worst = 0, row[6];
  int rows = 0;
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "r");
  CHECK(file != NULL);
  while (file && fgets(line, sizeof line, file)) {
    if (sscanf(line, "%lf %lf %lf %lf %lf %lf", row, row + 1, row + 2, row + 3, row + 4, row + 5) != 6) continue;
    int found = -1;
    for (int i = 0; i < b->n / 3 && found < 0; i++)
      if (fabs(X[3 * i] - row[0]) + fabs(X[3 * i + 1] - row[1]) + fabs(X[3 * i + 2] - row[2]) < 1e-9) found = i;
    CHECK(found >= 0);
    for (int c = 0; c < 3 && found >= 0; c++)
      worst = fmax(worst, fabs(b->state.x[3 * found + c] - X[3 * found + c] - row[3 + c]));
    rows++;
  }
  if (file) fclose(file);
  CHECK(rows == b->n / 3);
  return worst;
}

/* Backward Euler, h = 1/60 s, 30 steps, with mid-edge nodes added to the mesh of order 1. */
static void bar_swings(void)
{
  flesh_mesh *linear = NULL, *mesh = NULL;
  test_body b;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-11);
  CHECK_OK(flesh_mesh_read("reference/oracle/bar_8x2x2.mesh", &linear));
  CHECK_OK(flesh_mesh_raise_order(linear, &mesh));
  flesh_mesh_destroy(&linear);
  CHECK_OK(make(mesh, material_of(FLESH_ENERGY_B, 1e5, 0.4), FLESH_ELEMENT_TET10, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int k = 0; k < 30; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
  const double distance = distance_by_place("dyn10_8x2x2_B_nu0.4_step30.txt", &b);
  printf("# off by %.3g m\n", distance);
  CHECK_BELOW(distance, 1e-9);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(bar_bends_under_its_weight), TEST(block_is_drawn_aside), TEST(bar_swings));
}
