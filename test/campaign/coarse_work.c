/* coarse_work.c: the cost of the coarse level's factor, of which every rank has a full copy.
 *
 *   build/test/coarse_work_avx512 4 6 8 ...
 *
 * Each argument is the number of groups of four vertices along an edge of a cube; each group is coupled with its 26
 * neighbours. Prints the vertices, the blocks of the factor, the block products of a factorisation, and the CPU times
 * of a factorisation (the least of three) and of thirty solves. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "linear/coarse_cholesky.c"

static double seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Lists the neighbours of each group: `starts` [n+1], `neighbours` [26 n]. */
static void couple(int edge, int *starts, int *neighbours)
{
  int count = 0;
  for (int i = 0; i < edge * edge * edge; i++) {
    const int x = i % edge, y = i / edge % edge, z = i / edge / edge;
    starts[i] = count;
    for (int k = 0; k < 27; k++) {
      const int a = x + k % 3 - 1, b = y + k / 3 % 3 - 1, c = z + k / 9 - 1;
      if (k == 13 || a < 0 || b < 0 || c < 0 || a >= edge || b >= edge || c >= edge) continue;
      neighbours[count++] = a + edge * (b + edge * c);
    }
  }
  starts[edge * edge * edge] = count;
}

static void load(flesh_coarse_cholesky *A, const int *starts, const int *neighbours)
{
  flesh_coarse_cholesky_zero(A);
  for (int i = 0; i < A->n; i++) {
    double *pivot = flesh_coarse_cholesky_at(A, A->place[i], A->place[i]);
    for (int d = 0; d < FLESH_BLOCK12; d++) pivot[(FLESH_BLOCK12 + 1) * d] = 30;
    for (int e = starts[i]; e < starts[i + 1]; e++) {
      if (A->place[neighbours[e]] < A->place[i]) continue;
      double *block = flesh_coarse_cholesky_at(A, A->place[i], A->place[neighbours[e]]);
      for (int d = 0; d < FLESH_BLOCK12; d++) block[(FLESH_BLOCK12 + 1) * d] = -1;
    }
  }
}

static int measure(int edge)
{
  enum { FACTORS = 3, SOLVES = 30 };
  const int n = edge * edge * edge;
  int *starts = malloc(((size_t)n + 1) * sizeof *starts), *neighbours = malloc(26 * (size_t)n * sizeof *neighbours);
  flesh_coarse_cholesky A = {0};
  double work = 0, factor = 1e300, solve = 1e300;
  couple(edge, starts, neighbours);
  int fine = !flesh_coarse_cholesky_create(n, starts, neighbours, &A);
  for (int k = 0; fine && k < n; k++) {
    const double column = A.start[k + 1] - A.start[k];
    work += column * (column + 1) / 2;
  }
  for (int k = 0; fine && k < FACTORS; k++) {
    load(&A, starts, neighbours);
    const double start = seconds();
    fine = flesh_coarse_cholesky_factor(&A);
    if (seconds() - start < factor) factor = seconds() - start;
  }
  for (int k = 0; fine && k < SOLVES; k++) {
    for (int d = 0; d < FLESH_BLOCK12 * n; d++) A.x[d] = 1;
    const double start = seconds();
    flesh_coarse_cholesky_solve(&A);
    if (seconds() - start < solve) solve = seconds() - start;
  }
  if (fine)
    printf("vertices %d blocks %d products %.0f factor %.3g ms solve %.3g ms\n", 4 * n, A.start[n], work, 1e3 * factor,
           1e3 * solve);
  flesh_coarse_cholesky_clear(&A);
  free(starts);
  free(neighbours);
  return fine;
}

int main(int argc, char **argv)
{
  for (int k = 1; k < argc; k++)
    if (atoi(argv[k]) < 1 || !measure(atoi(argv[k]))) return 1;
  return 0;
}
