// TEST quick
/* test_smooth.c: smoothing moves nodes so that tets are better shaped, and keeps the body, its regions and its sets. */
#include <math.h>

#include "mesh/inspect.h"
#include "mesh/smooth.h"
#include "quadratic.h"

/* Makes irregular tets in the box [0, 1] x [0, 1] x [0, 1] with straight faces, randomly bisected into worse ones; with
 * two regions divided at z = 0.5, and sets of the nodes of x < 0.55, of the face z = 0, and of half the edge y = z =
 * 0. */
static flesh_mesh *worse(int order)
{
  flesh_mesh *grid, *made, *ten, *finer;
  CHECK_OK(flesh_mesh_box((int[]){4, 4, 4}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &grid));
  const int nodes = flesh_mesh_node_count(grid), tets = flesh_mesh_tet_count(grid);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  int *regions = malloc((size_t)tets * sizeof *regions), set, face, edge;
  unsigned long long seed = 4;
  flesh_mesh_sets sets = {0};
  CHECK_OK(flesh_mesh_sets_take(&sets, "near", 4, &set));
  CHECK_OK(flesh_mesh_sets_take(&sets, "face", 4, &face));
  CHECK_OK(flesh_mesh_sets_take(&sets, "edge", 4, &edge));
  for (int i = 0; i < 3 * nodes; i++) {
    const double at = flesh_mesh_positions(grid)[i];
    x[i] = at == 0 || at == 1 || (i % 3 == 2 && at == 0.5) ? at : at + 0.14 * (test_uniform(&seed) - 0.5);
    if (i % 3 == 0 && at < 0.55) CHECK_OK(flesh_members_add(&sets.sets[set].nodes, i / 3));
  }
  for (int t = 0; t < tets; t++) {
    double z = 0;
    for (int a = 0; a < 4; a++) z += flesh_mesh_positions(grid)[3 * flesh_mesh_tets(grid)[4 * t + a] + 2] / 4;
    regions[t] = z > 0.5;
  }
  for (int n = 0; n < nodes; n++) {
    const double *X = flesh_mesh_positions(grid) + 3 * n;
    if (X[2] == 0) CHECK_OK(flesh_members_add(&sets.sets[face].nodes, n));
    if (X[2] == 0 && X[1] == 0 && X[0] < 0.55) CHECK_OK(flesh_members_add(&sets.sets[edge].nodes, n));
  }
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = nodes, .tets = tets, .positions = x, .regions = regions,
                                                .tet_nodes = flesh_mesh_tets(grid), .sets = &sets}, NULL, &made));
  flesh_mesh_sets_clear(&sets);
  flesh_mesh_destroy(&grid);
  CHECK_OK(flesh_mesh_raise_order(made, &ten));
  if (order == 2) flesh_mesh_destroy(&made), made = ten;
  else flesh_mesh_destroy(&ten);
  for (int k = 0; k < 6; k++) {
    uint8_t *halvings = calloc((size_t)flesh_mesh_tet_count(made), 1);
    for (int t = 0; t < 40; t++) halvings[(int)(flesh_mesh_tet_count(made) * test_uniform(&seed))] = 1;
    CHECK_OK(flesh_mesh_refine_marked(made, halvings, &finer, NULL));
    flesh_mesh_destroy(&made);
    free(halvings);
    made = finer;
  }
  free(x);
  free(regions);
  return made;
}

static void shapes_are_better_in_the_same_body(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *mesh = worse(order), *smooth, *finer;
    flesh_mesh_info before, after;
    CHECK_OK(flesh_mesh_smooth(mesh, 0.35, &smooth));
    flesh_mesh_inspect(mesh, &before);
    flesh_mesh_inspect(smooth, &after);
    printf("# %d tets, least radius ratio %.3g -> %.3g\n", after.tets, before.radius_ratio_min, after.radius_ratio_min);
    CHECK(before.radius_ratio_min < 0.18 && after.radius_ratio_min > 0.28);
    CHECK(after.tets == before.tets && after.nodes == before.nodes && !after.flipped && !after.curved);
    CHECK_NEAR(after.volume, 1, 1e-13);
    const double *X = flesh_mesh_positions(mesh), *Y = flesh_mesh_positions(smooth);
    int moved = 0, slid = 0;
    for (int i = 0; i < 3 * before.nodes; i++) { /* nodes in a plane of the box stay in it, to the last bit */
      if (X[i] == 0 || X[i] == 1 || Y[i] == 0 || Y[i] == 1) CHECK(X[i] == Y[i]);
      moved += X[i] != Y[i];
    }
    for (int n = 0; n < before.nodes; n++) {
      int planes = 0;
      for (int d = 0; d < 3; d++) planes += X[3 * n + d] == 0 || X[3 * n + d] == 1;
      slid += planes == 2 && memcmp(X + 3 * n, Y + 3 * n, 3 * sizeof *X);
      if (planes == 3) CHECK(!memcmp(X + 3 * n, Y + 3 * n, 3 * sizeof *X));
    }
    printf("# %d moved, %d slid\n", moved, slid);
    CHECK(moved > 100 && slid > 0);
    /* Bisection continues as before. */
    uint8_t *halvings = calloc((size_t)after.tets, 1);
    halvings[7] = 3;
    CHECK_OK(flesh_mesh_refine_marked(smooth, halvings, &finer, NULL));
    CHECK(!memcmp(smooth->marks, mesh->marks, (size_t)after.tets * sizeof *mesh->marks));
    free(halvings);
    flesh_mesh_destroy(&mesh);
    flesh_mesh_destroy(&smooth);
    flesh_mesh_destroy(&finer);
  }
}

