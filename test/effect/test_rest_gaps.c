// TEST quick
/* test_rest_gaps.c: features nearer than the thickness at rest: pieces of one body, which touch nevertheless; and ends
 * of one piece across a gap, which do not, and are reported. */
#include "body.h"
#include "effect/surface_contact.h"
#include "test.h"

/* Two blocks of 1 m in one mesh, `gap` above each other. */
static flesh_mesh *make_blocks(double gap)
{
  flesh_mesh *one = NULL, *both = NULL;
  CHECK_OK(flesh_mesh_box((int[]){2, 2, 2}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &one));
  const int nodes = flesh_mesh_node_count(one), tets = flesh_mesh_tet_count(one);
  double *x = malloc(6 * (size_t)nodes * sizeof *x);
  int *corners = malloc(8 * (size_t)tets * sizeof *corners);
  for (int d = 0; d < 6 * nodes; d++)
    x[d] = flesh_mesh_positions(one)[d % (3 * nodes)] + (d >= 3 * nodes && d % 3 == 2 ? 1 + gap : 0);
  for (int k = 0; k < 8 * tets; k++) corners[k] = flesh_mesh_tets(one)[k % (4 * tets)] + (k >= 4 * tets ? nodes : 0);
  CHECK_OK(flesh_mesh_create(2 * nodes, x, 2 * tets, corners, NULL, &both));
  free(x);
  free(corners);
  flesh_mesh_destroy(&one);
  return both;
}

/* Makes a bar of 0.2 m x 0.2 m bent to a ring with a gap between its ends. */
static flesh_mesh *make_ring(double gap)
{
  flesh_mesh *bar = NULL, *ring = NULL;
  const double radius = 1;
  CHECK_OK(flesh_mesh_box((int[]){24, 2, 2}, (double[]){1, 0.2, 0.2}, (double[]){0, 0, 0}, &bar));
  const int nodes = flesh_mesh_node_count(bar);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  memcpy(x, flesh_mesh_positions(bar), 3 * (size_t)nodes * sizeof *x);
  for (int i = 0; i < nodes; i++) {
    const double angle = (2 * 3.14159265358979 - gap / radius) * x[3 * i], r = radius - x[3 * i + 2];
    x[3 * i] = r * cos(angle), x[3 * i + 2] = r * sin(angle);
  }
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(bar), flesh_mesh_tets(bar), NULL, &ring));
  free(x);
  flesh_mesh_destroy(&bar);
  return ring;
}

/* Makes a bar of 1.2 m with cells of 0.1 m, folded in the middle so far that its top faces itself at 40 degrees. */
static flesh_mesh *make_fold(void)
{
  flesh_mesh *bar = NULL, *fold = NULL;
  CHECK_OK(flesh_mesh_box((int[]){12, 1, 1}, (double[]){1.2, 0.1, 0.1}, (double[]){-0.6, 0, -0.1}, &bar));
  const int nodes = flesh_mesh_node_count(bar);
  double *x = malloc(3 * (size_t)nodes * sizeof *x);
  memcpy(x, flesh_mesh_positions(bar), 3 * (size_t)nodes * sizeof *x);
  for (int i = 0; i < nodes; i++) {
    double *p = x + 3 * i;
    const double angle = fabs(p[0]) < 1e-9 ? 0 : copysign(70 * 3.14159265358979 / 180, p[0]), along = p[0], up = p[2];
    p[0] = along * cos(angle) - up * sin(angle), p[2] = along * sin(angle) + up * cos(angle);
  }
  CHECK_OK(flesh_mesh_create(nodes, x, flesh_mesh_tet_count(bar), flesh_mesh_tets(bar), NULL, &fold));
  free(x);
  flesh_mesh_destroy(&bar);
  return fold;
}

/* Returns the energy of contact at rest; `count` pairs of parts may touch; 0: all. */
static double energy_at_rest(const flesh_body *body, double thickness, int count, const int *pairs)
{
  const double *X = flesh_mesh_positions(body->mesh);
  const flesh_contact_options options = {.stiffness = 1e5, .thickness = thickness, .slip_speed = 1e-3};
  const flesh_point point = flesh_point_at(0, X, X, X);
  flesh_effect *effect = NULL;
  double energy = NAN;
  CHECK_OK(flesh_effect_surface_contact(body, &options, count, pairs, &effect));
  CHECK_OK(effect->operations->energy(effect, &point, &energy));
  flesh_effect_destroy(&effect);
  return energy;
}

/* A body without parts whose pieces are nearer than the thickness has the same energy as two parts. */
static void pieces_touch(void)
{
  test_body b;
  CHECK_OK(test_body_create(make_blocks(0.02), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0, &b));
  const double alone = energy_at_rest(&b.body, 0.05, 0, NULL);
  const int half = flesh_mesh_tet_count(b.mesh) / 2;
  const flesh_body_part parts[4] = {{.name = "a", .tets = half}, {.name = "b", .first_tet = half, .tets = half},
                                    {.name = "none", .first_tet = 2 * half}, {.name = "nor", .first_tet = 2 * half}};
  b.body.part_count = 2;
  b.body.parts = parts;
  const double as_parts = energy_at_rest(&b.body, 0.05, 0, NULL);
  printf("# %.6g J, as parts %.6g J\n", alone, as_parts);
  CHECK(alone > 0 && alone == as_parts);
  CHECK(energy_at_rest(&b.body, 0.019, 0, NULL) == 0);
  /* Parts without tets do not change which bodies touch. */
  b.body.part_count = 4;
  CHECK(energy_at_rest(&b.body, 0.05, 1, (int[]){0, 1}) == alone);
  CHECK(energy_at_rest(&b.body, 0.05, 1, (int[]){0, 2}) == 0);
  test_body_destroy(&b);
}

/* Returns how many nodes of the body are found, and the least gap. */
static flesh_left_out left_out(flesh_mesh *mesh, double thickness)
{
  const flesh_contact_options options = {.stiffness = 1e5, .thickness = thickness, .slip_speed = 1e-3};
  test_body b;
  flesh_effect *effect = NULL;
  flesh_left_out found;
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_effect_surface_contact(&b.body, &options, 0, NULL, &effect));
  CHECK_OK(flesh_surface_contact_left_out(effect, &found));
  CHECK_BELOW(energy_at_rest(&b.body, thickness, 0, NULL), 1e-30); /* J; the processor may fuse products and sums */
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
  return found;
}

/* The ring's ends, of nine nodes each, are reported if the thickness exceeds their gap; the surroundings of a fold and
 * the other side of a thin wall are not. */
static void gaps_are_found(void)
{
  flesh_left_out found = left_out(make_ring(0.02), 0.05);
  printf("# %d nodes, the nearest %.4g m apart\n", found.nodes, found.gap);
  CHECK(found.nodes == 18);
  CHECK(found.gap > 0.8 * 0.9 * 0.02 && found.gap < 0.0201); /* the gap is 0.016 m at the inner radius */
  CHECK(left_out(make_ring(0.02), 0.014).nodes == 0);
  CHECK(left_out(make_ring(0.1), 0.05).nodes == 0);
  flesh_mesh *plate = NULL;
  CHECK_OK(flesh_mesh_box((int[]){6, 6, 1}, (double[]){1, 1, 0.03}, (double[]){0, 0, 0}, &plate));
  CHECK(left_out(plate, 0.05).nodes == 0);
  CHECK(left_out(make_fold(), 0.2).nodes == 0);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(pieces_touch), TEST(gaps_are_found)); }
