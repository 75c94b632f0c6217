// TEST full memory
/* test_bisect.c: local refinement by bisection: refined meshes are conforming, fill the same body, keep their shapes,
 * and reproduce fields. */
#include "quadratic.h"

/* Chooses some random tets, to be bisected one to three times, and those at node 0, once, so that sizes differ more and
 * more. */
static uint8_t *choose(const flesh_mesh *mesh, unsigned long long *seed)
{
  const int tets = flesh_mesh_tet_count(mesh);
  uint8_t *halvings = calloc((size_t)tets, 1);
  for (int k = 0; k < 20; k++) halvings[(int)(tets * test_uniform(seed))] = (uint8_t)(1 + 3 * test_uniform(seed));
  for (int k = 0; k < 4 * tets; k++)
    if (flesh_mesh_tets(mesh)[k] == 0) halvings[k / 4] |= 1;
  return halvings;
}

static double distance(const double *a, const double *b) { return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]); }

static double area(const flesh_mesh *mesh)
{
  int count;
  const int *surface = flesh_mesh_surface(mesh, &count);
  double sum = 0;
  for (int k = 0; k < count; k++) {
    const double *X = flesh_mesh_positions(mesh), *a = X + 3 * surface[3 * k], *b = X + 3 * surface[3 * k + 1],
                 *c = X + 3 * surface[3 * k + 2];
    const double p = distance(a, b), q = distance(b, c), r = distance(c, a), h = (p + q + r) / 2;
    sum += sqrt(fmax(h * (h - p) * (h - q) * (h - r), 0));
  }
  return sum;
}

/* Each tet is a part of its parent, and the parts of one tet fill it. */
static void check_parents(const flesh_mesh *mesh, const flesh_mesh *finer, const flesh_mesh_parents *parents,
                          const uint8_t *halvings)
{
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  double *sums = calloc((size_t)tets, sizeof *sums), worst = 0;
  int *parts = calloc((size_t)tets, sizeof *parts), good = 1;
  CHECK(parents->nodes == flesh_mesh_node_count(finer) && parents->tets == flesh_mesh_tet_count(finer));
  CHECK(!memcmp(flesh_mesh_positions(mesh), flesh_mesh_positions(finer), 3 * (size_t)nodes * sizeof(double)));
  for (int t = 0; t < parents->tets; t++) {
    good &= !t || parents->tet[t] >= parents->tet[t - 1];
    good &= flesh_mesh_regions(finer)[t] == flesh_mesh_regions(mesh)[parents->tet[t]];
    sums[parents->tet[t]] += flesh_mesh_tet_volumes(finer)[t];
    parts[parents->tet[t]]++;
  }
  for (int t = 0; t < tets; t++) {
    worst = fmax(worst, fabs(sums[t] / flesh_mesh_tet_volumes(mesh)[t] - 1));
    good &= parts[t] > halvings[t];
  }
  CHECK_NEAR(worst, 0, 1e-11);
  double *moved = malloc(3 * (size_t)parents->nodes * sizeof *moved);
  CHECK_OK(flesh_mesh_transfer(mesh, parents, 3, flesh_mesh_positions(mesh), moved));
  worst = 0;
  for (int i = 0; i < 3 * parents->nodes; i++) worst = fmax(worst, fabs(moved[i] - flesh_mesh_positions(finer)[i]));
  CHECK_NEAR(worst, 0, 1e-13);
  for (int i = 0; i < 4 * parents->nodes; i++) good &= parents->place[i] >= 0 && parents->place[i] <= 1;
  CHECK(good);
  free(sums);
  free(parts);
  free(moved);
}

