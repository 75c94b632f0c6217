/* test_hertz.c: a ball of 1 m on a block, at the default tolerance, is pressed back with Hertz's force, which the
 * block's finite height raises as Dimitriadis et al. say. */
#include "press.h"

/* Dimitriadis, Horkay, Maresca, Kachar & Chadwick 2002, "Determination of elastic moduli of thin layers of soft
 * material using the atomic force microscope", for a layer bonded to a rigid base. */
static double force_on_layer(double young, double poisson, double radius, double depth, double height)
{
  const double pi = 3.14159265358979, x = sqrt(radius * depth) / height;
  const double alpha = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson * poisson) / (1 - poisson);
  const double beta = (0.6387 - 1.0277 * poisson + 1.5164 * poisson * poisson) / (1 - poisson);
  const double cube = pow(alpha, 3) + 4 * pi * pi / 15 * beta;
  const double fourth = alpha * (pow(alpha, 3) + 3 * pi * pi / 5 * beta);
  const double more = -2 * alpha / pi * x + 4 * alpha * alpha / (pi * pi) * x * x - 8 / pow(pi, 3) * cube * pow(x, 3) +
                      16 / pow(pi, 4) * fourth * pow(x, 4);
  return 4. / 3 * young / (1 - poisson * poisson) * sqrt(radius) * pow(depth, 1.5) * (1 + more);
}

/* The nodes that touch come and go, so that errors fall with the spacing's first power. */
static void contact_forces_are_those_of_hertz(void)
{
  const double depths[] = {0.02, 0.01};
  for (int k = 0; k < 2; k++) {
    double coarse[DEPTHS], fine[DEPTHS];
    const double expected = force_on_layer(1e5, 0.3, 1, depths[k], 1);
    press(14, 1e-6, 1e-8, depths[k], coarse);
    press(28, 1e-6, 1e-8, depths[k], fine);
    const double limit = 2 * fine[1] - coarse[1];
    printf("# pressed in by %g m: %g and %g N, in the limit %g N; expected %g N\n", depths[k], coarse[1], fine[1],
           limit, expected);
    CHECK_BELOW(expected, fine[1]);
    CHECK_BELOW(fine[1], coarse[1]);
    CHECK_NEAR(limit / expected, 1, 0.08);
  }
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(contact_forces_are_those_of_hertz)); }
