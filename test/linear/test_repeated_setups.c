// TEST quick seconds=60 args: neighbours_in_a_pair_do_not_disturb_each_other few_setups_give_the_same_bits
// TEST name=test_thousands_of_setups full seconds=300 builds=plain,memory args: two_thousand_setups_give_the_same_bits
/* test_repeated_setups.c: preconditioners that two threads set up repeatedly are equal to those that one thread sets
 * up, to the last bit, on irregular meshes: there threads write next to each other at random. */
#include <stdatomic.h>
#include <stdint.h>

#include "matrices.h"
#include "linear/linear.h"
#include "linear/triangle.h"
#include "test.h"

enum { PAIRS = 512, ROUNDS = 8000, WRITERS = 2, LOOKS = 20000 };

/* A triangle of rows of two blocks, the first of which belong to the first writer. The writers start at opposite ends,
 * so that they meet. */
typedef struct writing {
  flesh_triangle triangle;
  float number; /* the value of all entries; those of the second writer are its negative */
  atomic_int begun;
} writing;

static void write_blocks(void *data, int writer)
{
  writing *w = data;
  float entries[9];
  for (int e = 0; e < 9; e++) entries[e] = writer ? -w->number : w->number;
  atomic_fetch_add_explicit(&w->begun, 1, memory_order_relaxed);
  for (int look = 0; look < LOOKS && atomic_load_explicit(&w->begun, memory_order_relaxed) < WRITERS; look++) continue;
  for (int k = 0; k < PAIRS; k++) {
    const int row = writer ? PAIRS - 1 - k : k;
    flesh_triangle_set(&w->triangle, flesh_triangle_place(&w->triangle, row, writer), entries);
  }
}

/* Blocks that share words keep what each thread has written. Numbers have eight binary digits: nothing is rounded. */
static void neighbours_in_a_pair_do_not_disturb_each_other(void)
{
  int blocks[PAIRS], order[PAIRS], lost = 0;
  for (int row = 0; row < PAIRS; row++) blocks[row] = WRITERS, order[row] = row;
  writing w = {.number = 0};
  flesh_threads *threads = NULL;
  CHECK_OK(flesh_triangle_create(PAIRS, blocks, order, 0, &w.triangle));
  CHECK_OK(flesh_threads_create(WRITERS, &threads));
  float y[4 * WRITERS] = {1, 0, 0, 0, 0, 1, 0, 0};
  for (int row = 0; row < PAIRS; row++)
    for (int n = 0; n < WRITERS; n++) flesh_triangle_set_column(&w.triangle, row, n, n);
  for (int round = 0; round < ROUNDS; round++) {
    w.number = (float)(1 + round % 128);
    atomic_store(&w.begun, 0);
    flesh_threads_run(threads, WRITERS, write_blocks, &w);
    for (int row = 0; row < PAIRS; row++)
      for (int n = 0; n < WRITERS; n++) {
        memset(y, 0, sizeof y);
        y[5 * n] = 1; /* column n of block n */
        const flesh_float4 column =
            flesh_triangle_product(&w.triangle, w.triangle.start[row], w.triangle.start[row + 1], y);
        for (int c = 0; c < 3; c++) lost += column[c] != (n ? -w.number : w.number);
      }
  }
  if (lost) printf("# %d entries are not what was written last\n", lost);
  CHECK(lost == 0);
  flesh_threads_destroy(&threads);
  flesh_triangle_clear(&w.triangle);
}

/* Makes a body clamped at its low end along y, at rest and bent. The two matrices alternate, so that the next set-up
 * cannot just repeat the contents that the previous one left. */
enum { MATRICES = 2 };

