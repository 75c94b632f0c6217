// TEST full seconds=600
/* test_false_equilibria.c: nearly incompressible bodies (form E, Poisson's ratio .499) on irregular meshes, with nodes
 * displaced by up to .7 of an edge, are released. Four-node tets lock, and have false equilibria in which they are
 * bent, with energy left but no inverted tet. Softer materials avoid these: with four nodes as well as with ten and the
 * mean of J the bodies return to their rest shape. */
#include "body.h"
#include "test.h"

enum { STEPS = 120 }; /* of 1/60 s */

static const char *const finger = "../data/meshes/finger_coarse.msh", *const limbs = "reference/meshes/limbs.msh";

/* Displaced corners, with mid-edge nodes between them. */
static void displace(unsigned long long seed, double amount, test_body *b)
{
  static const int ends[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  flesh_mesh *low = NULL;
  double *x = b->state.x;
  int corners = b->n / 3;
  if (flesh_mesh_order(b->mesh) == 2) {
    CHECK_OK(flesh_mesh_lower_order(b->mesh, &low));
    corners = flesh_mesh_node_count(low); /* they come first */
    flesh_mesh_destroy(&low);
  }
  test_jitter(3 * corners, amount, seed, x);
  for (int k = 0; flesh_mesh_order(b->mesh) == 2 && k < 6 * flesh_mesh_tet_count(b->mesh); k++) {
    const int *corner = flesh_mesh_tets(b->mesh) + 4 * (k / 6), node = flesh_mesh_tet_edges(b->mesh)[k];
    const double *a = x + 3 * corner[ends[k % 6][0]], *z = x + 3 * corner[ends[k % 6][1]];
    for (int c = 0; c < 3; c++) x[3 * node + c] = (a[c] + z[c]) / 2;
  }
}

static void make(const char *path, flesh_element element, double *edge, double *volume, test_body *b)
{
  flesh_mesh *mesh = NULL, *raised = NULL;
  flesh_mesh_info info;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_mesh_read(path, &mesh));
  flesh_mesh_inspect(mesh, &info);
  *edge = info.edge_mean;
  *volume = info.volume;
  if (element != FLESH_ELEMENT_TET4) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_E, 0.499), 1000, FLESH_MASS_LUMPED, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  CHECK_OK(flesh_system_create(mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_inertia(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Returns the energies of the body above those at rest, over Young's modulus times its volume, once they are small or
 * after all steps of backward Euler. */
static double energy_left(const char *path, flesh_element element, int seed)
{
  test_body b;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-6);
  double edge, volume, at_rest[2], now[2], left = INFINITY;
  int step = 0, inverted;
  make(path, element, &edge, &volume, &b);
  const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  CHECK_OK(flesh_system_energies(b.system, &point, at_rest));
  displace((unsigned long long)seed, 0.7 * edge, &b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (; step < STEPS && left > 1e-5; step++) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
    CHECK_OK(flesh_system_energies(b.system, &point, now));
    left = (now[0] - at_rest[0] + now[1]) / (1e5 * volume);
  }
  const double least = flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, &inverted);
  printf("# %s, start %d, %s: after %d steps %.3g J of elasticity and %.2g J of motion, %.2g E V; J %.4f at least\n",
         path == finger ? "finger" : "limbs", seed, flesh_element_name(element), step, now[0] - at_rest[0], now[1], left,
         least);
  fflush(stdout);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return left;
}

static void false_equilibria_of_locking_are_passed(void)
{
  const struct {
    const char *path;
    int seed;
  } starts[] = {{finger, 3}, {finger, 6}, {limbs, 1}, {limbs, 7}, {limbs, 18}};
  for (int k = 0; k < 5; k++) {
    CHECK_BELOW(energy_left(starts[k].path, FLESH_ELEMENT_TET4, starts[k].seed), 1e-5);
    CHECK_BELOW(energy_left(starts[k].path, FLESH_ELEMENT_TET10_MEAN, starts[k].seed), 1e-5);
  }
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(false_equilibria_of_locking_are_passed)); }
