// TEST quick seconds=60
/* test_contact_bodies.c: the barrier between whole bodies: cubes of four-node and ten-node tets on top of each other,
 * and curved faces, whose energy converges to that of the surfaces as triangles become small. */
#include "facing.h"
#include "flesh/mesh.h"
#include "geometry/barrier.h"

static facing f; /* large */

/* Adds the surface of a cube of side 1 m. */
static void add_cube(int cells, int order, double z)
{
  flesh_mesh *mesh = NULL, *raised = NULL;
  flesh_contact_surface s;
  const int first = f.nodes, body = first ? f.body[first - 1] + 1 : 0;
  CHECK_OK(flesh_mesh_box((const int[]){cells, cells, cells}, (const double[]){1, 1, 1}, (const double[]){0, 0, z},
                          &mesh));
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(flesh_contact_surface_of_mesh(mesh, NULL, &s));
  for (int k = 0; k < s.node_count; k++, f.nodes++) {
    memcpy(f.X + 3 * f.nodes, flesh_mesh_positions(mesh) + 3 * s.nodes[k], 3 * sizeof *f.X);
    memcpy(f.x + 3 * f.nodes, flesh_mesh_positions(mesh) + 3 * s.nodes[k], 3 * sizeof *f.X);
    f.body[f.nodes] = body;
  }
  for (int k = 0; k < 3 * s.face_count; k++) f.triangles[3 * f.faces + k] = first + s.node_place[s.faces[k]];
  f.faces += s.face_count;
  flesh_contact_surface_clear(&s);
  flesh_mesh_destroy(&mesh);
}

/* Cubes of different meshes face to face have the pressure of obstacles: k |B'| on the area of the nodes that face the
 * other body, half of it from each; nodes of the rim have a share of the sides. */
static void cubes_bear_as_obstacles_do(void)
{
  static double r[3 * FACING_NODES];
  for (int trial = 0; trial < 10; trial++) {
    const double w = trial % 2 ? 0.45 : 0.04, d = 0.45 * w, z = 1 + d;
    const flesh_contact_law law = {3e4, w, FLESH_CONTACT_EDGE_THICKNESS * w};
    flesh_contact_set set;
    double value, first, second, area = 0, force = 0;
    add_cube(3, 1 + trial / 2 % 2, 0);
    add_cube(trial < 2 ? 4 : trial < 6 ? 2 : 3, trial < 4 ? 1 : 2, z);
    facing_finish(&f);
    CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
    const double energy = facing_energy(&f, &set, f.x, r);
    for (int k = 0; k < f.surface.node_count; k++)
      if (fabs(f.x[3 * f.surface.nodes[k] + 2] - (f.surface.node_body[k] ? z : 1)) < 1e-12)
        area += f.surface.node_area[k] / 2;
    for (int i = 0; i < f.nodes; i++) force += f.body[i] ? r[3 * i + 2] : 0;
    flesh_barrier_law(d / w, &value, &first, &second);
    /* Nodes of the rim also have half of the adjacent cells of the sides: 2/n of the face of n cells along an edge. */
    const double below = 3 * (1 + trial / 2 % 2), on_top = trial < 2 ? 4 : trial < 4 ? 2 : trial < 6 ? 4 : 6;
    CHECK_NEAR(area, 1 + 1 / below + 1 / on_top, 1e-12);
    if (w < 0.1) { /* the sides' nodes are out of reach */
      CHECK_NEAR(energy, law.stiffness * area * w * value, 1e-11 * energy);
      CHECK_NEAR(force, law.stiffness * area * first, -1e-11 * force);
    }
    CHECK(area > 1 && area < 2.1 && energy > law.stiffness * area * w * value * (1 - 1e-11));
    /* Convex bodies: one pair for each point, also if nodes are exactly above nodes and edges. */
    for (int k = 0; k < set.count; k++) {
      CHECK(set.pairs[k].weight > 0 && (k == 0 || set.pairs[k].owner > set.pairs[k - 1].owner));
      const double *at = f.x + 3 * set.pairs[k].nodes[0];
      const int inside = at[0] > 0 && at[0] < 1 && at[1] > 0 && at[1] < 1;
      CHECK(!inside || set.pairs[k].kind == FLESH_CONTACT_POINT_TRIANGLE);
    }
    flesh_contact_set_clear(&set);
    facing_clear(&f);
  }
}

/* A bowl and a dome of radius 1 m and 2 m that face each other, with more and more triangles at the same thickness. */
static double energy_of_caps(int cells)
{
  const flesh_contact_law law = {3e4, 0.3, FLESH_CONTACT_EDGE_THICKNESS * 0.3};
  flesh_contact_set set;
  facing_add_sheet(&f, cells, 0, 0, 1, 0, 1, 0.3);
  const int second = f.nodes;
  facing_add_sheet(&f, cells - 1, 0, 0, 1, 0, 0, 0.3);
  for (int i = 0; i < f.nodes; i++) {
    const double x = f.X[3 * i] - 0.4, y = f.X[3 * i + 1] - 0.45;
    f.x[3 * i + 2] = f.X[3 * i + 2] = i < second ? (x * x + y * y) / 4 : 0.12 + (x * x + 0.5 * y * y) / 2;
  }
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
  const double energy = facing_energy(&f, &set, f.x, NULL);
  for (int k = 0; k < set.count; k++) CHECK(set.pairs[k].owner >= 0);
  flesh_contact_set_clear(&set);
  facing_clear(&f);
  return energy;
}

static void curved_faces_converge(void)
{
  static const int cells[4] = {4, 8, 16, 22};
  double energy[4];
  for (int k = 0; k < 4; k++) energy[k] = energy_of_caps(cells[k]);
  const double limit = energy[3] + (energy[3] - energy[2]) * 16 * 16 / (22. * 22 - 16 * 16);
  double error[4];
  for (int k = 0; k < 4; k++) error[k] = fabs(energy[k] / limit - 1);
  printf("# errors %.2e %.2e %.2e of the limit %.6g J\n", error[0], error[1], error[2], limit);
  CHECK_BELOW(error[1], 0.4 * error[0]); /* 1/4 for second order; the triangles are random */
  CHECK_BELOW(error[2], 0.4 * error[1]);
  CHECK_BELOW(error[2], 1e-2);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(cubes_bear_as_obstacles_do), TEST(curved_faces_converge));
}
