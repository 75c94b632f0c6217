// TEST quick
/* test_contact_seat.c: seats have the derivatives of their energy, push and never pull, and conserve momentum and
 * angular momentum. */
#include "geometry/contact_seat.h"

#include <math.h>
#include <string.h>

#include "math/mat3.h"
#include "test.h"

static const flesh_contact_seat seat = {{0, 1, 2, 3}, 0.15, 7};

/* Makes a node at height z above, or below, a face in general position, some way off its middle. */
static void place(double z, double x[12])
{
  static const double at[12] = {0.5, 0.1, 0, 0.1, -0.2, 0.03, 1.2, 0.1, -0.05, 0.3, 0.9, 0.02};
  memcpy(x, at, sizeof at);
  x[2] = z;
}

/* Compares with central differences of the energy and of the gradient. */
static void derivatives_are_those_of_the_energy(void)
{
  const double s = 1e-5, heights[] = {-0.3, 0.05, 0.149};
  for (int k = 0; k < 3; k++) {
    double x[12], y[12], g[12], H[144], up[12], down[12];
    place(heights[k], x);
    flesh_contact_seat_gradient(&seat, x, g);
    flesh_contact_seat_hessian(&seat, x, FLESH_FILTER_NONE, H);
    for (int d = 0; d < 12; d++) {
      memcpy(y, x, sizeof y);
      y[d] = x[d] + s;
      const double high = flesh_contact_seat_gradient(&seat, y, up);
      y[d] = x[d] - s;
      const double low = flesh_contact_seat_gradient(&seat, y, down);
      CHECK_NEAR((high - low) / (2 * s), g[d], 1e-8);
      for (int e = 0; e < 12; e++) CHECK_NEAR((up[e] - down[e]) / (2 * s), H[12 * d + e], 1e-7);
    }
  }
}

static void it_only_pushes(void)
{
  double x[12], g[12], sum[3] = {0}, torque[3] = {0}, arm[3];
  place(0.3, x);
  CHECK(flesh_contact_seat_gradient(&seat, x, g) == 0);
  for (int d = 0; d < 12; d++) CHECK(g[d] == 0);
  place(-0.1, x);
  CHECK(flesh_contact_seat_opening(seat.nodes, x) < 0);
  CHECK(flesh_contact_seat_gradient(&seat, x, g) > 0);
  CHECK(g[2] < 0); /* downhill is up */
  for (int a = 0; a < 4; a++) {
    flesh_vec3_cross(x + 3 * a, g + 3 * a, arm);
    for (int c = 0; c < 3; c++) sum[c] += g[3 * a + c], torque[c] += arm[c];
  }
  for (int c = 0; c < 3; c++) CHECK(fabs(sum[c]) < 1e-14 && fabs(torque[c]) < 1e-14);
}

/* If filtered, no direction has a negative curvature, and the one across has all of it. */
static void filtered_curvature_is_not_negative(void)
{
  double x[12], H[144];
  place(-0.3, x);
  flesh_contact_seat_hessian(&seat, x, FLESH_FILTER_CLAMP, H);
  for (int a = 0; a < 12; a++)
    for (int b = 0; b < 12; b++) {
      CHECK_NEAR(H[12 * a + b], H[12 * b + a], 1e-14);
      CHECK(H[13 * a] * H[13 * b] - H[12 * a + b] * H[12 * b + a] > -1e-12);
    }
  CHECK(H[26] > 0.9 * seat.stiffness);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(derivatives_are_those_of_the_energy), TEST(it_only_pushes),
                   TEST(filtered_curvature_is_not_negative));
}
