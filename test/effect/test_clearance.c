// TEST quick seconds=60
/* test_clearance.c: a far obstacle is not evaluated, and one that comes near, or that a body comes near to, acts as if
 * it were always evaluated, with the same bits, whoever moves, however fast, and with whatever steps. */
#include <stdlib.h>

#include "body.h"
#include "effect/private.h"
#include "test.h"

enum { PLANE, SPHERE, CAPSULE, MESH, SHAPES };
static const char *const names[SHAPES] = {"plane", "sphere", "capsule", "mesh"};

/* About 3 m below the unit cube at the origin. */
static flesh_obstacle *make(int shape)
{
  flesh_obstacle *o = NULL;
  if (shape == PLANE) CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, -3}, (const double[]){0.1, 0, 1}, &o));
  if (shape == SPHERE) CHECK_OK(flesh_obstacle_sphere((const double[]){0.4, 0.6, -4}, 1, &o));
  if (shape == CAPSULE)
    CHECK_OK(flesh_obstacle_capsule((const double[]){-2, 0.4, -3.5}, (const double[]){3, 0.6, -3.4}, 0.5, &o));
  if (shape == MESH) {
    const double X[] = {-9, -9, -3, 9, -9, -3.2, 9, 9, -3, -9, 9, -3.2};
    CHECK_OK(flesh_obstacle_mesh(4, X, 2, (const int[]){0, 1, 2, 0, 2, 3}, &o));
  }
  return o;
}

/* Contact that counts its evaluations; `always`: without a clearance. */
static const flesh_effect_operations *contact;
static long evaluations, looks;

static int counted_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  evaluations++;
  return contact->residual(effect, point, r);
}

static int counted_evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                            double *phi, double *magnitude)
{
  evaluations++;
  return contact->library->evaluate(effect, point, shift, r, phi, magnitude);
}

static double counted_clearance(const flesh_effect *effect, double t, const double *x)
{
  looks++;
  return contact->barrier->clearance(effect, t, x);
}

typedef struct run {
  test_body b;
  flesh_integrator *integrator;
  flesh_effect_operations operations;
  flesh_effect_private library;
  flesh_effect_barrier barrier;
} run;

/* Makes a cube with the velocity v; the obstacle follows `motion` (NULL: it does not move). */
static void begin(flesh_method method, int shape, const flesh_motion *motion, const double v[3], int always, run *r)
{
  flesh_obstacle *obstacle = make(shape);
  flesh_effect *effect = NULL;
  flesh_contact_options options;
  const flesh_solver_options solver = test_options(1e-6);
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e6, 0.4, &material));
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &r->b));
  if (motion) CHECK_OK(flesh_obstacle_move(obstacle, motion));
  flesh_contact_options_default(&options);
  options.friction = 0.3;
  options.slip_speed = 0.01;
  CHECK_OK(flesh_effect_obstacle_contact(&r->b.body, &options, &obstacle, &effect));
  contact = effect->operations;
  r->operations = *contact;
  r->operations.residual = counted_residual;
  r->library = *contact->library;
  r->library.evaluate = counted_evaluate;
  r->operations.library = &r->library;
  r->barrier = *contact->barrier;
  r->barrier.clearance = always ? NULL : counted_clearance;
  r->operations.barrier = &r->barrier;
  effect->operations = &r->operations;
  CHECK_OK(flesh_system_add_effect(r->b.system, &effect));
  CHECK_OK(flesh_system_finalize(r->b.system));
  for (int d = 0; d < r->b.n; d++) r->b.state.v[d] = v[d % 3];
  CHECK_OK(flesh_integrator_create(r->b.system, method, &solver, &r->integrator));
  evaluations = looks = 0;
}

static void clear(run *r)
{
  flesh_integrator_destroy(&r->integrator);
  test_body_destroy(&r->b);
}

/* Two runs, one of which always evaluates contact, are equal to the last bit; and the obstacle stops or pushes the
 * body. */
static void compare(const char *what, flesh_method method, int shape, const flesh_motion *motion, const double v[3],
                    double h, double growth, int steps)
{
  run own, always;
  begin(method, shape, motion, v, 1, &always);
  begin(method, shape, motion, v, 0, &own);
  long asked[2] = {0, 0};
  int differ = 0, failed = 0;
  double fastest = 0;
  for (int k = 0; k < steps && !differ && !failed; k++, h *= growth) {
    evaluations = 0;
    failed |= flesh_integrator_step(always.integrator, &always.b.state, h, NULL) != FLESH_OK;
    asked[1] += evaluations;
    evaluations = 0;
    failed |= flesh_integrator_step(own.integrator, &own.b.state, h, NULL) != FLESH_OK;
    asked[0] += evaluations;
    differ = memcmp(own.b.state.x, always.b.state.x, (size_t)own.b.n * sizeof(double)) ||
             memcmp(own.b.state.v, always.b.state.v, (size_t)own.b.n * sizeof(double));
    for (int d = 2; d < own.b.n; d += 3) fastest = fmax(fastest, own.b.state.v[d] - v[2]);
  }
  printf("# %s, %s, %s: contact asked %ld times of %ld, %ld looks in %d steps; pushed by %.3g m/s\n", what,
         names[shape], flesh_method_name(method), asked[0], asked[1], looks, steps, fastest);
  CHECK(!differ && !failed);
  CHECK(asked[0] < asked[1] && looks > 0);
  CHECK(fastest > 1);
  clear(&own);
  clear(&always);
}

