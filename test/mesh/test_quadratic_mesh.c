// TEST quick
/* test_quadratic_mesh.c: meshes of ten-node tets: creation, checks and faces. */
#include "quadratic.h"

static void raised_meshes_have_middles(void)
{
  flesh_mesh *box, *mesh, *again;
  CHECK_OK(flesh_mesh_box((int[]){3, 2, 4}, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &box));
  CHECK(flesh_mesh_order(box) == 1 && !flesh_mesh_tet_edges(box));
  CHECK_OK(flesh_mesh_raise_order(box, &mesh));
  int corners = flesh_mesh_node_count(box), nodes = flesh_mesh_node_count(mesh), tets = flesh_mesh_tet_count(mesh);
  /* Kuhn's tets subdivide into those of the grid with twice the cells, whose nodes are therefore these. */
  CHECK(flesh_mesh_order(mesh) == 2 && nodes == 7 * 5 * 9 && tets == flesh_mesh_tet_count(box));
  CHECK(!memcmp(flesh_mesh_positions(mesh), flesh_mesh_positions(box), 3 * (size_t)corners * sizeof(double)));
  CHECK(!memcmp(flesh_mesh_tets(mesh), flesh_mesh_tets(box), 4 * (size_t)tets * sizeof(int)));
  const double *x = flesh_mesh_positions(mesh);
  int *low = calloc((size_t)nodes, sizeof *low), *high = calloc((size_t)nodes, sizeof *high);
  for (int t = 0; t < tets; t++) {
    int n[10];
    ten_nodes(mesh, t, n);
    CHECK(!flesh_mesh_tet_curved(mesh)[t]);
    for (int k = 0; k < 6; k++) {
      int a = n[ends[k][0]], b = n[ends[k][1]], m = n[4 + k];
      CHECK(m >= corners && m < nodes);
      for (int d = 0; d < 3; d++) CHECK_NEAR(x[3 * m + d], (x[3 * a + d] + x[3 * b + d]) / 2, 1e-15);
      low[m] = a < b ? a : b, high[m] = a < b ? b : a;
    }
  }
  for (int m = corners + 1; m < nodes; m++)
    CHECK(low[m] > low[m - 1] || (low[m] == low[m - 1] && high[m] > high[m - 1]));
  for (int n = 0; n < nodes; n++) CHECK(flesh_mesh_node_used(mesh)[n] == 1);
  CHECK(flesh_mesh_raise_order(mesh, &again) == FLESH_ERR_ARGUMENT && !again);
  CHECK_TEXT(flesh_error_text(), "order 2 already");
  free(low);
  free(high);
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&mesh);
}

static void lowered_meshes_have_the_corners(void)
{
  flesh_mesh *mesh = raised_box(2, 0.1), *lowered, *again, *none;
  CHECK_OK(flesh_mesh_lower_order(mesh, &lowered));
  CHECK(flesh_mesh_order(lowered) == 1 && flesh_mesh_node_count(lowered) == 3 * 4 * 3);
  CHECK(!memcmp(flesh_mesh_tets(lowered), flesh_mesh_tets(mesh), 4 * 72 * sizeof(int)));
  CHECK(!memcmp(flesh_mesh_positions(lowered), flesh_mesh_positions(mesh), 3 * 36 * sizeof(double)));
  CHECK(flesh_mesh_lower_order(lowered, &none) == FLESH_ERR_ARGUMENT && !none);
  flesh_mesh_destroy(&lowered);
  /* Corners, mid-edge nodes and an unused node in any order. */
  int nodes = flesh_mesh_node_count(mesh), ten[10 * 72];
  double *x = malloc(3 * ((size_t)nodes + 1) * sizeof *x);
  for (int n = 0; n < nodes; n++) memcpy(x + 3 * (nodes - n), flesh_mesh_positions(mesh) + 3 * n, 3 * sizeof *x);
  x[0] = x[1] = x[2] = 77;
  for (int t = 0; t < 72; t++) {
    ten_nodes(mesh, t, ten + 10 * t);
    for (int k = 0; k < 10; k++) ten[10 * t + k] = nodes - ten[10 * t + k];
  }
  CHECK_OK(flesh_mesh_create_quadratic(nodes + 1, x, 72, ten, NULL, &again));
  CHECK_OK(flesh_mesh_lower_order(again, &lowered));
  CHECK(flesh_mesh_node_count(lowered) == 37 && flesh_mesh_positions(lowered)[0] == 77);
  for (int n = 0; n < 36; n++)
    CHECK(!memcmp(flesh_mesh_positions(lowered) + 3 * (36 - n), flesh_mesh_positions(mesh) + 3 * n, 3 * sizeof *x));
  for (int k = 0; k < 4 * 72; k++) CHECK(flesh_mesh_tets(lowered)[k] == 36 - flesh_mesh_tets(mesh)[k]);
  free(x);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&again);
  flesh_mesh_destroy(&lowered);
}

