// TEST quick seconds=60
/* test_free_bodies.c: a force that grows and fades moves a free body, with adaptive steps. Its centre follows Newton's
 * law within the tolerance: a momentum error by a residual would affect the position until the end. */
#include <math.h>

#include "flesh/observer.h"
#include "touching.h"

/* Returns the error of the centre's position at the end over the tolerance and the cube's side; NaN: the method has no
 * estimate. */
static double carry(const char *method, double tolerance)
{
  char scene[1024];
  touching m;
  snprintf(scene, sizeof scene,
           "body: {mesh: ../meshes/cube_3x3x3.mesh, density: 1000, material: {energy: S, young: 2e5, poisson: 0.45}}\n"
           "effects:\n  - inertia: {}\n  - force:\n      box: [[-1, -1, -1], [1e-6, 1, 1]]\n      force: [2, 0, 0]\n"
           "      amplitude: [{time: 0, value: 0}, {time: 0.5, value: 1}, {time: 1, value: 0}]\n"
           "      interpolation: smooth\n"
           "time: {method: %s, adaptive: true, tolerance: %g, step: 0.1, end: 1}\n",
           method, tolerance);
  if (touching_begin(scene, NULL, 1000, &m)) return NAN;
  const flesh_run_options options = {.h = 0.1, .end = 1};
  double mass = 0, moved = 0;
  CHECK_OK(flesh_run(flesh_scene_system(m.scene), m.integrator, &options, &m.state, NULL));
  const double *X = flesh_mesh_positions(flesh_scene_body(m.scene)->mesh);
  for (int i = 0; i < m.n / 3; i++) mass += m.mass[i], moved += m.mass[i] * (m.state.x[3 * i] - X[3 * i]);
  touching_end(&m);
  return fabs(moved / mass - 2 / mass * 0.25) / (tolerance * 0.1);
}

static void forces_carry_free_bodies_as_far_as_the_tolerance_says(void)
{
  int methods = 0;
  for (int k = 0; flesh_method_name((flesh_method)k); k++) {
    const int order = flesh_method_order((flesh_method)k);
    for (int digits = 2; digits < 2 + 2 * order - (order == 1); digits++) {
      const double error = carry(flesh_method_name((flesh_method)k), pow(10, -digits));
      printf("# %s, 1e-%d: %.2f tolerances\n", flesh_method_name((flesh_method)k), digits, error);
      if (isnan(error)) break;
      CHECK_BELOW(error, 2);
      methods += digits == 2;
    }
  }
  CHECK(methods >= 6);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(forces_carry_free_bodies_as_far_as_the_tolerance_says));
}
