// TEST quick seconds=60
/* test_contact_set.c: the barrier between surfaces: it does not depend on the triangulation of faces, has no kinks, is
 * the potential of its forces, which balance, and has the same bits for any number of threads. */
#include "facing.h"
#include "geometry/barrier.h"

static facing f; /* large */

static void law_of(double s, double *value, double *first)
{
  double second;
  flesh_barrier_law(s, value, first, &second);
}

static flesh_contact_law law_with(double thickness)
{
  return (flesh_contact_law){3e4, thickness, FLESH_CONTACT_EDGE_THICKNESS * thickness};
}

/* Two squares of 1 m^2 with different triangles, pressed to gaps down to 0.26 of the thickness, which is a third of an
 * edge, or five edges. */
static void flat_faces_do_not_depend_on_triangles(void)
{
  static double r[3 * FACING_NODES];
  for (int trial = 0; trial < 12; trial++) {
    const double w = trial % 2 ? 0.6 : 0.03, d = w * (0.26 + 0.06 * trial);
    const flesh_contact_law law = law_with(w);
    flesh_contact_set set;
    double value, first, up[3] = {0};
    facing_add_sheet(&f, 3 + trial, 0, 0, 1, 0, 1, 0.3);
    facing_add_sheet(&f, 9 - trial / 2, 0, 0, 1, d, 0, 0.3);
    facing_finish(&f);
    CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
    const double energy = facing_energy(&f, &set, f.x, r);
    law_of(d / w, &value, &first);
    CHECK_NEAR(energy, law.stiffness * w * value, 1e-11 * energy);
    CHECK_NEAR(set.distance, d, 1e-9 * w);
    for (int i = 0; i < f.nodes; i++)
      for (int c = 0; c < 3; c++) up[c] += f.body[i] ? r[3 * i + c] : 0;
    CHECK_NEAR(up[2], law.stiffness * first, -1e-11 * law.stiffness * first); /* r is minus the force */
    CHECK_NEAR(hypot(up[0], up[1]), 0, -1e-11 * law.stiffness * first);
    for (int k = 0; k < set.count; k++) CHECK(set.pairs[k].weight > 0 && set.pairs[k].owner >= 0);
    CHECK(set.count == f.surface.node_count); /* one pair each: all other terms cancel */
    flesh_contact_set_clear(&set);
    facing_clear(&f);
  }
}

/* Above a part of a flat face that ends at a line, with only its triangles as candidates, the barrier is that of this
 * part: inside it, above its rim, and beside it, also if the gap is as small as the distance to the rim. */
static void parts_of_faces_end_in_their_rims(void)
{
  const double w = 0.4;
  const flesh_contact_law law = law_with(w);
  flesh_contact_set set;
  facing_add_sheet(&f, 6, 0, 0, 1, 0, 1, 0);
  const int tip = facing_add_needle(&f, (const double[]){0.5, 0.5, 0.1}, 5);
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
  int kept = 0;
  for (int k = 0; k < f.candidates.point_count; k++) {
    const int *candidate = f.candidates.point_faces + 2 * k, *nodes = f.surface.faces + 3 * candidate[1];
    double largest = 0;
    for (int c = 0; c < 3; c++) largest = fmax(largest, f.X[3 * nodes[c]]);
    if (candidate[0] != tip || largest > 0.51) continue;
    memmove(f.lists[0] + 2 * kept++, candidate, 2 * sizeof *candidate);
  }
  f.candidates.point_count = kept;
  f.candidates.edge_count = 0;
  for (int trial = 0; trial < 500; trial++) {
    double value = 0, first, *p = f.x + 3 * tip, out[3];
    p[0] = 0.5 + 0.45 * uniform(), p[1] = 0.5 + 0.7 * uniform(), p[2] = 0.02 + 0.4 * (1 + uniform()) / 2;
    out[0] = fmax(p[0] - 0.5, 0);
    out[1] = fmax(fmax(p[1] - 1, -p[1]), 0);
    out[2] = p[2];
    const double d = sqrt(flesh_vec3_dot(out, out)), energy = facing_energy(&f, &set, f.x, NULL);
    if (d < w) law_of(d / w, &value, &first);
    const double weight = law.stiffness * f.surface.node_area[f.surface.node_place[tip]] / 2;
    CHECK_NEAR(energy, weight * w * value, 1e-11 * weight * w * value);
    CHECK(set.count == (d < w));
  }
  for (int side = -1; side <= 1; side++) {
    double value, first;
    const double place[3] = {0.5 + side * 3e-10 * w, 0.41, 1e-10 * w}, out = fmax(place[0] - 0.5, 0);
    memcpy(f.x + 3 * tip, place, sizeof place);
    law_of(hypot(out, place[2]) / w, &value, &first);
    const double expected = law.stiffness * f.surface.node_area[f.surface.node_place[tip]] / 2 * w * value;
    CHECK_NEAR(facing_energy(&f, &set, f.x, NULL), expected, 1e-4 * expected);
  }
  flesh_contact_set_clear(&set);
  facing_clear(&f);
}

