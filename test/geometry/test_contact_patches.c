// TEST quick
/* test_contact_patches.c: patches of intersecting boxes: winding numbers, which pairs are ignored and which are not,
 * and from when on they count again. */
#include "geometry/contact_patches.h"
#include "geometry/near_pairs.h"
#include "geometry/surface_winding.h"
#include "soups.h"

static unsigned long long state = 11;

/* An upright box of 12 cells^2 triangles, oriented outward, or inward if `inward`: a hollow. */
typedef struct box {
  double low[3], size[3];
  int body, inward;
} box;

/* Computes the position of node (i, j) of a side on which `axis` is constant. */
static void place_on(const box *b, int axis, int top, int cells, int i, int j, double x[3])
{
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  x[axis] = b->low[axis] + b->size[axis] * (top ? cells : 0) / cells;
  x[u] = b->low[u] + b->size[u] * i / cells;
  x[v] = b->low[v] + b->size[v] * j / cells;
}

/* Returns the box's node at the position, or a new one. */
static int node_at(soup *s, int first, const double x[3], int body)
{
  for (int k = first; k < s->nodes; k++)
    if (!memcmp(s->X + 3 * k, x, 3 * sizeof *x)) return k;
  memcpy(s->X + 3 * s->nodes, x, 3 * sizeof *x);
  s->body[s->nodes] = body;
  return s->nodes++;
}

static soup soup_of_boxes(int count, const box *boxes, int cells)
{
  soup s = soup_create(count * 6 * (cells + 1) * (cells + 1), count * 12 * cells * cells);
  int *corner = s.corners;
  s.nodes = 0;
  for (int b = 0; b < count; b++) {
    const int first = s.nodes;
    for (int k = 0; k < 6 * cells * cells; k++) {
      const int side = k / (cells * cells), i = k / cells % cells, j = k % cells;
      int quad[4];
      for (int q = 0; q < 4; q++) {
        double x[3];
        place_on(&boxes[b], side / 2, side % 2, cells, i + (q == 1 || q == 2), j + (q > 1), x);
        quad[q] = node_at(&s, first, x, boxes[b].body);
      }
      const int turned = (side % 2 == 0) ^ boxes[b].inward, second = turned ? 3 : 1, fourth = 4 - second;
      const int triangles[6] = {quad[0], quad[second], quad[2], quad[0], quad[2], quad[fourth]};
      memcpy(corner, triangles, sizeof triangles);
      corner += 6;
    }
  }
  CHECK_OK(flesh_contact_surface_of_triangles(s.nodes, s.X, s.triangles, s.corners, s.body, &s.surface));
  return s;
}

static int is_in(const box *b, const double p[3])
{
  for (int c = 0; c < 3; c++)
    if (p[c] <= b->low[c] || p[c] >= b->low[c] + b->size[c]) return 0;
  return 1;
}

/* Random boxes of two bodies, some of them hollows: a body winds around a point just outside a face as often as it has
 * boxes there, minus its hollows; outside, the face's own box does not count, nor inside, its own hollow. */
static void windings_count_boxes(void)
{
  int most = 0, least = 0;
  for (int round = 0; round < 20; round++) {
    enum { BOXES = 5 };
    box boxes[BOXES];
    for (int k = 0; k < BOXES; k++) {
      boxes[k] = (box){.body = k % 2, .inward = k == 4};
      for (int c = 0; c < 3; c++) {
        boxes[k].low[c] = test_uniform(&state);
        boxes[k].size[c] = 0.3 + test_uniform(&state);
        if (round % 2) boxes[k].low[c] = floor(4 * boxes[k].low[c]) / 4 + 0.01 * k, boxes[k].size[c] = 1.25;
      }
    }
    soup s = soup_of_boxes(BOXES, boxes, 2);
    int *face_body = malloc((size_t)s.triangles * sizeof *face_body);
    for (int f = 0; f < s.triangles; f++) face_body[f] = s.body[s.corners[3 * f]];
    for (int f = 0; f < s.triangles; f++)
      for (int body = 0; body < 2; body++) {
        const int own = f / (s.triangles / BOXES);
        double p[3];
        int expected = 0;
        for (int c = 0; c < 3; c++) {
          p[c] = 0;
          for (int k = 0; k < 3; k++) p[c] += s.X[3 * s.corners[3 * f + k] + c] / 3;
        }
        for (int k = 0; k < BOXES; k++) /* inside a hollow is outside of the hollow's surface */
          if (boxes[k].body == body && (k == own ? boxes[k].inward : is_in(&boxes[k], p))) expected += boxes[k].inward ? -1 : 1;
        const int winding = flesh_surface_winding(&s.surface, face_body, body, f, s.X);
        CHECK(winding == expected);
        most = expected > most ? expected : most, least = expected < least ? expected : least;
      }
    free(face_body);
    soup_clear(&s);
  }
  CHECK(most >= 2 && least < 0);
}

typedef struct trial {
  soup s;
  flesh_near_finder *finder;
  flesh_contact_patches patches;
  double *x;
} trial;

static const double thickness = 0.02, reach = 0.05;

