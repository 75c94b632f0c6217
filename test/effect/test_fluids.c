// TEST name=test_fluids_quick quick excerpt args: balls_have_half_the_drag_of_plates
// TEST+ wind_works_as_much_as_the_body_gains submerged_bodies_obey_archimedes deep_water_presses_evenly
// TEST+ derivatives_are_exact_at_the_water_line blocks_float_at_their_draught
// TEST+ floating_blocks_are_stable_by_their_metacentre blocks_heave_and_capsize nonsense_is_refused
// TEST full seconds=60
/* test_fluids.c: drag and buoyancy against closed forms: terminal velocity, Archimedes' principle, draught, heave and
 * metacentric height of floating blocks, work of the wind. */
#include <stdlib.h>

#include "body.h"
#include "methods.h"
#include "test.h"

static const double g = 9.81;

/* A box with a corner at the origin, of four- or ten-node tets; stiff, so that it moves as a rigid body. */
static void make(int order, const int cells[3], const double size[3], double density, test_body *b)
{
  flesh_mesh *mesh = test_box(cells[0], cells[1], cells[2], size[0], size[1], size[2]);
  flesh_material stiff;
  if (order == 2) {
    flesh_mesh *raised = NULL;
    CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
    flesh_mesh_destroy(&mesh);
    mesh = raised;
  }
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e8, 0.3, &stiff));
  CHECK_OK(test_body_create(mesh, stiff, density, FLESH_MASS_LUMPED, 1, b));
}

static void add(test_body *b, flesh_effect *effect) { CHECK_OK(flesh_system_add_effect(b->system, &effect)); }

static void add_drag(test_body *b, double density, const double velocity[3], double coefficient)
{
  flesh_effect *effect = NULL;
  int count;
  const int *triangles = flesh_mesh_surface(b->mesh, &count);
  CHECK_OK(flesh_effect_drag(&b->body, count, triangles, density, velocity, coefficient, &effect));
  add(b, effect);
}

static flesh_effect *buoyancy(const test_body *b, double level, double density)
{
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_buoyancy(&b->body, level, density, (double[]){0, 0, -g}, &effect));
  return effect;
}

static flesh_point point_of(const test_body *b)
{
  return flesh_point_at(0, b->state.x, b->state.v, b->state.v);
}

/* Computes force and torque of the residual about `centre`, and the sum of magnitudes. */
static double resultant(const test_body *b, const flesh_effect *effect, const double centre[3], double sums[6])
{
  double *r = calloc((size_t)b->n, sizeof *r), size = 0;
  const flesh_point point = point_of(b);
  CHECK_OK(effect->operations->residual(effect, &point, r));
  memset(sums, 0, 6 * sizeof *sums);
  for (int i = 0; i < b->n / 3; i++)
    for (int c = 0; c < 3; c++) {
      const double *x = b->state.x + 3 * i, *f = r + 3 * i;
      const int p = (c + 1) % 3, q = (c + 2) % 3;
      sums[c] += f[c];
      sums[3 + c] += (x[p] - centre[p]) * f[q] - (x[q] - centre[q]) * f[p];
      size += fabs(f[c]);
    }
  free(r);
  return size;
}

static double mean_of(const test_body *b, const double *x, int c)
{
  double *mass = malloc((size_t)b->n * sizeof *mass), sum = 0, whole = 0;
  flesh_mesh_lumped_mass(b->mesh, b->density, mass);
  for (int i = 0; i < b->n / 3; i++) sum += mass[i] * x[3 * i + c], whole += mass[i];
  free(mass);
  return sum / whole;
}

static void rotate(test_body *b, double angle)
{
  const double *X = flesh_mesh_positions(b->mesh), c = cos(angle), s = sin(angle);
  for (int i = 0; i < b->n / 3; i++) {
    b->state.x[3 * i] = c * X[3 * i] - s * X[3 * i + 2];
    b->state.x[3 * i + 2] = s * X[3 * i] + c * X[3 * i + 2];
  }
}

