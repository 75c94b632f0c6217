// TEST quick
/* test_refine.c: refined meshes fill the same body with conforming tets of an eighth of the volume. */
#include <math.h>

#include "mesh/refine.h"
#include "quadratic.h"

static int by_numbers(const void *a, const void *b)
{
  const double *p = a, *q = b;
  for (int k = 0; k < 12; k++)
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  return 0;
}

static int by_place(const void *a, const void *b)
{
  const double *p = a, *q = b;
  for (int d = 0; d < 3; d++)
    if (p[d] != q[d]) return p[d] < q[d] ? -1 : 1;
  return 0;
}

/* Returns the tets as the sorted positions of their corners, sorted: [12*tets]. */
static double *sorted_tets(const flesh_mesh *mesh)
{
  const int tets = flesh_mesh_tet_count(mesh);
  double *rows = malloc(12 * (size_t)tets * sizeof *rows);
  for (int t = 0; t < tets; t++) {
    for (int a = 0; a < 4; a++)
      memcpy(rows + 12 * t + 3 * a, flesh_mesh_positions(mesh) + 3 * flesh_mesh_tets(mesh)[4 * t + a], 3 * sizeof *rows);
    qsort(rows + 12 * t, 4, 3 * sizeof *rows, by_place);
  }
  qsort(rows, (size_t)tets, 12 * sizeof *rows, by_numbers);
  return rows;
}

/* Refined twice, a box of Kuhn's tets is the box of four times the cells, whatever their shape. */
static void boxes_become_boxes(void)
{
  const double sizes[3][3] = {{2, 1, 4}, {8, 1, 0.5}, {0.25, 4, 1}};
  for (int k = 0; k < 3; k++) {
    flesh_mesh *mesh, *finer, *finest, *other;
    CHECK_OK(flesh_mesh_box((int[]){2, 1, 4}, sizes[k], (double[]){-1, 0, 2}, &mesh));
    CHECK_OK(flesh_mesh_refine(mesh, &finer));
    CHECK_OK(flesh_mesh_refine(finer, &finest));
    CHECK_OK(flesh_mesh_box((int[]){8, 4, 16}, sizes[k], (double[]){-1, 0, 2}, &other));
    const int tets = flesh_mesh_tet_count(other);
    CHECK(flesh_mesh_tet_count(finest) == tets && flesh_mesh_node_count(finest) == flesh_mesh_node_count(other));
    double *a = sorted_tets(finest), *b = sorted_tets(other), worst = 0;
    for (int i = 0; i < 12 * tets; i++) worst = fmax(worst, fabs(a[i] - b[i]));
    CHECK_NEAR(worst, 0, 1e-14);
    free(a);
    free(b);
    flesh_mesh_destroy(&mesh);
    flesh_mesh_destroy(&finer);
    flesh_mesh_destroy(&finest);
    flesh_mesh_destroy(&other);
  }
}

static flesh_mesh *with_regions(const flesh_mesh *mesh)
{
  const int tets = flesh_mesh_tet_count(mesh);
  int *regions = malloc((size_t)tets * sizeof *regions);
  flesh_mesh *tagged;
  for (int t = 0; t < tets; t++) regions[t] = t % 5 - 1;
  CHECK_OK(flesh_mesh_create(flesh_mesh_node_count(mesh), flesh_mesh_positions(mesh), tets, flesh_mesh_tets(mesh),
                             regions, &tagged));
  free(regions);
  return tagged;
}

/* On an irregular mesh, nodes, regions and volumes are kept, and the surface has four triangles for one; a
 * non-conforming face would be on it. */