static void what_comes_near_is_met(void)
{
  const flesh_keyframe lift[] = {{0, {0}, {0}}, {0.1, {0}, {0}}, {0.4, {0, 0, 3.5}, {0}}};
  const flesh_keyframe turn[] = {{0, {0}, {0}}, {0.4, {0, 0, 3.3}, {0.1, 0, 0.5}}};
  const flesh_motion lifted = {.count = 3, .keyframes = lift},
                     turned = {.count = 2, .keyframes = turn, .smooth = 1, .centre = {2, 0, -3}};
  for (int shape = 0; shape < SHAPES; shape++) {
    compare("thrown", FLESH_METHOD_BACKWARD_EULER, shape, NULL, (double[]){1, 0, -20}, 0.01, 1, 25);
    compare("thrown at once", FLESH_METHOD_BACKWARD_EULER, shape, NULL, (double[]){1, 0, -200}, 0.02, 1, 3);
    compare("growing steps", FLESH_METHOD_BACKWARD_EULER, shape, NULL, (double[]){0, 0, -10}, 1e-3, 1.3, 18);
    compare("thrown", FLESH_METHOD_MIDPOINT, shape, NULL, (double[]){1, 0, -20}, 0.005, 1, 40);
    compare("lifted", FLESH_METHOD_BACKWARD_EULER, shape, &lifted, (double[]){0, 0, 0}, 0.01, 1, 40);
    compare("turned", FLESH_METHOD_BDF2, shape, &turned, (double[]){0, 0, 0}, 0.01, 1, 40);
  }
}

/* Contact is not evaluated while it is far, and its distance is checked a few times while the body moves by 2 m. */
static void what_stays_far_is_not_asked(void)
{
  for (int shape = 0; shape < SHAPES; shape++) {
    run r;
    begin(FLESH_METHOD_BACKWARD_EULER, shape, NULL, (double[]){2, 0, -0.5}, 0, &r);
    for (int k = 0; k < 100; k++) CHECK_OK(flesh_integrator_step(r.integrator, &r.b.state, 0.01, NULL));
    printf("# %s: asked %ld times, %ld looks in 100 steps\n", names[shape], evaluations, looks);
    CHECK(evaluations == 0 && looks <= 6);
    /* For another state the distance is computed anew. */
    for (int d = 2; d < r.b.n; d += 3) r.b.state.x[d] += 5, r.b.state.v[d] = -300;
    const long before = looks;
    for (int k = 0; k < 4; k++) CHECK_OK(flesh_integrator_step(r.integrator, &r.b.state, 0.01, NULL));
    CHECK(looks > before && evaluations > 0);
    clear(&r);
  }
}

/* At random positions and times: while body and obstacle have approached by less than the clearance, nothing acts or
 * limits a step. */
static void clearances_are_bounds(void)
{
  unsigned long long random = 5;
  for (int shape = 0; shape < SHAPES; shape++) {
    int held = 0, wrong = 0, trials = 0;
    for (int motions = 0; motions < 20; motions++) {
      flesh_keyframe keys[2] = {{.t = 0}, {.t = 1}};
      run r;
      for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) {
          keys[k].translation[c] = 2 * test_uniform(&random) - 1;
          keys[k].rotation[c] = test_uniform(&random) - 0.5;
        }
      const flesh_motion motion = {.count = 2, .keyframes = keys, .centre = {0.5, 0.5, -1}};
      begin(FLESH_METHOD_BACKWARD_EULER, shape, &motion, (double[]){0, 0, 0}, 0, &r);
      const flesh_effect *effect = flesh_system_effect(r.b.system, flesh_system_effect_count(r.b.system) - 1);
      double *x = malloc((size_t)r.b.n * sizeof *x), *v = calloc((size_t)r.b.n, sizeof *v);
      for (int inner = 0; inner < 100; inner++, trials++) {
        const double t0 = test_uniform(&random), t1 = t0 + 0.3 * (test_uniform(&random) - 0.5);
        double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9}, move = 0, shift[3];
        for (int c = 0; c < 3; c++) shift[c] = 2 * (test_uniform(&random) - 0.5);
        for (int d = 0; d < r.b.n; d++) {
          x[d] = flesh_mesh_positions(r.b.mesh)[d] + shift[d % 3];
          low[d % 3] = fmin(low[d % 3], x[d]);
          high[d % 3] = fmax(high[d % 3], x[d]);
        }
        const double room = contact->barrier->clearance(effect, t0, x), carried = contact->barrier->approach(effect, t0, t1, low, high);
        const double most = 3 * test_uniform(&random);
        for (int i = 0; i < r.b.n; i += 3) {
          double square = 0;
          for (int c = 0; c < 3; c++) {
            const double d = (c == 2 ? -1 : 0.2) * most * test_uniform(&random);
            r.b.state.x[i + c] = x[i + c] + d;
            square += d * d;
          }
          move = fmax(move, sqrt(square));
        }
        if (!(move + carried < room)) continue;
        held++;
        const flesh_point point = flesh_point_at(t1, r.b.state.x, v, v);
        double energy = 0;
        wrong += contact->energy(effect, &point, &energy) != FLESH_OK || energy != 0;
        wrong += contact->barrier->max_feasible_step(effect, NULL, NULL, t0, x, t1, r.b.state.x) < 1;
      }
      free(x);
      free(v);
      clear(&r);
    }
    printf("# %s: %d of %d trials within the clearance, %d wrong\n", names[shape], held, trials, wrong);
    CHECK(wrong == 0);
    CHECK(held > trials / 10 && held < 9 * trials / 10);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_comes_near_is_met), TEST(what_stays_far_is_not_asked),
                   TEST(clearances_are_bounds));
}