/* Returns the error of the speed relative to -v_t tanh(g t/v_t) at `end`, v_t^2 = 2 m g/(density C A). */
static double fall(flesh_method method, int order, double step, double end)
{
  test_body b;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(1e-10);
  const double size[3] = {1, 0.8, 0.5}, density = 50, fluid = 10, coefficient = 1.3;
  make(order, (int[]){2, 2, 1}, size, density, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -g));
  add_drag(&b, fluid, (double[]){0, 0, 0}, coefficient);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  const int steps = (int)(end / step + 0.5);
  int status = FLESH_OK;
  for (int k = 0; k < steps && !status; k++) status = flesh_integrator_step(integrator, &b.state, step, NULL);
  CHECK_OK(status);
  const double terminal = sqrt(2 * density * size[2] * g / (fluid * coefficient));
  const double error = mean_of(&b, b.state.v, 2) + terminal * tanh(g * end / terminal);
  CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 3 * step * step); /* the error of its work is that of a
                                                                                    * sum over steps */
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return fabs(error) / terminal;
}

static void bodies_fall_at_terminal_velocity(void)
{
  for (int order = 1; order <= 2; order++) {
    for_every_method(method, TEST_FIXED_STEPS) {
      const double late = fall(method, order, 0.05, 4), coarse = fall(method, order, 0.05, 0.5),
                   fine = fall(method, order, 0.025, 0.5), halves = log2(coarse / fine);
      printf("# order %d, %s: terminal velocity off by %.2g; after 0.5 s by %.2g, with half the step by %.2g\n", order,
             flesh_method_name(method), late, coarse, fine);
      CHECK_BELOW(late, 1e-5);
      CHECK_BELOW(fine, flesh_method_order(method) == 1 ? 3e-2 : 2e-3);
      CHECK(halves > flesh_method_order(method) - 0.2); /* only the shape is lagged */
      /* The first three steps of runge-kutta have a larger error, which falls faster. */
      if (method != FLESH_METHOD_RUNGE_KUTTA) CHECK_NEAR(halves, flesh_method_order(method), 0.2);
    }
  }
}