static void nothing_is_lost(void)
{
  flesh_mesh *ten = raised_box(3, 0.2), *plain, *mesh, *finer;
  CHECK_OK(flesh_mesh_lower_order(ten, &plain));
  mesh = with_regions(plain);
  CHECK_OK(flesh_mesh_refine(mesh, &finer));
  const int nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  int triangles, more;
  flesh_mesh_surface(mesh, &triangles);
  flesh_mesh_surface(finer, &more);
  CHECK(flesh_mesh_order(finer) == 1 && flesh_mesh_tet_count(finer) == 8 * tets && more == 4 * triangles);
  CHECK(flesh_mesh_node_count(finer) == flesh_mesh_node_count(ten)); /* a node for each edge */
  CHECK(!memcmp(flesh_mesh_positions(finer), flesh_mesh_positions(mesh), 3 * (size_t)nodes * sizeof(double)));
  CHECK(!memcmp(flesh_mesh_positions(finer), flesh_mesh_positions(ten),
                3 * (size_t)flesh_mesh_node_count(ten) * sizeof(double)));
  for (int t = 0; t < 8 * tets; t++) {
    CHECK_NEAR(flesh_mesh_tet_volumes(finer)[t], flesh_mesh_tet_volumes(mesh)[t / 8] / 8, 1e-14);
    CHECK(flesh_mesh_regions(finer)[t] == t / 8 % 5 - 1);
  }
  flesh_mesh_info info;
  flesh_mesh_inspect(finer, &info);
  CHECK(info.flipped == 0 && info.unused_nodes == 0 && info.regions == 5);
  /* Shapes do not degenerate: the worst after a second refinement is hardly worse than after the first. */
  flesh_mesh *finest;
  CHECK_OK(flesh_mesh_refine(finer, &finest));
  flesh_mesh_info last;
  flesh_mesh_inspect(finest, &last);
  CHECK(last.radius_ratio_min > 0.8 * info.radius_ratio_min);
  flesh_mesh_destroy(&finest);
  flesh_mesh_destroy(&ten);
  flesh_mesh_destroy(&plain);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&finer);
}

/* x plus a quadratic function, so that straight tets get curved edges, but no corner moves so far that a tet is
 * subdivided differently. */
static void bend(const double *X, double x[3])
{
  const double y = X[1] - 2.75, z = X[2] - 1;
  x[0] = X[0] + 0.1 * y * y - 0.05 * X[0] * z;
  x[1] = X[1] + 0.07 * X[0] * X[0];
  x[2] = X[2] - 0.06 * X[0] * y + 0.03 * z * z;
}

/* A quadratic map is the same map in its parts: a bent mesh refined is the refined mesh bent. */
static void curved_tets_keep_their_shape(void)
{
  flesh_mesh *straight = raised_box(2, 0), *bent, *finer, *reference;
  const int nodes = flesh_mesh_node_count(straight), tets = flesh_mesh_tet_count(straight);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  int *ten = malloc(10 * (size_t)tets * sizeof *ten);
  for (int n = 0; n < nodes; n++) bend(flesh_mesh_positions(straight) + 3 * n, x + 3 * n);
  for (int t = 0; t < tets; t++) ten_nodes(straight, t, ten + 10 * t);
  CHECK_OK(flesh_mesh_create_quadratic(nodes, x, tets, ten, NULL, &bent));
  CHECK_OK(flesh_mesh_refine(bent, &finer));
  CHECK_OK(flesh_mesh_refine(straight, &reference));
  const int more = flesh_mesh_node_count(finer);
  CHECK(more == flesh_mesh_node_count(reference) && flesh_mesh_order(finer) == 2);
  CHECK(flesh_mesh_tet_count(finer) == 8 * tets);
  double worst = 0;
  for (int n = 0; n < more; n++) {
    double to[3];
    bend(flesh_mesh_positions(reference) + 3 * n, to);
    for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(flesh_mesh_positions(finer)[3 * n + d] - to[d]));
  }
  CHECK_NEAR(worst, 0, 1e-14);
  CHECK_NEAR(flesh_mesh_volume(finer, flesh_mesh_positions(finer)), flesh_mesh_volume(bent, x), 1e-13);
  /* A field is reproduced in the same way. */
  double *field = malloc(3 * (size_t)more * sizeof *field);
  for (int n = 0; n < nodes; n++) bend(flesh_mesh_positions(straight) + 3 * n, field + 3 * n);
  CHECK_OK(flesh_mesh_refine_field(straight, field));
  for (int n = 0; n < 3 * more; n++) CHECK_NEAR(field[n], flesh_mesh_positions(finer)[n], 1e-14);
  free(field);
  free(x);
  free(ten);
  flesh_mesh_destroy(&straight);
  flesh_mesh_destroy(&bent);
  flesh_mesh_destroy(&finer);
  flesh_mesh_destroy(&reference);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(boxes_become_boxes), TEST(nothing_is_lost), TEST(curved_tets_keep_their_shape));
}
