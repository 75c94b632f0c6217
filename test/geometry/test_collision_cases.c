// TEST quick
/* test_collision_cases.c: motions of points, edges and triangles with known results. */
#include "collision_reference.h"

/* Moves the first hull of a pair by d. */
static void move_first(trial *p, double dx, double dy, double dz)
{
  memcpy(p->x1, p->x0, sizeof p->x1);
  for (int k = 0; k < p->first; k++) p->x1[k][0] += dx, p->x1[k][1] += dy, p->x1[k][2] += dz;
}

/* Makes hulls of each kind whose nearest points are interior, the first at the height `gap` above the second. */
static trial pair_above(int kind, double gap)
{
  static const double flat[4][4][3] = {
      {{0.3, 0.3, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}},
      {{0.3, 0, 0}, {0, 0, 0}, {1, 0, 0}},
      {{0, 0, 0}, {0, 0, 0}},
  };
  trial p = {.first = kinds[kind][0], .second = kinds[kind][1]};
  memcpy(p.x0, flat[kind], sizeof p.x0);
  for (int k = 0; k < p.first; k++) p.x0[k][2] = gap;
  return p;
}

/* The two move by 10 gaps towards each other: 9 tenths of one gap are feasible. */
static void head_on(void)
{
  for (int kind = 0; kind < 4; kind++)
    for (double gap = 1e-9; gap < 2; gap *= 10) {
      trial p = pair_above(kind, gap);
      move_first(&p, 0, 0, -10 * gap);
      CHECK_NEAR(advance(&p), (1 - keep) / 10, 1e-4 * gap + 1e-5);
      CHECK(advance(&p) <= (1 - keep) / 10);
      move_first(&p, 0, 0, -0.8 * gap);
      CHECK(advance(&p) == 1);
    }
}

/* Motions along each other, and apart, are feasible entirely, even from almost touching. */
static void sliding_is_free(void)
{
  for (int kind = 0; kind < 4; kind++)
    for (int up = 0; up < 2; up++) {
      trial p = pair_above(kind, 1e-8);
      move_first(&p, kind < 3 ? 1e3 : 0, kind == 1 ? 1e2 : 0, up);
      CHECK(advance(&p) == 1);
    }
}

static void touching_pairs_may_only_part(void)
{
  for (int kind = 0; kind < 4; kind++) {
    trial p = pair_above(kind, 0);
    move_first(&p, 0, 0, 0);
    CHECK(advance(&p) == 1); /* none moves */
    move_first(&p, 0, 0, -1);
    CHECK(advance(&p) == 0);
    p = pair_above(kind, 1e-17);
    move_first(&p, 0, 0, -1);
    CHECK(advance(&p) == 0);
    move_first(&p, 0, 0, 1);
    CHECK(advance(&p) == 1);
  }
}

/* A translation of both changes nothing, however long. */
static void common_motion_does_not_count(void)
{
  for (int kind = 0; kind < 4; kind++) {
    trial p = pair_above(kind, 0.5);
    move_first(&p, 0, 0, -1);
    const double alone = advance(&p);
    for (int k = 0; k < 4; k++) p.x1[k][0] += 0x1p20, p.x1[k][2] -= 0x1p22;
    CHECK_NEAR(advance(&p), alone, 1e-8);
  }
}

static void what_is_not_finite_stays(void)
{
  const double bad[] = {NAN, INFINITY, -INFINITY, 1e200};
  for (int kind = 0; kind < 4; kind++)
    for (int k = 0; k < kinds[kind][0] + kinds[kind][1]; k++)
      for (int b = 0; b < 4; b++) {
        trial p = pair_above(kind, 1);
        move_first(&p, 0, 0, 0);
        p.x1[k][k % 3] = bad[b];
        CHECK(advance(&p) == 0);
        p = pair_above(kind, 1);
        move_first(&p, 0, 0, 0);
        p.x0[k][k % 3] = bad[b];
        CHECK(advance(&p) == 0);
      }
}