/* A ball has half the drag coefficient of a plate: 1/2 density (pi R^2) s^2/2. */
static void balls_have_half_the_drag_of_plates(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    double sums[6];
    make(order, (int[]){8, 8, 8}, (double[]){2, 2, 2}, 1, &b);
    for (int i = 0; i < b.n / 3; i++) {
      double *x = b.state.x + 3 * i, largest = 0, length = 0;
      for (int c = 0; c < 3; c++) x[c] -= 1, largest = fmax(largest, fabs(x[c])), length += x[c] * x[c];
      for (int c = 0; c < 3 && length > 0; c++) x[c] *= largest / sqrt(length);
      b.state.v[3 * i + 1] = 3;
    }
    flesh_effect *effect = NULL;
    int count;
    const int *triangles = flesh_mesh_surface(b.mesh, &count);
    CHECK_OK(flesh_effect_drag(&b.body, count, triangles, 1000, (double[]){0, -2, 0}, 0.7, &effect));
    resultant(&b, effect, (double[]){0, 0, 0}, sums);
    const double exact = 0.7 * 1000 / 2 * 25 * acos(-1) / 2;
    printf("# order %d: %.6g N of %.6g N, aside %.2g N\n", order, sums[1], exact, fabs(sums[0]) + fabs(sums[2]));
    CHECK_NEAR(sums[1], exact, (order == 2 ? 1e-3 : 0.03) * exact);
    CHECK_BELOW(fabs(sums[0]) + fabs(sums[2]), 1e-3 * exact);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* The work of the wind on a light block is its only energy: 1/2 m v^2 = W. */
static void wind_works_as_much_as_the_body_gains(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    const double off = flesh_method_order(method) == 1 ? 5e-2 : 2e-3;
    test_body b;
    flesh_integrator *integrator = NULL;
    flesh_solver_options options = test_options(1e-10);
    make(1, (int[]){2, 2, 2}, (double[]){1, 1, 1}, 20, &b);
    add_drag(&b, 1.2, (double[]){30, 0, 0}, 1);
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
    for (int k = 0; k < 100; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
    const double v = mean_of(&b, b.state.v, 0), kinetic = 20 * v * v / 2;
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    printf("# %s: %.6g m/s, %.6g J, supplied %.6g J\n", flesh_method_name(method), v, kinetic, balance->supplied);
    /* dv/dt = k (w - v)^2: w - v = w/(1 + k w t), k = density C A/(2 m) = 0.03/m. */
    CHECK_NEAR(v, 30 - 30 / (1 + 0.03 * 30 * 1), off);
    CHECK_NEAR(balance->supplied, kinetic, off * kinetic);
    CHECK_BELOW(balance->gain, 1e-3);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Under water a body of any shape is lifted by the weight of its volume of fluid, at the centre of that volume. */
static void submerged_bodies_obey_archimedes(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    double sums[6], middle[3] = {0}, before, after;
    make(order, (int[]){2, 3, 2}, (double[]){1, 1, 1}, 1, &b);
    test_jitter(b.n, 0.05, 3, b.state.x);
    flesh_effect *effect = buoyancy(&b, 2, 900);
    const double volume = flesh_mesh_volume(b.mesh, b.state.x);
    const double size = resultant(&b, effect, middle, sums);
    CHECK_NEAR(sums[2], -900 * g * volume, 1e-12 * size);
    CHECK_BELOW(fabs(sums[0]) + fabs(sums[1]) + fabs(sums[5]), 1e-12 * size);
    /* The torque gives the position of the centre; the energy shows that it rises with the body. */
    flesh_point point = point_of(&b);
    CHECK_OK(effect->operations->energy(effect, &point, &before));
    middle[0] = -sums[4] / sums[2], middle[1] = sums[3] / sums[2];
    CHECK(middle[0] > 0.45 && middle[0] < 0.55 && middle[1] > 0.45 && middle[1] < 0.55);
    resultant(&b, effect, middle, sums);
    CHECK_BELOW(fabs(sums[3]) + fabs(sums[4]) + fabs(sums[5]), 1e-12 * size);
    for (int d = 2; d < b.n; d += 3) b.state.x[d] -= 0.7;
    CHECK_OK(effect->operations->energy(effect, &point, &after));
    CHECK_NEAR(after - before, 900 * g * volume * 0.7, 1e-12 * after);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* Deep below the level its pressure is that of the effect `pressure`, node by node. */
static void deep_water_presses_evenly(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    int count;
    flesh_effect *even = NULL;
    make(order, (int[]){2, 1, 2}, (double[]){1, 1, 1}, 1, &b);
    test_jitter(b.n, 0.05, 5, b.state.x);
    const int *triangles = flesh_mesh_surface(b.mesh, &count);
    flesh_effect *deep = buoyancy(&b, 1e5, 1000 / (g * 1e5));
    CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 1000, NULL, &even));
    double *r = calloc((size_t)b.n * 2, sizeof *r);
    const flesh_point point = point_of(&b);
    CHECK_OK(deep->operations->residual(deep, &point, r));
    CHECK_OK(even->operations->residual(even, &point, r + b.n));
    CHECK_BELOW(test_distance(b.n, r, r + b.n), 2e-5 * test_norm(b.n, r));
    free(r);
    flesh_effect_destroy(&deep);
    flesh_effect_destroy(&even);
    test_body_destroy(&b);
  }
}

/* Checks faces cut by the fluid's surface at any position, with tilted faces. */
static void derivatives_are_exact_at_the_water_line(void)
{
  for (int order = 1; order <= 2; order++)
    for (int k = 0; k < 8; k++) {
      test_body b;
      int count;
      flesh_effect *wind = NULL;
      flesh_derivative_report report;
      make(order, (int[]){2, 2, 2}, (double[]){1, 1, 1}, 1, &b);
      test_jitter(b.n, 0.05, 7 + (unsigned)k, b.state.x);
      flesh_effect *effect = NULL;
      CHECK_OK(flesh_effect_buoyancy(&b.body, -0.3 + 0.2 * k, 1000, (double[]){1, k % 3, -8}, &effect));
      CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
      CHECK(flesh_derivative_report_passes(&report, 1e-6));
      CHECK(!(report.negative < -1e-12));
      const int *triangles = flesh_mesh_surface(b.mesh, &count);
      CHECK_OK(flesh_effect_drag(&b.body, count, triangles, 9, (double[]){1, k - 3, 2}, 1, &wind));
      CHECK_OK(flesh_effect_check_derivatives(wind, b.mesh, 0, b.state.x, 5, &report));
      CHECK(flesh_derivative_report_passes(&report, 1e-6));
      flesh_effect_destroy(&effect);
      flesh_effect_destroy(&wind);
      test_body_destroy(&b);
    }
}

/* A block of 0.6 times the fluid's density floats with 0.6 of its height under water; its vertical sides are cut by the
 * surface. */
static void blocks_float_at_their_draught(void)
{
  for (int order = 1; order <= 2; order++) {
    test_body b;
    double sums[6], high = 0;
    make(order, (int[]){3, 2, 3}, (double[]){1, 0.7, 0.5}, 600, &b);
    flesh_effect *effect = buoyancy(&b, 0, 1000);
    for (int d = 2; d < b.n; d += 3) b.state.x[d] -= 0.6 * 0.5;
    const double weight = 600 * g * 0.35, size = resultant(&b, effect, (double[]){0.5, 0.35, 0}, sums);
    for (int c = 0; c < 6; c++) high = fmax(high, fabs(sums[c] + (c == 2) * weight));
    printf("# order %d: off by %.2g of the weight\n", order, high / weight);
    CHECK_BELOW(high, 1e-12 * size);
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* The torque of weight and buoyancy at a small tilt is m g GM, with the metacentric height GM = b^2/(12 T) - (h - T)/2
 * of a block of width b, height h and draught T: a raft rights itself, a post capsizes. */
static void floating_blocks_are_stable_by_their_metacentre(void)
{
  const double sizes[2][3] = {{1, 0.6, 0.4}, {0.4, 0.6, 1}}, tilt = 1e-4;
  for (int run = 0; run < 4; run++) {
    test_body b;
    double sums[6];
    const int k = run % 2, order = 1 + run / 2;
    const double *size = sizes[k], T = 0.6 * size[2], weight = 600 * g * size[0] * size[1] * size[2];
    make(order, (int[]){4, 2, 4}, size, 600, &b);
    flesh_effect *effect = buoyancy(&b, 0, 1000);
    rotate(&b, tilt);
    const double dx = size[0] / 2 - mean_of(&b, b.state.x, 0), dz = size[2] / 2 - T - mean_of(&b, b.state.x, 2);
    for (int i = 0; i < b.n / 3; i++) b.state.x[3 * i] += dx, b.state.x[3 * i + 2] += dz;
    resultant(&b, effect, (double[]){size[0] / 2, size[1] / 2, size[2] / 2 - T}, sums);
    const double metacentre = size[0] * size[0] / (12 * T) - (size[2] - T) / 2;
    printf("# GM %.6g m, of the torque %.6g m\n", metacentre, -sums[4] / (weight * tilt));
    CHECK_NEAR(-sums[4], weight * metacentre * tilt, (order == 1 ? 1e-6 : 0.02 * fabs(metacentre)) * weight * tilt);
    CHECK((metacentre > 0) == (k == 0));
    flesh_effect_destroy(&effect);
    test_body_destroy(&b);
  }
}

/* The raft heaves with the period 2 pi sqrt(T/g) of its draught T; the post capsizes and the raft does not. */
static void blocks_heave_and_capsize(void)
{
  const double sizes[2][3] = {{1, 0.6, 0.4}, {0.4, 0.6, 1}};
  for (int k = 0; k < 2; k++) {
    test_body b;
    flesh_integrator *integrator = NULL;
    flesh_solver_options options = test_options(1e-9);
    const double *size = sizes[k], T = 0.6 * size[2], period = 2 * acos(-1) * sqrt(T / g), tilt = k ? 0.02 : 0.1;
    make(1, (int[]){2, 1, 2}, size, 600, &b);
    CHECK_OK(test_body_gravity(&b, 0, 0, -g));
    add(&b, buoyancy(&b, 0, 1000));
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_NEWMARK, &options, &integrator));
    const double lift = 0.05;
    for (int d = 2; d < b.n; d += 3) b.state.x[d] += lift - T;
    for (int s = 0; s < 100; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, period / 100, NULL));
    const double z = mean_of(&b, b.state.x, 2) - size[2] / 2 + T;
    printf("# after a period it is %.6g m above, from %.3g m\n", z, lift);
    CHECK_NEAR(z, lift, 1e-3 * lift);
    flesh_integrator_destroy(&integrator);
    /* From rest with a small tilt, for three seconds. */
    rotate(&b, tilt);
    memset(b.state.v, 0, (size_t)b.n * sizeof *b.state.v);
    for (int d = 2; d < b.n; d += 3) b.state.x[d] -= T;
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_NEWMARK, &options, &integrator));
    double largest = 0;
    for (int s = 0; s < 150; s++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.02, NULL));
      const double *x = b.state.x, *e = x + 3 * (size_t)2; /* along x at rest: nodes 0 and 2 */
      largest = fmax(largest, fabs(atan2(e[2] - x[2], e[0] - x[0])));
    }
    printf("# tilted by %.3g it reaches %.3g; energy gained from nowhere %.2g\n", tilt, largest,
           flesh_integrator_energy_balance(integrator)->gain);
    CHECK(k ? largest > 1 : largest < 1.6 * tilt);
    CHECK_BELOW(flesh_integrator_energy_balance(integrator)->gain, 0.02);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