/* Refines randomly, many times, replacing *mesh. Returns the least radius ratio on the way, over that of the start. */
static double refine_often(flesh_mesh **mesh, int times)
{
  flesh_mesh_info info, first;
  const double volume = flesh_mesh_volume(*mesh, flesh_mesh_positions(*mesh)), skin = area(*mesh);
  unsigned long long seed = 5;
  double least = 1;
  flesh_mesh_inspect(*mesh, &first);
  for (int k = 0; k < times; k++) {
    flesh_mesh *finer;
    flesh_mesh_parents parents;
    uint8_t *halvings = choose(*mesh, &seed);
    CHECK_OK(flesh_mesh_refine_marked(*mesh, halvings, &finer, &parents));
    if (!finer) return 0;
    check_parents(*mesh, finer, &parents, halvings);
    flesh_mesh_inspect(finer, &info);
    CHECK(info.flipped == 0 && info.unused_nodes == first.unused_nodes && info.regions == first.regions);
    CHECK_NEAR(info.volume / volume, 1, 1e-12);
    /* A non-conforming face would be on the surface. */
    if (!info.curved) CHECK_NEAR(area(finer) / skin, 1, 1e-11);
    least = fmin(least, info.radius_ratio_min / first.radius_ratio_min);
    flesh_mesh_parents_clear(&parents);
    flesh_mesh_destroy(mesh);
    free(halvings);
    *mesh = finer;
  }
  printf("# %d tets from %d, edges of %.3g to %.3g, least radius ratio %.3g, of the start's %.3g %.3g\n", info.tets,
         first.tets, info.edge_min, info.edge_max, info.radius_ratio_min, first.radius_ratio_min, least);
  CHECK(info.tets > 5 * first.tets);
  CHECK(info.edge_min < first.edge_min / 8);
  return least;
}

static void boxes_keep_their_shapes(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *box, *mesh;
    CHECK_OK(flesh_mesh_box((int[]){2, 2, 3}, (double[]){1, 1, 1.5}, (double[]){0, 0, 0}, &box));
    CHECK_OK(flesh_mesh_raise_order(box, &mesh));
    CHECK(refine_often(order == 1 ? &box : &mesh, 20) > 0.5);
    flesh_mesh_destroy(&box);
    flesh_mesh_destroy(&mesh);
  }
}

static void irregular_tets_keep_their_shapes(void)
{
  flesh_mesh *ten = raised_box(2, 0.25), *mesh;
  CHECK_OK(flesh_mesh_lower_order(ten, &mesh));
  CHECK(refine_often(&mesh, 20) > 0.15);
  flesh_mesh_destroy(&ten);
  flesh_mesh_destroy(&mesh);
}

static int by_shape(const void *a, const void *b)
{
  const double *p = a, *q = b;
  for (int k = 0; k < 6; k++)
    if (fabs(p[k] - q[k]) > 1e-6) return p[k] < q[k] ? -1 : 1;
  return 0;
}

static int by_number(const void *a, const void *b)
{
  const double p = *(const double *)a, q = *(const double *)b;
  return (p > q) - (p < q);
}

/* Counts the different lists of edge lengths over the cube root of the volume. */
static int count_shapes(const flesh_mesh *mesh)
{
  const int tets = flesh_mesh_tet_count(mesh);
  const double *X = flesh_mesh_positions(mesh);
  double *shapes = malloc(6 * (size_t)tets * sizeof *shapes);
  int count = 0;
  for (int t = 0; t < tets; t++) {
    const int *n = flesh_mesh_tets(mesh) + 4 * t;
    for (int e = 0; e < 6; e++)
      shapes[6 * t + e] = distance(X + 3 * n[ends[e][0]], X + 3 * n[ends[e][1]]) / cbrt(flesh_mesh_tet_volumes(mesh)[t]);
    qsort(shapes + 6 * t, 6, sizeof *shapes, by_number);
  }
  qsort(shapes, (size_t)tets, 6 * sizeof *shapes, by_shape);
  for (int t = 0; t < tets; t++) count += !t || by_shape(shapes + 6 * t, shapes + 6 * (t - 1));
  free(shapes);
  return count;
}