/* Shapes z(x, y) of a sheet: ridge, valley, peak, pit, saddle, and a smoothly bent one. */
static double shape(int which, double x, double y)
{
  const double a = fabs(x - 0.5), b = fabs(y - 0.5);
  switch (which) {
  case 0: return -0.8 * a;
  case 1: return 0.8 * a;
  case 2: return -0.6 * (a + b);
  case 3: return 0.6 * (a + b);
  case 4: return 0.7 * (a - b);
  default: return 0.1 * sin(9 * x + 2) * cos(7 * y);
  }
}

/* Finds the largest jumps of energy and force of a point that crosses the sheet in this many steps. */
static void jumps_of(flesh_contact_set *set, int tip, int which, int steps, double jump[2])
{
  static double r[3 * FACING_NODES];
  double last[4] = {0}, *p = f.x + 3 * tip;
  jump[0] = jump[1] = 0;
  for (int k = 0; k <= steps; k++) {
    const double s = (double)k / steps;
    p[0] = 0.21 + 0.6 * s, p[1] = 0.32 + 0.37 * s, p[2] = shape(which, p[0], p[1]) + 0.07 + 0.02 * sin(40 * s);
    const double now[4] = {facing_energy(&f, set, f.x, r), r[3 * tip], r[3 * tip + 1], r[3 * tip + 2]};
    CHECK(isfinite(now[0]));
    if (k) jump[0] = fmax(jump[0], fabs(now[0] - last[0]));
    for (int c = 1; c < 4 && k; c++) jump[1] = fmax(jump[1], fabs(now[c] - last[c]));
    memcpy(last, now, sizeof last);
  }
}

/* A point slides over creases of all kinds: continuous quantities change a quarter as much in a quarter of a step. */
static void nothing_jumps_where_a_point_slides(void)
{
  for (int which = 0; which < 6; which++) {
    const flesh_contact_law law = law_with(0.13);
    flesh_contact_set set;
    double coarse[2], fine[2];
    facing_add_sheet(&f, 6, 0, 0, 1, 0, 1, 0);
    for (int i = 0; i < f.nodes; i++) f.x[3 * i + 2] = f.X[3 * i + 2] = shape(which, f.X[3 * i], f.X[3 * i + 1]);
    const int tip = facing_add_needle(&f, (const double[]){0.5, 0.5, 0.1}, 5);
    facing_finish(&f);
    f.candidates.edge_count = 0; /* those of the needle's sides behave differently */
    CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
    jumps_of(&set, tip, which, 2000, coarse);
    jumps_of(&set, tip, which, 8000, fine);
    printf("# shape %d: energy %.3g J, force %.3g N in a step; %.3f and %.3f of it in a quarter\n", which, coarse[0],
           coarse[1], fine[0] / coarse[0], fine[1] / coarse[1]);
    CHECK_BELOW(fine[0], 0.27 * coarse[0]);
    CHECK_BELOW(fine[1], 0.27 * coarse[1]);
    flesh_contact_set_clear(&set);
    facing_clear(&f);
  }
}