static void nonsense_is_refused(void)
{
  test_body b;
  int count;
  flesh_effect *effect = NULL;
  make(1, (int[]){1, 1, 1}, (double[]){1, 1, 1}, 1, &b);
  const int *triangles = flesh_mesh_surface(b.mesh, &count);
  const double still[3] = {0}, down[3] = {0, 0, -1}, mad[3] = {NAN};
#define REFUSED(call, text) CHECK((call) == FLESH_ERR_ARGUMENT && strstr(flesh_error_text(), text) && !effect)
  REFUSED(flesh_effect_drag(&b.body, count, triangles, 0, still, 1, &effect), "density is 0");
  REFUSED(flesh_effect_drag(&b.body, count, triangles, 1, mad, 1, &effect), "velocity");
  REFUSED(flesh_effect_drag(&b.body, count, triangles, 1, still, -1, &effect), "coefficient is -1");
  REFUSED(flesh_effect_drag(&b.body, 0, triangles, 1, still, 1, &effect), "acts on nothing");
  REFUSED(flesh_effect_drag(&b.body, 1, (int[]){0, 1, 8}, 1, still, 1, &effect), "triangle 0 has node 8");
  REFUSED(flesh_effect_drag(&b.body, 1, (int[]){0, 1, 1}, 1, still, 1, &effect), "node 1 twice");
  REFUSED(flesh_effect_buoyancy(&b.body, INFINITY, 1, down, &effect), "level is inf");
  REFUSED(flesh_effect_buoyancy(&b.body, 0, -1, down, &effect), "density is -1");
  REFUSED(flesh_effect_buoyancy(&b.body, 0, 1, still, &effect), "acceleration");
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(bodies_fall_at_terminal_velocity), TEST(balls_have_half_the_drag_of_plates),
                   TEST(wind_works_as_much_as_the_body_gains), TEST(submerged_bodies_obey_archimedes),
                   TEST(deep_water_presses_evenly), TEST(derivatives_are_exact_at_the_water_line),
                   TEST(blocks_float_at_their_draught), TEST(floating_blocks_are_stable_by_their_metacentre),
                   TEST(blocks_heave_and_capsize), TEST(nonsense_is_refused));
}
