// TEST quick
/* test_box_tree.c: trees of boxes find what brute force finds, with the same bits for any number of threads. */
#include <stdlib.h>

#include "geometry/box_tree.h"
#include "test.h"

enum { PRIMITIVES = 3000, NODES = 2000 };

static unsigned long long state = 11;
static double between(double a, double b) { return a + (b - a) * test_uniform(&state); }

static double x0[3 * NODES], x1[3 * NODES];
static int nodes[3 * PRIMITIVES], tags[PRIMITIVES];

/* Makes small primitives of nodes that lie in a line of clusters. */
static void make_soup(int corners, double motion)
{
  for (int i = 0; i < NODES; i++)
    for (int c = 0; c < 3; c++) {
      x0[3 * i + c] = between(-1, 1) + (c == i / 500 ? 0.5 * (i / 100) : 0);
      x1[3 * i + c] = x0[3 * i + c] + motion * between(-1, 1);
    }
  for (int p = 0; p < PRIMITIVES; p++) {
    for (int k = 0; k < corners; k++) nodes[corners * p + k] = (p / 20 * 13 + (int)between(0, 20)) % NODES;
    tags[p] = p / 20 * 13 % NODES / 500;
  }
}

static char seen[PRIMITIVES];

/* Visits the leaves whose boxes meet the given one, checks that they come in the tree's order, and counts the visits of
 * each primitive in `seen`. Returns the number of leaves. */
static int walk(const flesh_box_tree *tree, const double low[3], const double high[3])
{
  int stack[FLESH_BOX_TREE_DEPTH] = {0}, leaves = 0, last = 0;
  memset(seen, 0, sizeof seen);
  for (int height = 1; height > 0;) {
    const flesh_box_branch *b = &tree->branches[stack[--height]];
    if (!flesh_boxes_meet(b->low, b->high, low, high)) continue;
    if (b->children) {
      stack[height++] = b->children + 1;
      stack[height++] = b->children;
      continue;
    }
    CHECK(b->begin >= last && b->end - b->begin <= FLESH_BOX_TREE_LEAF);
    for (int p = b->begin; p < b->end; p++) seen[tree->order[p]]++;
    leaves++;
    last = b->end;
  }
  return leaves;
}

/* Every primitive that meets a box by brute force is visited, once; and the walk does not visit everything. */
static void check_tree(const flesh_box_tree *tree, const double *end, double inflation)
{
  int leaves = 0;
  const int corners = tree->corners;
  for (int p = 0; p < PRIMITIVES; p += 37) {
    double low[3], high[3], other_low[3], other_high[3];
    flesh_box_around(corners, nodes + corners * p, x0, end, 0, low, high);
    leaves += walk(tree, low, high);
    for (int q = 0; q < PRIMITIVES; q++) {
      flesh_box_around(corners, nodes + corners * q, x0, end, 0, other_low, other_high);
      int near = 1;
      for (int c = 0; c < 3; c++) near &= low[c] <= other_high[c] + inflation && other_low[c] - inflation <= high[c];
      CHECK(seen[q] <= 1 && (!near || seen[q]));
    }
  }
  CHECK(leaves < tree->leaf_count * (PRIMITIVES / 37) / 2);
}

static void finds_what_brute_force_finds(void)
{
  for (int corners = 1; corners <= 3; corners++)
    for (int moving = 0; moving < 2; moving++) {
      flesh_box_tree *tree;
      make_soup(corners, 0.3);
      CHECK_OK(flesh_box_tree_create(PRIMITIVES, corners, nodes, NULL, x0, &tree));
      CHECK(flesh_box_tree_memory(tree) < 200 * PRIMITIVES);
      check_tree(tree, NULL, 0);
      flesh_box_tree_refit(tree, x0, moving ? x1 : NULL, 0.05, NULL);
      check_tree(tree, moving ? x1 : NULL, 0.05);
      flesh_box_tree_destroy(&tree);
      CHECK(tree == NULL);
    }
}

/* Every branch contains its children, and has the tag that all below it share. */
static void branches_hold_their_children(void)
{
  flesh_box_tree *tree;
  make_soup(3, 0.3);
  CHECK_OK(flesh_box_tree_create(PRIMITIVES, 3, nodes, tags, x0, &tree));
  flesh_box_tree_refit(tree, x0, x1, 0.01, NULL);
  int tagged = 0;
  for (int k = 0; k < tree->branch_count; k++) {
    const flesh_box_branch *b = &tree->branches[k];
    for (int p = b->begin; p < b->end; p++) {
      double low[3], high[3];
      flesh_box_around(3, nodes + 3 * tree->order[p], x0, x1, 0.01, low, high);
      for (int c = 0; c < 3; c++) CHECK(b->low[c] <= low[c] && high[c] <= b->high[c]);
      CHECK(b->tag < 0 || b->tag == tags[tree->order[p]]);
    }
    CHECK(!b->children || b->children > k);
    tagged += b->tag >= 0;
  }
  CHECK(tagged > tree->leaf_count / 2);
  flesh_box_tree_destroy(&tree);
}

