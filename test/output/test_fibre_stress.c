// TEST quick seconds=60
/* test_fibre_stress.c: the stress that frames and probes show for a muscle is that of the material plus the fibres: the
 * closed form of a bar that contracts while it is held, the mean stress of all forces; tets without fibres are
 * unaffected. */
#include "scene_files.h"

#include <math.h>
#include <string.h>

#include "output/fields.h"

static const char *const elements[] = {"tet4", "tet10", "tet10-mean"};
enum { ELEMENTS = 3, MOST_ROWS = 16 };
static const double mu = 1e5, lambda = 4e5, peak = 3e4; /* Pa */

/* Returns the Cauchy stress along a bar of form S at this stretch, with free sides; the stretch of the sides is found
 * by bisection. */
static double elastic_stress(double a, double *side)
{
  const double alpha = 1 + mu / lambda - mu / (4 * lambda);
  double low = 0.5, high = 1.5, b = 1, twice_I = 0;
  for (int k = 0; k < 200; k++) {
    b = (low + high) / 2;
    twice_I = mu * (1 - 1 / (a * a + 2 * b * b + 1));
    *(twice_I / a + lambda * (a * b * b - alpha) > 0 ? &high : &low) = b;
  }
  *side = b;
  return twice_I * (a * a - b * b) / (a * b * b);
}

/* Returns the stress of fibres along the bar, with optimal stretch 1: Blemker's curves, beyond the toe of the passive
 * one or at 1. */
static double fibre_stress(double activation, double a, double side)
{
  const double l = a - 1;
  return peak * (activation * (1 - 4 * l * l) + 0.05 * expm1(6.6 * l)) / (side * side); /* force over area */
}

typedef struct watch {
  flesh_fields fields;
  int rows;
  double t[MOST_ROWS], low[MOST_ROWS], high[MOST_ROWS], across[MOST_ROWS]; /* stress XX; the largest of the others */
} watch;

static int look(void *data, const flesh_step_record *record)
{
  watch *w = data;
  const int k = w->rows++;
  const flesh_field_list *lists[] = {&w->fields.nodes, &w->fields.tets};
  const int counts[] = {flesh_mesh_node_count(w->fields.body->mesh), flesh_mesh_tet_count(w->fields.body->mesh)};
  flesh_fields_find(&w->fields, record);
  w->t[k] = record->state->t, w->low[k] = INFINITY, w->high[k] = -INFINITY;
  for (int l = 0; l < 2; l++)
    for (int a = 0; a < lists[l]->count; a++)
      for (int i = 0; i < counts[l] * lists[l]->arrays[a].components; i++) {
        const double value = lists[l]->arrays[a].doubles[i];
        if (i % 6 == 0) w->low[k] = fmin(w->low[k], value), w->high[k] = fmax(w->high[k], value);
        else w->across[k] = fmax(w->across[k], fabs(value));
      }
  return FLESH_OK;
}

/* t and six stresses at a point and of all tets, one row for each step. */
static int read_probes(double rows[MOST_ROWS][13])
{
  char *text = read_text(file_path("probes.csv")), *at = strchr(text, '\n');
  int count = 0;
  for (; at && at[1] && count < MOST_ROWS; at = strchr(at, '\n'), count++)
    for (int c = 0; c < 13; c++) rows[count][c] = strtod(at + 1, &at);
  free(text);
  return count;
}

static void open_scene(const char *text, const char *element, flesh_scene **scene, flesh_state *state)
{
  char set[64];
  const char *const overrides[] = {set};
  snprintf(set, sizeof set, "body.element=%s", element);
  CHECK_OK(read_scene("fibres.yaml", text, 1, overrides, scene));
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(*scene));
  *state = (flesh_state){.x = calloc(n, sizeof(double)), .v = calloc(n, sizeof(double))};
  flesh_scene_start(*scene, state);
}

static void forget(flesh_scene *scene, flesh_state *state)
{
  flesh_scene_destroy(&scene);
  free(state->x);
  free(state->v);
}

#define PROBES                                                                                                          \
  "output:\n  probes:\n    - {name: p, point: [1.3, 0.4, 0.7], quantities: [stress]}\n"                                 \
  "    - {name: all, box: [[-1, -1, -1], [5, 2, 2]], quantities: [stress]}\n"

