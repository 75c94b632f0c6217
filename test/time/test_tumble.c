// TEST full builds=plain seconds=5
/* test_tumble.c: jelly that tumbles down stairs by Runge-Kutta methods with a tolerance of a tenth: its cost, and that
 * it gains no energy and passes through nothing. */
#include <stdlib.h>

#include "flesh/scene.h"
#include "test.h"

enum { RUNS = 9 };

typedef struct tumble {
  const flesh_system *system;
  double *zeros;
  double least, gain, fastest; /* J */
  int inside;
} tumble;

static int see(void *data, const flesh_internal_step *step)
{
  tumble *self = data;
  double energies[8], energy = 0;
  const flesh_point point = flesh_point_at(step->t, step->state->x, step->state->v, self->zeros);
  CHECK_OK(flesh_system_energies(self->system, &point, energies));
  for (int k = 0; k < flesh_system_effect_count(self->system); k++) energy += energies[k];
  self->least = fmin(self->least, energy);
  self->gain = fmax(self->gain, energy - self->least);
  self->fastest = fmax(self->fastest, energies[0]); /* inertia */
  self->inside += flesh_system_check(self->system, step->t, step->state->x) != FLESH_OK;
  return FLESH_OK;
}

/* Its motion bifurcates at edges, so that neighbouring tolerances scatter: the mean counts. */
static void jelly_tumbles_at_a_tenth(void)
{
  const char *const set[] = {"time.method=runge-kutta", "time.end=0.6"};
  flesh_scene *scene = NULL;
  CHECK_OK(flesh_scene_read("../data/scenes/jelly_drop.yaml", 2, set, &scene));
  const flesh_scene_time *time = flesh_scene_times(scene);
  tumble seen = {.system = flesh_scene_system(scene)};
  const int n = flesh_system_unknowns(seen.system);
  double *x = calloc(3 * (size_t)n, sizeof *x);
  seen.zeros = x + 2 * n;
  int newton = 0;
  for (int k = 0; k < RUNS; k++) {
    flesh_integrator *integrator = NULL;
    flesh_state state = {.x = x, .v = x + n};
    flesh_solve_stats stats = {0};
    flesh_adaptive_options adaptive = time->adaptive;
    adaptive.control = 1;
    adaptive.tolerance = 0.15 - 0.01 * k;
    adaptive.observe = see;
    adaptive.observe_data = &seen;
    seen.least = INFINITY;
    seen.gain = seen.fastest = 0;
    flesh_scene_start(scene, &state);
    CHECK_OK(flesh_integrator_create(seen.system, time->method, flesh_scene_solver(scene), &integrator));
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
    CHECK_OK(flesh_integrator_step(integrator, &state, time->end, &stats));
    printf("# tolerance %.2f: %d steps, %d Newton, %d backtracks, gain %.2g of %.2g J\n", adaptive.tolerance, stats.steps,
           stats.newton, stats.backtracks, seen.gain, seen.fastest);
    newton += stats.newton;
    CHECK_BELOW(seen.gain, 0.05 * seen.fastest);
    flesh_integrator_destroy(&integrator);
  }
  /* 1283 to 1424 for five sets of tolerances close by; 1769 with only the tangent of friction */
  CHECK_BELOW(newton / RUNS, 1500);
  CHECK(seen.inside == 0);
  free(x);
  flesh_scene_destroy(&scene);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(jelly_tumbles_at_a_tenth)); }
