// TEST quick
/* test_contact_surface.c: the triangulated surface of bodies: each edge once with its faces, areas that add up, and the
 * nodes' bodies. */
#include <stdlib.h>

#include "flesh/mesh.h"
#include "geometry/contact_surface.h"
#include "test.h"

static flesh_mesh *box(int cells, double size, int order)
{
  flesh_mesh *mesh = NULL, *raised = NULL;
  CHECK_OK(flesh_mesh_box((const int[]){cells, cells, cells}, (const double[]){size, size, size},
                          (const double[]){0, 0, 0}, &mesh));
  if (order == 1) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  return raised;
}

/* Checks that all lists agree with each other, and that areas add up to `area`. */
static void check(const flesh_contact_surface *s, double area)
{
  double nodes = 0, edges = 0;
  int uses = 0;
  for (int k = 0; k < s->node_count; k++) {
    nodes += s->node_area[k];
    uses += s->node_faces[k];
    CHECK(s->node_place[s->nodes[k]] == k && (k == 0 || s->nodes[k] > s->nodes[k - 1]));
  }
  CHECK(uses == 3 * s->face_count);
  for (int e = 0; e < s->edge_count; e++) {
    const int *n = s->edges + 2 * e;
    edges += s->edge_area[e];
    CHECK(n[0] < n[1] && (e == 0 || n[0] > n[-2] || (n[0] == n[-2] && n[1] > n[-1])));
    for (int k = 0; k < 2 && k < s->edge_uses[e]; k++) {
      const int f = s->edge_faces[2 * e + k];
      int found = 0;
      for (int c = 0; c < 3; c++) found += s->face_edges[3 * f + c] == e;
      CHECK(found == 1);
    }
  }
  for (int k = 0; k < 3 * s->face_count; k++) {
    const int *n = s->edges + 2 * s->face_edges[k], a = s->faces[k], b = s->faces[k % 3 == 2 ? k - 2 : k + 1];
    CHECK((n[0] == a && n[1] == b) || (n[0] == b && n[1] == a));
  }
  CHECK_NEAR(s->area, area, 1e-13 * area);
  CHECK_NEAR(nodes, area, 1e-13 * area);
  CHECK_NEAR(edges, area, 1e-13 * area);
}

static void boxes_are_closed_surfaces(void)
{
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *mesh = box(3, 0.5, order);
    flesh_contact_surface s;
    CHECK_OK(flesh_contact_surface_of_mesh(mesh, NULL, &s));
    check(&s, 6 * 0.25);
    CHECK(s.face_count == 6 * 9 * 2 * (order == 1 ? 1 : 4));
    CHECK(s.node_count - s.edge_count + s.face_count == 2); /* Euler */
    CHECK(s.body_count == 1);
    for (int e = 0; e < s.edge_count; e++) CHECK(s.edge_uses[e] == 2);
    flesh_contact_surface_clear(&s);
    flesh_contact_surface_clear(&s);
    flesh_mesh_destroy(&mesh);
  }
}

/* Two separate tets, a third one that shares an edge with the second, and an unused node. */
static const double places[10][3] = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                     {3, 0, 0}, {4, 0, 0}, {3, 1, 0}, {3, 0, 1}, {4, -1, 0}};
static const int tets[3][4] = {{5, 6, 7, 8}, {1, 2, 3, 4}, {6, 5, 9, 0}};

static void bodies_are_what_is_connected(void)
{
  static const int given[3] = {7, 2, 4};
  flesh_mesh *mesh = NULL;
  flesh_contact_surface s;
  CHECK_OK(flesh_mesh_create(10, *places, 2, *tets, NULL, &mesh));
  CHECK_OK(flesh_contact_surface_of_mesh(mesh, NULL, &s));
  CHECK(s.node_count == 8 && s.body_count == 2 && s.node_place[0] == -1 && s.node_place[9] == -1);
  for (int k = 0; k < s.node_count; k++) CHECK(s.node_body[k] == (s.nodes[k] >= 5));
  flesh_contact_surface_clear(&s);
  flesh_mesh_destroy(&mesh);
  CHECK_OK(flesh_mesh_create(10, *places, 3, *tets, NULL, &mesh));
  CHECK_OK(flesh_contact_surface_of_mesh(mesh, given, &s));
  CHECK(s.node_count == 10 && s.body_count == 8);
  for (int k = 0; k < s.node_count; k++) {
    const int n = s.nodes[k];
    CHECK(s.node_body[k] == (n == 5 || n == 6 || n == 9 || n == 0 ? 4 : n > 4 ? 7 : 2));
  }
  int shared = 0;
  for (int e = 0; e < s.edge_count; e++)
    shared += s.edge_uses[e] == 4 && s.edges[2 * e] == 5 && s.edges[2 * e + 1] == 6;
  CHECK(shared == 1);
  flesh_contact_surface_clear(&s);
  CHECK(flesh_contact_surface_of_mesh(mesh, (const int[]){0, -1, 0}, &s) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "bodies have the numbers 0, 1");
  flesh_mesh_destroy(&mesh);
}

static void rims_and_bad_triangles(void)
{
  static const double X[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  flesh_contact_surface s;
  CHECK_OK(flesh_contact_surface_of_triangles(4, *X, 2, (const int[]){0, 1, 2, 0, 2, 3}, NULL, &s));
  check(&s, 1);
  CHECK(s.edge_count == 5 && s.mean_edge > 1 && s.mean_edge < 1.1);
  for (int e = 0; e < 5; e++) {
    const int inner = s.edges[2 * e] == 0 && s.edges[2 * e + 1] == 2;
    CHECK(s.edge_uses[e] == 1 + inner && (s.edge_faces[2 * e + 1] == -1) == !inner);
  }
  CHECK(s.node_edges[0] == 3 && s.node_edge_uses[0] == 4 && s.node_faces[0] == 2 && s.node_faces[1] == 1);
  flesh_contact_surface_clear(&s);
  CHECK(flesh_contact_surface_of_triangles(4, *X, 1, (const int[]){0, 1, 1}, NULL, &s) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_contact_surface_of_triangles(4, *X, 1, (const int[]){0, 1, 4}, NULL, &s) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "nodes 0 to 3");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(boxes_are_closed_surfaces), TEST(bodies_are_what_is_connected),
                   TEST(rims_and_bad_triangles));
}