static void distances_of_hulls(void)
{
  for (int k = 0; k < 4000; k++) {
    const trial p = random_trial(k % 4, 1, 0);
    const double *const x[4] = {p.x0[0], p.x0[1], p.x0[2], p.x0[3]};
    double unit[3];
    const double distance = flesh_hull_distance(p.first, p.second, x, unit);
    CHECK_NEAR(distance, (double)distance_at(&p, 0), 1e-12);
    CHECK_NEAR(unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2], 1, 1e-14);
  }
}

static void random_motions(void)
{
  tally count = {0};
  for (int k = 0; k < 3000; k++) {
    const trial p = random_trial(k % 4, 1, power(-2, 3));
    check_trial(&p, &count, "random");
  }
  CHECK(count.stopped > 100 && count.touching > 30 && count.early == 0 && count.unsettled == 0);
}

/* Whether the early exit is taken. */
static int is_told(const trial *p)
{
  const double *from[4], *to[4];
  double place = 0;
  for (int a = 0; a < 4; a++) from[a] = p->x0[a], to[a] = p->x1[a];
  for (int a = 0; a < p->first + p->second; a++)
    for (int c = 0; c < 3; c++) place += fabs(p->x0[a][c]) + fabs(p->x1[a][c]);
  return flesh_hulls_move_little(p->first, p->second, from, to, keep, place);
}

/* The early exit gives the result of an advancement, the whole step. It detects at least half of the motions that are
 * small compared with the gap. */
static void little_motions_are_told_at_once(void)
{
  int told = 0, little = 0, both = 0;
  for (int k = 0; k < 4000; k++) {
    trial p = random_trial(k % 4, 1, 1);
    double unit[3], farthest = 0;
    const double *from[4], part = power(-4, 1);
    for (int a = 0; a < 4; a++) from[a] = p.x0[a];
    const double gap = flesh_hull_distance(p.first, p.second, from, unit);
    for (int a = 0; a < p.first + p.second; a++)
      for (int c = 0; c < 3; c++) farthest = fmax(farthest, fabs(p.x1[a][c] - p.x0[a][c]));
    for (int a = 0; a < p.first + p.second; a++)
      for (int c = 0; c < 3; c++) p.x1[a][c] = p.x0[a][c] + part * gap / farthest * (p.x1[a][c] - p.x0[a][c]);
    const int at_once = is_told(&p);
    if (at_once) CHECK(advance(&p) == 1);
    told += at_once;
    little += part < 0.01 && gap > 1e-6;
    both += at_once && part < 0.01 && gap > 1e-6;
  }
  CHECK(told < 4000 && little > 500 && 2 * both > little);
}

static void what_touches_or_is_not_finite_is_not_told(void)
{
  for (int kind = 0; kind < 4; kind++) {
    trial p = pair_above(kind, 0);
    move_first(&p, 0, 0, -1e-9);
    CHECK(!is_told(&p));
    p = pair_above(kind, 1);
    move_first(&p, 0, 0, -1e-9);
    CHECK(is_told(&p));
    move_first(&p, 0, 0, -0.95); /* less than a tenth is left */
    CHECK(!is_told(&p));
    move_first(&p, 2, 0, 0); /* a long way along the other */
    CHECK(kind > 1 || is_told(&p));
    p.x1[0][1] = NAN;
    CHECK(!is_told(&p));
    p.x1[0][1] = INFINITY;
    CHECK(!is_told(&p));
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(head_on), TEST(sliding_is_free), TEST(touching_pairs_may_only_part),
                   TEST(common_motion_does_not_count), TEST(what_is_not_finite_stays), TEST(distances_of_hulls),
                   TEST(random_motions), TEST(little_motions_are_told_at_once),
                   TEST(what_touches_or_is_not_finite_is_not_told));
}