/* One tet has at most 72 similarity classes of parts (Arnold, Mukherjee & Pouly 2000). */
static void shapes_are_few(void)
{
  unsigned long long seed = 3;
  for (int k = 0; k < 6; k++) {
    double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int i = 0; i < 12; i++) x[i] += 0.6 * (test_uniform(&seed) - 0.5);
    flesh_mesh *mesh, *finer;
    CHECK_OK(flesh_mesh_create(4, x, 1, (int[]){0, 1, 2, 3}, NULL, &mesh));
    int shapes[6];
    for (int level = 0; level < 6; level++) {
      uint8_t *halvings = malloc((size_t)flesh_mesh_tet_count(mesh));
      memset(halvings, 2, (size_t)flesh_mesh_tet_count(mesh));
      CHECK_OK(flesh_mesh_refine_marked(mesh, halvings, &finer, NULL));
      free(halvings);
      flesh_mesh_destroy(&mesh);
      mesh = finer;
      shapes[level] = count_shapes(mesh);
    }
    printf("# %d shapes of %d tets\n", shapes[5], flesh_mesh_tet_count(mesh));
    CHECK(shapes[5] <= 72 && shapes[5] == shapes[4]);
    flesh_mesh_destroy(&mesh);
  }
}

static double of_degree_2(const double x[3])
{
  return 1 + x[0] - 2 * x[1] + 3 * x[2] * x[0] - x[1] * x[1] + 0.5 * x[2] * x[2] + x[0] * x[1];
}

/* Affine fields on four-node tets and quadratic ones on straight ten-node tets are reproduced exactly. */
static void fields_are_taken_over_exactly(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *ten = raised_box(2, 0.2), *four, *finer;
    CHECK_OK(flesh_mesh_lower_order(ten, &four));
    const flesh_mesh *mesh = order == 1 ? four : ten;
    unsigned long long seed = 9;
    uint8_t *halvings = choose(mesh, &seed);
    flesh_mesh_parents parents;
    CHECK_OK(flesh_mesh_refine_marked(mesh, halvings, &finer, &parents));
    const int nodes = flesh_mesh_node_count(mesh), more = flesh_mesh_node_count(finer);
    double *field = malloc(2 * (size_t)nodes * sizeof *field), *moved = malloc(2 * (size_t)more * sizeof *moved), worst = 0;
    for (int pass = 0; pass < 2; pass++) {
      for (int n = 0; n < (pass ? more : nodes); n++) {
        const double *x = flesh_mesh_positions(pass ? finer : mesh) + 3 * n;
        const double values[2] = {1 + x[0] - 3 * x[1] + x[2] / 3, order == 2 ? of_degree_2(x) : x[2]};
        for (int c = 0; c < 2 && !pass; c++) field[2 * n + c] = values[c];
        for (int c = 0; c < 2 && pass; c++) worst = fmax(worst, fabs(moved[2 * n + c] - values[c]));
      }
      if (!pass) CHECK_OK(flesh_mesh_transfer(mesh, &parents, 2, field, moved));
    }
    CHECK(more > nodes + 20);
    CHECK_NEAR(worst, 0, 1e-13);
    CHECK(flesh_mesh_transfer(mesh, &parents, 0, field, moved) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "0 components");
    parents.nodes = nodes - 1;
    CHECK(flesh_mesh_transfer(mesh, &parents, 2, field, moved) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "are not in this mesh");
    parents.nodes = more;
    free(field);
    free(moved);
    free(halvings);
    flesh_mesh_parents_clear(&parents);
    CHECK(!parents.tet && !parents.nodes);
    flesh_mesh_destroy(&ten);
    flesh_mesh_destroy(&four);
    flesh_mesh_destroy(&finer);
  }
}

static void bend(const double *X, double x[3])
{
  x[0] = X[0] + 0.1 * X[1] * X[1];
  x[1] = X[1] + 0.07 * X[0] * X[0];
  x[2] = X[2] - 0.06 * X[0] * X[1];
}

