// TEST quick seconds=60
/* test_muscle_speed.c: muscle that is weaker while it shortens and stronger while it is stretched. A cube moved at a
 * speed pulls according to the closed form of a step, which converges to that of Hill and Thelen; a cube under a load
 * shortens as Hill's hyperbola predicts; the loss by the speed is dissipated. Cubes have negligible mass, except for
 * the last one. */
#include "body.h"
#include "pull.h"
#include "test.h"

static const double PEAK = 3e5, OPTIMAL = 1.1, FASTEST = 8, POISSON = 0.3, SOFT = 1e3;

/* Active tension at |1 - l| <= 0.4. */
static double active(int curve, double l) { return curve ? exp(-(l - 1) * (l - 1) / 0.45) : 1 - 4 * (1 - l) * (1 - l); }

/* Thelen 2003, equation 6, with A_f = 0.25 and F_len = 1.4, solved for the force. */
static double of_speed(double v)
{
  if (v < -1) return 0;
  return v < 0 ? (1 + v) / (1 - v / 0.25) : (0.4 + 10 * 1.4 * v) / (0.4 + 10 * v);
}

typedef struct cube {
  test_body b;
  flesh_integrator *integrator;
  double *x0; /* [n] positions at the beginning of the last step */
} cube;

/* Makes a cube of 1 m, free to slide on the planes x = 0, y = 0, z = 0, with fibres along x without passive tension. */
static void make_cube(int order, int curve, double young, double activation, double density, cube *c)
{
  flesh_mesh *four = test_box(2, 2, 2, 1, 1, 1), *mesh = four;
  flesh_material material;
  flesh_fibre fibre;
  flesh_effect *effect = NULL;
  const flesh_curve_point one = {0, activation};
  const flesh_amplitude constant = {.count = 1, .points = &one, .from = -INFINITY, .until = INFINITY};
  if (order == 2) {
    CHECK_OK(flesh_mesh_raise_order(four, &mesh));
    flesh_mesh_destroy(&four);
  }
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, POISSON, &material));
  CHECK_OK(test_body_create(mesh, material, density, FLESH_MASS_LUMPED, 1, &c->b));
  for (int a = 0; a < 3; a++) CHECK_OK(test_body_hold(&c->b, a, 0, 1u << a, NULL, -INFINITY, INFINITY));
  const int tets = flesh_mesh_tet_count(mesh);
  double *fibres = calloc(3 * (size_t)tets, sizeof *fibres);
  for (int e = 0; e < tets; e++) fibres[3 * e] = 1;
  CHECK_OK(flesh_fibre_default((flesh_fibre_curve)curve, PEAK, &fibre));
  fibre.passive_stress = 0;
  fibre.optimal_stretch = OPTIMAL;
  fibre.max_shortening_velocity = FASTEST;
  CHECK_OK(flesh_effect_muscle(&c->b.body, tets, NULL, fibres, &fibre, &constant, &effect));
  CHECK_OK(flesh_system_add_effect(c->b.system, &effect));
  free(fibres);
}

static void start(cube *c, double tolerance)
{
  flesh_solver_options options = test_options(tolerance);
  options.linear_tolerance = 1e-6;
  CHECK_OK(flesh_system_finalize(c->b.system));
  CHECK_OK(flesh_integrator_create(c->b.system, FLESH_METHOD_BACKWARD_EULER, &options, &c->integrator));
  c->x0 = malloc((size_t)c->b.n * sizeof *c->x0);
}

static void step(cube *c, double h)
{
  memcpy(c->x0, c->b.state.x, (size_t)c->b.n * sizeof *c->x0);
  CHECK_OK(flesh_integrator_step(c->integrator, &c->b.state, h, NULL));
}

static void clear(cube *c)
{
  flesh_integrator_destroy(&c->integrator);
  free(c->x0);
  test_body_destroy(&c->b);
}

/* Returns the reaction of the face x = 1 at the end of a step; the cube's mass is negligible. */
static double reaction(const cube *c)
{
  const flesh_state *s = &c->b.state;
  double *r = calloc(2 * (size_t)c->b.n, sizeof *r), sum = 0;
  flesh_point point = flesh_point_at(s->t, s->x, s->v, r + c->b.n);
  point.frozen = (flesh_frozen){c->x0, NULL};
  CHECK_OK(flesh_system_residual(c->b.system, &point, r));
  for (int i = 0; i < c->b.n / 3; i++)
    if (fabs(flesh_mesh_positions(c->b.mesh)[3 * i] - 1) < 1e-9) sum += r[3 * i];
  free(r);
  return sum;
}

/* Returns the tension at the end of a step in which a fibre goes from one stretch to another; with no duration, in the
 * limit. */