/* Sums the volume of the tets of region 1, and of those with all corners in the set. */
static void measure(const flesh_mesh *mesh, double volumes[2])
{
  uint8_t *inside = calloc((size_t)mesh->nodes, 1);
  const flesh_members *nodes = &mesh->sets.sets[0].nodes;
  volumes[0] = volumes[1] = 0;
  for (int k = 0; k < nodes->count; k++) inside[nodes->values[k]] = 1;
  for (int t = 0; t < mesh->tets; t++) {
    int in = 0;
    for (int a = 0; a < 4; a++) in += inside[mesh->tet_nodes[4 * t + a]];
    volumes[0] += mesh->regions[t] * mesh->volumes[t];
    volumes[1] += (in == 4) * mesh->volumes[t];
  }
  free(inside);
}

static void regions_and_sets_stay_what_they_are(void)
{
  flesh_mesh *mesh = worse(1), *smooth;
  double before[2], after[2];
  CHECK_OK(flesh_mesh_smooth(mesh, 0.35, &smooth));
  measure(mesh, before);
  measure(smooth, after);
  CHECK_NEAR(before[0], 0.5, 1e-13);
  CHECK_NEAR(after[0], 0.5, 1e-13);
  CHECK(before[1] > 0.3);
  CHECK_NEAR(after[1], before[1], 1e-13);
  CHECK(smooth->sets.count == 3 && smooth->sets.sets[0].nodes.count == mesh->sets.sets[0].nodes.count);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&smooth);
}

/* At the straight edges around a face that is a set, nodes slide, because the face stays the same; along an edge on
 * which a set ends they do not. */
static void nodes_slide_along_the_ends_of_sets(void)
{
  flesh_mesh *mesh = worse(1), *smooth;
  int slid = 0;
  CHECK_OK(flesh_mesh_smooth(mesh, 0.5, &smooth));
  for (int k = 0; k < mesh->sets.sets[1].nodes.count; k++) {
    const int n = mesh->sets.sets[1].nodes.values[k];
    const double *X = mesh->positions + 3 * n, *Y = smooth->positions + 3 * n;
    CHECK(Y[2] == 0);
    slid += (X[0] == 0 || X[0] == 1 || X[1] == 0 || X[1] == 1) && memcmp(X, Y, 3 * sizeof *X);
  }
  printf("# %d slid along the ends of the face\n", slid);
  CHECK(slid > 0);
  CHECK(mesh->sets.sets[2].nodes.count > 2);
  for (int k = 0; k < mesh->sets.sets[2].nodes.count; k++) {
    const size_t n = 3 * (size_t)mesh->sets.sets[2].nodes.values[k];
    CHECK(!memcmp(mesh->positions + n, smooth->positions + n, 3 * sizeof(double)));
  }
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&smooth);
}

/* Nothing moves if shapes are good enough, and no curved mesh is moved. */
static void the_rest_stays(void)
{
  flesh_mesh *mesh = worse(2), *same, *bent;
  CHECK_OK(flesh_mesh_smooth(mesh, 0.01, &same));
  CHECK(!memcmp(mesh->positions, same->positions, 3 * (size_t)mesh->nodes * sizeof(double)));
  flesh_mesh_destroy(&same);
  double *x = malloc(3 * (size_t)mesh->nodes * sizeof *x);
  for (int n = 0; n < mesh->nodes; n++) {
    const double *X = mesh->positions + 3 * n;
    x[3 * n] = X[0] + 0.02 * X[1] * X[1], x[3 * n + 1] = X[1] + 0.02 * X[0] * X[0], x[3 * n + 2] = X[2] - 0.02 * X[0] * X[2];
  }
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = mesh->nodes, .tets = mesh->tets, .positions = x,
                                                .tet_nodes = mesh->tet_nodes, .edge_nodes = mesh->edge_nodes}, NULL, &bent));
  CHECK_OK(flesh_mesh_smooth(bent, 0.4, &same));
  CHECK(!memcmp(bent->positions, same->positions, 3 * (size_t)mesh->nodes * sizeof(double)));
  free(x);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&bent);
  flesh_mesh_destroy(&same);
}

/* A flat tet has the worst shape, and would change the body if any of its corners moved. */
static void corners_stay(void)
{
  const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0.05};
  flesh_mesh *flat, *same;
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = 4, .tets = 1, .positions = x, .tet_nodes = (int[]){0, 1, 2, 3}},
                            NULL, &flat));
  CHECK_OK(flesh_mesh_smooth(flat, 0.9, &same));
  CHECK(!memcmp(same->positions, x, sizeof x));
  flesh_mesh_destroy(&flat);
  flesh_mesh_destroy(&same);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(shapes_are_better_in_the_same_body), TEST(regions_and_sets_stay_what_they_are),
                   TEST(nodes_slide_along_the_ends_of_sets), TEST(the_rest_stays), TEST(corners_stay));
}