/* Makes two crumpled sheets near each other, with a thickness larger than their edges and creases. */
static void crumple(double gap)
{
  facing_add_sheet(&f, 7, 0, 0, 1, 0, 1, 0.3);
  facing_add_sheet(&f, 6, 0.1, -0.05, 1, gap, 0, 0.3);
  for (int i = 0; i < f.nodes; i++) {
    f.x[3 * i + 2] += 0.4 * gap * uniform();
    for (int c = 0; c < 2; c++) f.x[3 * i + c] += 0.01 * uniform();
  }
  facing_finish(&f);
}

static const int steps[4] = {-2, -1, 1, 2};

static double derivative(const double f[4], double h) { return (f[0] - f[3] + 8 * (f[2] - f[1])) / (12 * h); }

static void forces_are_the_derivatives_of_the_energy(void)
{
  static double x[3 * FACING_NODES], du[3 * FACING_NODES], r[5][3 * FACING_NODES], image[3 * FACING_NODES];
  double *hessians = malloc(144 * sizeof(double) * 20000), worst[2] = {0, 0};
  int negative = 0, edges = 0;
  for (int trial = 0; trial < 6; trial++) {
    flesh_contact_law law = law_with(0.25);
    flesh_contact_set set;
    if (trial % 2) law.edge_thickness = law.thickness; /* so that many edges are in contact */
    crumple(0.1);
    CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
    const double h = 1e-7, energy = facing_energy(&f, &set, f.x, r[0]);
    double slope = 0, terms = 0, size = 0, difference[4];
    CHECK(energy > 0 && set.count < 20000);
    flesh_contact_set_hessians(&set, f.x, 2, FLESH_FILTER_NONE, NULL, hessians);
    memset(image, 0, sizeof image);
    for (int k = 0; k < 3 * f.nodes; k++) {
      du[k] = uniform();
      slope += r[0][k] * du[k];
      terms += fabs(r[0][k] * du[k]);
    }
    for (int k = 0; k < set.count; k++) {
      negative += set.pairs[k].weight < 0;
      edges += set.pairs[k].owner < 0;
      for (int i = 0; i < 12; i++)
        for (int j = 0; j < 12 && set.pairs[k].nodes[i / 3] >= 0; j++)
          if (set.pairs[k].nodes[j / 3] >= 0)
            image[3 * set.pairs[k].nodes[i / 3] + i % 3] +=
                hessians[144 * k + 12 * i + j] / 2 * du[3 * set.pairs[k].nodes[j / 3] + j % 3];
    }
    for (int side = 0; side < 4; side++) {
      for (int k = 0; k < 3 * f.nodes; k++) x[k] = f.x[k] + h * steps[side] * du[k];
      difference[side] = facing_energy(&f, &set, x, r[1 + side]);
    }
    worst[0] = fmax(worst[0], fabs(derivative(difference, h) - slope) / terms);
    for (int k = 0; k < 3 * f.nodes; k++) size = fmax(size, fabs(image[k]));
    for (int k = 0; k < 3 * f.nodes; k++) {
      const double of_r[4] = {r[1][k], r[2][k], r[3][k], r[4][k]};
      worst[1] = fmax(worst[1], fabs(derivative(of_r, h) - image[k]) / size);
    }
    flesh_contact_set_clear(&set);
    facing_clear(&f);
  }
  free(hessians);
  printf("# residual %.2g, Hessian %.2g; %d negative pairs, %d of edges\n", worst[0], worst[1], negative, edges);
  CHECK(negative > 50 && edges > 50);
  CHECK_BELOW(worst[0], 1e-8);
  CHECK_BELOW(worst[1], 1e-6);
}