static double tension(int curve, double activation, double from, double to, double h)
{
  const double l_0 = from / OPTIMAL, l = to / OPTIMAL, fastest = FASTEST * (0.25 + 0.75 * activation),
               v = (l * l - l_0 * l_0) / (2 * l_0 * h * fastest);
  return activation * PEAK / OPTIMAL * (active(curve, l) + active(curve, l_0) * (of_speed(v) - 1) * l / l_0);
}

static double hill(int curve, double activation, double stretch, double rate)
{
  const double l = stretch / OPTIMAL, v = rate / OPTIMAL / (FASTEST * (0.25 + 0.75 * activation));
  return activation * PEAK / OPTIMAL * active(curve, l) * of_speed(v);
}

typedef struct errors {
  double step, hill, tension; /* over the peak stress: the largest errors of all steps, and of the last two */
} errors;

/* Moves the face x = 1 at `rate` for 16 ms. The material is stiff enough for tensions that fall with the stretch, so
 * that the stretch stays uniform. */
static errors move(int order, int curve, double activation, double rate, int steps)
{
  cube c = {0};
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {rate, 0, 0}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  const double h = 0.016 / steps, stiff = 6e5;
  errors e = {0};
  make_cube(order, curve, stiff, activation, 1e-9, &c);
  CHECK_OK(test_body_hold(&c.b, 0, 1, FLESH_AXIS_X, &motion, -INFINITY, INFINITY));
  start(&c, 1e-11);
  for (int k = 0; k < steps; k++) {
    const double from = 1 + rate * c.b.state.t;
    step(&c, h);
    double side;
    const double to = 1 + rate * c.b.state.t, own = uniaxial(&c.b.material, to, &side), force = reaction(&c) - own;
    e.step = fmax(e.step, fabs(force - tension(curve, activation, from, to, h)) / PEAK);
    e.hill = fabs(force - hill(curve, activation, to, rate)) / PEAK;
    e.tension = force / PEAK;
  }
  clear(&c);
  return e;
}

/* Concentric and eccentric. */
static void moved_cubes_pull_as_the_closed_form(void)
{
  const double speeds[] = {-0.9, -0.5, -0.1, -0.01, 0.01, 0.2, 1.5};
  for (int order = 1; order <= 2; order++)
    for (int curve = 0; curve < FLESH_FIBRE_CURVE_COUNT; curve++) {
      double worst = 0;
      for (int k = 0; k < 14; k++) {
        const double activation = k < 7 ? 1 : 0.4, fastest = FASTEST * (0.25 + 0.75 * activation) * OPTIMAL;
        worst = fmax(worst, move(order, curve, activation, speeds[k % 7] * fastest, 4).step);
      }
      printf("# order %d, %s: off by %.2g of the peak stress\n", order, flesh_fibre_curve_name((flesh_fibre_curve)curve),
             worst);
      CHECK_BELOW(worst, 1e-8);
    }
}

/* In the limit of short steps, to first order; above the greatest speed fibres do not pull. */
static void short_steps_pull_as_hill_and_thelen(void)
{
  const double rates[] = {-3, 3, -1.3 * FASTEST * OPTIMAL};
  for (int curve = 0; curve < FLESH_FIBRE_CURVE_COUNT; curve++)
    for (int k = 0; k < 3; k++) {
      errors e[2];
      for (int fine = 0; fine < 2; fine++) e[fine] = move(1, curve, 1, rates[k], fine ? 32 : 16);
      printf("# %s at %g 1/s: %.6f of the peak stress, off by %.3g and %.3g\n",
             flesh_fibre_curve_name((flesh_fibre_curve)curve), rates[k], e[1].tension, e[0].hill, e[1].hill);
      CHECK_NEAR(e[0].hill / e[1].hill, 2, 0.15);
      CHECK_BELOW(e[1].hill, 0.01);
    }
}

/* Returns (g + A)(s + A) over A (1 + A), which is 1 on Hill's hyperbola, for a cube that shortens for some steps under
 * a fraction of its isometric tension: g is its tension over the isometric one, s its speed over the greatest. */
static double shorten(double part, double h, double *speed)
{
  const double hill_constant = 0.25;
  cube c = {0};
  double before = 1, stretch = 1;
  make_cube(1, FLESH_FIBRE_BLEMKER, SOFT, 1, 1e-9, &c);
  const double pull = part * PEAK / OPTIMAL * active(FLESH_FIBRE_BLEMKER, 1 / OPTIMAL);
  add_pull(&c.b, pull);
  start(&c, 1e-9);
  for (int k = 0; k < 4; k++) {
    step(&c, h);
    before = stretch;
    for (int i = 0; i < c.b.n / 3; i++)
      if (flesh_mesh_positions(c.b.mesh)[3 * i] > 1 - 1e-9) stretch = c.b.state.x[3 * i];
  }
  *speed = (before - stretch) / h / (FASTEST * OPTIMAL);
  double side;
  const double still = PEAK / OPTIMAL * active(FLESH_FIBRE_BLEMKER, stretch / OPTIMAL),
               g = (pull - uniaxial(&c.b.material, stretch, &side)) / still;
  clear(&c);
  return (g + hill_constant) * (*speed + hill_constant) / (hill_constant * (1 + hill_constant));
}