/* A quadratic map is the same map in its parts: a bent mesh refined is the refined mesh bent. */
static void curved_bodies_keep_their_shape(void)
{
  flesh_mesh *straight = raised_box(2, 0), *bent, *finer, *reference;
  const int nodes = flesh_mesh_node_count(straight), tets = flesh_mesh_tet_count(straight);
  double *x = malloc(3 * (size_t)nodes * sizeof *x), worst = 0;
  int *ten = malloc(10 * (size_t)tets * sizeof *ten);
  for (int n = 0; n < nodes; n++) bend(flesh_mesh_positions(straight) + 3 * n, x + 3 * n);
  for (int t = 0; t < tets; t++) ten_nodes(straight, t, ten + 10 * t);
  CHECK_OK(flesh_mesh_create_quadratic(nodes, x, tets, ten, NULL, &bent));
  uint8_t *halvings = calloc((size_t)tets, 1);
  halvings[3] = 4, halvings[tets - 1] = 1;
  CHECK_OK(flesh_mesh_refine_marked(bent, halvings, &finer, NULL));
  flesh_mesh_parents parents;
  CHECK_OK(flesh_mesh_refine_marked(straight, halvings, &reference, &parents));
  /* Other edges may be the longest on the bent mesh: compare by its own map. */
  double *moved = malloc(3 * (size_t)parents.nodes * sizeof *moved);
  CHECK_OK(flesh_mesh_transfer(straight, &parents, 3, x, moved));
  for (int n = 0; n < parents.nodes; n++) {
    double to[3];
    bend(flesh_mesh_positions(reference) + 3 * n, to);
    worst = fmax(worst, distance(to, moved + 3 * n));
  }
  CHECK_NEAR(worst, 0, 1e-13);
  CHECK(refine_often(&finer, 12) > 0.2);
  CHECK_NEAR(flesh_mesh_volume(finer, flesh_mesh_positions(finer)), flesh_mesh_volume(bent, x), 1e-12);
  flesh_mesh_info info;
  flesh_mesh_inspect(finer, &info);
  CHECK(info.curved > tets && info.order == 2);
  free(x);
  free(ten);
  free(moved);
  free(halvings);
  flesh_mesh_parents_clear(&parents);
  flesh_mesh_destroy(&straight);
  flesh_mesh_destroy(&bent);
  flesh_mesh_destroy(&finer);
  flesh_mesh_destroy(&reference);
}

/* Bisecting one tet only affects its neighbours as far as conformity requires; if nothing is marked, nothing is
 * bisected. */
static void what_is_not_marked_stays(void)
{
  flesh_mesh *box, *same, *finer;
  CHECK_OK(flesh_mesh_box((int[]){4, 4, 4}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &box));
  const int tets = flesh_mesh_tet_count(box);
  uint8_t *halvings = calloc((size_t)tets, 1);
  CHECK_OK(flesh_mesh_refine_marked(box, halvings, &same, NULL));
  CHECK(flesh_mesh_tet_count(same) == tets && flesh_mesh_node_count(same) == flesh_mesh_node_count(box));
  CHECK(!memcmp(flesh_mesh_tets(same), flesh_mesh_tets(box), 4 * (size_t)tets * sizeof(int)));
  halvings[0] = 1; /* the diagonal of a cell, which its six tets share */
  CHECK_OK(flesh_mesh_refine_marked(box, halvings, &finer, NULL));
  CHECK(flesh_mesh_tet_count(finer) == tets + 6 && flesh_mesh_node_count(finer) == flesh_mesh_node_count(box) + 1);
  flesh_mesh_destroy(&finer);
  halvings[0] = 255; /* 2^255 parts are refused before memory is exhausted */
  CHECK(flesh_mesh_refine_marked(box, halvings, &finer, NULL) == FLESH_ERR_ARGUMENT && !finer);
  CHECK_TEXT(flesh_error_text(), "the refined mesh has 5.79e+76 tets at least; 536870911 are supported");
  free(halvings);
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&same);
  flesh_mesh_destroy(&finer);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(boxes_keep_their_shapes), TEST(irregular_tets_keep_their_shapes), TEST(shapes_are_few),
                   TEST(fields_are_taken_over_exactly), TEST(curved_bodies_keep_their_shape),
                   TEST(what_is_not_marked_stays));
}
