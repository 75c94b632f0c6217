// TEST full memory seconds=60
/* test_saved.c: an integrator's memory is saved as bytes: a motion whose integrator is replaced after every step by a
 * new one that loads what the last one saved has the same bits and counts; invalid data are refused. */
#include <stdlib.h>

#include "effect/effect.h"
#include "flesh/scene.h"
#include "flesh/solver.h"
#include "flesh/state.h"
#include "system/system.h"
#include "test.h"
#include "time/integrator.h"

typedef struct motion {
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_state state;
  int n;
  double h;
} motion;

enum { MOST = 16 };

/* Reads a scene of the data, with further values up to NULL. */
static void begin(const char *path, const char *const *set, motion *m)
{
  int count = 0;
  while (set[count]) count++;
  *m = (motion){0};
  CHECK_OK(flesh_scene_read(path, count, set, &m->scene));
  const flesh_system *system = flesh_scene_system(m->scene);
  m->n = flesh_system_unknowns(system);
  m->h = flesh_scene_times(m->scene)->step;
  m->state.multiplier_count = flesh_system_multiplier_count(system);
  m->state.x = calloc((size_t)m->n + 1, sizeof(double));
  m->state.v = calloc((size_t)m->n + 1, sizeof(double));
  if (m->state.multiplier_count) m->state.multipliers = calloc((size_t)m->state.multiplier_count, sizeof(double));
  flesh_scene_start(m->scene, &m->state);
}

static void make_integrator(motion *m)
{
  const flesh_scene_time *time = flesh_scene_times(m->scene);
  CHECK_OK(flesh_integrator_create(flesh_scene_system(m->scene), time->method, flesh_scene_solver(m->scene),
                                   &m->integrator));
  CHECK_OK(flesh_integrator_set_adaptive(m->integrator, &time->adaptive));
  CHECK_OK(flesh_integrator_set_method_options(m->integrator, &time->options));
  m->integrator->ahead.limit = INFINITY; /* as in a run */
}

static void end(motion *m)
{
  flesh_integrator_destroy(&m->integrator);
  free(m->state.x);
  free(m->state.v);
  free(m->state.multipliers);
  flesh_scene_destroy(&m->scene);
}

static void *saved(const flesh_integrator *integrator, size_t *size)
{
  CHECK_OK(flesh_integrator_save(integrator, 0, NULL, size));
  void *data = malloc(*size);
  CHECK_OK(flesh_integrator_save(integrator, *size, data, size));
  return data;
}

/* Replaces the integrator by a new one that loads its saved data. */
static void replace(motion *m)
{
  size_t size;
  void *data = saved(m->integrator, &size);
  const double *known = flesh_integrator_energies(m->integrator, &m->state);
  const size_t effects = (size_t)flesh_system_effect_count(flesh_scene_system(m->scene)) * sizeof(double);
  double energies[MOST];
  if (known) memcpy(energies, known, effects);
  flesh_integrator_destroy(&m->integrator);
  make_integrator(m);
  CHECK_OK(flesh_integrator_load(m->integrator, data, size));
  free(data);
  const double *loaded = flesh_integrator_energies(m->integrator, &m->state);
  CHECK(!known == !loaded);
  if (known && loaded) CHECK(!memcmp(energies, loaded, effects));
}

static int same(const motion *a, const motion *b)
{
  const size_t bytes = (size_t)a->n * sizeof(double);
  return a->state.t == b->state.t && !memcmp(a->state.x, b->state.x, bytes) && !memcmp(a->state.v, b->state.v, bytes) &&
         !memcmp(a->state.multipliers ? a->state.multipliers : a->state.x,
                 b->state.multipliers ? b->state.multipliers : b->state.x,
                 (size_t)a->state.multiplier_count * sizeof(double));
}