static void begin(int count, const box *boxes, int cells, flesh_threads *threads, trial *t)
{
  t->s = soup_of_boxes(count, boxes, cells);
  t->x = malloc(3 * (size_t)t->s.nodes * sizeof *t->x);
  memcpy(t->x, t->s.X, 3 * (size_t)t->s.nodes * sizeof *t->x);
  CHECK_OK(flesh_near_finder_create(&t->s.surface, t->s.X, NULL, thickness, threads, &t->finder));
  CHECK_OK(flesh_contact_patches_create(&t->s.surface, &t->patches));
  CHECK_OK(flesh_contact_patches_update(&t->patches, t->finder, t->x, thickness, reach, threads));
}

static void end(trial *t)
{
  flesh_contact_patches_clear(&t->patches);
  flesh_near_finder_destroy(&t->finder);
  soup_clear(&t->s);
  free(t->x);
}

/* Moves the nodes from `first` to before `until` along an axis. Returns the number of remaining pairs of patches. */
static int left_at(trial *t, int first, int until, int axis, double by)
{
  for (int k = first; k < until; k++) t->x[3 * k + axis] = t->s.X[3 * k + axis] + by;
  CHECK_OK(flesh_contact_patches_update(&t->patches, t->finder, t->x, thickness, reach, NULL));
  return t->patches.pair_count;
}

/* Counts the pairs in contact at the position, within the reach, between two bodies. */
static int count_pairs(trial *t, int with_patches, int body, int other)
{
  const flesh_contact_surface *s = &t->s.surface;
  flesh_near_pairs pairs = {0};
  int found = 0;
  t->finder->patches = with_patches ? &t->patches : NULL;
  CHECK_OK(flesh_near_pairs_find(t->finder, t->x, NULL, reach, NULL, &pairs));
  for (int k = 0; k < pairs.point_count; k++) {
    const int a = s->node_body[pairs.point_faces[2 * k]],
              b = s->node_body[s->node_place[s->faces[3 * pairs.point_faces[2 * k + 1]]]];
    found += (a == body && b == other) || (a == other && b == body);
  }
  for (int k = 0; k < pairs.edge_count; k++) {
    const int a = s->node_body[s->node_place[s->edges[2 * pairs.edge_pairs[2 * k]]]],
              b = s->node_body[s->node_place[s->edges[2 * pairs.edge_pairs[2 * k + 1]]]];
    found += (a == body && b == other) || (a == other && b == body);
  }
  t->finder->patches = NULL;
  flesh_near_pairs_clear(&pairs);
  return found;
}

/* A box's corner in another box, and a third box beside the first: everything inside belongs to a patch, nothing far
 * does; no pair of the two counts, all pairs with the third do. When pulled out they count again, but not before they
 * are a thickness apart. */
static void what_crosses_is_ignored_until_apart(void)
{
  const box boxes[3] = {{{0, 0, 0}, {1, 1, 1}, 0, 0}, {{0.71, 0.72, 0.73}, {1, 1, 1}, 1, 0},
                        {{-1.01, 0.01, 0.02}, {1, 1, 1}, 2, 0}};
  int *expected = NULL;
  for (int threads_count = 1; threads_count <= 3; threads_count += 2) {
    trial t;
    flesh_threads *threads;
    CHECK_OK(flesh_threads_create(threads_count, &threads));
    begin(3, boxes, 6, threads, &t);
    CHECK(t.patches.pair_count == 1 && t.patches.count == 2);
    const flesh_patch_pair *pair = &t.patches.pairs[0];
    CHECK(pair->bodies[0] == 0 && pair->bodies[1] == 1 && pair->faces[0] > 0 && pair->faces[1] > 0);
    for (int c = 0; c < 3; c++) CHECK(pair->place[c] > 0.7 && pair->place[c] < 1.01);
    for (int k = 0; k < t.s.nodes; k++) {
      const double *p = t.x + 3 * k;
      const int other = 1 - t.s.body[k], node = t.s.surface.node_place[k];
      if (t.s.body[k] < 2 && is_in(&boxes[other], p)) CHECK(t.patches.node_patch[node] >= 0);
      double far = 0;
      for (int c = 0; c < 3 && t.s.body[k] < 2; c++)
        far = fmax(far, fmax(boxes[other].low[c] - p[c], p[c] - boxes[other].low[c] - 1));
      if (t.s.body[k] == 2 || far > 2. / 6 * 1.5) CHECK(t.patches.node_patch[node] < 0);
    }
    for (int f = 0; f < t.s.triangles; f++)
      for (int c = 0; c < 3 && t.patches.face_patch[f] < 0; c++) {
        CHECK(t.patches.node_patch[t.s.surface.node_place[t.s.surface.faces[3 * f + c]]] < 0);
        CHECK(t.patches.edge_patch[t.s.surface.face_edges[3 * f + c]] < 0);
      }
    const size_t bytes = (size_t)t.s.triangles * sizeof *expected;
    if (!expected) {
      expected = malloc(bytes);
      memcpy(expected, t.patches.face_patch, bytes);
    }
    CHECK(!memcmp(expected, t.patches.face_patch, bytes));
    CHECK(count_pairs(&t, 0, 0, 1) > 50 && count_pairs(&t, 1, 0, 1) == 0);
    CHECK(count_pairs(&t, 0, 0, 2) > 100 && count_pairs(&t, 1, 0, 2) == count_pairs(&t, 0, 0, 2));
    const int first = t.s.nodes / 3;
    CHECK(left_at(&t, first, 2 * first, 0, 0.2) == 1);
    CHECK(left_at(&t, first, 2 * first, 0, 0.29 + 0.9 * thickness) == 1);
    CHECK(left_at(&t, first, 2 * first, 0, 0.29 + 1.1 * thickness) == 0);
    CHECK(count_pairs(&t, 1, 0, 1) == count_pairs(&t, 0, 0, 1));
    end(&t);
    flesh_threads_destroy(&threads);
  }
  free(expected);
}

