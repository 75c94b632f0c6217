// TEST quick seconds=120
/* test_oracle.c: agreement with independent codes (reference/oracle/README.md): element quantities, equilibria,
 * backward Euler. */
#include <stdlib.h>

#include "body.h"
#include "test.h"

static void oracle_open(flesh_mesh *mesh, flesh_material material, flesh_mass mass, int inertia, test_body *b)
{
  CHECK_OK(test_body_create(mesh, material, 1000, mass, inertia, b));
}

static void oracle_finish(test_body *b) { CHECK_OK(flesh_system_finalize(b->system)); }
static void oracle_close(test_body *b) { test_body_destroy(b); }
static int oracle_nodes(const test_body *b) { return b->n / 3; }

static const double *oracle_whole(const test_body *b, const double *own)
{
  (void)b;
  return own;
}

static void oracle_take(const test_body *b, const double *whole, double *own)
{
  memcpy(own, whole, (size_t)b->n * sizeof *own);
}

static double *oracle_dense(const test_body *b, const flesh_block_matrix *K)
{
  (void)b;
  return test_dense(K);
}

#include "oracle.h"

static void trajectories(void)
{
  oracle_trajectory("grav_lumped_be_h0.01_states.txt", FLESH_MASS_LUMPED, 0.01, FLESH_LINEAR_PCG);
  oracle_trajectory("grav_lumped_be_h0.01_states.txt", FLESH_MASS_LUMPED, 0.01, FLESH_LINEAR_KLU);
  oracle_trajectory("grav_consistent_be_h0.005_states.txt", FLESH_MASS_CONSISTENT, 0.005, FLESH_LINEAR_PCG);
}

static void element_quantities(void)
{
  oracle_element_quantities("mesh_1tet.txt", "static_x_1tet.txt", "static_1tet.txt");
  oracle_element_quantities("mesh_8x2x2.txt", "static_x_jitter.txt", "static_jitter.txt");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(element_quantities), TEST(oracle_equilibria), TEST(oracle_backward_euler),
                   TEST(trajectories), TEST(oracle_scalars_of_e));
}
