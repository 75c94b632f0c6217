// TEST quick
/* test_lanes.c: the operations that lanes.h, logarithm.h, exponential.h and error_function.h add to the compiler's
 * vectors, against the C library. */
#define FLESH_LANES 2
#include "math/error_function.h"
#include "math/exponential.h"
#include "math/logarithm.h"
#include "test.h"

static unsigned long long seed = 77;

/* Returns a number between 10^low and 10^high. */
static double number(double low, double high)
{
  return pow(10, low + (high - low) * test_uniform(&seed));
}

/* Returns the error in units in the last place of the exact result. */
static double ulps(double value, long double right)
{
  double near = (double)right;
  return (double)fabsl(value - right) / (nextafter(fabs(near), INFINITY) - fabs(near));
}

static void logarithms(void)
{
  double worst = 0, worst_at_one = 0;
  for (int trial = 0; trial < 200000; trial++) {
    flesh_real x = {number(-280, 280), number(-1, 1)}, y = flesh_log(x);
    worst = fmax(worst, fmax(ulps(y[0], logl(x[0])), ulps(y[1], logl(x[1]))));
    x[0] = 1 + number(-16, -1), x[1] = 1 - number(-16, -1);
    y = flesh_log(x);
    worst_at_one = fmax(worst_at_one, fmax(ulps(y[0], logl(x[0])), ulps(y[1], logl(x[1]))));
  }
  printf("# %.2f units in the last place, %.2f near 1\n", worst, worst_at_one);
  CHECK_BELOW(worst, 3);
  CHECK_BELOW(worst_at_one, 3);
  flesh_real exact = flesh_log((flesh_real){1, 0x1p512});
  CHECK(exact[0] == 0 && ulps(exact[1], 512 * logl(2)) <= 1);
}

static void exponentials(void)
{
  double worst = 0, worst_at_zero = 0;
  for (int trial = 0; trial < 200000; trial++) {
    flesh_real x = {FLESH_EXPONENTIAL_LARGEST * (2 * test_uniform(&seed) - 1), number(-16, -1)}, y = flesh_exp(x);
    worst = fmax(worst, ulps(y[0], expl(x[0])));
    worst_at_zero = fmax(worst_at_zero, fmax(ulps(y[1], expl(x[1])), ulps(flesh_exp(-x)[1], expl(-x[1]))));
  }
  printf("# %.2f units in the last place, %.2f near 0\n", worst, worst_at_zero);
  CHECK_BELOW(worst, 3);
  CHECK_BELOW(worst_at_zero, 3);
  flesh_real exact = flesh_exp((flesh_real){0, 1});
  CHECK(exact[0] == 1 && ulps(exact[1], expl(1)) <= 1);
}

static void error_functions(void)
{
  double worst = 0;
  for (int trial = 0; trial < 100000; trial++) {
    const flesh_real x = {10 * (2 * test_uniform(&seed) - 1), number(-16, 300)}, y = flesh_erf(x);
    for (int l = 0; l < 2; l++) worst = fmax(worst, (double)fabsl(y[l] - erfl(x[l])));
  }
  printf("# off by %.2g\n", worst);
  CHECK_BELOW(worst, 1e-15);
}

static void cube_roots(void)
{
  double worst = 0;
  for (int trial = 0; trial < 200000; trial++) {
    flesh_real x = {number(-280, 280), number(-1, 1)}, y = flesh_inverse_cbrt(x);
    for (int l = 0; l < 2; l++) worst = fmax(worst, ulps(y[l], 1 / cbrtl(x[l])));
  }
  printf("# %.2f units in the last place\n", worst);
  CHECK_BELOW(worst, 3);
}

static void selections(void)
{
  flesh_real a = {1, -2}, b = {-3, 4}, picked = flesh_select(a > b, a, b);
  CHECK(picked[0] == 1 && picked[1] == 4);
  CHECK(flesh_any(a > b) && flesh_any(b > a) && !flesh_any(a > 5.0));
  CHECK(flesh_abs(a)[1] == 2 && flesh_max(a, b)[0] == 1 && flesh_sqrt(a * a)[1] == 2);
  flesh_set_lane(&a, 1, 7);
  CHECK(flesh_lane(a, 1) == 7 && flesh_all(3)[1] == 3);
}

static void transposition(void)
{
  flesh_real v[2] = {{1, 2}, {3, 4}};
  flesh_transpose(v);
  CHECK(v[0][0] == 1 && v[0][1] == 3 && v[1][0] == 2 && v[1][1] == 4);
}

/* Four numbers for each lane, minus four others, all from separate addresses. */
static void differences_of_four(void)
{
  const double numbers[16] __attribute__((aligned(32))) = {1, 2, 3, 4, 50, 60, 70, 80, 100, 300, 500, 700, 0, 1, 1, 2};
  const double *const from[] = {numbers, numbers + 12}, *const place[] = {numbers + 8, numbers + 4};
  flesh_real v[4];
  flesh_load_from(from, place, v);
  for (int k = 0; k < 4; k++) {
    CHECK(v[k][0] == numbers[8 + k] - numbers[k]);
    CHECK(v[k][1] == numbers[4 + k] - numbers[12 + k]);
  }
}

/* Lanes are added one after the other, also to the same address. */
static void additions_of_four(void)
{
  double sums[8] __attribute__((aligned(32))) = {0, 0, 0, 0, 1000, 2000, 3000, 4000};
  double *apart[] = {sums + 4, sums}, *together[] = {sums, sums};
  flesh_real v[4] = {{1, 10}, {2, 20}, {3, 30}, {4, 40}}, same[4] = {{1, 10}, {2, 20}, {3, 30}, {4, 40}};
  flesh_add_four(apart, v);
  for (int k = 0; k < 4; k++) CHECK(sums[k] == 10 * (k + 1) && sums[4 + k] == 1001 * (k + 1));
  flesh_add_four(together, same);
  for (int k = 0; k < 4; k++) CHECK(sums[k] == 21 * (k + 1));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(logarithms), TEST(exponentials), TEST(error_functions), TEST(cube_roots),
                   TEST(selections),
                   TEST(transposition), TEST(differences_of_four), TEST(additions_of_four));
}
