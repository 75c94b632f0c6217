/* test_methods.c: the fixed-step methods against GSL's integrators, closed forms and another code: orders, constraints
 * that move, events, restarts, damping. */
#include <gsl/gsl_math.h>

#include "motion_reference.h"

static const flesh_method second_order[] = {FLESH_METHOD_BDF2, FLESH_METHOD_MIDPOINT, FLESH_METHOD_NEWMARK,
                                            FLESH_METHOD_HHT};
enum { SECOND_ORDER = sizeof second_order / sizeof second_order[0] };

static flesh_material soft(flesh_energy energy)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(energy, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  return material;
}

/* A bar 3 x 1 x 1 m, clamped at x = 0, that swings up from its rest shape under gravity. */
static void make_bar(flesh_energy energy, flesh_mass mass, test_body *b)
{
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), soft(energy), 1000, mass, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -2));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finish(b->system));
  for (int i = 0; i < b->n / 3; i++) {
    double X = flesh_mesh_positions(b->mesh)[3 * i];
    b->state.v[3 * i + 2] = 0.2 * X * X;
  }
}

static double order_of(const test_body *b, flesh_method method, double end, const flesh_state *exact, int coarsest)
{
  enum { RUNS = 4 };
  double h[RUNS], error[RUNS];
  for (int k = 0; k < RUNS; k++) {
    flesh_state state = state_copy(b->n, &b->state);
    h[k] = end / (coarsest << k);
    motion_run(b, method, 1e-11, coarsest << k, end, &state);
    error[k] = motion_distance(b->n, state.x, exact->x);
    state_free(&state);
  }
  double order = fitted_order(RUNS, h, error);
  printf("# %s: order %.3f, errors %.3g ... %.3g m\n", flesh_method_name(method), order, error[0], error[RUNS - 1]);
  return order;
}

static void orders_are_as_promised(void)
{
  const flesh_energy energies[] = {FLESH_ENERGY_S, FLESH_ENERGY_NEO};
  for (int e = 0; e < 2; e++) {
    test_body b;
    make_bar(energies[e], FLESH_MASS_LUMPED, &b);
    flesh_state exact = state_copy(b.n, &b.state);
    motion_reference_run(&b, 0.5, 1e-13, &exact);
    CHECK_NEAR(order_of(&b, FLESH_METHOD_BACKWARD_EULER, 0.5, &exact, 200), 1, 0.1);
    for (int k = 0; k < SECOND_ORDER; k++) {
      CHECK_NEAR(order_of(&b, second_order[k], 0.5, &exact, 50), 2, 0.1);
      CHECK(flesh_method_order(second_order[k]) == 2);
    }
    state_free(&exact);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(orders_are_as_promised));
}
