// TEST quick seconds=60
/* test_near_pairs.c: searches for near pairs find what brute force finds, and little else; the steps that pairs
 * allow. */
#include "collision_reference.h"
#include "geometry/near_finder.h"
#include "geometry/near_pairs.h"
#include "soups.h"

/* A pair of the reference, at two positions. */
static trial pair_of(const soup *s, int is_point, int first, int second, const double *x0, const double *x1)
{
  const flesh_contact_surface *f = &s->surface;
  trial p = {.first = is_point ? 1 : 2, .second = is_point ? 3 : 2};
  for (int k = 0; k < 4; k++) {
    const int node = is_point ? (k ? f->faces[3 * second + k - 1] : f->nodes[first])
                              : f->edges[k < 2 ? 2 * first + k : 2 * second + k - 2];
    memcpy(p.x0[k], x0 + 3 * node, sizeof p.x0[k]);
    memcpy(p.x1[k], x1 + 3 * node, sizeof p.x1[k]);
  }
  return p;
}

static int share_a_node(const flesh_contact_surface *f, int is_point, int first, int second)
{
  const int *p = is_point ? f->nodes + first : f->edges + 2 * first;
  const int *q = is_point ? f->faces + 3 * second : f->edges + 2 * second;
  for (int i = 0; i < (is_point ? 1 : 2); i++)
    for (int j = 0; j < (is_point ? 3 : 2); j++)
      if (p[i] == q[j]) return 1;
  return 0;
}

static int body_of(const flesh_contact_surface *f, int count, const int *nodes)
{
  int body = 0;
  for (int k = 0; k < count; k++)
    if (f->node_body[f->node_place[nodes[k]]] > body) body = f->node_body[f->node_place[nodes[k]]];
  return body;
}

/* Returns the least of the distances at several times along the path. */
static double least_distance(const trial *p, int samples)
{
  double least = INFINITY;
  for (int k = 0; k <= samples; k++) least = fmin(least, (double)distance_at(p, samples ? (real)k / samples : 0));
  return least;
}

/* Whether the boxes around the paths of the two hulls are further apart than the distance. */
static int boxes_are_apart(const trial *p, double distance)
{
  for (int c = 0; c < 3; c++) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 4; k++) {
      const int hull = k >= p->first;
      low[hull] = fmin(low[hull], fmin(p->x0[k][c], p->x1[k][c]));
      high[hull] = fmax(high[hull], fmax(p->x0[k][c], p->x1[k][c]));
    }
    if (low[0] - high[1] > distance || low[1] - high[0] > distance) return 1;
  }
  return 0;
}

typedef struct expectation {
  const soup *s;
  const unsigned char *may_meet;
  double rest, distance;
  const double *x0, *x1; /* x1 NULL: at one position */
  int near, listed, left_out;
} expectation;

static void check_kind(expectation *e, int is_point, int firsts, int seconds, int count, const int *pairs)
{
  const flesh_contact_surface *f = &e->s->surface;
  int k = 0;
  for (int i = 0; i < firsts; i++)
    for (int j = is_point ? 0 : i + 1; j < seconds; j++) {
      const int listed = k < count && pairs[2 * k] == i && pairs[2 * k + 1] == j; /* in order, without duplicates */
      k += listed;
      const int a = body_of(f, is_point ? 1 : 2, is_point ? f->nodes + i : f->edges + 2 * i);
      const int b = body_of(f, is_point ? 3 : 2, is_point ? f->faces + 3 * j : f->edges + 2 * j);
      if (share_a_node(f, is_point, i, j) || (e->may_meet && !e->may_meet[a * f->body_count + b])) {
        CHECK(!listed);
        continue;
      }
      const trial p = pair_of(e->s, is_point, i, j, e->x0, e->x1 ? e->x1 : e->x0);
      if (!listed && boxes_are_apart(&p, e->distance)) continue;
      const trial at_rest = pair_of(e->s, is_point, i, j, e->s->X, e->s->X);
      const int first = f->node_place[is_point ? f->nodes[i] : f->edges[2 * i]],
                second = f->node_place[is_point ? f->faces[3 * j] : f->edges[2 * j]];
      const double rest = a == b && f->node_piece[first] == f->node_piece[second] ? (double)distance_at(&at_rest, 0)
                                                                                 : INFINITY;
      if (rest < e->rest * (1 - 1e-9)) {
        e->left_out++;
        CHECK(!listed);
        continue;
      }
      const double least = least_distance(&p, e->x1 ? 16 : 0);
      if (least <= e->distance && rest > e->rest * (1 + 1e-9)) CHECK(listed);
      if (!e->x1 && listed) CHECK(least <= e->distance * (1 + 1e-9));
      e->near += least <= e->distance;
      e->listed += listed;
    }
  CHECK(k == count); /* no others, no duplicates */
}

