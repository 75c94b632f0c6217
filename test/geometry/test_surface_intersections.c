// TEST quick seconds=60
/* test_surface_intersections.c: intersecting surfaces are detected, with the right faces and positions, as by brute
 * force in integers. */
#include "geometry/near_finder.h"
#include "geometry/surface_intersections.h"
#include "soups.h"
#include "wide.h"

static unsigned long long state = 3;

static int share_a_node(const flesh_contact_surface *f, int edge, int face)
{
  for (int k = 0; k < 6; k++)
    if (f->edges[2 * edge + k / 3] == f->faces[3 * face + k % 3]) return 1;
  return 0;
}

/* Whether contact excludes the edge with a side of the face, or an end of it with the face, for their distance at
 * rest. */
static int is_left_out(const flesh_near_finder *finder, const flesh_surface_intersection *found)
{
  const flesh_contact_surface *s = finder->surface;
  int left_out = 0;
  for (int k = 0; k < 2; k++)
    left_out |= flesh_near_finder_excludes(finder, 0, s->node_place[s->edges[2 * found->edge + k]], found->face);
  for (int k = 0; k < 3; k++) {
    const int e = found->edge, side = s->face_edges[3 * found->face + k];
    left_out |= flesh_near_finder_excludes(finder, 1, e < side ? e : side, e < side ? side : e);
  }
  return left_out;
}

/* Compares with all edges and faces of bodies that may touch. Returns the number of intersections. Uses wide integers
 * if boxes meet. */
static int check_all(const soup *s, const double *x, const unsigned char *may_meet,
                     const flesh_surface_intersections *found)
{
  const flesh_contact_surface *f = &s->surface;
  int k = 0;
  for (int e = 0; e < f->edge_count; e++)
    for (int t = 0; t < f->face_count; t++) {
      const int listed = k < found->count && found->items[k].edge == e && found->items[k].face == t;
      k += listed;
      const double *p[5];
      for (int j = 0; j < 5; j++) p[j] = x + 3 * (j < 2 ? f->edges[2 * e + j] : f->faces[3 * t + j - 2]);
      const int a = f->node_body[f->node_place[f->edges[2 * e]]], b = f->node_body[f->node_place[f->faces[3 * t]]];
      int apart = share_a_node(f, e, t) || (may_meet && !may_meet[a * f->body_count + b]);
      for (int c = 0; c < 3 && !apart; c++)
        apart = fmax(p[0][c], p[1][c]) < fmin(p[2][c], fmin(p[3][c], p[4][c])) ||
                fmin(p[0][c], p[1][c]) > fmax(p[2][c], fmax(p[3][c], p[4][c]));
      const int meet = apart ? 0 : wide_segment_meets_triangle(p[0], p[1], p[2], p[3], p[4]);
      CHECK(meet < 0 || meet == listed); /* < 0: a triangle without area */
    }
  CHECK(k == found->count);
  return k;
}

static void random_soups(void)
{
  const unsigned char some[9] = {0, 1, 0, 1, 1, 0, 0, 0, 1};
  for (int round = 0; round < 4; round++) {
    soup s = soup_at_random(150, 0.3, &state);
    if (round % 2) /* on a grid, where edges touch faces and lie in them */
      for (int d = 0; d < 3 * s.nodes; d++) s.X[d] = 0.1 * floor(10 * s.X[d]);
    const unsigned char *may_meet = round < 2 ? NULL : some;
    int expected = -1;
    for (int count = 1; count <= 5; count += 2) {
      flesh_threads *threads;
      flesh_near_finder *finder;
      flesh_surface_intersections found = {0};
      CHECK_OK(flesh_threads_create(count, &threads));
      CHECK_OK(flesh_near_finder_create(&s.surface, s.X, may_meet, 0, threads, &finder));
      CHECK_OK(flesh_surface_intersections_find(finder, s.X, threads, &found));
      if (expected < 0) expected = check_all(&s, s.X, may_meet, &found);
      CHECK(found.count == expected);
      flesh_surface_intersections_clear(&found);
      flesh_near_finder_destroy(&finder);
      flesh_threads_destroy(&threads);
    }
    printf("# %d edges meet faces\n", expected);
    CHECK(expected > 50);
    soup_clear(&s);
  }
}

