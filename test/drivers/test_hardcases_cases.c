// TEST quick sources=hardcases/cases.c,hardcases/mesh.c,hardcases/start.c
/* test_hardcases_cases.c: the battery's meshes and start states are as hard as they say. */
#include <stdlib.h>

#include "hardcases/cases.h"
#include "test.h"

static const flesh_hardcases_case *row(const char *name)
{
  const flesh_hardcases_case *r = flesh_hardcases_case_table;
  while (r->name && strcmp(r->name, name)) r++;
  CHECK(r->name != NULL);
  return r->name ? r : flesh_hardcases_case_table;
}

typedef struct body {
  flesh_mesh *mesh;
  flesh_mesh_info info;
  flesh_state state;
} body;

static body make(const char *name, int seed)
{
  body b = {0};
  CHECK_OK(flesh_hardcases_make_mesh(row(name), 1, &b.mesh));
  flesh_mesh_inspect(b.mesh, &b.info);
  b.state.x = calloc(3 * (size_t)b.info.nodes, sizeof(double));
  b.state.v = calloc(3 * (size_t)b.info.nodes, sizeof(double));
  CHECK_OK(flesh_hardcases_make_start(row(name), b.mesh, seed, 1. / 60, &b.state));
  return b;
}

static void drop(body *b)
{
  flesh_mesh_destroy(&b->mesh);
  free(b->state.x);
  free(b->state.v);
}

static int inverted(const body *b)
{
  int count;
  flesh_mesh_jacobians(b->mesh, b->state.x, NULL, NULL, &count);
  return count;
}

/* Every case of the table, both sizes: fine meshes, finite states, names of their own. */
static void every_case_can_be_made(void)
{
  for (const flesh_hardcases_case *r = flesh_hardcases_case_table; r->name; r++)
    for (int quick = 0; quick < 2; quick++) {
      flesh_mesh *mesh = NULL;
      CHECK_OK(flesh_hardcases_make_mesh(r, quick, &mesh));
      if (!mesh) continue;
      int n = 3 * flesh_mesh_node_count(mesh), finite = 1;
      flesh_mesh_info info;
      flesh_mesh_inspect(mesh, &info);
      CHECK(info.unused_nodes == 0);
      if (quick) CHECK(info.tets <= 3000);
      if (!quick && r->mesh == FLESH_HARDCASES_LARGE) CHECK(info.tets >= 15000 && info.tets <= 50000);
      flesh_state state = {.t = 0, .x = malloc(sizeof(double) * (size_t)n), .v = malloc(sizeof(double) * (size_t)n)};
      CHECK_OK(flesh_hardcases_make_start(r, mesh, 1, 1. / 60, &state));
      for (int d = 0; d < n; d++) finite &= isfinite(state.x[d]) && isfinite(state.v[d]);
      CHECK(finite);
      free(state.x);
      free(state.v);
      flesh_mesh_destroy(&mesh);
      for (const flesh_hardcases_case *other = r + 1; other->name; other++)
        CHECK(strcmp(r->name, other->name));
    }
}

static void meshes_are_bad_as_promised(void)
{
  body slivers = make("slivers_stretch", 1), graded = make("graded_stretch", 1),
       fan = make("fan_jitter", 1);
  CHECK_BELOW(slivers.info.radius_ratio_min, 2e-4);
  CHECK(slivers.info.radius_ratio_min > 1e-5);
  CHECK(graded.info.edge_max / graded.info.edge_min > 0.9e4);
  CHECK(graded.info.radius_ratio_min > 0.1); /* graded, but of good shape */
  CHECK_NEAR(graded.info.volume, 1e-3, 1e-15);
  CHECK_NEAR(fan.info.volume, 1e-3, 1e-15);
  int around = 0;
  for (int k = 0; k < 4 * fan.info.tets; k++) around += flesh_mesh_tets(fan.mesh)[k] == 0;
  CHECK(around == fan.info.tets && around >= 200);
  drop(&slivers), drop(&graded), drop(&fan);
}

static void neighbours_differ_in_a_checker(void)
{
  body b = make("checker1e6", 1);
  int ones = 0;
  for (int t = 0; t < b.info.tets; t++) ones += flesh_mesh_regions(b.mesh)[t] == 1;
  CHECK(b.info.regions == 2);
  CHECK(abs(2 * ones - b.info.tets) <= 6);
  CHECK(flesh_mesh_regions(b.mesh)[0] != flesh_mesh_regions(b.mesh)[6]);
  drop(&b);
}