static void check_pairs(expectation *e, const flesh_near_pairs *pairs)
{
  const flesh_contact_surface *f = &e->s->surface;
  check_kind(e, 1, f->node_count, f->face_count, pairs->point_count, pairs->point_faces);
  check_kind(e, 0, f->edge_count, f->edge_count, pairs->edge_count, pairs->edge_pairs);
  printf("# %d pairs are near, %d are listed, %d left out\n", e->near, e->listed, e->left_out);
  CHECK(e->left_out > 0 || !(e->rest > 0));
  CHECK(e->near > 50);
  CHECK(e->listed <= (e->x1 ? 2 : 1.001) * e->near + 10);
}

static void finds_what_brute_force_finds(void)
{
  const unsigned char some[9] = {0, 1, 0, 1, 1, 0, 0, 0, 1};
  for (int round = 0; round < 6; round++) {
    soup s = soup_at_random(160, 0.15, &state);
    const int moving = round % 2;
    const unsigned char *may_meet = round < 4 ? NULL : some;
    double *x0 = malloc(3 * (size_t)s.nodes * sizeof *x0), *x1 = malloc(3 * (size_t)s.nodes * sizeof *x1);
    for (int d = 0; d < 3 * s.nodes; d++) x0[d] = s.X[d] + between(-0.1, 0.1), x1[d] = x0[d] + between(-0.1, 0.1);
    flesh_near_finder *finder;
    flesh_near_pairs pairs = {0};
    const double rest = round / 2 % 2 ? 0.05 : 0;
    CHECK_OK(flesh_near_finder_create(&s.surface, s.X, may_meet, rest, NULL, &finder));
    CHECK_OK(flesh_near_pairs_find(finder, x0, moving ? x1 : NULL, 0.03, NULL, &pairs));
    expectation e = {&s, may_meet, rest, 0.03, x0, moving ? x1 : NULL, 0, 0, 0};
    check_pairs(&e, &pairs);
    flesh_near_pairs_clear(&pairs);
    flesh_near_finder_destroy(&finder);
    soup_clear(&s);
    free(x0);
    free(x1);
  }
}

/* A sheet's own pairs are excluded by their distance at rest, three cells here, and found when it folds. */
static void neighbours_at_rest_are_left_out(void)
{
  soup s = soup_of_sheets(1, 16, 0);
  flesh_near_finder *finder;
  flesh_near_pairs pairs = {0};
  const double w = 3.0 / 16;
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, w, NULL, &finder));
  CHECK_OK(flesh_near_pairs_find(finder, s.X, NULL, w * 0.999, NULL, &pairs));
  CHECK(pairs.point_count == 0 && pairs.edge_count == 0);
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  memcpy(x, s.X, 3 * (size_t)s.nodes * sizeof *x);
  for (int i = 0; i < s.nodes; i++) /* folded like a letter */
    if (x[3 * i] > 0.5) x[3 * i] = 1 - x[3 * i], x[3 * i + 2] = 0.1;
  CHECK_OK(flesh_near_pairs_find(finder, x, NULL, w, NULL, &pairs));
  expectation e = {&s, NULL, w, w, x, NULL, 0, 0, 0};
  check_kind(&e, 1, s.surface.node_count, s.surface.face_count, pairs.point_count, pairs.point_faces);
  check_kind(&e, 0, s.surface.edge_count, s.surface.edge_count, pairs.edge_count, pairs.edge_pairs);
  CHECK(pairs.point_count > 1000);
  flesh_near_pairs_clear(&pairs);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* Empty lists of pairs may be NULL. */
