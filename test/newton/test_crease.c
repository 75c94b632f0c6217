// TEST quick seconds=60
/* test_crease.c: a step in which the pressed side of a clamped bar folds into a crease is not expensive. There the body
 * leaves a saddle of the incremental potential, where steps of a projected Hessian are short. */
#include "swing.h"

/* A short bar under eight times gravity; it creases in the step from 0.2 s. */
static const swing bar = {{16, 13, 13}, 20, {1. / 3, 13. / 48, 13. / 48}, 0.45, 8, 1, 1, 0};

static void creases_are_cheap(void)
{
  swing_cost cost = swing_run(&bar);
  CHECK_BELOW(cost.newton, 4); /* 2.8 */
  CHECK_BELOW(cost.work, 7);   /* 6.4 */
}

/* Otherwise nothing would be tested. */
static void creases_are_dear_when_negative_curvature_is_projected_away(void)
{
  swing off = bar;
  off.follow = off.eliminate = 0;
  off.steps = 13;
  off.enough = 60; /* of 239, where the median is 5 */
  swing_cost cost = swing_run(&off);
  CHECK(cost.newton >= 12 && cost.work >= 10);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(creases_are_cheap),
                   TEST(creases_are_dear_when_negative_curvature_is_projected_away));
}