/* Folds the far part of a sheet back through the near part along the line x = 0.3. */
static void a_sheet_folded_through_itself(void)
{
  enum { N = 20 };
  soup s = soup_of_sheets(1, N, 0);
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  flesh_near_finder *finder;
  flesh_surface_intersections found = {0};
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0.08, NULL, &finder));
  for (int i = 0; i < s.nodes; i++) {
    const double u = s.X[3 * i];
    x[3 * i] = u < 0.61 ? u : 1.21 - u; /* folded at 0.605 */
    x[3 * i + 1] = s.X[3 * i + 1] + (u < 0.61 ? 0 : 0.013);
    x[3 * i + 2] = u < 0.61 ? 0 : (u < 0.76 ? 0.2 : 0.2 - (u - 0.75) * 1.37); /* through 0 at u = 0.896 */
  }
  CHECK_OK(flesh_surface_intersections_find(finder, x, NULL, &found));
  const int count = check_all(&s, x, NULL, &found);
  printf("# %d intersections\n", count);
  CHECK(count >= 2 * N && count < 8 * N);
  for (int k = 0; k < count; k++) {
    const flesh_surface_intersection *i = &found.items[k];
    CHECK_NEAR(i->place[2], 0, 1e-12);
    CHECK_NEAR(i->place[0], 1.21 - (0.75 + 0.2 / 1.37), 1e-9);
    CHECK(i->edge_body == 0 && i->face_body == 0 && !is_left_out(finder, i) && i->edge_faces[0] >= 0);
  }
  CHECK_OK(flesh_surface_intersections_find(finder, s.X, NULL, &found));
  CHECK(found.count == 0);
  flesh_surface_intersections_clear(&found);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* One corner pulled through its neighbours: pairs that contact excludes for their distance at rest. */
static void neighbours_at_rest_are_found_too(void)
{
  soup s = soup_of_sheets(1, 8, 0);
  flesh_near_finder *finder;
  flesh_surface_intersections found = {0};
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0.3, NULL, &finder));
  s.X[2] = 0.1; /* the corner node, over to the third cell and a little down at its tip */
  s.X[0] = s.X[1] = 0.33;
  s.X[2] = -0.01;
  s.X[3 * 1 + 2] = s.X[3 * 9 + 2] = s.X[3 * 10 + 2] = 0.05;
  CHECK_OK(flesh_surface_intersections_find(finder, s.X, NULL, &found));
  CHECK(check_all(&s, s.X, NULL, &found) > 0);
  for (int k = 0; k < found.count; k++) CHECK(is_left_out(finder, &found.items[k]));
  s.X[0] = NAN;
  CHECK(flesh_surface_intersections_find(finder, s.X, NULL, &found) == FLESH_UNDEFINED && found.count == 0);
  flesh_surface_intersections_clear(&found);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
}

/* A second sheet across the first: all crossings of its edges, of these two bodies. */
static void two_bodies_across(void)
{
  soup s = soup_of_sheets(2, 10, 0.5);
  flesh_near_finder *finder;
  flesh_surface_intersections found = {0};
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder));
  for (int i = s.nodes / 2; i < s.nodes; i++) { /* turned upright at y = 0.52, from z = -0.46 to 0.54 */
    s.X[3 * i + 2] = s.X[3 * i + 1] - 0.46;
    s.X[3 * i + 1] = 0.52;
    s.X[3 * i] += 0.003;
  }
  CHECK_OK(flesh_surface_intersections_find(finder, s.X, NULL, &found));
  CHECK(check_all(&s, s.X, NULL, &found) > 20);
  for (int k = 0; k < found.count; k++) {
    CHECK(found.items[k].edge_body != found.items[k].face_body);
    CHECK_NEAR(found.items[k].place[1], 0.52, 1e-12);
    CHECK_NEAR(found.items[k].place[2], 0, 1e-12);
  }
  flesh_surface_intersections_clear(&found);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
}

/* Two sheets in one plane, the second with cells three times as long: edges lie in the planes of the faces that they
 * meet, and each position is in the face. */
static void places_in_a_plane_are_in_the_face(void)
{
  soup s = soup_of_sheets(2, 6, 0);
  flesh_near_finder *finder;
  flesh_surface_intersections found = {0};
  int off_middle = 0;
  for (int i = 0; i < s.nodes; i++) {
    s.X[3 * i + 2] = 0;
    for (int c = 0; c < 2 && i >= s.nodes / 2; c++) s.X[3 * i + c] = 3 * s.X[3 * i + c] - 0.7 - 0.2 * c;
  }
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder));
  CHECK_OK(flesh_surface_intersections_find(finder, s.X, NULL, &found));
  CHECK(found.count > 50);
  for (int k = 0; k < found.count; k++) {
    const flesh_surface_intersection *i = &found.items[k];
    const int *face = s.surface.faces + 3 * i->face, *edge = s.surface.edges + 2 * i->edge;
    const double *a = s.X + 3 * face[0], *b = s.X + 3 * face[1], *c = s.X + 3 * face[2], *p = i->place;
    const double whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    const double at_b = ((p[0] - a[0]) * (c[1] - a[1]) - (p[1] - a[1]) * (c[0] - a[0])) / whole;
    const double at_c = ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / whole;
    CHECK(at_b > -1e-9 && at_c > -1e-9 && at_b + at_c < 1 + 1e-9 && fabs(p[2]) < 1e-12);
    off_middle += fabs(p[0] - (s.X[3 * edge[0]] + s.X[3 * edge[1]]) / 2) > 0.01;
  }
  CHECK(off_middle > 10);
  flesh_surface_intersections_clear(&found);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST_OF_THREADS(random_soups), TEST(a_sheet_folded_through_itself),
                   TEST(neighbours_at_rest_are_found_too), TEST(two_bodies_across),
                   TEST(places_in_a_plane_are_in_the_face));
}
