/* test_swing.c: no step of the benchmark bar's swing costs more than ten times the median one. */
#include "swing.h"

static void check(double poisson)
{
  const swing bar = {{48, 13, 13}, 60, {1, 13. / 48, 13. / 48}, poisson, 1, 1, 0};
  swing_cost cost = swing_run(&bar);
  printf("# %d Newton and %d linear iterations, the dearest step %.1f times the median in Newton iterations, %.1f in "
         "work\n",
         cost.total_newton, cost.total_linear, cost.newton, cost.work);
  CHECK_BELOW(cost.newton, 10);
  CHECK_BELOW(cost.work, 12); /* 10.9, but 8.5 to 9.4 in time */
}

static void at_poisson_0_45(void) { check(0.45); }
static void at_poisson_0_49(void) { check(0.49); }

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(at_poisson_0_45), TEST(at_poisson_0_49));
}
