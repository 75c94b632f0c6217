// TEST quick seconds=120
/* test_incompressible.c: ten-node tets at Poisson's ratio 1/2 against closed forms of incompressible bodies and the
 * limit of nearly incompressible ones; derivatives; refusals. */
#include <stdlib.h>

#include "flesh/ida.h"
#include "flesh/ode.h"
#include "incompressible.h"

/* A user-defined neo-Hookean psi, with the volume term of its lambda. */
static int own_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  *psi = (flesh_psi){.value = m->mu / 2 * (I_C - 3) + m->lambda / 2 * (J - 1) * (J - 1) - m->mu * J,
                     .I = m->mu / 2,
                     .J = m->lambda * (J - 1) - m->mu,
                     .JJ = m->lambda};
  return FLESH_OK;
}

static flesh_material own_material(void)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_psi(own_psi, NULL, &material));
  material.mu = 1e5 / 3;
  material.lambda = 60 * material.mu;
  material.incompressible = 1;
  return material;
}

static const flesh_energy forms[] = {FLESH_ENERGY_NEO, FLESH_ENERGY_A, FLESH_ENERGY_B,    FLESH_ENERGY_D,
                                     FLESH_ENERGY_E,   FLESH_ENERGY_S, FLESH_ENERGY_FUNG, FLESH_ENERGY_AB,
                                     FLESH_ENERGY_USER};
enum { FORMS = sizeof forms / sizeof forms[0] };

static flesh_material material_of(flesh_energy form)
{
  return form == FLESH_ENERGY_USER ? own_material() : test_material(form, 0.5);
}

/* Returns psi at F = diag(s, 1/sqrt s, 1/sqrt s). */
static flesh_psi psi_at(const flesh_material *m, double s)
{
  flesh_psi psi = {0};
  CHECK_OK(m->psi(s * s + 2 / s, 1, m, &psi));
  return psi;
}

/* Returns the nominal stress of uniaxial tension with sides free of stress. */
static double nominal_stress(const flesh_material *m, double s)
{
  return 2 * psi_at(m, s).I * (s - 1 / (s * s));
}

/* Lists the triangles of the surface with X_c = at; allocated. */
static int *side(const flesh_mesh *mesh, int c, double at, int *count)
{
  int all;
  const double *X = flesh_mesh_positions(mesh);
  const int *surface = flesh_mesh_surface(mesh, &all);
  int *chosen = malloc(3 * (size_t)all * sizeof *chosen);
  *count = 0;
  for (int k = 0; k < all; k++) {
    const int *n = surface + 3 * k;
    int on = 1;
    for (int a = 0; a < 3; a++) on &= fabs(X[3 * n[a] + c] - at) < 1e-9;
    if (on) memcpy(chosen + 3 * (*count)++, n, 3 * sizeof *n);
  }
  return chosen;
}

/* Uniaxial tension: a nominal traction T at the end of a bar that slides on three planes. With sides free of stress, T
 * = 2 psi_I (s - 1/s^2) and p = -2 psi_I/s - psi_J, with psi_J at J = 1 without the pressure. */
