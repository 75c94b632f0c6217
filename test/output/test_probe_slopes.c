// TEST quick seconds=20
/* test_probe_slopes.c: derivatives of tets' probes agree with differences, with means of J and muscles; smoothed values keep
 * quadratic ones, up to where another region begins. */
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

/* Strains that are quadratic on both sides of x = 2, where region 7 begins, and another one there. */
static void smoothing_keeps_quadratic_strains_of_a_region(void)
{
  static const char text[] =
      "body:\n  mesh: bar.node\n  element: tet10\n  refine: 1\n  density: 1000\n  material: {energy: M, constants: raw, mu: 1e5, lambda: 0}\n"
      "  regions: [{tags: [7], material: {energy: M, constants: raw, mu: 3e5, lambda: 0}}]\n"
      "effects:\n  - elasticity: {}\n"
      "output:\n  probes: [{name: p, point: [1.93, 0.4, 0.7], quantities: [position, J, energy]},\n"
      "    {name: q, point: [2.2, 0.99, 0.02], quantities: [J, energy]}, {name: all, box: [[-1, -1, -1], [5, 2, 2]],\n"
      "    quantities: [J]}]\n";
  flesh_scene *scene;
  flesh_probes *probes;
  int count, all;
  CHECK_OK(read_scene("smooth.yaml", text, 0, NULL, &scene));
  const flesh_system *system = flesh_scene_system(scene);
  const size_t n = (size_t)flesh_system_unknowns(system);
  flesh_state state = {.x = calloc(n, sizeof(double)), .v = calloc(n, sizeof(double))};
  flesh_scene_start(scene, &state);
  for (size_t i = 0; i < n; i += 3) {
    const double X = state.x[i], Y = state.x[i + 1];
    state.x[i] += 0.03 * X * X + 0.2 * fmax(X - 2, 0);
    state.x[i + 1] -= 0.1 * Y * Y;
  }
  const flesh_probe *given = flesh_scene_probes(scene, &count);
  CHECK_OK(flesh_probes_open(flesh_scene_body(scene), system, FLESH_METHOD_STATIC, count, given, &probes));
  CHECK_OK(flesh_probes_smooth(&probes));
  CHECK_OK(flesh_probes_begin(&probes, file_path("smooth.csv")));
  CHECK_OK(flesh_probes_observe(probes, &(flesh_step_record){.system = system, .state = &state, .stage = &state}));
  CHECK_OK(flesh_probes_close(&probes));
  char *table = read_text(file_path("smooth.csv")), *row = strchr(table, '\n');
  CHECK(strstr(table, ",all.J_mean [1],p.J_smooth [1],p.energy_smooth [J/m^3],q.J_smooth [1],q.energy_smooth [J/m^3]\n"));
  double values[14];
  for (all = 0; row && all < 13; row = strchr(row + 1, ',')) values[all++] = strtod(row + 1, NULL);
  CHECK(all == 13 && !row);
  /* t, three positions, J and energy of p, of q, J of all; then the smoothed. */
  CHECK_NEAR(values[4], (1 + 0.06 * 1.93) * (1 - 0.2 * 0.4), 1e-12);
  CHECK_NEAR(values[6], (1.2 + 0.06 * 2.2) * (1 - 0.2 * 0.99), 1e-12);
  for (int k = 0; k < 4; k++) CHECK_NEAR(values[9 + k] / values[4 + k], 1, 1e-11);
  free(table);
  flesh_scene_destroy(&scene);
  free(state.x);
  free(state.v);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(slopes_are_those_of_differences),
                         TEST(smoothing_keeps_quadratic_strains_of_a_region));
  test_folder_remove(folder);
  return failed;
}