static int same_list(int count, const int *a, const int *b)
{
  return !count || !memcmp(a, b, 2 * (size_t)count * sizeof *a);
}

static int same_pairs(const flesh_near_pairs *a, const flesh_near_pairs *b)
{
  return a->point_count == b->point_count && a->edge_count == b->edge_count &&
         same_list(a->point_count, a->point_faces, b->point_faces) &&
         same_list(a->edge_count, a->edge_pairs, b->edge_pairs);
}

/* Threads, the boxes of an earlier search and the tree's grouping do not change a result. */
static void same_for_any_number_of_threads(void)
{
  const int counts[] = {1, 2, 5};
  soup s = soup_at_random(800, 0.06, &state);
  double *x0 = malloc(3 * (size_t)s.nodes * sizeof *x0), *x1 = malloc(3 * (size_t)s.nodes * sizeof *x1);
  for (int d = 0; d < 3 * s.nodes; d++) x0[d] = s.X[d] + between(-0.05, 0.05), x1[d] = x0[d] + between(-0.05, 0.05);
  flesh_near_pairs first = {0};
  double step = 0;
  for (int k = 0; k < 3; k++) {
    flesh_threads *threads;
    flesh_near_finder *finder;
    flesh_near_pairs pairs = {0};
    CHECK_OK(flesh_threads_create(counts[k], &threads));
    CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0.02, threads, &finder));
    if (k) CHECK_OK(flesh_near_pairs_find(finder, x1, x0, 0.04 * k, threads, &pairs));
    CHECK_OK(flesh_near_pairs_find(finder, x0, x1, 0.01, threads, k ? &pairs : &first));
    CHECK(!k || same_pairs(&first, &pairs));
    const double t = flesh_near_pairs_feasible_step(finder, &first, x0, x1, keep, INFINITY, threads);
    CHECK(k == 0 || t == step);
    step = t;
    flesh_near_pairs_clear(&pairs);
    flesh_near_finder_destroy(&finder);
    flesh_threads_destroy(&threads);
  }
  CHECK(step >= 0 && step < 1);
  CHECK(first.point_count > 300 && first.edge_count > 300);
  flesh_near_pairs_clear(&first);
  soup_clear(&s);
  free(x0);
  free(x1);
}

/* Within the validity of an old result nothing is missing from it. */
static void old_results_reach(void)
{
  soup s = soup_at_random(160, 0.15, &state);
  flesh_near_finder *finder;
  flesh_near_pairs pairs = {0};
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder));
  CHECK_OK(flesh_near_pairs_find(finder, s.X, NULL, 0.08, NULL, &pairs));
  double farthest = 0; /* squared */
  for (int i = 0; i < s.nodes; i++) {
    double square = 0;
    for (int d = 3 * i; d < 3 * i + 3; d++) {
      x[d] = s.X[d] + between(-0.01, 0.01);
      square += (x[d] - s.X[d]) * (x[d] - s.X[d]);
    }
    farthest = fmax(farthest, square);
  }
  const double reach = pairs.distance - 2 * sqrt(farthest);
  CHECK(pairs.distance == 0.08 && reach > 0.08 - 2 * 0.01 * 1.733 && reach < 0.06);
  expectation e = {&s, NULL, 0, reach, x, NULL, 0, 0, 0};
  int k[2] = {0, 0}; /* every pair that near is in the list */
  for (int is_point = 0; is_point < 2; is_point++) {
    const int count = is_point ? pairs.point_count : pairs.edge_count;
    const int *list = is_point ? pairs.point_faces : pairs.edge_pairs;
    const int firsts = is_point ? s.surface.node_count : s.surface.edge_count;
    const int seconds = is_point ? s.surface.face_count : s.surface.edge_count;
    for (int i = 0; i < firsts; i++)
      for (int j = is_point ? 0 : i + 1; j < seconds; j++) {
        const int listed = k[is_point] < count && list[2 * k[is_point]] == i && list[2 * k[is_point] + 1] == j;
        k[is_point] += listed;
        if (share_a_node(&s.surface, is_point, i, j)) continue;
        const trial p = pair_of(&s, is_point, i, j, x, x);
        const int near = !boxes_are_apart(&p, e.distance) && (double)distance_at(&p, 0) <= e.distance;
        e.near += near;
        CHECK(!near || listed);
      }
  }
  CHECK(e.near > 100);
  x[3 * s.surface.nodes[5]] = NAN;
  CHECK(flesh_near_pairs_find(finder, x, NULL, 0.1, NULL, &pairs) == FLESH_UNDEFINED && pairs.point_count == 0);
  CHECK(flesh_near_pairs_find(finder, s.X, x, 0.1, NULL, &pairs) == FLESH_UNDEFINED && pairs.edge_count == 0);
  flesh_near_pairs_clear(&pairs);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* Selection gives all pairs that near at another position, in their order, and no others, for any number of threads. */
