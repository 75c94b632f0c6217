/* ranks.h: tests on several MPI ranks. A test runs on all of them, and fails if a check fails on any; the first rank
 * prints the TAP lines.
 *
 *   int main(int argc, char **argv) { return RUN_TESTS_ON_RANKS(argc, argv, TEST(sums_are_exact)); } */
#ifndef FLESH_TEST_RANKS_H
#define FLESH_TEST_RANKS_H

#include <mpi.h>
#include <stdlib.h>

#include "parallel/rank_part.h"
#include "parallel/partition.h"
#include "test.h"

static flesh_communicator *ranks; /* all of them */

static inline int ranks_run_all(int argc, char **argv, const test_case *cases, int count)
{
  int got, failed = 0, number = 0;
  MPI_Comm world = MPI_COMM_WORLD;
  if (MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &got) || flesh_communicator_create(&world, &ranks)) return 99;
  const int first = flesh_communicator_rank(ranks) == 0;
  if (first) printf("1..%d\n", count);
  for (int c = 0; c < count; c++) {
    test_failures = 0;
    cases[c].run();
    fflush(stdout);
    double failures = test_failures;
    flesh_communicator_sum(ranks, 1, &failures);
    if (first) printf("%s %d - %s\n", failures > 0 ? "not ok" : "ok", ++number, cases[c].name);
    fflush(stdout);
    failed += failures > 0;
  }
  flesh_communicator_destroy(&ranks);
  MPI_Finalize();
  return failed != 0;
}

#define RUN_TESTS_ON_RANKS(argc, argv, ...)                    \
  ranks_run_all(argc, argv, (const test_case[]){__VA_ARGS__},  \
                (int)(sizeof((const test_case[]){__VA_ARGS__}) / sizeof(test_case)))

/* Creates the part of this rank. */
static inline flesh_rank_part *ranks_cut(const flesh_mesh *whole)
{
  flesh_rank_part *part = NULL;
  CHECK_OK(flesh_rank_part_create(ranks, whole, NULL, &part));
  return part;
}

#endif
