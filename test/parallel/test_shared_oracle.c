// TEST full memory needs=ranks ranks=1,2,3,5,8
/* test_shared_oracle.c: a body shared by ranks agrees with independent codes (reference/oracle/README.md) as on one
 * rank: forces and matrices of elements, equilibria, backward Euler. */
#include "ranks.h"

#include "body.h"

static flesh_rank_part *part; /* part of the body that is open */
static flesh_mesh *whole;
static double *gathered;

static void oracle_open(flesh_mesh *mesh, flesh_material material, flesh_mass mass, int inertia, test_body *b)
{
  whole = mesh;
  part = ranks_cut(mesh);
  gathered = calloc(3 * (size_t)flesh_mesh_node_count(mesh), sizeof *gathered);
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(part), material, 1000, mass, inertia, b));
  CHECK_OK(flesh_system_set_part(b->system, part));
}

static void oracle_finish(test_body *b) { CHECK_OK(flesh_system_finalize(b->system)); }

static void oracle_close(test_body *b)
{
  b->mesh = NULL; /* the part's */
  test_body_destroy(b);
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&whole);
  free(gathered);
}

static int oracle_nodes(const test_body *b)
{
  (void)b;
  return flesh_mesh_node_count(whole);
}

static const double *oracle_whole(const test_body *b, const double *own)
{
  (void)b;
  CHECK_OK(flesh_rank_part_gather(part, own, gathered));
  return gathered;
}

static void oracle_take(const test_body *b, const double *from, double *own)
{
  for (int d = 0; d < b->n; d++) own[d] = from[3 * flesh_rank_part_nodes(part)[d / 3] + d % 3];
}

/* Sums the ranks' values at the whole's nodes. */
static double *oracle_dense(const test_body *b, const flesh_block_matrix *K)
{
  const int n = 3 * oracle_nodes(b), *nodes = flesh_rank_part_nodes(part);
  double *H = calloc((size_t)n * (size_t)n, sizeof *H), *own = test_dense(K);
  for (int i = 0; i < b->n; i++)
    for (int j = 0; j < b->n; j++)
      H[(3 * nodes[i / 3] + i % 3) * n + 3 * nodes[j / 3] + j % 3] = own[i * b->n + j];
  flesh_communicator_sum(ranks, n * n, H);
  free(own);
  return H;
}

#include "oracle.h"

static void trajectories(void)
{
  oracle_trajectory("grav_lumped_be_h0.01_states.txt", FLESH_MASS_LUMPED, 0.01, FLESH_LINEAR_PCG);
  oracle_trajectory("grav_consistent_be_h0.005_states.txt", FLESH_MASS_CONSISTENT, 0.005, FLESH_LINEAR_PCG);
}

static void element_quantities(void)
{
  oracle_element_quantities("mesh_8x2x2.txt", "static_x_jitter.txt", "static_jitter.txt");
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(element_quantities), TEST(oracle_equilibria), TEST(oracle_backward_euler),
                            TEST(trajectories), TEST(oracle_scalars_of_e));
}