static void choices_miss_nothing(void)
{
  const int counts[] = {1, 2, 5};
  const double nearest[2] = {0.015, 0.03}; /* edges, points */
  soup s = soup_at_random(160, 0.15, &state);
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  flesh_near_finder *finder;
  flesh_near_pairs all = {0}, first = {0};
  for (int d = 0; d < 3 * s.nodes; d++) x[d] = s.X[d] + between(-0.02, 0.02);
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder));
  CHECK_OK(flesh_near_pairs_find(finder, s.X, NULL, 0.1, NULL, &all));
  for (int k = 0; k < 3; k++) {
    flesh_threads *threads;
    flesh_near_pairs chosen = {0};
    CHECK_OK(flesh_threads_create(counts[k], &threads));
    CHECK_OK(flesh_near_pairs_choose(finder, &all, x, nearest[1], nearest[0], threads, k ? &chosen : &first));
    CHECK(!k || same_pairs(&first, &chosen));
    flesh_near_pairs_clear(&chosen);
    flesh_threads_destroy(&threads);
  }
  for (int is_point = 0, at = 0; is_point < 2; is_point++, at = 0) {
    const int count = is_point ? all.point_count : all.edge_count, left = is_point ? first.point_count : first.edge_count;
    const int *from = is_point ? all.point_faces : all.edge_pairs, *to = is_point ? first.point_faces : first.edge_pairs;
    for (int k = 0; k < count; k++) {
      const trial p = pair_of(&s, is_point, from[2 * k], from[2 * k + 1], x, x);
      const int chosen = at < left && !memcmp(to + 2 * at, from + 2 * k, 2 * sizeof *to);
      at += chosen;
      const double distance = (double)distance_at(&p, 0);
      CHECK(chosen ? distance <= (1 + 1e-9) * nearest[is_point] : distance > nearest[is_point]);
    }
    printf("# %d of %d are chosen\n", left, count);
    CHECK(at == left && left > 100 && left < 0.8 * count);
  }
  flesh_near_pairs_clear(&all);
  flesh_near_pairs_clear(&first);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* Sheets that fall onto each other stop at a tenth of their distance. */