static void bars_stretch_as_they_must(void)
{
  for (int f = 0; f < FORMS; f++) {
    test_body b;
    flesh_effect *effect = NULL;
    int count;
    double low = 1, high = 3, off = 0, off_p = 0;
    const flesh_material material = material_of(forms[f]);
    make(test_box(3, 2, 2, 2, 1, 1), material, 0, &b);
    const double *X = flesh_mesh_positions(b.mesh);
    int *end = side(b.mesh, 0, 2, &count);
    CHECK_OK(flesh_effect_traction(&b.body, count, end, (double[]){3e4, 0, 0}, NULL, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(&b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-10, 1);
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
    for (int k = 0; k < 100; k++)
      if (nominal_stress(&material, (low + high) / 2) < 3e4) low = (low + high) / 2;
      else high = (low + high) / 2;
    const flesh_psi psi = psi_at(&material, low);
    const double s[3] = {low, 1 / sqrt(low), 1 / sqrt(low)}, p = -2 * psi.I / low - psi.J;
    for (int d = 0; d < b.n; d++) off = fmax(off, fabs(b.state.x[d] - s[d % 3] * X[d]));
    for (int k = 0; k < b.state.multiplier_count; k++) off_p = fmax(off_p, fabs(b.state.multipliers[k] - p));
    printf("# %s: stretched by %.6f, off by %.2g m; pressure %.6g Pa, off by %.2g Pa; volumes to %.1g; %d updates\n",
           flesh_energy_name(forms[f]), low, off, p, off_p, largest_gap(&b), stats.multiplier_updates);
    CHECK_BELOW(off, 1e-8);
    CHECK_BELOW(off_p, 1e-3 * 1e4);
    CHECK_BELOW(largest_gap(&b), 1e-10);
    free(end);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* Simple shear by g of a cube whose surface is constrained, so that the volumes of its tets are not independent: inside
 * u_x = g y, and the force on the top is 2 psi_I g per area. */
static void cubes_shear_as_they_must(void)
{
  static const double g = 0.6;
  for (int f = 0; f < FORMS; f++) {
    test_body b;
    const flesh_material material = material_of(forms[f]);
    make(test_box(3, 3, 3, 1, 1, 1), material, 0, &b);
    const double *X = flesh_mesh_positions(b.mesh);
    double worst = 0, force = 0;
    for (int i = 0; i < b.n / 3; i++) {
      int outside = 0;
      for (int c = 0; c < 3; c++) outside |= X[3 * i + c] == 0 || X[3 * i + c] == 1;
      const flesh_keyframe frame = {.translation = {g * X[3 * i + 1], 0, 0}};
      if (outside)
        CHECK_OK(flesh_system_add_prescribed_motion(b.system, 1, &i, FLESH_AXES_ALL,
                                                    &(flesh_motion){.count = 1, .keyframes = &frame}, -INFINITY,
                                                    INFINITY));
    }
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-11, 1);
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, NULL));
    double *r = malloc((size_t)b.n * sizeof *r);
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    point.multipliers = b.state.multipliers;
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    for (int d = 0; d < b.n; d++) {
      worst = fmax(worst, fabs(b.state.x[d] - X[d] - (d % 3 == 0 ? g * X[d + 1] : 0)));
      if (d % 3 == 0 && X[d + 1] == 1) force += r[d];
    }
    flesh_psi psi;
    CHECK_OK(material.psi(3 + g * g, 1, &material, &psi));
    printf("# %s: off by %.2g m, force %.9g N for %.9g N\n", flesh_energy_name(forms[f]), worst, force, 2 * psi.I * g);
    CHECK_BELOW(worst, 1e-8);
    CHECK_NEAR(force, 2 * psi.I * g, 1e-6 * force);
    free(r);
    flesh_integrator_destroy(&integrator);
    destroy(&b);
  }
}

/* Makes a quarter of a thick tube, inner radius 1 m, outer 2 m, from a box of layers x sectors x 1 cells of curved
 * tets. */
static flesh_mesh *quarter_tube(int layers, int sectors)
{
  flesh_mesh *box = test_box(layers, sectors, 1, 1, M_PI / 2, 1. / layers), *raised = NULL, *tube = NULL;
  CHECK_OK(flesh_mesh_raise_order(box, &raised));
  const int nodes = flesh_mesh_node_count(raised), tets = flesh_mesh_tet_count(raised);
  double *X = malloc(3 * (size_t)nodes * sizeof *X);
  int *node = malloc(10 * (size_t)tets * sizeof *node);
  for (int i = 0; i < nodes; i++) {
    const double *q = flesh_mesh_positions(raised) + 3 * i;
    X[3 * i] = (1 + q[0]) * cos(q[1]);
    X[3 * i + 1] = (1 + q[0]) * sin(q[1]);
    X[3 * i + 2] = q[2];
    for (int c = 0; c < 2; c++) X[3 * i + c] = fabs(X[3 * i + c]) < 1e-12 ? 0 : X[3 * i + c];
  }
  for (int k = 0; k < 10 * tets; k++)
    node[k] = k % 10 < 4 ? flesh_mesh_tets(raised)[4 * (k / 10) + k % 10]
                         : flesh_mesh_tet_edges(raised)[6 * (k / 10) + k % 10 - 4];
  CHECK_OK(flesh_mesh_create_quadratic(nodes, X, tets, node, NULL, &tube));
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&raised);
  free(X);
  free(node);
  return tube;
}