static void loaded_cubes_shorten_on_hills_hyperbola(void)
{
  double last = 1;
  for (double part = 0.1; part < 0.95; part += 0.2) {
    double speed[2], on[2];
    for (int k = 0; k < 2; k++) on[k] = shorten(part, 0.001 / (1 << k), &speed[k]);
    printf("# under %.1f of the tension at rest: %.4f of the greatest speed; on the hyperbola by %.2g, %.2g\n", part,
           speed[1], on[0] - 1, on[1] - 1);
    CHECK_NEAR(on[1], 1, 0.005);
    CHECK(fabs(on[1] - 1) < 0.6 * fabs(on[0] - 1));
    CHECK(speed[1] < last && speed[1] > 0);
    last = speed[1];
  }
}

/* Returns the power of the speed-dependent forces, W, at a point of the midpoint rule. */
static double dissipated(const test_body *b, const double *x, const double *v)
{
  const int n = b->n;
  double *r = calloc(3 * (size_t)n, sizeof *r), power = 0;
  flesh_point point = flesh_point_at(0, x, v, r + n);
  const flesh_effect *muscle = flesh_system_effect(b->system, flesh_system_effect_count(b->system) - 1);
  CHECK_OK(muscle->operations->residual(muscle, &point, r));
  point = flesh_point_at(0, x, r + n, r + n);
  CHECK_OK(muscle->operations->residual(muscle, &point, r + 2 * n));
  for (int d = 0; d < n; d++) power += (r[d] - r[2 * n + d]) * v[d];
  free(r);
  return power;
}

/* Returns kinetic, elastic and fibre energy. */
static double energy(const test_body *b)
{
  double energies[8] = {0}, sum = 0, *zeros = calloc((size_t)b->n, sizeof *zeros);
  const flesh_point point = flesh_point_at(b->state.t, b->state.x, b->state.v, zeros);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  for (int k = 0; k < flesh_system_effect_count(b->system); k++) sum += energies[k];
  free(zeros);
  return sum;
}

/* Returns the energy that an active cube loses in 0.1 s with the midpoint rule, over the dissipation by its speed. */
static double swing(double h)
{
  cube c = {0};
  flesh_solver_options options = test_options(1e-10);
  double lost = 0, heat = 0;
  make_cube(1, FLESH_FIBRE_THELEN, SOFT, 0.5, 1000, &c);
  CHECK_OK(flesh_system_finalize(c.b.system));
  CHECK_OK(flesh_integrator_create(c.b.system, FLESH_METHOD_MIDPOINT, &options, &c.integrator));
  double *x = malloc((size_t)c.b.n * sizeof *x), *v = malloc((size_t)c.b.n * sizeof *v);
  c.x0 = malloc((size_t)c.b.n * sizeof *c.x0);
  const double first = energy(&c.b);
  while (c.b.state.t < 0.1 - h / 2) {
    const double before = energy(&c.b);
    step(&c, h);
    CHECK_BELOW(energy(&c.b) - before, 1e-6 * fabs(first));
    for (int d = 0; d < c.b.n; d++) {
      x[d] = (c.b.state.x[d] + c.x0[d]) / 2;
      v[d] = (c.b.state.x[d] - c.x0[d]) / h;
    }
    const double power = dissipated(&c.b, x, v);
    CHECK(power >= 0);
    heat += h * power;
  }
  lost = first - energy(&c.b);
  printf("# steps of %g s: %.6g J lost, %.6g J dissipated\n", h, lost, heat);
  CHECK(flesh_integrator_energy_balance(c.integrator)->gain == 0);
  free(x);
  free(v);
  clear(&c);
  return lost / heat;
}

static void what_the_speed_takes_off_is_dissipated(void)
{
  const double coarse = swing(0.004), fine = swing(0.002);
  CHECK_NEAR(fine, 1, 0.01);
  CHECK(fabs(fine - 1) < 0.4 * fabs(coarse - 1));
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(moved_cubes_pull_as_the_closed_form), TEST(short_steps_pull_as_hill_and_thelen),
                   TEST(loaded_cubes_shorten_on_hills_hyperbola), TEST(what_the_speed_takes_off_is_dissipated));
}
