// TEST quick seconds=20
/* test_probe_slopes.c: derivatives of tets' probes agree with differences, with means of J and muscles. */
#include "scene_files.h"

#include <math.h>
#include <string.h>

#include "math/differences.h"
#include "math/xorshift.h"
#include "output/resume.h"

#define SCENE                                                                                                           \
  "body: {mesh: bar.node, density: 1000, material: {energy: S, constants: matched, young: 4e5, poisson: 0.45}}\n"       \
  "effects:\n  - elasticity: {}\n"                                                                                      \
  "  - muscle: {regions: [7], fibres: {direction: [1, 2, 0.5]}, peak_stress: 3e5,\n"                                    \
  "              activation: [{time: 0, value: 0.2}, {time: 2, value: 1}]}\n"                                           \
  "output:\n  probes:\n    - {name: p, point: [2.3, 0.4, 0.7], quantities: [J, stretch, stress, energy]}\n"             \
  "    - {name: half, box: [[0.9, -1, -1], [5, 2, 2]], quantities: [J, stretch, stress, energy]}\n"

typedef struct moved {
  const flesh_system *system;
  flesh_state state;
  flesh_probes *probes;
  double figures[FLESH_PROBE_COLUMNS * FLESH_PROBE_FIGURES];
} moved;

/* Computes the columns' values at x + distance * way. */
static void observe(moved *m, int n, double distance, const double *way, double values[FLESH_PROBE_COLUMNS])
{
  for (int d = 0; d < n; d++) m->state.x[d] += distance * way[d];
  CHECK_OK(flesh_probes_observe(m->probes, &(flesh_step_record){.system = m->system, .state = &m->state, .stage = &m->state}));
  for (int d = 0; d < n; d++) m->state.x[d] -= distance * way[d];
  for (int c = 0; c < FLESH_PROBE_COLUMNS; c++) values[c] = m->figures[FLESH_PROBE_FIGURES * c];
}

/* Returns the error of the worst column of a quantity, for the derivative along a random direction. */
static double worst_of(const flesh_scene *scene, const flesh_probe *given, unsigned quantity, moved *m, int *count)
{
  static const double step = 1e-4;
  const int n = flesh_system_unknowns(m->system);
  double values[FLESH_DIFFERENCES][FLESH_PROBE_COLUMNS], worst = 0;
  double *way = calloc(2 * (size_t)n, sizeof *way), *by_x = way + n;
  flesh_probe probe = *given;
  flesh_probe_column columns[FLESH_PROBE_COLUMNS];
  uint32_t random = flesh_xorshift_first;
  probe.quantities = quantity;
  CHECK_OK(flesh_probes_open(flesh_scene_body(scene), m->system, FLESH_METHOD_STATIC, 1, &probe, &m->probes));
  flesh_probes_note(m->probes, m->figures);
  for (int d = 0; d < n; d++) way[d] = flesh_xorshift(&random) * 0x1p-31 - 1;
  for (int k = 0; k < FLESH_DIFFERENCES; k++) observe(m, n, flesh_difference_at[k] * step, way, values[k]);
  *count = flesh_probe_columns(&probe, columns);
  for (int c = 0; c < *count; c++) {
    const double right = flesh_difference_of(values[0][c], values[1][c], values[2][c], values[3][c], step);
    double sum = 0, size = 0;
    memset(by_x, 0, (size_t)n * sizeof *by_x);
    flesh_probes_differentiate(m->probes, &m->state, c, by_x);
    for (int d = 0; d < n; d++) sum += by_x[d] * way[d], size += fabs(by_x[d] * way[d]);
    CHECK(size > 0 && fabs(right) > 1e-6 * size);
    if (!(fabs(sum - right) < 1e-9 * size)) printf("# %s.%s %.12g %.12g\n", probe.name, columns[c].name, sum, right);
    worst = fmax(worst, fabs(sum - right) / size);
  }
  CHECK_OK(flesh_probes_close(&m->probes));
  free(way);
  return worst;
}

static void check_element(const char *element)
{
  const char *const overrides[] = {element};
  flesh_scene *scene;
  double worst = 0;
  int count, all = 0;
  CHECK_OK(read_scene("probed.yaml", SCENE, 1, overrides, &scene));
  moved m = {.system = flesh_scene_system(scene)};
  const int n = flesh_system_unknowns(m.system);
  m.state = (flesh_state){.t = 0.5, .x = calloc((size_t)n, sizeof(double)), .v = calloc((size_t)n, sizeof(double))};
  flesh_scene_start(scene, &m.state);
  m.state.t = 0.5;
  for (int i = 0; i < n; i += 3) {
    double *x = m.state.x + i;
    const double X[3] = {x[0], x[1], x[2]};
    x[0] = 1.2 * X[0] + 0.3 * X[1] - 0.1 * X[2] + 0.06 * sin(2 * X[1]) * X[0];
    x[1] = 0.05 * X[0] + 0.9 * X[1] + 0.2 * X[2] + 0.05 * cos(3 * X[2]) * X[0];
    x[2] = 0.1 * X[0] - 0.15 * X[1] + 1.1 * X[2] + 0.04 * X[0] * X[0];
  }
  const flesh_probe *probes = flesh_scene_probes(scene, &count);
  for (int k = 0; k < 2; k++)
    for (unsigned quantity = FLESH_PROBE_J; quantity <= FLESH_PROBE_ENERGY; quantity *= 2) {
      worst = fmax(worst, worst_of(scene, &probes[k], quantity, &m, &count));
      all += count;
    }
  printf("# %s: %d columns off by %.2g\n", element, all, worst);
  CHECK(all == 22);
  CHECK_BELOW(worst, 1e-9);
  flesh_scene_destroy(&scene);
  free(m.state.x);
  free(m.state.v);
}

static void slopes_are_those_of_differences(void)
{
  static const char *const elements[] = {"body.element=tet4", "body.element=tet10", "body.element=tet10-mean"};
  for (int e = 0; e < 3; e++) check_element(elements[e]);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(slopes_are_those_of_differences));
  test_folder_remove(folder);
  return failed;
}
