// TEST quick seconds=60
/* test_muscle.c: a cube of muscle held at a length, shortening under a load and stretched while active follows closed
 * forms; a nearly incompressible one preserves its volume; the energy supplied by an activation is the work done; a
 * scrambled body of active muscle finds its equilibrium. */
#include <stdlib.h>

#include "body.h"
#include "methods.h"
#include "pull.h"
#include "test.h"

static const double soft = 4e4, stiff = 6e5, peak = 3e5, optimal = 1.25; /* Pa; Pa */
static const double thickness = 0.8; /* length of the cube along y, m; 1 along x and z */

static double blemker(double l) { return 1 - 4 * (1 - l) * (1 - l); } /* Active tension at |1 - l| <= 0.4. */
static double thelen(double l) { return exp(-(l - 1) * (l - 1) / 0.45); }

/* Passive tension at l > 1.06, beyond both toes. */
static double passive(int curve, double l)
{
  return curve ? (exp((l - 1) * 5 / 0.6) - 1) / (exp(5) - 1) : 0.05 * (exp(6.6 * (l - 1)) - 1);
}

/* Returns the first Piola-Kirchhoff stress of the fibres. */
static double tension(int curve, double activation, double stretch)
{
  const double l = stretch / optimal;
  return peak / optimal * (activation * (curve ? thelen(l) : blemker(l)) + (l > 1 ? passive(curve, l) : 0));
}

static void add(test_body *b, flesh_effect *effect) { CHECK_OK(flesh_system_add_effect(b->system, &effect)); }

static void add_muscle(test_body *b, int curve, const double direction[3], const flesh_amplitude *activation)
{
  const int tets = flesh_mesh_tet_count(b->mesh);
  double *fibres = malloc(3 * (size_t)tets * sizeof *fibres);
  flesh_fibre fibre;
  flesh_effect *effect = NULL;
  for (int d = 0; d < 3 * tets; d++) fibres[d] = direction[d % 3];
  CHECK_OK(flesh_fibre_default((flesh_fibre_curve)curve, peak, &fibre));
  fibre.optimal_stretch = optimal;
  CHECK_OK(flesh_effect_muscle(&b->body, tets, NULL, fibres, &fibre, activation, &effect));
  add(b, effect);
  free(fibres);
}

static flesh_mesh *box_of(int order, int nx, int n, double x)
{
  flesh_mesh *four = test_box(nx, n, n, x, thickness, 1), *ten = NULL;
  if (order == 1) return four;
  CHECK_OK(flesh_mesh_raise_order(four, &ten));
  flesh_mesh_destroy(&four);
  return ten;
}

static flesh_material flesh_of(double young, double poisson)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, poisson, &material));
  return material;
}

/* Makes a cube free to slide on the planes x = 0, y = 0, z = 0; fibres along x. */
static void make_cube(int order, int curve, double young, double poisson, const flesh_amplitude *activation, test_body *b)
{
  CHECK_OK(test_body_create(box_of(order, 2, 2, 1), flesh_of(young, poisson), 1000, FLESH_MASS_LUMPED, 0, b));
  for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
  add_muscle(b, curve, (double[]){2, 0, 0}, activation);
}

/* Returns the reaction of the face x = 1, over its area. */
static double reaction(const test_body *b, double t)
{
  double *r = calloc((size_t)b->n, sizeof *r), sum = 0;
  const flesh_point point = flesh_point_at(t, b->state.x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  for (int i = 0; i < b->n / 3; i++)
    if (fabs(flesh_mesh_positions(b->mesh)[3 * i] - 1) < 1e-9) sum += r[3 * i];
  free(r);
  return sum / thickness;
}

static flesh_integrator *statics_of(const test_body *b)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(1e-12);
  options.linear_tolerance = 1e-6;
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_STATIC, &options, &integrator));
  return integrator;
}

/* Computes a corner's stretches along x and y. */
static void stretches(const test_body *b, double *along, double *across)
{
  for (int i = 0; i < b->n / 3; i++) {
    const double *X = flesh_mesh_positions(b->mesh) + 3 * i, *x = b->state.x + 3 * i;
    if (X[0] > 1 - 1e-9 && X[1] > thickness - 1e-9 && X[2] > 1 - 1e-9) *along = x[0], *across = x[1] / thickness;
  }
}