static void same_bits_for_any_number_of_threads(void)
{
  const int counts[] = {1, 2, 5};
  flesh_box_branch *first = NULL;
  double wear = 0;
  make_soup(2, 0.3);
  for (int k = 0; k < 3; k++) {
    flesh_threads *threads;
    flesh_box_tree *tree;
    CHECK_OK(flesh_threads_create(counts[k], &threads));
    CHECK_OK(flesh_box_tree_create(PRIMITIVES, 2, nodes, NULL, x0, &tree));
    flesh_box_tree_refit(tree, x1, x0, 0.01, threads);
    const size_t bytes = (size_t)tree->branch_count * sizeof *tree->branches;
    if (!first) {
      first = malloc(bytes);
      memcpy(first, tree->branches, bytes);
      wear = flesh_box_tree_wear(tree);
    }
    CHECK(!memcmp(first, tree->branches, bytes) && flesh_box_tree_wear(tree) == wear);
    flesh_box_tree_destroy(&tree);
    flesh_threads_destroy(&threads);
  }
  free(first);
}

/* Makes rows of a sheet, as points, edges along them, or triangles. */
static void make_sheet(int corners)
{
  for (int i = 0; i < NODES; i++) {
    x0[3 * i] = i % 40;
    x0[3 * i + 1] = i / 40;
    x0[3 * i + 2] = between(0, 0.1);
  }
  for (int p = 0, i = 0; p < PRIMITIVES; p++, i = (i + 1) % 1950) {
    const int mine[3] = {i, i + 1, i + 2};
    memcpy(nodes + corners * p, mine, (size_t)corners * sizeof *mine);
  }
}

/* Wear depends on which primitives lie together, not on size: it is detected when neighbours separate, and gone after
 * regrouping. */
static void wear_is_measured(void)
{
  flesh_box_tree *tree;
  for (int corners = 1; corners <= 3; corners++) {
    make_sheet(corners);
    CHECK_OK(flesh_box_tree_create(1900, corners, nodes, NULL, x0, &tree));
    CHECK(flesh_box_tree_wear(tree) == 1);
    for (int d = 0; d < 3 * NODES; d++) x1[d] = 8 * x0[d];
    flesh_box_tree_refit(tree, x1, x0, 0.5, NULL);
    CHECK_NEAR(flesh_box_tree_wear(tree), 1, 1e-12);
    for (int i = 0; i < NODES; i++) /* every second row moves to the sheet's other end */
      x1[3 * i] = x0[3 * i], x1[3 * i + 1] = x0[3 * i + 1] + (i / 40 % 4 < 2 ? 90 : 0), x1[3 * i + 2] = 0;
    flesh_box_tree_refit(tree, x1, NULL, 0, NULL);
    const double worn = flesh_box_tree_wear(tree);
    printf("# corners %d: wear %g\n", corners, worn);
    CHECK(worn > 1.4);
    flesh_box_tree_regroup(tree, x1);
    CHECK(flesh_box_tree_wear(tree) == 1);
    flesh_box_tree_destroy(&tree);
  }
}

static void a_place_that_is_not_finite_is_near_everything(void)
{
  flesh_box_tree *tree;
  make_soup(3, 0);
  CHECK_OK(flesh_box_tree_create(PRIMITIVES, 3, nodes, NULL, x0, &tree));
  x1[0] = x0[3 * nodes[30] + 1];
  x0[3 * nodes[30] + 1] = NAN;
  flesh_box_tree_refit(tree, x0, NULL, 0, NULL);
  CHECK(flesh_box_tree_wear(tree) == INFINITY);
  const int leaves = walk(tree, (const double[]){1e9, 1e9, 1e9}, (const double[]){1e9, 1e9, 1e9});
  CHECK(seen[10] == 1 && leaves < tree->leaf_count / 2);
  flesh_box_tree_regroup(tree, x0);
  flesh_box_tree_destroy(&tree);
}

static void few_primitives(void)
{
  for (int count = 1; count < 12; count++) {
    flesh_box_tree *tree;
    make_soup(1, 0);
    CHECK_OK(flesh_box_tree_create(count, 1, nodes, NULL, x0, &tree));
    int places = 0;
    for (int k = 0; k < tree->leaf_count; k++) {
      const flesh_box_branch *leaf = &tree->branches[tree->leaves[k]];
      CHECK(leaf->begin == places);
      places = leaf->end;
    }
    CHECK(places == count);
    flesh_box_tree_destroy(&tree);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(finds_what_brute_force_finds), TEST(branches_hold_their_children),
                   TEST_OF_THREADS(same_bits_for_any_number_of_threads), TEST(wear_is_measured),
                   TEST(a_place_that_is_not_finite_is_near_everything), TEST(few_primitives));
}