/* Mid-edge nodes do not depend on the order and orientation of the tets. */
static void the_order_of_tets_does_not_matter(void)
{
  flesh_mesh *mesh = raised_box(2, 0.1), *mixed, *raised;
  int tets = flesh_mesh_tet_count(mesh), corners = 0;
  int *shuffled = malloc(4 * (size_t)tets * sizeof *shuffled);
  for (int t = 0; t < tets; t++)
    for (int i = 0; i < 4; i++) {
      int n = flesh_mesh_tets(mesh)[4 * ((7 * t + 3) % tets) + (i + t) % 4];
      shuffled[4 * t + i] = n;
      corners = n >= corners ? n + 1 : corners;
    }
  CHECK_OK(flesh_mesh_create(corners, flesh_mesh_positions(mesh), tets, shuffled, NULL, &mixed));
  flesh_mesh_info info;
  flesh_mesh_inspect(mixed, &info);
  CHECK(info.flipped > 0);
  CHECK_OK(flesh_mesh_raise_order(mixed, &raised));
  CHECK(flesh_mesh_node_count(raised) == flesh_mesh_node_count(mesh));
  CHECK(!memcmp(flesh_mesh_positions(raised), flesh_mesh_positions(mesh),
                3 * (size_t)flesh_mesh_node_count(mesh) * sizeof(double)));
  free(shuffled);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&mixed);
  flesh_mesh_destroy(&raised);
}

