// TEST full memory seconds=60
/* test_volume_split.c: how the volume term is divided between the mean of J and the points: forces of tet10-mean are
 * smooth in Poisson's ratio, and the points keep a positive part that grows with it. */
#include <math.h>

#include "body.h"
#include "element/element.h"
#include "material/form.h"
#include "material/psi.h"
#include "quadratic.h"

enum { NODES = 175 };

/* Computes the forces r [3*NODES] of the mesh, bent by a quadratic map. */
static void forces(flesh_energy energy, double poisson, double *r)
{
  test_body b;
  flesh_mesh *mesh = raised_box(2, 0);
  CHECK(flesh_mesh_node_count(mesh) == NODES);
  CHECK_OK(test_body_create(mesh, test_material(energy, poisson), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < NODES; i++) {
    const double *X = flesh_mesh_positions(mesh) + 3 * i;
    double *x = b.state.x + 3 * i;
    x[0] += 0.05 * X[1] * X[1] - 0.04 * X[0] * X[2];
    x[1] += 0.03 * X[0] * X[0] + 0.02 * X[2];
    x[2] += 0.05 * X[0] * X[1] - 0.03 * X[2] * X[2];
  }
  const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  test_body_destroy(&b);
}

/* Returns the relative jump of the forces' slope by the ratio, from differences with steps h to either side. */
static double jump_of_slope(flesh_energy energy, double poisson)
{
  const double h = 1e-5;
  double r[3][3 * NODES], largest = 0, jump = 0;
  for (int k = 0; k < 3; k++) forces(energy, poisson + (k - 1) * h, r[k]);
  for (int d = 0; d < 3 * NODES; d++) {
    largest = fmax(largest, fmax(fabs(r[1][d] - r[0][d]), fabs(r[2][d] - r[1][d])));
    jump = fmax(jump, fabs(r[2][d] - 2 * r[1][d] + r[0][d]));
  }
  return jump / largest;
}

/* All ratios, including those at which lambda of a form is one, two and three times mu. */
static void forces_are_smooth_in_poissons_ratio(void)
{
  for (int e = 0; e < FLESH_ENERGY_USER; e++) {
    if (flesh_forms[e].volume_term == FLESH_VOLUME_NONE) continue;
    double worst = 0, at = 0;
    for (int k = 0; k < 4; k++)
      for (int numerator = 1; numerator < 60; numerator++) {
        static const double denominators[] = {120, 130, 140, 76};
        const double poisson = numerator / denominators[k];
        if (poisson > 0.47) continue;
        const double jump = jump_of_slope((flesh_energy)e, poisson);
        if (jump > worst) worst = jump, at = poisson;
      }
    printf("# %s: the slope changes by %.2g at most, at %.4g\n", flesh_forms[e].name, worst, at);
    CHECK_BELOW(worst, 0.01);
  }
}

/* The parts of lambda add up; from 3 mu on the points have 2 mu, up to mu they have all. */
static void both_parts_are_positive(void)
{
  double before = 0;
  for (double ratio = 0.01; ratio < 20; ratio *= 1.001) {
    flesh_material material = test_material(FLESH_ENERGY_S, 0.3);
    flesh_psi at;
    flesh_volume_share share;
    CHECK_OK(flesh_psi_at(&material, (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1}, &at));
    const double mu = 2 * at.I;
    material.lambda = ratio * mu;
    CHECK_OK(flesh_volume_share_of(&material, &share));
    const double points = (material.lambda - share.share) / mu;
    CHECK(share.share >= 0 && points > 0 && points <= 2 * (1 + 1e-12) && points >= before - 1e-12);
    if (ratio <= 1) CHECK(share.share == 0);
    if (ratio >= 3) CHECK(share.share == material.lambda - 2 * mu);
    before = points;
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(forces_are_smooth_in_poissons_ratio), TEST(both_parts_are_positive));
}