/* Takes both motions through the steps; the second one's integrator is replaced after every `every`-th. */
static void check_motion(const char *path, int steps, int every, const char *const *set, flesh_solve_stats *total)
{
  motion whole, parted;
  int step = 0, differs = 0;
  begin(path, set, &whole);
  begin(path, set, &parted);
  make_integrator(&whole);
  make_integrator(&parted);
  *total = (flesh_solve_stats){0};
  for (; step < steps && !differs; step++) {
    flesh_solve_stats a = {0}, b = {0};
    CHECK_OK(flesh_integrator_step(whole.integrator, &whole.state, whole.h, &a));
    CHECK_OK(flesh_integrator_step(parted.integrator, &parted.state, parted.h, &b));
    if ((step + 1) % every == 0) replace(&parted);
    differs = !same(&whole, &parted) || a.newton != b.newton || a.linear != b.linear || a.linear_single != b.linear_single ||
              a.assemblies != b.assemblies || a.residuals != b.residuals || a.potentials != b.potentials;
    total->newton += a.newton;
    total->assemblies += a.assemblies;
    total->linear_single += a.linear_single;
    total->projections += a.projections;
    total->direct += a.direct;
    total->untanglings += a.untanglings;
    total->multiplier_updates += a.multiplier_updates;
    total->impact_steps += a.impact_steps;
  }
  printf("# %s %s: %d Newton, %d assemblies, %d projections%s\n", path, set[0] ? set[0] : "", total->newton,
         total->assemblies, total->projections, differs ? "; DIFFERS" : "");
  if (differs) printf("# differs after step %d\n", step);
  CHECK(!differs);
  const flesh_energy_balance *a = flesh_integrator_energy_balance(whole.integrator),
                             *b = flesh_integrator_energy_balance(parted.integrator);
  CHECK(a->supplied == b->supplied && a->excess == b->excess && a->gain == b->gain && a->scale == b->scale);
  const int effects = flesh_system_effect_count(flesh_scene_system(whole.scene));
  for (int e = 0; e < effects; e++) {
    const flesh_effect_cost *p = &flesh_integrator_costs(whole.integrator)->effects[e],
                            *q = &flesh_integrator_costs(parted.integrator)->effects[e];
    /* Contact of bodies counts no energy if its last search found nothing near, and a new integrator's search was
     * later. */
    const int searches = flesh_effect_as_barrier(flesh_system_effect(flesh_scene_system(whole.scene), e))->remember != NULL;
    CHECK(p->residuals == q->residuals && p->jacobians == q->jacobians && p->potentials == q->potentials &&
          (searches || p->energies == q->energies));
  }
  end(&whole);
  end(&parted);
}

#define SET(...) ((const char *const[]){__VA_ARGS__, NULL})
#define SWING "../data/scenes/swing_coarse.yaml"

static void every_method_goes_on(void)
{
  flesh_solve_stats total;
  static const char *const methods[] = {"time.method=backward-euler", "time.method=bdf2", "time.method=midpoint",
                                        "time.method=newmark", "time.method=hht", "time.method=generalized-alpha",
                                        "time.method=runge-kutta"};
  for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++) check_motion(SWING, 20, 1, SET(methods[k]), &total);
  static const char *const controlled[] = {"time.method=backward-euler", "time.method=bdf2", "time.method=newmark",
                                           "time.method=generalized-alpha"};
  for (size_t k = 0; k < sizeof controlled / sizeof controlled[0]; k++)
    check_motion(SWING, 20, 1, SET(controlled[k], "time.adaptive=true", "time.tolerance=1e-2"), &total);
  /* Steps small enough for matrices and factors to be reused, individually and alternating. */
  for (int every = 1; every < 6; every += 2) {
    check_motion(SWING, 40, every, SET("time.step=1/480"), &total);
    CHECK(total.assemblies < total.newton);
  }
}