/* Prescribes the inner radius: computes the necessary pressure and the outer radius. */
static void inflate(int layers, int sectors, double a, double *pressure, double *outer)
{
  test_body b;
  double nodes = 0;
  make(quarter_tube(layers, sectors), test_material(FLESH_ENERGY_E, 0.5), 0, &b);
  const double *X = flesh_mesh_positions(b.mesh);
  for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(&b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(&b, 2, 1. / layers, FLESH_AXIS_Z, NULL, -INFINITY, INFINITY));
  for (int i = 0; i < b.n / 3; i++) {
    const flesh_keyframe frame = {.translation = {(a - 1) * X[3 * i], (a - 1) * X[3 * i + 1], 0}};
    if (fabs(hypot(X[3 * i], X[3 * i + 1]) - 1) < 1e-9)
      CHECK_OK(flesh_system_add_prescribed_motion(b.system, 1, &i, FLESH_AXIS_X | FLESH_AXIS_Y,
                                                  &(flesh_motion){.count = 1, .keyframes = &frame}, -INFINITY,
                                                  INFINITY));
  }
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-8, 1);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, NULL));
  double *r = malloc((size_t)b.n * sizeof *r);
  flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  point.multipliers = b.state.multipliers;
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  *pressure = *outer = 0;
  for (int i = 0; i < b.n / 3; i++) {
    const double R = hypot(X[3 * i], X[3 * i + 1]);
    if (fabs(R - 1) < 1e-9) *pressure += (r[3 * i] * X[3 * i] + r[3 * i + 1] * X[3 * i + 1]) / (a * M_PI / 2 / layers);
    if (fabs(R - 2) < 1e-9) *outer += hypot(b.state.x[3 * i], b.state.x[3 * i + 1]), nodes++;
  }
  *outer /= nodes;
  CHECK_BELOW(largest_gap(&b), 1e-8);
  free(r);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

/* A thick tube of constant length: r^2 = R^2 + a^2 - 1 for any material, and for a neo-Hookean one the pressure is mu
 * (log(l_a/l_b) + 1/(2 l_b^2) - 1/(2 l_a^2)), l = r/R inside and outside (from the balance of radial forces). */
static void tubes_inflate_as_they_must(void)
{
  const double a = 1.5, outer = sqrt(4 + a * a - 1), stretch = outer / 2;
  const double exact = 1e5 / 3 * (log(a / stretch) + 1 / (2 * stretch * stretch) - 1 / (2 * a * a));
  double off[2], radius[2];
  for (int k = 0; k < 2; k++) {
    double pressure, b;
    inflate(2 + 2 * k, 3 + 3 * k, a, &pressure, &b);
    off[k] = pressure / exact - 1;
    radius[k] = b / outer - 1;
    printf("# pressure %.6g Pa, off by %.2g %%; outer radius by %.1g %%\n", pressure, 100 * off[k], 100 * radius[k]);
  }
  CHECK_BELOW(fabs(off[0]), 1e-3);
  CHECK_BELOW(fabs(off[1]), 0.3 * fabs(off[0]));
  CHECK_BELOW(fabs(radius[0]), 2e-4);
  CHECK_BELOW(fabs(radius[1]), 0.3 * fabs(radius[0]));
}

/* Returns the deflection of the tip of a bar of 4 x 1 x 1 m under 200 N/m^3, of nx x ny x ny cells. */
static double tip_of(double poisson, int nx, int ny)
{
  test_body b;
  double tip = NAN;
  make(test_box(nx, ny, ny, 4, 1, 1), test_material(FLESH_ENERGY_S, poisson), 0, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -0.2));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  if (poisson < 0.5) b.state.multiplier_count = 0, free(b.state.multipliers), b.state.multipliers = NULL;
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-8, 1);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, NULL));
  for (int i = 0; i < b.n / 3; i++) {
    const double *X = flesh_mesh_positions(b.mesh) + 3 * i;
    if (X[0] == 4 && X[1] == 0.5 && X[2] == 0.5) tip = b.state.x[3 * i + 2] - 0.5;
  }
  if (poisson == 0.5) CHECK_BELOW(largest_gap(&b), 1e-8);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
  return tip;
}

/* Compares with the limit of fine meshes at 0.4999, -0.7565 m, which an independent code gives to .15 %
 * (test_tet10_physics); for 1/2 the tips converge to the same, with an error like 1/lambda. */