static void two_bodies_share_nothing(void)
{
  body b = make("two_bodies", 1);
  const double *X = flesh_mesh_positions(b.mesh);
  int mixed = 0;
  for (int t = 0; t < b.info.tets; t++) {
    int right = 0;
    for (int a = 0; a < 4; a++) right += X[3 * flesh_mesh_tets(b.mesh)[4 * t + a]] > 0.1;
    mixed += right != 0 && right != 4;
  }
  CHECK(mixed == 0);
  drop(&b);
}

static void exact_starts_are_exact(void)
{
  body plane = make("plane", 1), line = make("line", 1), point = make("point", 1),
       noisy = make("plane_noise", 1);
  double off[4] = {0};
  for (int i = 0; i < plane.info.nodes; i++) {
    off[0] = fmax(off[0], fabs(plane.state.x[3 * i + 2] - plane.state.x[2]));
    for (int c = 1; c < 3; c++)
      off[1] = fmax(off[1], fabs(line.state.x[3 * i + c] - line.state.x[c]));
    for (int c = 0; c < 3; c++)
      off[2] = fmax(off[2], fabs(point.state.x[3 * i + c] - point.state.x[c]));
    off[3] = fmax(off[3], fabs(noisy.state.x[3 * i + 2] - 0.05));
  }
  CHECK(off[0] == 0 && off[1] == 0 && off[2] == 0);
  CHECK(off[3] > 1e-10 && off[3] <= 2e-10);
  drop(&plane), drop(&line), drop(&point), drop(&noisy);
}

static void inversions_are_counted(void)
{
  body one = make("invert_one", 1), all = make("mirrored", 1), rest = make("spin_body", 1);
  CHECK(inverted(&one) == 1);
  CHECK(inverted(&all) == all.info.tets);
  CHECK(inverted(&rest) == 0);
  drop(&one), drop(&all), drop(&rest);
}

/* A turn over the length: the far face is where it was, the middle stands on its head. */
static void twists_turn(void)
{
  body b = make("twist5", 1);
  const double *X = flesh_mesh_positions(b.mesh);
  double far = 0, largest = 0;
  for (int i = 0; i < b.info.nodes; i++) {
    double d = 0;
    for (int c = 0; c < 3; c++) d += fabs(b.state.x[3 * i + c] - X[3 * i + c]);
    if (X[3 * i] > 0.1999) far = fmax(far, d);
    largest = fmax(largest, d);
  }
  CHECK_BELOW(far, 1e-14);
  CHECK(largest > 0.1);
  /* Less than half a turn per layer, or another twist would stand here. */
  int layers = 0;
  for (int i = 0; i < b.info.nodes; i++) layers += X[3 * i + 1] == 0 && X[3 * i + 2] == 0;
  CHECK(5. / (layers - 1) < 0.3);
  drop(&b);
}

static void seeds_differ_and_repeat(void)
{
  body a = make("scramble", 1), b = make("scramble", 2), c = make("scramble", 1);
  int same = 0, outside = 0, n = 3 * a.info.nodes;
  double mean = 0;
  for (int d = 0; d < n; d++) {
    same += a.state.x[d] == b.state.x[d];
    outside += !(a.state.x[d] >= 0 && a.state.x[d] <= (d % 3 ? 0.1 : 0.2));
    mean += a.state.x[d] / (d % 3 ? 0.1 : 0.2) / n;
  }
  CHECK(same == 0 && outside == 0);
  CHECK_NEAR(mean, 0.5, 0.06); /* four standard deviations of 336 uniform numbers */
  CHECK(!memcmp(a.state.x, c.state.x, sizeof(double) * (size_t)n));
  drop(&a), drop(&b), drop(&c);
}

/* omega x r with a turn per step; 100 m/s from where two steps lead into place. */
static void moving_starts_move(void)
{
  body spin = make("spin_body", 1), fly = make("crash", 1);
  double worst = 0, omega = 2 * acos(-1) * 60;
  for (int i = 0; i < spin.info.nodes; i++) {
    const double *x = spin.state.x + 3 * i, *v = spin.state.v + 3 * i;
    worst = fmax(worst, fabs(v[0] + omega * (x[1] - 0.05)) + fabs(v[1] - omega * (x[0] - 0.1)) +
                            fabs(v[2]));
    double place = fly.state.x[3 * i] + 2. / 30 * fly.state.v[3 * i];
    CHECK_NEAR(place, flesh_mesh_positions(fly.mesh)[3 * i], 1e-12);
  }
  CHECK_BELOW(worst, 1e-12);
  drop(&spin), drop(&fly);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(every_case_can_be_made), TEST(meshes_are_bad_as_promised),
                   TEST(neighbours_differ_in_a_checker), TEST(two_bodies_share_nothing),
                   TEST(exact_starts_are_exact), TEST(inversions_are_counted), TEST(twists_turn),
                   TEST(seeds_differ_and_repeat), TEST(moving_starts_move));
}