/* The length of the next step, and the data that determine it, are stored. */
static void steps_that_errors_choose_go_on(void)
{
  flesh_solve_stats total;
  for (int every = 1; every < 4; every++)
    check_motion(SWING, 20, every, SET("time.method=runge-kutta", "time.tolerance=1e-4"), &total);
  check_motion(SWING, 20, 1, SET("time.method=newmark", "time.adaptive=true", "time.tolerance=1e-3"), &total);
  check_motion("../data/scenes/twist.yaml", 8, 1, SET("time.method=runge-kutta", "time.tolerance=1e-1"), &total);
  check_motion("../data/scenes/jelly_drop.yaml", 14, 1,
               SET("start.velocity=[0.4, 0, -5]", "time.method=runge-kutta", "time.tolerance=1e-1"), &total);
  CHECK(total.projections > 0);
  /* Whether the body is held determines how long momentum errors by contact last. */
  check_motion(SWING, 3, 1,
               SET("effects=[inertia: {}, gravity: {}, pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}, contact: {plane: {point: "
                   "[0, 0, -0.03]}, friction: 0.5}]", "start={velocity: [0, 0, -5]}", "body.material.young=4e5", "time.method=runge-kutta", "time.tolerance=1e-4"), &total);
  check_motion(SWING, 4, 1, SET("body.element=tet10-mean", "body.material.poisson=0.5", "time.method=runge-kutta",
                                "time.tolerance=1e-3"), &total);
  CHECK(total.multiplier_updates > 0);
}

static void every_solver_goes_on(void)
{
  flesh_solve_stats total;
  static const char *const solvers[] = {"solver.linear_solver=klu", "solver.preconditioner=two-level",
                                        "solver.preconditioner=jacobi", "solver.preconditioner=none",
                                        "solver.line_search=none", "solver.line_search=residual"};
  for (size_t k = 0; k < sizeof solvers / sizeof solvers[0]; k++)
    check_motion(SWING, 10, 1, SET(solvers[k], "time.step=1/240"), &total);
  check_motion(SWING, 4, 1, SET("solver.preconditioner=none", "solver.max_linear=40"), &total);
  CHECK(total.direct > 0);
  /* A long solve before the state was saved ends later solves sooner. */
  check_motion(SWING, 10, 1, SET("solver.preconditioner=none", "body.material.poisson=0.4999"), &total);
  CHECK(total.direct > 0 && total.linear < 5000);
}

static void several_threads_go_on(void)
{
  flesh_solve_stats total;
  check_motion(SWING, 10, 1, SET("solver.threads=2", "time.step=1/240"), &total);
}

static void bodies_that_keep_volume_go_on(void)
{
  flesh_solve_stats total;
  check_motion(SWING, 4, 1, SET("body.element=tet10-mean", "body.material.poisson=0.4995"), &total);
  for (int m = 0; m < 2; m++) {
    check_motion(SWING, 4, 1,
                 SET(m ? "time.method=midpoint" : "time.method=backward-euler", "body.element=tet10-mean",
                     "body.material.poisson=0.5"),
                 &total);
    CHECK(total.multiplier_updates > 0);
  }
}

static void contact_and_violence_go_on(void)
{
  flesh_solve_stats total;
  check_motion("../data/scenes/jelly_drop.yaml", 12, 1, SET("start.velocity=[0.4, 0, -3]"), &total);
  check_motion("../data/scenes/jelly_drop.yaml", 12, 1, SET("start.velocity=[0.4, 0, -3]", "time.method=midpoint"), &total);
  /* Two bodies that are near, but do not touch yet, and then meet. */
  static const char *const methods[] = {"time.method=bdf2", "time.method=newmark", "time.method=runge-kutta"};
  for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++)
    for (int every = 1; every < 4; every += 2)
      check_motion("../data/scenes/two_bodies.yaml", 30, every, SET(methods[k], "time.step=1/120"), &total);
  check_motion("../data/scenes/twist.yaml", 3, 1, SET("time.step=1/60"), &total);
  CHECK(total.projections > 0);
  check_motion("../data/scenes/viscous_spin.yaml", 6, 1, SET("body.mesh=../data/meshes/bar_8x2x2.mesh"), &total);
}

static void equilibria_go_on(void)
{
  flesh_solve_stats total;
  check_motion("../data/scenes/loaded_bar.yaml", 4, 1, SET("body.mesh=../data/meshes/bar_8x2x2.mesh"), &total);
}