static const flesh_curve_point rise[] = {{0, 0.2}, {1, 1}};
static const flesh_amplitude rising = {.count = 2, .points = rise, .from = -INFINITY, .until = INFINITY};

/* Held at its rest length while the activation rises; and stretched by a half at a rising activation, beyond the
 * optimum, where the active tension falls and fibres also resist passively. The material is stiff enough for the
 * falling tension, so that the stretch stays uniform. */
static void held_and_stretched_cubes_pull_as_the_closed_form(void)
{
  const flesh_keyframe still[] = {{0, {0}, {0}}}, pulled[] = {{0, {0}, {0}}, {1, {0.5, 0, 0}, {0}}};
  for (int kind = 0; kind < 2; kind++)
    for (int order = 1; order <= 2; order++)
      for (int curve = 0; curve < FLESH_FIBRE_CURVE_COUNT; curve++) {
        test_body b;
        double worst = 0;
        make_cube(order, curve, stiff, 0.45, &rising, &b);
        const flesh_motion motion = {.count = kind ? 2 : 1, .keyframes = kind ? pulled : still};
        CHECK_OK(test_body_hold(&b, 0, 1, FLESH_AXIS_X, &motion, -INFINITY, INFINITY));
        CHECK_OK(flesh_system_finalize(b.system));
        flesh_integrator *integrator = statics_of(&b);
        for (int k = 0; k < 4; k++) {
          double side, along = 0, across = 0;
          CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.25, NULL));
          const double stretch = 1 + kind * 0.5 * b.state.t, activation = 0.2 + 0.8 * b.state.t;
          const double own = uniaxial(&b.material, stretch, &side), right = own + tension(curve, activation, stretch);
          if (kind && fabs(stretch / optimal - 1.05) < 0.05) continue; /* the toe of the passive part */
          stretches(&b, &along, &across);
          worst = fmax(worst, fabs(reaction(&b, b.state.t) / right - 1));
          CHECK_NEAR(across, side, 1e-8);
          CHECK_NEAR(along, stretch, 1e-12);
        }
        printf("# %s, order %d, %s: force off by %.2g\n", kind ? "eccentric" : "isometric", order,
               flesh_fibre_curve_name((flesh_fibre_curve)curve), worst);
        CHECK_BELOW(worst, 1e-8);
        flesh_integrator_destroy(&integrator);
        test_body_destroy(&b);
      }
}

/* Returns the stretch at which the cube bears a pull. */
static double isotonic_stretch(const flesh_material *m, int curve, double activation, double pull)
{
  double low = 0.52, high = 1.2, mid = 1, side; /* of l > 0.4 */
  for (int k = 0; k < 100; k++) {
    mid = (low + high) / 2;
    *(uniaxial(m, mid, &side) + tension(curve, activation, mid) > pull ? &high : &low) = mid;
  }
  return mid;
}

static const flesh_curve_point weak[] = {{0, 0}, {1, 0.3}};
static const flesh_amplitude weakly = {.count = 2, .points = weak, .from = -INFINITY, .until = INFINITY};

/* The cube has four-node tets at nu = 0.45, or ten-node tets at nu = 0.499, whose volume changes only as the bulk
 * modulus allows. */
static void a_loaded_cube_shortens_as_the_closed_form(void)
{
  const double pull = 2e4;
  for (int order = 1; order <= 2; order++)
    for (int curve = 0; curve < FLESH_FIBRE_CURVE_COUNT; curve++) {
      test_body b;
      make_cube(order, curve, soft, order == 1 ? 0.45 : 0.499, &weakly, &b);
      add_pull(&b, pull);
      CHECK_OK(flesh_system_finalize(b.system));
      flesh_integrator *integrator = statics_of(&b);
      double worst = 0, along = 0, across = 0, side, J = 1;
      for (int k = 0; k < 3; k++) {
        CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 3, NULL));
        stretches(&b, &along, &across);
        const double right = isotonic_stretch(&b.material, curve, 0.3 * b.state.t, pull);
        uniaxial(&b.material, right, &side);
        J = along * across * across;
        worst = fmax(worst, fmax(fabs(along - right), fabs(J - right * side * side)));
      }
      printf("# isotonic, order %d, %s: stretch %.6f, J - 1 = %.2g, off by %.2g\n", order,
             flesh_fibre_curve_name((flesh_fibre_curve)curve), along, J - 1, worst);
      if (order == 2) CHECK_BELOW(fabs(J - 1), 0.002);
      CHECK_BELOW(worst, 1e-8);
      CHECK(along < 0.8);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