static void forces_balance_and_turn_with_the_bodies(void)
{
  static double r[3 * FACING_NODES], turned[3 * FACING_NODES], x[3 * FACING_NODES];
  const flesh_contact_law law = law_with(0.25);
  flesh_contact_set set;
  double R[9], sums[6] = {0}, size = 0, off = 0;
  crumple(0.1);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
  const double energy = facing_energy(&f, &set, f.x, r);
  random_rotation(R);
  for (int i = 0; i < f.nodes; i++) {
    double moment[3];
    flesh_vec3_cross(f.x + 3 * i, r + 3 * i, moment);
    for (int c = 0; c < 3; c++) {
      sums[c] += r[3 * i + c], sums[3 + c] += moment[c];
      size += fabs(r[3 * i + c]);
    }
    flesh_mat3_times(R, f.x + 3 * i, x + 3 * i);
    x[3 * i] += 3;
  }
  for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-13 * size);
  CHECK_NEAR(facing_energy(&f, &set, x, turned), energy, 1e-12 * energy);
  for (int i = 0; i < f.nodes; i++) {
    double expected[3];
    flesh_mat3_times(R, r + 3 * i, expected);
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(turned[3 * i + c] - expected[c]));
  }
  printf("# turned by %.2g of all forces\n", off / size);
  CHECK_BELOW(off, 1e-13 * size);
  flesh_contact_set_clear(&set);
  facing_clear(&f);
}

static void threads_give_the_same_bits(void)
{
  static double r[3][3 * FACING_NODES];
  flesh_contact_law law = law_with(0.25);
  double energy[3] = {0}, *hessians[3];
  int count = 0;
  law.edge_thickness = law.thickness;
  crumple(0.1);
  for (int way = 0; way < 3; way++) {
    static const int threads_of[3] = {1, 2, 5};
    flesh_threads *threads = NULL;
    flesh_contact_set set;
    CHECK_OK(flesh_threads_create(threads_of[way], &threads));
    CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
    CHECK_OK(flesh_contact_set_update(&set, &f.candidates, f.x, threads));
    CHECK_OK(flesh_contact_set_evaluate(&set, f.x, threads, &energy[way], NULL, r[way]));
    hessians[way] = malloc(144 * sizeof(double) * (size_t)set.count);
    flesh_contact_set_hessians(&set, f.x, 1, FLESH_FILTER_CLAMP, threads, hessians[way]);
    count = set.count;
    /* A second update needs no more memory. */
    const flesh_contact_pair *pairs = set.pairs;
    CHECK_OK(flesh_contact_set_update(&set, &f.candidates, f.x, threads));
    CHECK(set.pairs == pairs && set.count == count);
    flesh_contact_set_clear(&set);
    flesh_threads_destroy(&threads);
  }
  for (int way = 1; way < 3; way++) {
    CHECK(energy[way] == energy[0] && !memcmp(r[way], r[0], sizeof r[0]));
    CHECK(!memcmp(hessians[way], hessians[0], 144 * sizeof(double) * (size_t)count));
  }
  for (int way = 0; way < 3; way++) free(hessians[way]);
  CHECK(count > 1000);
  facing_clear(&f);
}

/* Two sharp edges that cross touch only each other: the repulsion grows without bound, and vanishes if they are
 * parallel. */