static void sheets_stop_before_they_touch(void)
{
  soup s = soup_of_sheets(3, 12, 0.25);
  flesh_near_finder *finder;
  flesh_near_pairs pairs = {0};
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  const unsigned char others[9] = {0, 1, 0, 1, 0, 1, 0, 1, 0};
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, others, 0, NULL, &finder));
  for (int i = 0; i < s.nodes; i++) {
    memcpy(x + 3 * i, s.X + 3 * i, 3 * sizeof *x);
    x[3 * i + 2] -= 0.5 * s.body[i] - 0.3;
  }
  CHECK_OK(flesh_near_pairs_find(finder, s.X, x, 0, NULL, &pairs));
  const double t = flesh_near_pairs_feasible_step(finder, &pairs, s.X, x, 0.1, INFINITY, NULL);
  /* A pair that is further apart than its relative motion limits nothing. */
  CHECK(flesh_near_pairs_feasible_step(finder, &pairs, s.X, x, 0.1, 0.5 / 0.9, NULL) == t);
  CHECK(flesh_near_pairs_feasible_step(finder, &pairs, s.X, x, 0.1, 0.24, NULL) == 1);
  CHECK(t <= 0.9 * 0.5 && t > 0.9 * 0.5 - 0.011);
  flesh_near_pairs none = {0};
  CHECK(flesh_near_pairs_feasible_step(finder, &none, s.X, x, 0.1, INFINITY, NULL) == 1);
  CHECK(finder->regrouped == 0);
  flesh_near_pairs_clear(&pairs);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* Every second cluster of triangles moves far away: the tree is regrouped, once, and nothing is missed. */
static void worn_trees_are_grouped_anew(void)
{
  soup s = soup_at_random(600, 0.1, &state);
  flesh_near_finder *finder, *fresh;
  flesh_near_pairs pairs = {0}, expected = {0};
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  for (int d = 0; d < 3 * s.nodes; d++) x[d] = s.X[d] + (d / 36 % 2 ? 50 : 0);
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder));
  CHECK_OK(flesh_near_finder_create(&s.surface, x, NULL, 0, NULL, &fresh));
  CHECK_OK(flesh_near_pairs_find(finder, s.X, NULL, 0.01, NULL, &pairs));
  for (int again = 0; again < 2; again++) {
    CHECK_OK(flesh_near_pairs_find(finder, x, NULL, 0.01, NULL, &pairs));
    CHECK_OK(flesh_near_pairs_find(fresh, x, NULL, 0.01, NULL, &expected));
    CHECK(same_pairs(&pairs, &expected) && pairs.point_count > 100);
    CHECK(finder->regrouped == 1 && fresh->regrouped == 0);
  }
  flesh_near_pairs_clear(&pairs);
  flesh_near_pairs_clear(&expected);
  flesh_near_finder_destroy(&finder);
  flesh_near_finder_destroy(&fresh);
  soup_clear(&s);
  free(x);
}

/* Counts calls of malloc; a sanitizer's own malloc is left alone. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#endif

#if defined(__GLIBC__) && !defined(SANITIZED)
static long requests;
extern void *__libc_malloc(size_t), *__libc_realloc(void *, size_t);
void *malloc(size_t size)
{
  requests++;
  return __libc_malloc(size);
}
void *realloc(void *memory, size_t size)
{
  requests++;
  return __libc_realloc(memory, size);
}
#else
static long requests = 1;
#endif

/* Once the largest number of pairs has been found, no search allocates, even if the tree is regrouped. */
static void searching_again_allocates_nothing(void)
{
  soup s = soup_at_random(400, 0.1, &state);
  flesh_near_finder *finder;
  flesh_near_pairs pairs = {0};
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x);
  for (int d = 0; d < 3 * s.nodes; d++) x[d] = s.X[d] + (d / 36 % 2 ? 50 : 0);
  CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0.01, NULL, &finder));
  const long before = requests;
  CHECK_OK(flesh_near_pairs_find(finder, s.X, x, 0.05, NULL, &pairs));
  const long after = requests;
  CHECK(before > 0 && (after > before || before == 1)); /* the count counts */
  CHECK_OK(flesh_near_pairs_find(finder, s.X, x, 0.05, NULL, &pairs));
  CHECK_OK(flesh_near_pairs_find(finder, s.X, NULL, 0.04, NULL, &pairs));
  CHECK_OK(flesh_near_pairs_find(finder, x, NULL, 0.04, NULL, &pairs));
  CHECK(flesh_near_pairs_feasible_step(finder, &pairs, x, s.X, 0.1, INFINITY, NULL) > 0);
  CHECK(requests == after && finder->regrouped == 1);
  flesh_near_pairs_clear(&pairs);
  flesh_near_finder_destroy(&finder);
  soup_clear(&s);
  free(x);
}