static void flips_take_the_edges_with_them(void)
{
  static const int orders[4][4] = {{0, 1, 2, 3}, {1, 0, 2, 3}, {2, 1, 0, 3}, {3, 2, 0, 1}};
  static const double x[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  flesh_mesh *mesh;
  for (int o = 0; o < 4; o++) {
    double all[30];
    int n[10];
    memcpy(all, x, sizeof x);
    for (int i = 0; i < 4; i++) n[i] = orders[o][i];
    for (int k = 0; k < 6; k++) {
      n[4 + k] = 4 + k;
      for (int d = 0; d < 3; d++)
        all[3 * (4 + k) + d] = (x[3 * n[ends[k][0]] + d] + x[3 * n[ends[k][1]] + d]) / 2;
    }
    CHECK_OK(flesh_mesh_create_quadratic(10, all, 1, n, (int[]){5}, &mesh));
    flesh_mesh_info info;
    flesh_mesh_inspect(mesh, &info);
    CHECK(info.flipped == (o > 0) && flesh_mesh_regions(mesh)[0] == 5);
    CHECK_NEAR(flesh_mesh_tet_volumes(mesh)[0], 1. / 6, 1e-16);
    CHECK_NEAR(flesh_mesh_volume(mesh, all), 1. / 6, 1e-16);
    ten_nodes(mesh, 0, n);
    for (int k = 0; k < 6; k++)
      for (int d = 0; d < 3; d++)
        CHECK(all[3 * n[4 + k] + d] == (all[3 * n[ends[k][0]] + d] + all[3 * n[ends[k][1]] + d]) / 2);
    CHECK(!flesh_mesh_tet_curved(mesh)[0]);
    flesh_mesh_destroy(&mesh);
  }
}

/* Two tets share the face 012: valid mid-edge nodes, and each fault in turn. */
static void edges_that_do_not_fit_are_refused(void)
{
  double x[3 * 15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0.5, -1};
  const int good[20] = {0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 0, 2, 1, 4, 7, 6, 5, 11, 12, 13};
  int bad[20];
  for (int t = 0; t < 2; t++)
    for (int k = 0; k < 6; k++)
      for (int d = 0; d < 3; d++)
        x[3 * good[10 * t + 4 + k] + d] =
            (x[3 * good[10 * t + ends[k][0]] + d] + x[3 * good[10 * t + ends[k][1]] + d]) / 2;
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_create_quadratic(15, x, 2, good, NULL, &mesh));
  flesh_mesh_info info;
  flesh_mesh_inspect(mesh, &info);
  CHECK(info.unused_nodes == 1 && info.triangles == 24);
  flesh_mesh_destroy(&mesh);
  static const struct {
    int place, node;
    const char *text;
  } faults[] = {
      {15, 14, "tet 1 has node 14 on the edge of nodes 1 and 2, but an earlier tet has node 6 there"},
      {19, 10, "tet 1 has node 10 on the edge of nodes 1 and 4, but it is on the edge of nodes 2 and 3 already"},
      {9, 4, "tet 0 has node 4 on the edge of nodes 2 and 3, but it is the corner of a tet"},
      {9, 15, "tet 0 uses node 15; the nodes are 0 to 14"},
      {12, -1, "tet 1 uses node -1; the nodes are 0 to 14"},
      {8, 9, "tet 0 has node 9 on the edge of nodes 1 and 3, but it is"},
  };
  for (size_t f = 0; f < sizeof faults / sizeof *faults; f++) {
    memcpy(bad, good, sizeof bad);
    bad[faults[f].place] = faults[f].node;
    if (f == 5) bad[7] = 9;
    CHECK(flesh_mesh_create_quadratic(15, x, 2, bad, NULL, &mesh) == FLESH_ERR_ARGUMENT && !mesh);
    CHECK_TEXT(flesh_error_text(), faults[f].text);
  }
  x[3 * 12 + 1] = NAN;
  CHECK(flesh_mesh_create_quadratic(15, x, 2, good, NULL, &mesh) == FLESH_ERR_ARGUMENT && !mesh);
  CHECK_TEXT(flesh_error_text(), "node 12: y is nan");
  CHECK(flesh_mesh_create_quadratic(15, x, 0, good, NULL, &mesh) == FLESH_ERR_ARGUMENT && !mesh);
}

static void faces_are_four_triangles(void)
{
  flesh_mesh *mesh = raised_box(2, 0.1);
  const double *x = flesh_mesh_positions(mesh);
  int count;
  const int *s = flesh_mesh_surface(mesh, &count), *behind = flesh_mesh_surface_tets(mesh);
  double flux = 0, area[3] = {0};
  CHECK(count == 4 * 2 * 2 * (4 + 6 + 6));
  for (int f = 0; f < count; f++) {
    const double *a = x + 3 * s[3 * f], *b = x + 3 * s[3 * f + 1], *c = x + 3 * s[3 * f + 2];
    for (int d = 0; d < 3; d++) {
      int i = (d + 1) % 3, j = (d + 2) % 3;
      double normal = ((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])) / 2;
      area[d] += normal;
      flux += normal * (a[d] + b[d] + c[d]) / 3;
    }
    int n[10], found = 0;
    ten_nodes(mesh, behind[f], n);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 10; k++) found += n[k] == s[3 * f + i];
    CHECK(found == 3);
  }
  for (int f = 0; f < count; f += 4) {
    const int *q = s + 3 * f, middle[3] = {q[1], q[5], q[2]};
    CHECK(q[3] == q[1] && q[6] == q[2] && q[7] == q[5] && !memcmp(q + 9, middle, sizeof middle));
    CHECK(flesh_mesh_node_used(mesh)[q[1]] && behind[f] == behind[f + 3]);
  }
  for (int d = 0; d < 3; d++) CHECK_NEAR(area[d], 0, 1e-14);
  CHECK_NEAR(flux / 3, flesh_mesh_volume(mesh, x), 1e-13);
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(raised_meshes_have_middles), TEST(lowered_meshes_have_the_corners),
                   TEST(the_order_of_tets_does_not_matter), TEST(flips_take_the_edges_with_them),
                   TEST(edges_that_do_not_fit_are_refused), TEST(faces_are_four_triangles));
}