/* IDA's history is not restored: the motion agrees within the tolerance, and that is reported. */
static void adaptive_agrees_within_the_tolerance(void)
{
  motion whole, parted;
  static const char *const set[] = {"time.method=ida", "time.tolerance=1e-3", NULL};
  double off = 0;
  begin(SWING, set, &whole);
  begin(SWING, set, &parted);
  make_integrator(&whole);
  make_integrator(&parted);
  CHECK(flesh_integrator_saves_all(parted.integrator));
  for (int step = 0; step < 30; step++) {
    CHECK_OK(flesh_integrator_step(whole.integrator, &whole.state, whole.h, NULL));
    CHECK_OK(flesh_integrator_step(parted.integrator, &parted.state, parted.h, NULL));
    CHECK(!flesh_integrator_saves_all(parted.integrator));
    if (step % 10 == 9) replace(&parted);
    for (int d = 0; d < whole.n; d++) off = fmax(off, fabs(whole.state.x[d] - parted.state.x[d]));
  }
  printf("# off by %.2g of the length at most, tolerance 1e-3\n", off / 4);
  CHECK(off > 0);
  CHECK_BELOW(off / 4, 1e-3);
  end(&whole);
  end(&parted);
}

/* Tries to load `size` bytes into an integrator of the scene; returns the message. */
static void check_refused(const char *path, const char *const *set, const void *data, size_t size, int wanted,
                          const char *words)
{
  motion m;
  begin(path, set, &m);
  make_integrator(&m);
  const int status = flesh_integrator_load(m.integrator, data, size);
  CHECK(status == wanted);
  CHECK_TEXT(flesh_error_text(), words);
  CHECK_OK(flesh_integrator_step(m.integrator, &m.state, m.h, NULL)); /* nothing has changed */
  end(&m);
}

static void what_does_not_fit_is_refused(void)
{
  motion m;
  size_t size, less;
  begin(SWING, SET(NULL), &m);
  make_integrator(&m);
  CHECK_OK(flesh_integrator_step(m.integrator, &m.state, m.h, NULL));
  unsigned char *data = saved(m.integrator, &size);
  CHECK(flesh_integrator_save(m.integrator, size - 1, data, &less) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "there is room for");
  check_refused(SWING, SET("time.method=bdf2"), data, size, FLESH_ERR_ARGUMENT, "saved by method backward-euler");
  check_refused(SWING, SET("solver.linear_solver=klu"), data, size, FLESH_ERR_ARGUMENT, "another linear_solver");
  check_refused(SWING, SET("body.refine=1"), data, size, FLESH_ERR_ARGUMENT, "this system has");
  check_refused(SWING, SET("effects.gravity=null", "effects.viscosity.shear=1"), data, size, FLESH_ERR_ARGUMENT,
                "another mesh or other effects");
  check_refused(SWING, SET(NULL), data, 40, FLESH_ERR_FILE, "no saved history");
  check_refused(SWING, SET(NULL), data, size - 1, FLESH_ERR_FILE, "it must have");
  for (int k = 0; k < 40; k++) {
    const size_t at = 8 + (size_t)k * 7919 * 13 % (size - 8);
    data[at] ^= 4;
    motion other;
    begin(SWING, SET(NULL), &other);
    make_integrator(&other);
    CHECK(flesh_integrator_load(other.integrator, data, size) < 0);
    end(&other);
    data[at] ^= 4;
  }
  data[16] ^= 1; /* the sizes of numbers */
  check_refused(SWING, SET(NULL), data, size, FLESH_ERR_FILE, "other numbers");
  data[16] ^= 1;
  data[24] ^= 1; /* the version */
  check_refused(SWING, SET(NULL), data, size, FLESH_ERR_FILE, "goes on from its own only");
  free(data);
  end(&m);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(every_method_goes_on), TEST(steps_that_errors_choose_go_on),
                   TEST(every_solver_goes_on),
                   TEST_OF_THREADS(several_threads_go_on), TEST(bodies_that_keep_volume_go_on),
                   TEST(contact_and_violence_go_on), TEST(equilibria_go_on),
                   TEST(adaptive_agrees_within_the_tolerance), TEST(what_does_not_fit_is_refused));
}
