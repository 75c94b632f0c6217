// TEST quick seconds=60 args: pressure_is_exact small_strains_are_those_of_lame
// TEST name=test_inflated_sphere full seconds=300
// TEST+ args: large_inflation_is_that_of_radial_equilibrium pressures_are_no_checkerboard no_pressure_is_borne_beyond_the_largest
/* test_sphere.c: a thick hollow sphere of form S at a Poisson's ratio of .4999 under internal pressure: against Lame's
 * closed form for small strains and, if the hole opens by two fifths, against the equation of radial equilibrium,
 * integrated by GSL; and the checkerboard of its pressures. An octant that slides on its planes of symmetry, meshed by
 * gmsh with curved and with straight edges (reference/meshes/README.md). */
#include <gsl/gsl_odeiv2.h>

#include "body.h"
#include "cavity.h"
#include "pressure_field.h"
#include "test.h"

static const double poisson = 0.4999, pi = 3.14159265358979324;

/* Returns the radial stress [Pa] of form S at the stretches s along the radius and t across it; also computes the
 * stress across. */
static double radial_stress(const flesh_material *m, double s, double t, double *across)
{
  const double slope = m->mu * (1 - 1 / (s * s + 2 * t * t + 1)), pressure = m->lambda * (s * t * t - m->alpha);
  *across = slope * t + pressure * s * t;
  return slope * s + pressure * t * t;
}

/* Returns the radial stretch with that radial stress, by Newton's iteration. */
static double radial_stretch(const flesh_material *m, double stress, double t)
{
  double s = 1 / (t * t), across;
  for (int k = 0; k < 50; k++) {
    const double h = 1e-6, slope = (radial_stress(m, s + h, t, &across) - radial_stress(m, s - h, t, &across)) / (2 * h);
    s -= (radial_stress(m, s, t, &across) - stress) / slope;
  }
  return s;
}

/* Computes the derivatives of y = (r, P): dr/dR = s, dP/dR = -2 (P - P_across)/R. */
static int radial_equilibrium(double R, const double y[], double slope[], void *data)
{
  double across;
  const double s = radial_stretch(data, y[1], y[0] / R);
  radial_stress(data, s, y[0] / R, &across);
  slope[0] = s;
  slope[1] = -2 * (y[1] - across) / R;
  return 0;
}

/* Returns the pressure in a hole of radius a for which the outer radius b becomes r, and the hole's radius then. */
static double pressure_for(const flesh_material *m, double a, double b, double r, double *hole)
{
  gsl_odeiv2_system equations = {radial_equilibrium, NULL, 2, (void *)m};
  gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&equations, gsl_odeiv2_step_rk8pd, -1e-3, 1e-9, 1e-10);
  double R = b, y[2] = {r, 0};
  CHECK(gsl_odeiv2_driver_apply(driver, &R, a, y) == 0);
  gsl_odeiv2_driver_free(driver);
  *hole = y[0];
  return -y[1] / (y[0] * y[0] / (a * a));
}

/* Computes the radii [hole, outer] under a pressure below the largest that the body can bear. */
static void inflated(const flesh_material *m, double pressure, const double at_rest[2], double radii[2])
{
  double low = at_rest[1], high = 1.09 * at_rest[1]; /* before the pressure's maximum */
  for (int k = 0; k < 60; k++) {
    radii[1] = (low + high) / 2;
    *(pressure_for(m, at_rest[0], at_rest[1], radii[1], radii) < pressure ? &low : &high) = radii[1];
  }
}

/* Computes the radii of the inflated sphere for small strains (Lame). */
static void inflated_little(double young, double pressure, const double at_rest[2], double radii[2])
{
  const double a = pow(at_rest[0], 3), b = pow(at_rest[1], 3);
  for (int k = 0; k < 2; k++) {
    const double R = at_rest[k];
    radii[k] = R + pressure * a / (young * (b - a)) * ((1 - 2 * poisson) * R + (1 + poisson) * b / (2 * R * R));
  }
}

static flesh_mesh *octant(const char *path, flesh_element element, int curved)
{
  flesh_mesh *mesh = NULL, *low = NULL, *straight = NULL;
  CHECK_OK(flesh_mesh_read(path, &mesh));
  if (curved && element != FLESH_ELEMENT_TET4) return mesh;
  CHECK_OK(flesh_mesh_lower_order(mesh, &low));
  flesh_mesh_destroy(&mesh);
  if (element == FLESH_ELEMENT_TET4) return low;
  CHECK_OK(flesh_mesh_raise_order(low, &straight));
  flesh_mesh_destroy(&low);
  return straight;
}

