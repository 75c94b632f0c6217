// TEST quick needs=drivers
/* test_sweep.c: the samples of sweeps fill their space as their sequences guarantee. */
#include <math.h>
#include <stdlib.h>

#include "flesh/status.h"
#include "sweep/sweep.h"
#include "test.h"

enum { SOBOL, NIEDERREITER, HALTON, REVERSE_HALTON, RANDOM };

static void sobol_begins_as_published(void)
{
  /* The first points of Sobol's sequence in two dimensions, without the origin. */
  static const double first[] = {0.5,   0.5,   0.75,  0.25,  0.25,  0.75,  0.375,
                                 0.375, 0.875, 0.875, 0.625, 0.125, 0.125, 0.625};
  double points[14];
  CHECK(!flesh_sweep_sample(SOBOL, 2, 7, 0, 0, points));
  for (int k = 0; k < 14; k++) CHECK(points[k] == first[k]);
}

static void halton_is_the_radical_inverse(void)
{
  static const int primes[] = {2, 3, 5};
  double points[60];
  CHECK(!flesh_sweep_sample(HALTON, 3, 20, 0, 0, points));
  for (int k = 0; k < 20; k++)
    for (int d = 0; d < 3; d++) {
      double inverse = 0, place = 1;
      for (int n = k + 1; n; n /= primes[d]) inverse += n % primes[d] * (place /= primes[d]);
      CHECK(fabs(points[3 * k + d] - inverse) < 1e-14);
    }
}

/* With the origin, 2^7 points of Sobol's sequence have one point in each of 2^7 equal intervals of every axis. */
static void every_axis_is_filled_evenly(void)
{
  enum { N = 128, D = 10 };
  double points[(N - 1) * D];
  CHECK(!flesh_sweep_sample(SOBOL, D, N - 1, 0, 0, points));
  for (int d = 0; d < D; d++) {
    int count[N] = {0}, once = 0;
    for (int k = 0; k < N - 1; k++) count[(int)(points[k * D + d] * N)]++;
    for (int j = 0; j < N; j++) once += count[j] == 1;
    CHECK(once == N - 1);
  }
}

static void a_seed_shifts_all_points_alike(void)
{
  double plain[40], shifted[40], again[40];
  CHECK(!flesh_sweep_sample(SOBOL, 4, 10, 0, 0, plain));
  CHECK(!flesh_sweep_sample(SOBOL, 4, 10, 0, 5, shifted));
  CHECK(!flesh_sweep_sample(SOBOL, 4, 10, 0, 5, again));
  for (int k = 0; k < 40; k++) {
    double shift = fmod(shifted[k] - plain[k] + 1, 1), first = fmod(shifted[k % 4] - plain[k % 4] + 1, 1);
    CHECK(fabs(shift - first) < 1e-14 && first > 0);
    CHECK(shifted[k] == again[k] && shifted[k] >= 0 && shifted[k] < 1);
  }
}

static void skipped_points_go_on(void)
{
  for (int sequence = SOBOL; sequence <= RANDOM; sequence++) {
    double all[30], rest[15];
    CHECK(!flesh_sweep_sample(sequence, 3, 10, 0, 2, all));
    CHECK(!flesh_sweep_sample(sequence, 3, 5, 5, 2, rest));
    for (int k = 0; k < 15; k++) CHECK(rest[k] == all[15 + k]);
  }
}

static void too_many_dimensions_are_refused(void)
{
  double points[FLESH_STUDY_COLUMNS];
  CHECK(flesh_sweep_sample(SOBOL, 41, 1, 0, 0, points) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_sweep_sample(NIEDERREITER, 13, 1, 0, 0, points) == FLESH_ERR_ARGUMENT);
  CHECK(!flesh_sweep_sample(HALTON, FLESH_STUDY_COLUMNS, 1, 0, 0, points));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(sobol_begins_as_published), TEST(halton_is_the_radical_inverse),
                   TEST(every_axis_is_filled_evenly), TEST(a_seed_shifts_all_points_alike), TEST(skipped_points_go_on),
                   TEST(too_many_dimensions_are_refused));
}