/* Keeps the pairs of `all` [2*count] with a first node below `own`, in their order. Returns their number. */
static int keep_own(const int *first_nodes, int stride, int own, int count, const int *all, int *kept)
{
  int n = 0;
  for (int k = 0; k < count; k++)
    if (first_nodes[(size_t)stride * (size_t)all[2 * k]] < own) memcpy(kept + 2 * n++, all + 2 * k, 2 * sizeof *kept);
  return n;
}

/* A search for the pairs of some nodes finds these and no others, also along paths, and after its tree is regrouped. */
static void ranks_share_a_search_out(void)
{
  soup s = soup_of_sheets(3, 12, 0.02);
  double *x = malloc(3 * (size_t)s.nodes * sizeof *x), *x1 = malloc(3 * (size_t)s.nodes * sizeof *x1);
  for (int d = 0; d < 3 * s.nodes; d++) x[d] = s.X[d] + between(-0.01, 0.01), x1[d] = x[d] + between(-0.01, 0.01);
  const int owns[] = {0, 1, s.nodes / 5, s.nodes / 2, s.nodes};
  for (int k = 0; k < 10; k++) {
    flesh_near_finder *finder;
    flesh_near_pairs all = {0}, own = {0};
    const double *to = k % 2 ? x1 : NULL;
    CHECK_OK(flesh_near_finder_create(&s.surface, s.X, NULL, 0.005, NULL, &finder));
    CHECK_OK(flesh_near_pairs_find(finder, x, to, 0.02, NULL, &all));
    CHECK_OK(flesh_near_finder_restrict(finder, owns[k / 2]));
    if (k > 4) flesh_box_tree_regroup(finder->tree, x1);
    CHECK_OK(flesh_near_pairs_find(finder, x, to, 0.02, NULL, &own));
    int *kept = malloc(2 * ((size_t)all.point_count + (size_t)all.edge_count + 1) * sizeof *kept);
    const int points = keep_own(s.surface.nodes, 1, owns[k / 2], all.point_count, all.point_faces, kept);
    CHECK(points == own.point_count && same_list(points, kept, own.point_faces));
    const int edges = keep_own(s.surface.edges, 2, owns[k / 2], all.edge_count, all.edge_pairs, kept);
    CHECK(edges == own.edge_count && same_list(edges, kept, own.edge_pairs));
    CHECK(all.point_count > 300 && all.edge_count > 300);
    free(kept);
    flesh_near_pairs_clear(&all);
    flesh_near_pairs_clear(&own);
    flesh_near_finder_destroy(&finder);
  }
  soup_clear(&s);
  free(x);
  free(x1);
}

static void bad_input_is_refused(void)
{
  soup s = soup_of_sheets(1, 2, 0);
  flesh_near_finder *finder;
  CHECK(flesh_near_finder_create(&s.surface, s.X, NULL, -1, NULL, &finder) == FLESH_ERR_ARGUMENT && !finder);
  CHECK(flesh_near_finder_create(&s.surface, s.X, NULL, NAN, NULL, &finder) == FLESH_ERR_ARGUMENT);
  s.X[4] = INFINITY;
  CHECK(flesh_near_finder_create(&s.surface, s.X, NULL, 0, NULL, &finder) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "node 1 is not finite");
  soup_clear(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(finds_what_brute_force_finds), TEST(neighbours_at_rest_are_left_out),
                   TEST_OF_THREADS(same_for_any_number_of_threads), TEST(old_results_reach),
                   TEST_OF_THREADS(choices_miss_nothing), TEST(sheets_stop_before_they_touch), TEST(worn_trees_are_grouped_anew),
                   TEST(searching_again_allocates_nothing), TEST(ranks_share_a_search_out), TEST(bad_input_is_refused));
}