static void make_matrices(const test_body *b, uint8_t *fixed, flesh_block_matrix *matrices[MATRICES])
{
  double low = INFINITY, high = -INFINITY, *x = malloc((size_t)b->n * sizeof *x);
  const double *X = flesh_mesh_positions(b->mesh);
  for (int d = 1; d < b->n; d += 3) low = fmin(low, X[d]), high = fmax(high, X[d]);
  for (int d = 0; d < b->n; d++) fixed[d] = X[d - d % 3 + 1] < low + 0.05 * (high - low);
  for (int m = 0; m < MATRICES; m++) {
    memcpy(x, X, (size_t)b->n * sizeof *x);
    for (int d = 0; d < b->n && m; d += 3) x[d] += 0.3 * (X[d + 1] - low) * (X[d + 1] - low) / (high - low);
    flesh_point point = flesh_point_at(0, x, b->state.v, b->state.v);
    CHECK_OK(flesh_system_matrix_create(b->system, &matrices[m]));
    CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){1, 0, 3600, FLESH_FILTER_CLAMP}, matrices[m]));
    flesh_block_fix(matrices[m], fixed, 1e4, NULL);
  }
  free(x);
}

/* Returns how many of `count` set-ups by two threads give another z = P^-1 r than by one. */
static int differing(const test_body *b, flesh_preconditioner kind, int count)
{
  const flesh_linear *linear = flesh_linear_for(flesh_system_instructions(b->system));
  const size_t n = (size_t)b->n;
  const double *X = flesh_mesh_positions(b->mesh);
  double *r = malloc((2 + MATRICES) * n * sizeof *r), *z = r + n, *expected = z + n;
  uint8_t *fixed = calloc(n, 1);
  flesh_block_matrix *matrices[MATRICES];
  flesh_threads *threads = NULL;
  flesh_preconditioner_data *by_one = NULL, *by_two = NULL;
  int differ = 0;
  make_matrices(b, fixed, matrices);
  randomise(b->n, r);
  CHECK_OK(flesh_threads_create(2, &threads));
  CHECK_OK(linear->preconditioner_create(kind, matrices[0], X, 1, NULL, &by_one));
  CHECK_OK(linear->preconditioner_create(kind, matrices[0], X, 1, threads, &by_two));
  for (int k = 0; k < count; k++) { /* shifts settle first */
    const int m = k % MATRICES, known = k >= 4 * MATRICES;
    if (!known) {
      CHECK_OK(linear->preconditioner_setup(by_one, matrices[m], fixed));
      linear->preconditioner_apply(by_one, r, expected + n * (size_t)m);
    }
    CHECK_OK(linear->preconditioner_setup(by_two, matrices[m], fixed));
    linear->preconditioner_apply(by_two, r, z);
    differ += memcmp(z, expected + n * (size_t)m, n * sizeof *z) != 0;
  }
  CHECK(memcmp(expected, expected + n, n * sizeof *expected) != 0);
  linear->preconditioner_destroy(&by_one);
  linear->preconditioner_destroy(&by_two);
  flesh_threads_destroy(&threads);
  for (int m = 0; m < MATRICES; m++) flesh_block_matrix_destroy(&matrices[m]);
  free(fixed);
  free(r);
  return differ;
}

static void compare(int count)
{
  static const char *const meshes[] = {"hand_coarse", "finger_coarse", "limb"};
  static const flesh_preconditioner kinds[] = {FLESH_PRECONDITIONER_TWO_LEVEL, FLESH_PRECONDITIONER_IC};
  for (size_t k = 0; k < sizeof meshes / sizeof meshes[0]; k++) {
    char path[100];
    flesh_mesh *mesh = NULL;
    test_body b;
    snprintf(path, sizeof path, "../data/meshes/%s.msh", meshes[k]);
    CHECK_OK(flesh_mesh_read(path, &mesh));
    if (!mesh) continue;
    make(mesh, FLESH_ENERGY_S, 0.45, &b);
    for (size_t p = 0; p < sizeof kinds / sizeof kinds[0]; p++) {
      const int differ = differing(&b, kinds[p], count);
      printf("# %s, %d nodes, %s: %d of %d set-ups differ\n", meshes[k], b.n / 3, p ? "one level" : "two levels",
             differ, count);
      CHECK(differ == 0);
    }
    test_body_destroy(&b);
  }
}

static void few_setups_give_the_same_bits(void) { compare(40); }

static void two_thousand_setups_give_the_same_bits(void) { compare(2000); }

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST_OF_THREADS(neighbours_in_a_pair_do_not_disturb_each_other),
                   TEST_OF_THREADS(few_setups_give_the_same_bits), TEST_OF_THREADS(two_thousand_setups_give_the_same_bits));
}