/* A box inside another, intersecting nothing, can leave it anywhere; one in a hollow is not inside. */
static void what_is_swallowed_gets_out(void)
{
  const box full[2] = {{{0, 0, 0}, {1, 1, 1}, 0, 0}, {{0.3, 0.31, 0.32}, {0.4, 0.4, 0.4}, 1, 0}};
  const box hollow[3] = {{{0, 0, 0}, {1, 1, 1}, 0, 0}, {{0.1, 0.1, 0.1}, {0.8, 0.8, 0.8}, 0, 1}, full[1]};
  trial t;
  begin(2, full, 3, NULL, &t);
  CHECK(t.patches.pair_count == 1);
  CHECK(t.patches.pairs[0].faces[0] == t.s.triangles / 2 && t.patches.pairs[0].faces[1] == t.s.triangles / 2);
  const int first = t.s.nodes / 2;
  CHECK(left_at(&t, first, t.s.nodes, 2, 0.01) == 1); /* still inside */
  CHECK(left_at(&t, first, t.s.nodes, 2, 0.5) == 1);
  CHECK(count_pairs(&t, 1, 0, 1) == 0);
  CHECK(left_at(&t, first, t.s.nodes, 2, 0.68 + 1.1 * thickness) == 0);
  end(&t);
  begin(3, hollow, 3, NULL, &t);
  CHECK(t.patches.pair_count == 0);
  end(&t);
}

/* Makes a body of two boxes that intersect. */
static void a_body_in_itself(void)
{
  const box boxes[2] = {{{0, 0, 0}, {1, 1, 1}, 0, 0}, {{0.8, 0.33, 0.34}, {1, 0.3, 0.3}, 0, 0}};
  trial t;
  begin(2, boxes, 4, NULL, &t);
  CHECK(t.patches.pair_count == 1 && t.patches.pairs[0].bodies[0] == 0 && t.patches.pairs[0].bodies[1] == 0);
  CHECK(left_at(&t, t.s.nodes / 2, t.s.nodes, 0, 0.1) == 1);
  CHECK(left_at(&t, t.s.nodes / 2, t.s.nodes, 0, 0.2 + 1.1 * thickness) == 0);
  end(&t);
}

/* Patches are restored from bytes; those that do not fit are refused. */
static void patches_are_saved(void)
{
  const box boxes[2] = {{{0, 0, 0}, {1, 1, 1}, 0, 0}, {{0.71, 0.72, 0.73}, {1, 1, 1}, 1, 0}};
  trial t, other;
  begin(2, boxes, 3, NULL, &t);
  begin(2, boxes, 3, NULL, &other);
  other.patches.pair_count = other.patches.count = 0;
  for (int f = 0; f < t.s.triangles; f++) other.patches.face_patch[f] = -1;
  flesh_archive archive = {.mode = FLESH_ARCHIVE_MEASURE};
  CHECK_OK(flesh_contact_patches_archive(&t.patches, &archive));
  uint8_t *data = malloc(archive.at);
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = data, .size = archive.at};
  CHECK_OK(flesh_contact_patches_archive(&t.patches, &archive));
  const size_t size = archive.size;
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = data, .size = size};
  CHECK_OK(flesh_contact_patches_archive(&other.patches, &archive));
  CHECK(!archive.wrong && archive.at == size);
  CHECK(count_pairs(&other, 1, 0, 1) == 0 && count_pairs(&other, 0, 0, 1) > 0);
  CHECK(other.patches.pair_count == 1 && !memcmp(other.patches.pairs, t.patches.pairs, sizeof *t.patches.pairs));
  t.patches.face_patch[7] = t.patches.count;
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_SAVE, .data = data, .size = size};
  CHECK_OK(flesh_contact_patches_archive(&t.patches, &archive));
  archive = (flesh_archive){.mode = FLESH_ARCHIVE_LOAD, .data = data, .size = size};
  CHECK_OK(flesh_contact_patches_archive(&other.patches, &archive));
  CHECK(archive.wrong && other.patches.pair_count == 0);
  free(data);
  end(&t);
  end(&other);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(windings_count_boxes), TEST_OF_THREADS(what_crosses_is_ignored_until_apart),
                   TEST(what_is_swallowed_gets_out), TEST(a_body_in_itself), TEST(patches_are_saved));
}