/* Stretched by a fifth while the activation rises, then held while it continues to rise. */
#define CONTRACTION                                                                                                     \
  "body: {mesh: bar.node, density: 1000, material: {energy: S, constants: raw, mu: 1e5, lambda: 4e5}}\n"                \
  "effects:\n  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], axes: [x]}\n"                                                 \
  "  - pin: {box: [[-1, -1, -1], [5, 1e-9, 2]], axes: [y]}\n  - pin: {box: [[-1, -1, -1], [5, 2, 1e-9]], axes: [z]}\n" \
  "  - prescribed_motion: {box: [[3.9, -1, -1], [5, 2, 2]], axes: [x],\n"                                               \
  "                         motion: [{time: 0}, {time: 1, translation: [0.8, 0, 0]}]}\n"                               \
  "  - muscle: {fibres: {direction: [2, 0, 0]}, peak_stress: 3e4,\n"                                                    \
  "              activation: [{time: 0, value: 0.2}, {time: 2, value: 1}]}\n"                                           \
  "time: {end: 2, step: 1/2}\nsolver: {newton_tolerance: 1e-12}\n" PROBES

static void check_rows(const watch *w)
{
  double rows[MOST_ROWS][13], worst = 0;
  CHECK(w->rows == 5 && read_probes(rows) == 5);
  for (int k = 0; k < 5; k++) {
    const double a = 1 + 0.2 * fmin(w->t[k], 1);
    double side, own = elastic_stress(a, &side);
    const double right = own + fibre_stress(0.2 + 0.4 * w->t[k], a, side);
    CHECK(rows[k][0] == w->t[k] && right - own > 0.1 * peak);
    worst = fmax(worst, fmax(fabs(w->low[k] - right), fmax(fabs(w->high[k] - right), w->across[k])));
    for (int c = 1; c < 13; c++) worst = fmax(worst, fabs(rows[k][c] - (c % 6 == 1 ? right : 0)));
  }
  printf("# %.6g Pa at the end, off by %.2g Pa\n", w->high[4], worst);
  CHECK_BELOW(worst, 1e-8 * mu);
}

static void a_contraction_has_the_stress_of_the_closed_form(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    flesh_scene *scene;
    flesh_state state;
    flesh_integrator *integrator;
    flesh_probes *probes;
    watch w = {0};
    int count;
    open_scene(CONTRACTION, elements[e], &scene, &state);
    const flesh_scene_time *time = flesh_scene_times(scene);
    const flesh_system *system = flesh_scene_system(scene);
    const flesh_body *body = flesh_scene_body(scene);
    const flesh_probe *given = flesh_scene_probes(scene, &count);
    CHECK_OK(flesh_fields_open(body, system, time->method, FLESH_FIELD_STRESS,
                               FLESH_AT_NODES | FLESH_AT_TETS | FLESH_AT_POINTS, &w.fields));
    CHECK_OK(flesh_probes_create(file_path("probes.csv"), body, system, time->method, count, given, &probes));
    CHECK_OK(flesh_integrator_create(system, time->method, flesh_scene_solver(scene), &integrator));
    const flesh_observer observers[] = {{flesh_probes_observe, probes}, {look, &w}};
    CHECK_OK(flesh_run(system, integrator,
                       &(flesh_run_options){
                           .h = time->step, .end = time->end, .observer_count = 2, .observers = observers},
                       &state, NULL));
    CHECK_OK(flesh_probes_close(&probes));
    check_rows(&w);
    flesh_integrator_destroy(&integrator);
    flesh_fields_clear(&w.fields);
    forget(scene, &state);
  }
}

static void bend(const double X[3], double x[3])
{
  x[0] = 1.2 * X[0] + 0.3 * X[1] - 0.1 * X[2] + 0.06 * sin(2 * X[1]) * X[0];
  x[1] = 0.05 * X[0] + 0.9 * X[1] + 0.2 * X[2] + 0.05 * cos(3 * X[2]) * X[0];
  x[2] = 0.1 * X[0] - 0.15 * X[1] + 1.1 * X[2] + 0.04 * X[0] * X[0];
}

#define BAR                                                                                                             \
  "body: {mesh: bar.node, density: 1000, material: {energy: S, constants: matched, young: 4e5, poisson: 0.45}}\n"       \
  "effects:\n  - elasticity: {}\n"