static void crossing_edges_part(void)
{
  static double r[3 * FACING_NODES];
  const flesh_contact_law law = law_with(0.1);
  flesh_contact_set set;
  double last = 0;
  static const double X[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, 0, -1}, {0, -1, 1}, {0, 1, 1}, {0, 0, 2}};
  static const int triangles[6] = {0, 1, 2, 3, 4, 5};
  memcpy(f.X, X, sizeof X);
  memcpy(f.x, X, sizeof X);
  memcpy(f.triangles, triangles, sizeof triangles);
  f.nodes = 6, f.faces = 2;
  for (int i = 3; i < 6; i++) f.body[i] = 1;
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
  for (double d = 0.024; d > 1e-9; d /= 3) {
    double value, first;
    for (int i = 3; i < 6; i++) f.x[3 * i + 2] = X[i][2] - 1 + d;
    const double energy = facing_energy(&f, &set, f.x, r), weight = law.stiffness * (2. / 3) / 4;
    law_of(d / law.edge_thickness, &value, &first);
    CHECK(set.count == 1 && energy > last);
    CHECK_NEAR(energy, weight * law.edge_thickness * value, 1e-6 * energy);
    CHECK_NEAR(r[11] + r[14], weight * first, -1e-6 * weight * first);
    last = energy;
  }
  for (int i = 3; i < 6; i++) f.x[3 * i + 2] = X[i][2] - 1;
  CHECK(isnan(facing_energy(&f, &set, f.x, NULL)) && set.count == 0); /* they meet */
  for (int i = 3; i < 6; i++) f.x[3 * i] = X[i][1] + 1.5, f.x[3 * i + 1] = 0, f.x[3 * i + 2] = X[i][2] - 1 + 0.02;
  facing_energy(&f, &set, f.x, r);
  int edges = 0, parallel = 0;
  for (int k = 0; k < set.count; k++) {
    double value, g[12];
    edges += set.pairs[k].owner < 0;
    if (set.pairs[k].owner >= 0 || set.pairs[k].nodes[1] != 1 || set.pairs[k].nodes[3] != 4) continue;
    CHECK_OK(flesh_contact_pair_gradient(&set.pairs[k], &set.closest[k], f.x, &value, g));
    for (int i = 0; i < 12; i++) CHECK(value == 0 && g[i] == 0);
    parallel++;
  }
  /* Beside an end of each above the other, and the edges that begin there. */
  CHECK(parallel == 1 && edges == 3 && set.count == 5);
    flesh_contact_set_clear(&set);
  facing_clear(&f);
}

static void what_meets_or_is_no_number_is_undefined(void)
{
  const flesh_contact_law law = law_with(0.1);
  flesh_contact_set set;
  facing_add_sheet(&f, 2, 0, 0, 1, 0, 1, 0);
  const int tip = facing_add_needle(&f, (const double[]){0.3, 0.4, 0}, 5);
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, &set));
  CHECK(flesh_contact_set_update(&set, &f.candidates, f.x, NULL) == FLESH_UNDEFINED && set.count == 0);
  f.x[3 * tip + 2] = 0.05;
  CHECK_OK(flesh_contact_set_update(&set, &f.candidates, f.x, NULL));
  CHECK(set.count == 1 && set.pairs[0].kind == FLESH_CONTACT_POINT_TRIANGLE);
  for (int c = 0; c < 3; c++) {
    const double kept = f.x[3 * tip + c];
    f.x[3 * tip + c] = NAN;
    CHECK(flesh_contact_set_update(&set, &f.candidates, f.x, NULL) == FLESH_UNDEFINED && set.count == 0);
    f.x[3 * tip + c] = kept;
  }
  f.candidates.point_count = f.candidates.edge_count = 0;
  CHECK_OK(flesh_contact_set_update(&set, &f.candidates, f.x, NULL));
  CHECK(set.count == 0 && set.distance == INFINITY);
  flesh_contact_set_clear(&set);
  facing_clear(&f);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(flat_faces_do_not_depend_on_triangles), TEST(parts_of_faces_end_in_their_rims),
                   TEST(nothing_jumps_where_a_point_slides), TEST(forces_are_the_derivatives_of_the_energy),
                   TEST(forces_balance_and_turn_with_the_bodies), TEST_OF_THREADS(threads_give_the_same_bits),
                   TEST(crossing_edges_part), TEST(what_meets_or_is_no_number_is_undefined));
}