static double radius_of(const double x[3]) { return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]); }

/* Lists the triangles of the faces with all corners on the hole. Returns their number. */
static int hole_triangles(const flesh_mesh *mesh, int *hole)
{
  const int four = flesh_mesh_order(mesh) == 2;
  const double *X = flesh_mesh_positions(mesh);
  int all, count = 0;
  const int *surface = flesh_mesh_surface(mesh, &all);
  for (int k = 0; k < all; k += four ? 4 : 1) {
    const int *t = surface + 3 * k;
    const int corner[3] = {t[0], four ? t[4] : t[1], four ? t[8] : t[2]};
    int on = 1;
    for (int c = 0; c < 3; c++) on &= fabs(radius_of(X + 3 * corner[c]) - 0.5) < 1e-6;
    if (!on) continue;
    memcpy(hole + 3 * count, t, (four ? 12 : 3) * sizeof *t);
    count += four ? 4 : 1;
  }
  return count;
}

static void make(const char *path, flesh_element element, int curved, const flesh_material *material, double pressure,
                 test_body *b)
{
  int all;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(octant(path, element, curved), *material, 1000, FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  flesh_mesh_surface(b->mesh, &all);
  int *hole = malloc(3 * (size_t)all * sizeof *hole);
  const int count = hole_triangles(b->mesh, hole);
  CHECK(count > 0);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(cavity_create(b->mesh, count, hole, pressure, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  free(hole);
}

/* Computes the radii [hole, outer] of the spheres with the volumes of the hole and of all. */
static void radii_of(const test_body *b, const double *x, double pressure, double radii[2])
{
  const flesh_effect *effect = flesh_system_effect(b->system, 1);
  const flesh_point point = flesh_point_at(0, x, x, x);
  double phi = 0, magnitude = 0;
  CHECK_OK(effect->operations->potential(effect, &point, &(flesh_shift){.x = 1}, &phi, &magnitude));
  const double hole = -phi / pressure;
  radii[0] = cbrt(6 / pi * hole);
  radii[1] = cbrt(6 / pi * (hole + flesh_mesh_volume(b->mesh, x)));
}

/* Young's modulus is 1e5 Pa. Returns the larger error of both displacements; the expected ones are those of a sphere
 * with the volumes of the mesh, whose edges may be straight. *noise: that of the pressure. */
static double inflate(const char *path, flesh_element element, int curved, double pressure, int small, double *noise)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
  test_body b;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-7);
  flesh_solve_stats stats = {0};
  double at_rest[2], expected[2], found[2], error[2];
  make(path, element, curved, &material, pressure, &b);
  radii_of(&b, b.state.x, pressure, at_rest);
  if (small)
    inflated_little(1e5, pressure, at_rest, expected);
  else
    inflated(&material, pressure, at_rest, expected);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  radii_of(&b, b.state.x, pressure, found);
  for (int k = 0; k < 2; k++) error[k] = (found[k] - at_rest[k]) / (expected[k] - at_rest[k]) - 1;
  *noise = pressure_noise(b.mesh, b.state.x, material.lambda, 1e5 / 2 / (1 + poisson));
  printf("# %s%s, %d tets, %g Pa: hole %.4f m opens to %.4f, error %+.2f %%, outside %+.2f %%, noise %.3f (%d Newton)\n",
         flesh_element_name(element), curved ? ", curved" : "", flesh_mesh_tet_count(b.mesh), pressure, at_rest[0],
         found[0], 100 * error[0], 100 * error[1], *noise, stats.newton);
  fflush(stdout);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return fmax(fabs(error[0]), fabs(error[1]));
}

static const char *const coarse = "reference/meshes/sphere_octant_132.msh";
static const char *const fine = "reference/meshes/sphere_octant_336.msh";

/* Checks potential, residual and Jacobian of the pressure in the hole, also if the rim leaves its planes. */
static void pressure_is_exact(void)
{
  for (int element = FLESH_ELEMENT_TET4; element <= FLESH_ELEMENT_TET10; element++) {
    const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
    flesh_derivative_report report;
    test_body b;
    make(coarse, (flesh_element)element, 1, &material, 1e4, &b);
    double radii[2];
    radii_of(&b, b.state.x, 1e4, radii);
    printf("# %s: radii %.5f and %.5f m\n", flesh_element_name((flesh_element)element), radii[0], radii[1]);
    if (element == FLESH_ELEMENT_TET10) CHECK_NEAR(radii[0], 0.5, 5e-4);
    if (element == FLESH_ELEMENT_TET10) CHECK_NEAR(radii[1], 1, 1e-3);
    test_jitter(b.n, 0.02, 3, b.state.x);
    CHECK_OK(flesh_effect_check_derivatives(flesh_system_effect(b.system, 1), b.mesh, 0, b.state.x, 7, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
    test_body_destroy(&b);
  }
}

static void small_strains_are_those_of_lame(void)
{
  double noise;
  CHECK_BELOW(inflate(fine, FLESH_ELEMENT_TET10_MEAN, 0, 10, 1, &noise), 0.01);
  CHECK_BELOW(inflate(fine, FLESH_ELEMENT_TET10_MEAN, 1, 10, 1, &noise), 0.01);
}

/* The hole opens by two fifths. The other elements for comparison: tet10 is stiffer, tet4 does not open at all. */
static void large_inflation_is_that_of_radial_equilibrium(void)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
  double hole, noise;
  const double pressure = pressure_for(&material, 0.5, 1, 1.068, &hole);
  printf("# %.6g Pa open the hole to %.6f m\n", pressure, hole);
  CHECK(hole > 1.39 * 0.5);
  CHECK_BELOW(inflate(fine, FLESH_ELEMENT_TET10_MEAN, 0, pressure, 0, &noise), 0.01);
  CHECK_BELOW(inflate(fine, FLESH_ELEMENT_TET10_MEAN, 1, pressure, 0, &noise), 0.01);
  CHECK(inflate(fine, FLESH_ELEMENT_TET10, 1, pressure, 0, &noise) > 0.01);
  CHECK(inflate(fine, FLESH_ELEMENT_TET4, 0, pressure, 0, &noise) > 0.9);
}

/* The pressures of tet10-mean converge under refinement; those of the others, whose points all resist changes of
 * volume, do not. */
static void pressures_are_no_checkerboard(void)
{
  double wide, narrow, pointwise, linear;
  inflate(coarse, FLESH_ELEMENT_TET10_MEAN, 1, 24028, 0, &wide);
  inflate(fine, FLESH_ELEMENT_TET10_MEAN, 1, 24028, 0, &narrow);
  inflate(fine, FLESH_ELEMENT_TET10, 1, 24028, 0, &pointwise);
  inflate(fine, FLESH_ELEMENT_TET4, 0, 24028, 0, &linear);
  CHECK_BELOW(narrow, 0.03);
  CHECK_BELOW(narrow, 0.8 * wide);
  CHECK(pointwise > 0.09);
  CHECK(linear > 1);
}

/* A pressure beyond the largest of radial equilibrium would inflate the sphere without bound; the fraction that it
 * bears is reported. */
static void no_pressure_is_borne_beyond_the_largest(void)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
  const flesh_solver_options options = test_options(1e-4);
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  test_body b;
  double largest = 0, hole, beyond = 0, borne = 0;
  for (double r = 1.05; r < 1.3; r += 0.005) largest = fmax(largest, pressure_for(&material, 0.5, 1, r, &hole));
  make(coarse, FLESH_ELEMENT_TET10_MEAN, 1, &material, 1.6 * largest, &b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK(flesh_integrator_step(integrator, &b.state, 0, &stats) == FLESH_ERR_SOLVE);
  printf("# the largest pressure is %.5g Pa, %.3f of the load; %s (%d Newton)\n", largest, 1 / 1.6, flesh_error_text(),
         stats.newton);
  CHECK(sscanf(flesh_error_text(), "no equilibrium at t = 0 s: %lf of the load would stretch the body without bound, as pressure "
                                      "beyond the largest that it bears does; with %lf there", &beyond, &borne) == 2);
  CHECK_BELOW(borne, 1.02 / 1.6);
  CHECK(beyond > 0.98 / 1.6 && beyond - borne < 0.04);
  CHECK_BELOW(stats.newton, 1500);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(pressure_is_exact), TEST(small_strains_are_those_of_lame),
                   TEST(large_inflation_is_that_of_radial_equilibrium), TEST(pressures_are_no_checkerboard),
                   TEST(no_pressure_is_borne_beyond_the_largest));
}