#define MUSCLES                                                                                                         \
  "  - muscle: {regions: [7], fibres: {direction: [1, 2, 0.5]}, peak_stress: 3e5, curve: thelen,\n"                     \
  "              activation: [{time: 0, value: 0.2}, {time: 2, value: 1}]}\n"                                           \
  "  - muscle: {regions: [7], fibres: {direction: [0, -1, 1]}, peak_stress: 2e5, optimal_stretch: 1.1}\n"

/* Returns the fields' stress of all tets at t = 0.5 s and x = bend(X), and the Gauss sum of r_i x_i^T in VTK's order,
 * which is the integral of sigma over the volume; both allocated. */
static double *stress_of(const char *text, const char *element, int *tets, int *with_fibres, double gauss[6])
{
  static const int row[] = {0, 1, 2, 0, 1, 0}, column[] = {0, 1, 2, 1, 2, 2};
  flesh_scene *scene;
  flesh_state state;
  flesh_fields fields;
  open_scene(text, element, &scene, &state);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const int n = 3 * flesh_mesh_node_count(mesh);
  double *r = calloc((size_t)n, sizeof *r);
  for (int i = 0; i < n; i += 3) bend(flesh_mesh_positions(mesh) + i, state.x + i);
  state.t = 0.5;
  CHECK_OK(flesh_fields_open(flesh_scene_body(scene), flesh_scene_system(scene), FLESH_METHOD_STATIC,
                             FLESH_FIELD_STRESS, FLESH_AT_TETS, &fields));
  flesh_fields_find(&fields, &(flesh_step_record){.state = &state, .stage = &state});
  *tets = flesh_mesh_tet_count(mesh);
  double *made = calloc(8 * (size_t)*tets, sizeof *made);
  memcpy(made, fields.tets.arrays[0].doubles, 6 * (size_t)*tets * sizeof *made);
  flesh_mesh_mean_jacobians(mesh, state.x, made + 6 * *tets);
  for (int t = 0; t < *tets; t++) {
    made[6 * *tets + t] *= flesh_mesh_tet_volumes(mesh)[t]; /* m^3, present volume */
    with_fibres[t] = flesh_mesh_regions(mesh)[t] == 7;
  }
  const flesh_point point = flesh_point_at(state.t, state.x, state.v, state.v);
  CHECK_OK(flesh_system_residual(flesh_scene_system(scene), &point, r));
  for (int k = 0; k < 6; k++) {
    gauss[k] = 0;
    for (int i = 0; i < n; i += 3) gauss[k] += r[i + row[k]] * state.x[i + column[k]];
  }
  flesh_fields_clear(&fields);
  forget(scene, &state);
  free(r);
  return made;
}

/* The bar has any shape, fibres in any direction, and two muscles on the same tets, one of them at a fraction of its
 * activation. The tets of the other region have the same bits as in a body without muscles. */
static void mean_stress_is_that_of_all_forces(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    int tets, with_fibres[64], changed = 0;
    double gauss[6], without[6];
    double *stress = stress_of(BAR MUSCLES, elements[e], &tets, with_fibres, gauss);
    double *own = stress_of(BAR, elements[e], &tets, with_fibres, without);
    for (int k = 0; k < 6; k++) {
      double total = 0, size = 0;
      for (int t = 0; t < tets; t++) {
        total += stress[6 * tets + t] * stress[6 * t + k];
        size += fabs(stress[6 * tets + t] * stress[6 * t + k]);
      }
      CHECK_NEAR(total, gauss[k], 1e-10 * (size + 1e5));
      CHECK(fabs(gauss[k] - without[k]) > 1e3);
    }
    for (int t = 0; t < tets; t++) {
      const int differs = memcmp(stress + 6 * t, own + 6 * t, 6 * sizeof *own) != 0;
      CHECK(differs == with_fibres[t]);
      changed += differs;
    }
    CHECK(tets == 24 && changed == 12);
    free(stress);
    free(own);
  }
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(argc, argv, TEST(a_contraction_has_the_stress_of_the_closed_form),
                         TEST(mean_stress_is_that_of_all_forces));
  test_folder_remove(folder);
  return failed;
}
