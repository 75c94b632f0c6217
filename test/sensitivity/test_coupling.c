// TEST quick
/* test_coupling.c: an effect is differenced along few directions, whatever other effects add to K. */
#include "body.h"
#include "sensitivity/coupling.h"
#include "system/pattern.h"
#include "test.h"

/* Finds the couplings of a drag by its lagged state, where K has the pairs of these cells. */
static void find(const test_body *b, const flesh_cells *cells, flesh_couplings *couplings)
{
  flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  flesh_pattern pattern;
  point.lagged = (flesh_lagged){.x = b->state.x, .v = b->state.v};
  CHECK_OK(flesh_pattern_create(b->n / 3, 1, &cells, &pattern));
  const flesh_block_matrix K = flesh_pattern_matrix(&pattern, NULL);
  CHECK_OK(flesh_couplings_create(b->system, couplings));
  CHECK_OK(flesh_couplings_find(couplings, &point, 1u << FLESH_LAGGED_X, &K));
  flesh_pattern_clear(&pattern);
}

static void a_dense_matrix_costs_no_more_colours(void)
{
  test_body b;
  flesh_effect *drag = NULL;
  flesh_couplings sparse, dense;
  flesh_cells tets;
  int count, triangles;
  CHECK_OK(test_body_create(test_box(6, 3, 3, 1, 0.5, 0.5), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1,
                            &b));
  const int *surface = flesh_mesh_surface(b.mesh, &triangles);
  CHECK_OK(flesh_effect_drag(&b.body, triangles, surface, 1000, (double[]){0.3, -2, 1}, 0.7, &drag));
  CHECK_OK(flesh_system_add_effect(b.system, &drag));
  CHECK_OK(flesh_system_finalize(b.system));
  test_jitter(b.n, 0.01, 7, b.state.x);
  const int nodes = b.n / 3;
  int *all = malloc((size_t)nodes * sizeof *all);
  for (int i = 0; i < nodes; i++) all[i] = i;
  CHECK_OK(flesh_cells_of_tets(b.mesh, &tets));
  find(&b, &tets, &sparse);
  find(&b, &(flesh_cells){.count = 1, .nodes_per_cell = nodes, .nodes = all}, &dense);
  count = 0;
  for (int k = 0; k < FLESH_COLOURINGS; k++) count += dense.colourings[k].colours;
  printf("# %d colours, %d couplings\n", count, dense.by[FLESH_LAGGED_X].count);
  CHECK(dense.by[FLESH_LAGGED_X].count == sparse.by[FLESH_LAGGED_X].count && dense.by[FLESH_LAGGED_X].count > nodes);
  CHECK(count < nodes / 3);
  flesh_couplings_clear(&sparse);
  flesh_couplings_clear(&dense);
  flesh_cells_clear(&tets);
  free(all);
  test_body_destroy(&b);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(a_dense_matrix_costs_no_more_colours)); }
