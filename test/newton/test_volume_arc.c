// TEST full seconds=60
/* test_volume_arc.c: Newton's iteration for nearly incompressible ten-node tets from rest: how many iterations it
 * takes, however large Poisson's ratio is, and that the preconditioner is rebuilt when the body has turned. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

/* Makes a bar of 4 x 1 x 1 m, or Cook's membrane (48 m long, 44 and 16 m high, 10 m thick). */
static flesh_mesh *shaped(int cook)
{
  flesh_mesh *box = cook ? test_box(5, 5, 1, 1, 1, 1) : test_box(8, 2, 2, 4, 1, 1), *mesh = NULL, *raised = NULL;
  const int nodes = flesh_mesh_node_count(box);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  for (int i = 0; i < nodes; i++) {
    const double *X = flesh_mesh_positions(box) + 3 * i;
    x[3 * i] = cook ? 48 * X[0] : X[0];
    x[3 * i + 1] = cook ? 44 * X[0] + X[1] * (44 - 28 * X[0]) : X[1];
    x[3 * i + 2] = cook ? 10 * X[2] : X[2];
  }
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&mesh);
  free(x);
  return raised;
}

/* Computes the equilibrium under `force` N/m^3 along y. Returns how far the far end has moved. */
static double bend(int cook, flesh_energy energy, double poisson, double force, flesh_preconditioner kind,
                   flesh_solve_stats *stats)
{
  test_body b;
  flesh_solver_options options = test_options(1e-6);
  flesh_integrator *integrator = NULL;
  options.preconditioner = kind;
  CHECK_OK(test_body_create(shaped(cook), test_material(energy, poisson), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, force / 1000, 0));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, stats));
  double moved = 0;
  for (int d = 1; d < b.n; d += 3) moved = fmax(moved, fabs(b.state.x[d] - flesh_mesh_positions(b.mesh)[d]));
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return moved;
}

/* A bar of 4 m, which bends by a fifth of that; and Cook's, by a third of its height. */
static void newton_does_not_feel_nu(void)
{
  static const double poisson[] = {0.49, 0.499, 0.4999, 0.49999};
  static const flesh_energy forms[] = {FLESH_ENERGY_S, FLESH_ENERGY_E, FLESH_ENERGY_B};
  for (int cook = 0; cook < 2; cook++)
    for (int form = 0; form < 3; form++)
      for (int k = form ? 2 : 0; k < 4 - (form > 0); k++) {
        flesh_solve_stats stats = {0};
        const double moved =
            bend(cook, forms[form], poisson[k], cook ? 60 : -200, FLESH_PRECONDITIONER_VOLUME_PROJECTION, &stats);
        printf("# %s, %s, nu %g: moved %.4g m, %d Newton, %d linear iterations\n", cook ? "Cook" : "bar",
               flesh_energy_name(forms[form]), poisson[k], moved, (int)stats.newton, (int)stats.linear);
        CHECK_BELOW(stats.newton, 15);
        CHECK_BELOW(stats.linear, 60 * stats.newton); /* without a grid, as for so few nodes */
      }
}

/* Arcs lead to the same solution as straight steps. */
static void equilibria_are_the_same(void)
{
  flesh_solve_stats stats[2] = {{0}};
  const double straight = bend(0, FLESH_ENERGY_S, 0.499, -200, FLESH_PRECONDITIONER_IC, &stats[0]),
               bent = bend(0, FLESH_ENERGY_S, 0.499, -200, FLESH_PRECONDITIONER_VOLUME_PROJECTION, &stats[1]);
  printf("# %d and %d Newton iterations, off by %.2g m\n", (int)stats[0].newton, (int)stats[1].newton,
         fabs(straight - bent));
  CHECK_BELOW(fabs(straight - bent), 1e-5);
  CHECK(2 * stats[1].newton < stats[0].newton);
}

/* Blocks that start 8 to 12 times as long shrink along arcs, on which filtered steps do not reach the least
 * potential. */
static void steps_go_on_along_their_arcs(void)
{
  flesh_solve_stats stats = {0};
  for (int times = 8; times <= 12; times++) {
    test_body b;
    flesh_mesh *raised = NULL, *box = test_box(6, 3, 3, 0.2, 0.1, 0.1);
    flesh_solver_options options = test_options(1e-4);
    flesh_integrator *integrator = NULL;
    CHECK_OK(flesh_mesh_raise_order(box, &raised));
    flesh_mesh_destroy(&box);
    CHECK_OK(test_body_create(raised, test_material(FLESH_ENERGY_S, 0.4999), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int d = 0; d < b.n; d += 3) b.state.x[d] *= times;
    for (int step = 0; step < 2; step++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  printf("# %d Newton iterations\n", (int)stats.newton);
  CHECK(stats.newton < 850); /* 581; 1162 if arcs end at their first length */
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(newton_does_not_feel_nu), TEST(equilibria_are_the_same),
                   TEST(steps_go_on_along_their_arcs));
}