static void bars_bend_as_in_the_limit(void)
{
  const double tip = tip_of(0.5, 16, 4), off = 100 * (tip / -0.7565 - 1);
  printf("# nu 0.5: tip %.6f m, %+.2f %% of the limit at 0.4999\n", tip, off);
  CHECK_BELOW(fabs(off), 0.7);
  static const double ratios[3] = {0.49, 0.499, 0.4999};
  double distance[3];
  const double limit = tip_of(0.5, 6, 2);
  for (int k = 0; k < 3; k++) {
    distance[k] = tip_of(ratios[k], 6, 2) - limit;
    printf("# nu %g: %.3g m from nu 0.5\n", ratios[k], distance[k]);
    if (k) CHECK_NEAR(distance[k - 1] / distance[k], 10 * ratios[k] / ratios[k - 1], k > 1 ? 0.15 : 1);
  }
}

/* Residual and Hessian are derivatives, with pressures of a tenth of the penalty, and with the penalty raised. */
static void derivatives_agree(void)
{
  for (int f = 0; f < FORMS; f++) {
    test_body b;
    flesh_derivative_report report;
    make(test_box(2, 1, 1, 2, 1, 1), material_of(forms[f]), 0, &b);
    test_jitter(b.n, 0.05, 3, b.state.x);
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_effect_check_derivatives(flesh_system_effect(b.system, 0), b.mesh, 0, b.state.x, 7, &report));
    printf("# %s: potential %.1g, Hessian %.1g\n", flesh_energy_name(forms[f]), report.potential[0], report.jacobian[0]);
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
    destroy(&b);
  }
}

/* Elements, methods and solvers that cannot constrain volumes are refused with a message. */
static void others_are_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_ida_problem *ida = NULL;
  flesh_ode_problem *ode = NULL;
  flesh_integrator *integrator = NULL;
  throw_block(&b);
  const flesh_solver_options options = test_options(1e-6);
  CHECK(flesh_ida_problem_create(b.system, &options, &ida) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "incompressible tets (poisson 0.5)");
  CHECK(flesh_ode_problem_create(b.system, &options, &ode) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_integrator_create(b.system, FLESH_METHOD_IDA, &options, &integrator) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "a method of fixed steps");
  b.body.element = FLESH_ELEMENT_TET10;
  CHECK(flesh_effect_elasticity(&b.body, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the element tet10 cannot hold; set body.element to tet10-mean");
  b.body.element = FLESH_ELEMENT_TET10_MEAN;
  b.material = own_material();
  b.material.lambda = 4 * b.material.mu / 2;
  CHECK(flesh_effect_elasticity(&b.body, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "it must be more than twice the shear modulus");
  b.state.multiplier_count--;
  integrator = integrator_of(&b, FLESH_METHOD_MIDPOINT, 1e-6, 1);
  CHECK(flesh_integrator_step(integrator, &b.state, 0.01, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the system has");
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

/* A tet with all nodes constrained at a different volume has no solution, and the state is unchanged. */
static void what_cannot_be_held_fails(void)
{
  test_body b;
  make(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.5), 0, &b);
  const flesh_keyframe frame = {.translation = {0.2, 0, 0}};
  CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  for (int c = 1; c < 3; c++)
    for (int at = 0; at < 2; at++)
      CHECK_OK(test_body_hold(&b, c, at, FLESH_AXIS_Y | FLESH_AXIS_Z, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(&b, 0, 1, FLESH_AXES_ALL, &(flesh_motion){.count = 1, .keyframes = &frame}, -INFINITY,
                          INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-6, 1);
  CHECK(flesh_integrator_step(integrator, &b.state, 0, NULL) == FLESH_ERR_SOLVE);
  CHECK_TEXT(flesh_error_text(), "the forces balance, but volumes of incompressible tets are off by up to 0.00078");
  CHECK_NEAR(flesh_integrator_failure(integrator)->volume_gap, 0.2 / 256, 1e-7); /* of the smallest increment tried */
  for (int d = 0; d < b.n; d++) CHECK(b.state.x[d] == flesh_mesh_positions(b.mesh)[d]);
  for (int k = 0; k < b.state.multiplier_count; k++) CHECK(b.state.multipliers[k] == 0);
  flesh_integrator_destroy(&integrator);
  destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(bars_stretch_as_they_must), TEST(cubes_shear_as_they_must),
                   TEST(tubes_inflate_as_they_must), TEST(bars_bend_as_in_the_limit), TEST(derivatives_agree),
                   TEST(others_are_refused), TEST(what_cannot_be_held_fails));
}
