// TEST full seconds=300
/* test_continuous_collision.c: points, edges and triangles never pass through each other, and stop no earlier than
 * guaranteed, on random and on hard trajectories. */
#include "collision_reference.h"

/* At most one in a thousand of those that stop may stop because of the number of steps. */
static void report(const char *what, const tally *count)
{
  printf("# %-10s %d trials, %d touch in a plane, %d stopped, %d of these early, at up to %.3g of the distance; "
         "%d unsettled\n", what, count->trials, count->touching, count->stopped, count->early, count->largest_part,
         count->unsettled);
  CHECK(count->unsettled * 20 <= count->trials);
  CHECK(count->early * 1000 <= count->stopped);
}

static void random_trajectories(void)
{
  tally count = {0};
  for (int k = 0; k < 40000; k++) {
    const trial p = random_trial(k % 4, 1, power(-2, 3));
    check_trial(&p, &count, "random");
  }
  report("random", &count);
  CHECK(count.stopped > 1000 && count.stopped < 39000);
}

/* Puts one hull just above the other and moves it along it and by about its height up or down: they stay near for
 * long. */
static void grazing_trajectories(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(k % 4, 1, k % 3 ? 0 : power(-6, -1));
    const double gap = power(-9, -1), sideways = power(-2, 2), down = gap * power(-1, 1) * (k % 5 ? 1 : -1);
    for (int j = 0; j < p.first + p.second; j++) {
      const double bend = p.x1[j][2] - p.x0[j][2], height = j < p.first ? gap : 0;
      p.x0[j][2] = height + (j < p.first && j > 0 ? gap * between(0, 1) : 0);
      p.x1[j][2] = p.x0[j][2] + bend * gap - (j < p.first ? down : 0);
      p.x1[j][0] += j < p.first ? sideways : 0;
    }
    check_trial(&p, &count, "grazing");
  }
  report("grazing", &count);
}

/* Edges that are parallel or nearly so, before or after. */
static void parallel_edges(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(1, 1, power(-2, 1));
    const double off = k % 2 ? 0 : power(-14, -2);
    double (*x)[3] = k % 3 ? p.x0 : p.x1;
    for (int c = 0; c < 3; c++) x[3][c] = x[2][c] + between(0.1, 0.1) * 10 * (x[1][c] - x[0][c]) + off * between(-1, 1);
    check_trial(&p, &count, "parallel");
  }
  report("parallel", &count);
}

static void motions_in_a_plane(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(k % 4, 1, power(-1, 1));
    for (int j = 0; j < 4; j++) p.x0[j][k % 3] = p.x1[j][k % 3] = 0.3;
    check_trial(&p, &count, "in a plane");
  }
  report("in a plane", &count);
}

static void slivers(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(k % 2, 1, power(-2, 1));
    const double thin = power(-12, -3), along = between(-1, 2);
    for (int c = 0; c < 3; c++) {
      if (k % 2) p.x0[3][c] = p.x0[2][c] + thin * between(-1, 1); /* a short edge */
      else p.x0[3][c] = p.x0[1][c] + along * (p.x0[2][c] - p.x0[1][c]) + thin * between(-1, 1);
    }
    check_trial(&p, &count, "slivers");
  }
  report("slivers", &count);
}

/* Far from the origin, where positions are known only to 1e-10, and everything moves far. */
static void far_places(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(k % 4, 1, power(-2, 1));
    const double shift[3] = {between(-1e6, 1e6), between(-1e6, 1e6), between(-1e6, 1e6)};
    for (int j = 0; j < 4; j++)
      for (int c = 0; c < 3; c++) p.x0[j][c] += shift[c], p.x1[j][c] += shift[c] + (k % 2 ? 1e6 : 0);
    check_trial(&p, &count, "far places");
  }
  report("far places", &count);
}

/* Hulls that turn about an axis while they approach: planes turn with them. */
static void turning_hulls(void)
{
  tally count = {0};
  for (int k = 0; k < 20000; k++) {
    trial p = random_trial(k % 2, 1, 0);
    const double angle = between(-3, 3), size = power(0, 2);
    for (int j = 0; j < p.first + p.second; j++) {
      for (int c = 0; c < 2; c++) p.x0[j][c] *= j < p.first ? 1 : size;
      const double c = cos(angle), s = sin(angle);
      const double turned[3] = {c * p.x0[j][0] - s * p.x0[j][2], p.x0[j][1], s * p.x0[j][0] + c * p.x0[j][2]};
      for (int i = 0; i < 3; i++) p.x1[j][i] = j < p.first ? p.x0[j][i] + between(-1, 1) : turned[i];
    }
    check_trial(&p, &count, "turning");
  }
  report("turning", &count);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(random_trajectories), TEST(grazing_trajectories), TEST(parallel_edges),
                   TEST(motions_in_a_plane), TEST(slivers), TEST(far_places), TEST(turning_hulls));
}