/* A bar with both ends clamped, oblique fibres and full activation at nu = 0.499. */
static void volume_is_kept(void)
{
  double drift[3];
  for (int order = 1; order <= 2; order++) {
    test_body b;
    CHECK_OK(test_body_create(box_of(order, 6, 3, 2), flesh_of(soft, 0.499), 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
    add_muscle(&b, 0, (double[]){1, 0.3, 0.2}, &rising);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_integrator *integrator = NULL;
    flesh_solver_options options = test_options(1e-7);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, NULL));
    drift[order] = fabs(flesh_mesh_volume(b.mesh, b.state.x) / (2 * thickness) - 1);
    double along = INFINITY;
    for (int i = 0; i < b.n / 3; i++)
      if (flesh_mesh_positions(b.mesh)[3 * i] > 2 - 1e-9) along = fmin(along, b.state.x[3 * i] / 2);
    printf("# order %d: volume off by %.2g at a stretch of %.3f, smallest J %.3f\n", order, drift[order], along,
           flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, NULL));
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  CHECK_BELOW(drift[2], 0.003);
}

/* Makes a bar hanging on a wall that twitches: the activation rises, holds and falls. */
static void make_twitch(test_body *b)
{
  static const flesh_curve_point twitch[] = {{0, 0}, {0.1, 0.5}, {0.2, 0.5}, {0.3, 0.1}};
  CHECK_OK(test_body_create(box_of(1, 3, 2, 1), flesh_of(soft, 0.4), 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_hold(b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  add_muscle(b, 0, (double[]){1, 0.2, 0}, &(flesh_amplitude){.count = 4, .points = twitch, .smooth = 1,
                                                             .from = -INFINITY, .until = INFINITY});
  CHECK_OK(test_body_gravity(b, 9.81, 0, 0));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Returns the energy supplied minus the gain of kinetic, elastic, muscle and load energy, over the energy supplied and
 * removed. */
static double imbalance(flesh_method method, double h, double *put_in, double *gain)
{
  test_body b;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options = test_options(1e-8);
  double energies[4], worst = 0, before = 0;
  make_twitch(&b);
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  *put_in = 0;
  for (int k = 0; k <= lround(0.4 / h); k++) {
    if (k) CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    const flesh_point point = flesh_point_at(b.state.t, b.state.x, b.state.v, b.state.v);
    double sum = 0;
    CHECK_OK(flesh_system_energies(b.system, &point, energies));
    for (int e = 0; e < 4; e++) sum += energies[e];
    if (!k) before = sum;
    const double supplied = k ? flesh_integrator_energy_balance(integrator)->supplied : 0;
    *put_in = fmax(*put_in, supplied);
    worst = fmax(worst, fabs(sum - before - supplied));
  }
  *gain = flesh_integrator_energy_balance(integrator)->gain;
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return worst;
}

/* The midpoint rule keeps the balance to second order in the step; no method creates energy of its own. */
static void energy_put_in_is_work_done(void)
{
  double put_in, gain;
  const double coarse = imbalance(FLESH_METHOD_MIDPOINT, 1. / 200, &put_in, &gain),
               fine = imbalance(FLESH_METHOD_MIDPOINT, 1. / 400, &put_in, &gain);
  printf("# of %.6g J put in %.3g J are missing at h = 1/200 s, %.3g J at 1/400 s\n", put_in, coarse, fine);
  CHECK(put_in > 100);
  CHECK_BELOW(fine, 1e-3 * put_in);
  CHECK_BELOW(fine, 0.35 * coarse);
  for_every_method(m, TEST_FIXED_STEPS) {
    const double missing = imbalance(m, 1. / 100, &put_in, &gain);
    printf("# %s: %.3g of %.4g J missing, gain %.2g\n", flesh_method_name(m), missing, put_in, gain);
    CHECK_BELOW(gain, 0.02);
  }
}

/* From tets scrambled by more than their edges it returns to the state that it reaches from rest. */
static void scrambled_muscle_finds_its_equilibrium(void)
{
  double *right = NULL;
  for (int trial = 0; trial < 2; trial++) {
    test_body b;
    CHECK_OK(test_body_create(box_of(1, 4, 3, 2), flesh_of(soft, 0.4), 1000, FLESH_MASS_LUMPED, 0, &b));
    CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
    add_muscle(&b, trial % 2, (double[]){1, 0.4, 0}, NULL);
    CHECK_OK(flesh_system_finalize(b.system));
    right = malloc((size_t)b.n * sizeof *right);
    for (int start = 0; start < 2; start++) {
      memcpy(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof(double));
      b.state.t = 0;
      int inverted = 0;
      if (start) test_jitter(b.n, 0.6, 4, b.state.x);
      for (int i = 0; i < b.n / 3; i++)
        if (flesh_mesh_positions(b.mesh)[3 * i] == 0)
          memcpy(b.state.x + 3 * i, flesh_mesh_positions(b.mesh) + 3 * i, 3 * sizeof(double));
      flesh_mesh_jacobians(b.mesh, b.state.x, NULL, NULL, &inverted);
      flesh_integrator *integrator = NULL;
      flesh_solver_options options = test_options(1e-9);
      CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, NULL));
      flesh_integrator_destroy(&integrator);
      if (start) {
        printf("# from %d inverted tets: off by %.2g m\n", inverted, test_distance(b.n, b.state.x, right));
        CHECK(inverted > 20);
        CHECK_BELOW(test_distance(b.n, b.state.x, right), 1e-6);
      } else {
        memcpy(right, b.state.x, (size_t)b.n * sizeof *right);
      }
    }
    free(right);
    test_body_destroy(&b);
  }
}

static void bad_muscles_are_refused(void)
{
  test_body b;
  flesh_fibre fibre;
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), flesh_of(soft, 0.4), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(flesh_fibre_default(FLESH_FIBRE_BLEMKER, peak, &fibre));
  double fibres[18] = {1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0};
  const int twice[] = {1, 1}, far[] = {0, 6};
  CHECK(flesh_effect_muscle(&b.body, 5, NULL, fibres, &fibre, NULL, &effect) == FLESH_ERR_ARGUMENT && !effect);
  CHECK_TEXT(flesh_error_text(), "a muscle of 5 tets; the mesh has 6");
  CHECK(flesh_effect_muscle(&b.body, 2, twice, fibres, &fibre, NULL, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "tets[1] of a muscle is 1; tets must ascend within 0 to 5");
  CHECK(flesh_effect_muscle(&b.body, 2, far, fibres, &fibre, NULL, &effect) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_effect_muscle(&b.body, 0, far, fibres, &fibre, NULL, &effect) == FLESH_ERR_ARGUMENT);
  const flesh_curve_point high[] = {{0, 0}, {1, 1.5}};
  CHECK(flesh_effect_muscle(&b.body, 6, NULL, fibres, &fibre,
                            &(flesh_amplitude){.count = 2, .points = high, .from = 0, .until = 1}, &effect) ==
        FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the activation is 1.5 at 1 s; it must be from 0 to 1");
  fibres[4] = INFINITY;
  CHECK(flesh_effect_muscle(&b.body, 6, NULL, fibres, &fibre, NULL, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the fibre of tet 1 is (1, inf, 0); it must be finite");
  CHECK_OK(flesh_system_finalize(b.system));
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(held_and_stretched_cubes_pull_as_the_closed_form),
                   TEST(a_loaded_cube_shortens_as_the_closed_form), TEST(volume_is_kept),
                   TEST(energy_put_in_is_work_done), TEST(scrambled_muscle_finds_its_equilibrium),
                   TEST(bad_muscles_are_refused));
}
