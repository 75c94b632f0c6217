// TEST quick seconds=60
/* test_fields.c: the fields of frames agree with closed forms: uniaxial tension of every form, uniform strain of
 * several materials, bending; and their integrals with those of the forces. */
#include "scene_files.h"

#include <math.h>
#include <string.h>

#include "output/fields.h"

static const char *const elements[] = {"tet4", "tet10", "tet10-mean"};
enum { ELEMENTS = 3 };
static const unsigned all = FLESH_FIELD_J | FLESH_FIELD_STRETCH | FLESH_FIELD_STRESS | FLESH_FIELD_VON_MISES |
                            FLESH_FIELD_PRESSURE | FLESH_FIELD_ENERGY_DENSITY;
static const unsigned everywhere = FLESH_AT_NODES | FLESH_AT_TETS | FLESH_AT_POINTS;

/* A scene, its fields, and the state for which they were computed. */
typedef struct seen {
  flesh_scene *scene;
  const flesh_mesh *mesh;
  flesh_fields fields;
  flesh_state state;
  double *J_mean;          /* [tets] as in every frame */
  int nodes, tets, points; /* of each tet */
} seen;

static void open_scene(const char *text, const char *element, unsigned fields, seen *s)
{
  char set[64];
  const char *const overrides[] = {set};
  snprintf(set, sizeof set, "body.element=%s", element);
  CHECK_OK(read_scene("fields.yaml", text, 1, overrides, &s->scene));
  s->mesh = flesh_scene_mesh(s->scene);
  s->nodes = flesh_mesh_node_count(s->mesh), s->tets = flesh_mesh_tet_count(s->mesh);
  s->points = flesh_mesh_order(s->mesh) == 2 ? 4 : 1;
  const size_t n = 3 * (size_t)s->nodes;
  s->state = (flesh_state){.x = calloc(n, sizeof(double)), .v = calloc(n, sizeof(double)),
                           .multipliers = calloc((size_t)s->tets, sizeof(double)),
                           .multiplier_count = flesh_system_multiplier_count(flesh_scene_system(s->scene))};
  flesh_scene_start(s->scene, &s->state);
  CHECK_OK(flesh_fields_open(flesh_scene_body(s->scene), flesh_scene_system(s->scene), FLESH_METHOD_STATIC, fields,
                             everywhere, &s->fields));
}

static void find(seen *s)
{
  flesh_fields_find(&s->fields, &(flesh_step_record){.state = &s->state, .stage = &s->state});
  s->J_mean = malloc((size_t)s->tets * sizeof *s->J_mean);
  flesh_mesh_mean_jacobians(s->mesh, s->state.x, s->J_mean);
}

/* Computes the fields at x = move(X). */
static void see(const char *text, const char *element, void (*move)(const double X[3], double x[3]), seen *s)
{
  open_scene(text, element, all, s);
  const double *X = flesh_mesh_positions(s->mesh);
  for (int i = 0; i < s->nodes; i++) move(X + 3 * i, s->state.x + 3 * i);
  find(s);
}

static void solve(const char *text, const char *element, unsigned fields, seen *s)
{
  flesh_integrator *integrator;
  open_scene(text, element, fields, s);
  const flesh_scene_time *time = flesh_scene_times(s->scene);
  const flesh_system *system = flesh_scene_system(s->scene);
  CHECK_OK(flesh_integrator_create(system, time->method, flesh_scene_solver(s->scene), &integrator));
  CHECK_OK(flesh_run(system, integrator, &(flesh_run_options){.h = time->step, .end = time->end}, &s->state, NULL));
  flesh_integrator_destroy(&integrator);
  find(s);
}

static void forget(seen *s)
{
  flesh_fields_clear(&s->fields);
  flesh_scene_destroy(&s->scene);
  free(s->state.x);
  free(s->state.v);
  free(s->state.multipliers);
  free(s->J_mean);
}

static const double *array(const flesh_field_list *list, const char *name)
{
  for (int k = 0; k < list->count; k++)
    if (!strcmp(list->arrays[k].name, name)) return list->arrays[k].doubles;
  printf("# no array %s\n", name);
  abort();
}

/* Whether an array repeats a row of `size` numbers. */
static void check_rows(const double *values, int count, int size, const double *row, double tolerance)
{
  double worst = 0;
  for (int i = 0; i < count; i++)
    for (int k = 0; k < size; k++) worst = fmax(worst, fabs(values[i * size + k] - row[k]));
  CHECK(isfinite(values[0]) && worst <= tolerance);
  if (!(worst <= tolerance)) printf("# off by %g: %g instead of %g\n", worst, values[0], row[0]);
}

/* At nodes, in tets and at their points. */
static void check_everywhere(const seen *s, const char *name, const char *points_name, int size, const double *row,
                             double tolerance)
{
  check_rows(array(&s->fields.nodes, name), s->nodes, size, row, tolerance);
  check_rows(strcmp(name, "J_mean") ? array(&s->fields.tets, name) : s->J_mean, s->tets, size, row, tolerance);
  check_rows(array(&s->fields.tets, points_name), s->tets * s->points, size, row, tolerance);
}

/* 2 psi_I and psi_J of the README's formulas, with I = tr F^T F; and psi itself. */
typedef struct slopes {
  double twice_I, J, psi;
} slopes;

static slopes slopes_of(char form, double mu, double lambda, double I, double J)
{
  const double stable = form == 'S', a = 1 + mu / lambda - stable * mu / (4 * lambda), L = log(J);
  switch (form) {
  case 'N': return (slopes){mu, (lambda * L - mu) / J, mu / 2 * (I - 3) - mu * L + lambda / 2 * L * L};
  case 'A': return (slopes){mu, lambda * (J - 1) - mu / J, mu / 2 * (I - 3) - mu * L + lambda / 2 * (J - 1) * (J - 1)};
  case 'B': return (slopes){mu * pow(J, -2. / 3), lambda * (J - 1) - mu / 3 * pow(J, -5. / 3) * I,
                            mu / 2 * (pow(J, -2. / 3) * I - 3) + lambda / 2 * (J - 1) * (J - 1)};
  case 'D': return (slopes){mu, lambda * (J - 1), mu / 2 * (I - 3) + lambda / 2 * (J - 1) * (J - 1)};
  case 'M': return (slopes){mu, 0, mu / 2 * (I - 3)};
  default: return (slopes){mu * (1 - stable / (I + 1)), lambda * (J - a),
                           mu / 2 * (I - 3) + lambda / 2 * (J - a) * (J - a) - stable * mu / 2 * log(I + 1)};
  }
}

/* Returns the lateral stretch b of a bar of stretch a with free sides: 2 psi_I b^2/J + psi_J = 0. */
static double lateral_stretch(char form, double mu, double lambda, double a)
{
  double low = 0.5, high = 1.5;
  for (int k = 0; k < 200; k++) {
    const double b = (low + high) / 2, J = a * b * b;
    const slopes s = slopes_of(form, mu, lambda, a * a + 2 * b * b, J);
    if (s.twice_I * b * b / J + s.J > 0) high = b;
    else low = b;
  }
  return low;
}

/* Bars stretched to 1.3 of their length: sigma = 2 psi_I (a^2 - b^2)/J along it, and 0 across. */
static void uniaxial_tension_is_that_of_the_formula(void)
{
  static const char *const forms[] = {"Neo", "A", "B", "D", "E", "S"};
  const double mu = 1e5, lambda = 4e5, a = 1.3;
  for (size_t f = 0; f < sizeof forms / sizeof *forms; f++)
    for (int e = 0; e < ELEMENTS; e++) {
      char text[1000];
      seen s = {0};
      snprintf(text, sizeof text,
               "body: {mesh: bar.node, density: 1000, material: {energy: %s, constants: raw, mu: %g, lambda: %g}}\n"
               "effects:\n  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], axes: [x]}\n"
               "  - pin: {box: [[-1, -1, -1], [5, 1e-9, 2]], axes: [y]}\n"
               "  - pin: {box: [[-1, -1, -1], [5, 2, 1e-9]], axes: [z]}\n"
               "  - prescribed_motion: {box: [[3.9, -1, -1], [5, 2, 2]], axes: [x],\n"
               "                         motion: [{time: 0}, {time: 1, translation: [1.2, 0, 0]}]}\n"
               "time: {end: 1, step: 1/2}\nsolver: {newton_tolerance: 1e-12}\n",
               forms[f], mu, lambda);
      solve(text, elements[e], all, &s);
      const double b = lateral_stretch(*forms[f], mu, lambda, a), J = a * b * b, stretch[] = {a, b, b};
      const slopes at = slopes_of(*forms[f], mu, lambda, a * a + 2 * b * b, J);
      const double rest = slopes_of(*forms[f], mu, lambda, 3, 1).psi, energy = at.psi - rest;
      const double sigma = at.twice_I * (a * a - b * b) / J, stress[6] = {sigma}, pressure = -sigma / 3;
      CHECK(sigma > 5e4);
      check_everywhere(&s, "stress", "stress_at_points", 6, stress, 1e-8 * mu);
      check_everywhere(&s, "von_mises", "von_mises_at_points", 1, &sigma, 1e-8 * mu);
      check_everywhere(&s, "pressure", "pressure_at_points", 1, &pressure, 1e-8 * mu);
      check_everywhere(&s, "stretch", "stretch_at_points", 3, stretch, 1e-8);
      check_everywhere(&s, "J_mean", "J_at_points", 1, &J, 1e-8);
      check_everywhere(&s, "energy_density", "energy_density_at_points", 1, &energy, 1e-8 * mu);
      forget(&s);
    }
}

#define TWO_MATERIALS                                                                                                 \
  "body: {mesh: bar.node, density: 1000, material: {energy: S, young: 4e5, poisson: 0.45},\n"                          \
  "       regions: [{tags: [7], material: {energy: Neo, young: 1e4, poisson: 0.3}}]}\n"                               \
  "effects: [elasticity]\n"

static const double A[9] = {1.2, 0.3, -0.1, 0.05, 0.9, 0.2, 0.1, -0.15, 1.1};

static void affine(const double X[3], double x[3])
{
  for (int i = 0; i < 3; i++) x[i] = 0.5 * i + A[3 * i] * X[0] + A[3 * i + 1] * X[1] + A[3 * i + 2] * X[2];
}

static const int stress_row[] = {0, 1, 2, 0, 1, 0}, stress_column[] = {0, 1, 2, 1, 2, 2};

/* sigma of both materials; between them the mean weighted by the volume at rest. */
static void uniform_strain_has_the_stress_of_each_material(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    seen s = {0};
    see(TWO_MATERIALS, elements[e], affine, &s);
    const flesh_body *body = flesh_scene_body(s.scene);
    const double J = A[0] * (A[4] * A[8] - A[5] * A[7]) - A[1] * (A[3] * A[8] - A[5] * A[6]) +
                     A[2] * (A[3] * A[7] - A[4] * A[6]);
    double sigma[2][6], *sums = calloc((size_t)s.nodes, 7 * sizeof *sums);
    for (int m = 0; m < 2; m++) {
      double P[9];
      CHECK_OK(flesh_material_stress(&body->materials[m], A, P));
      for (int k = 0; k < 6; k++) {
        const double *p = P + 3 * stress_row[k], *f = A + 3 * stress_column[k];
        sigma[m][k] = (p[0] * f[0] + p[1] * f[1] + p[2] * f[2]) / J;
      }
    }
    for (int t = 0; t < s.tets; t++) {
      const double volume = flesh_mesh_tet_volumes(s.mesh)[t], *is = sigma[body->tet_material[t]];
      check_rows(array(&s.fields.tets, "stress") + 6 * t, 1, 6, is, 1e-6);
      check_rows(array(&s.fields.tets, "stress_at_points") + 6 * s.points * t, s.points, 6, is, 1e-6);
      check_rows(array(&s.fields.tets, "pressure") + t, 1, 1, (double[]){-(is[0] + is[1] + is[2]) / 3}, 1e-6);
      for (int a = 0; a < (s.points == 4 ? 10 : 4); a++) {
        const int node = a < 4 ? flesh_mesh_tets(s.mesh)[4 * t + a] : flesh_mesh_tet_edges(s.mesh)[6 * t + a - 4];
        for (int k = 0; k < 6; k++) sums[7 * node + k] += volume * is[k];
        sums[7 * node + 6] += volume;
      }
    }
    for (int i = 0; i < s.nodes; i++) {
      for (int k = 0; k < 6; k++) sums[7 * i + k] /= sums[7 * i + 6];
      check_rows(array(&s.fields.nodes, "stress") + 6 * i, 1, 6, sums + 7 * i, 1e-6);
    }
    check_everywhere(&s, "J_mean", "J_at_points", 1, &J, 1e-12);
    free(sums);
    forget(&s);
  }
}

static const double curvature = 1e-6, poisson = 0.3;

/* A bar bent to a curvature about y, according to linear elasticity. */
static void bend(const double X[3], double x[3])
{
  const double y = X[1] - 0.5, z = X[2] - 0.5;
  x[0] = X[0] + curvature * X[0] * z;
  x[1] = X[1] - poisson * curvature * y * z;
  x[2] = X[2] - curvature / 2 * (X[0] * X[0] - poisson * y * y + poisson * z * z);
}

/* sigma_xx = E z/R: exact at every node of ten-node tets, also at the surface. */
static void stress_in_bending_is_linear_up_to_the_surface(void)
{
  seen s = {0};
  see("body: {mesh: bar.node, density: 1000, material: {energy: S, young: 4e5, poisson: 0.3}}\neffects: [elasticity]\n",
      "tet10", bend, &s);
  const double *X = flesh_mesh_positions(s.mesh), *stress = array(&s.fields.nodes, "stress");
  const double *stretch = array(&s.fields.nodes, "stretch");
  double worst = 0;
  for (int i = 0; i < s.nodes; i++) {
    const double strain = curvature * (X[3 * i + 2] - 0.5);
    double trace = 0;
    for (int k = 0; k < 6; k++) worst = fmax(worst, fabs(stress[6 * i + k] / 4e5 - (k ? 0 : strain)));
    for (int k = 0; k < 3; k++) trace += stretch[3 * i + k] - 1;
    worst = fmax(worst, fabs(trace - (1 - 2 * poisson) * strain));
  }
  printf("# off by %g of the strain\n", worst / curvature);
  CHECK(worst < 1e-4 * curvature);
  forget(&s);
}

static void twist(const double X[3], double x[3])
{
  affine(X, x);
  x[0] += 0.06 * sin(2 * X[1]) * X[0], x[1] += 0.05 * cos(3 * X[2]) * X[0], x[2] += 0.04 * X[0] * X[0];
}

/* The integral of sigma dV over tets agrees with that over points; the sum over nodes, weighted by the volume at rest,
 * with that over points. */
static void fields_have_the_integrals_of_their_points(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    seen s = {0};
    see(TWO_MATERIALS, elements[e], twist, &s);
    const double *nodal = array(&s.fields.nodes, "stress"), *mean = array(&s.fields.tets, "stress");
    const double *J = s.J_mean, *at = array(&s.fields.tets, "stress_at_points");
    const double *J_at = array(&s.fields.tets, "J_at_points");
    const double *nodal_J = array(&s.fields.nodes, "J_mean"), *stretch = array(&s.fields.tets, "stretch_at_points");
    double sums[5] = {0};
    for (int t = 0; t < s.tets; t++) {
      const double V = flesh_mesh_tet_volumes(s.mesh)[t];
      double now = 0;
      for (int q = 0; q < s.points; q++) {
        const int p = s.points * t + q;
        now += J_at[p] / s.points;
        sums[0] += V / s.points * at[6 * p + 4] * J_at[p];
        sums[1] += V / s.points * at[6 * p + 4];
        CHECK_NEAR(stretch[3 * p] * stretch[3 * p + 1] * stretch[3 * p + 2], J_at[p], 1e-12);
        CHECK(stretch[3 * p] >= stretch[3 * p + 1] && stretch[3 * p + 1] >= stretch[3 * p + 2]);
      }
      CHECK_NEAR(J[t], now, 1e-12);
      sums[2] += V * J[t] * mean[6 * t + 4];
      for (int a = 0; a < 4; a++) {
        const int node = flesh_mesh_tets(s.mesh)[4 * t + a];
        sums[3] += V / 4 * nodal[6 * node + 4];
        sums[4] += V / 4 * (nodal_J[node] - J[t]);
      }
    }
    CHECK(fabs(sums[0]) > 1e3);
    CHECK_NEAR(sums[2], sums[0], 1e-7);
    CHECK_NEAR(sums[3], sums[1], 1e-7);
    CHECK_NEAR(sums[4], 0, 1e-12);
    forget(&s);
  }
}

/* In equilibrium: the integral of sigma dV is the sum of nodal forces, loads and reactions, times x^T (Gauss). */
static void mean_stress_is_that_of_loads_and_reactions(void)
{
  for (int e = 0; e < ELEMENTS; e++) {
    seen s = {0};
    solve("body: {mesh: bar.node, density: 1000, material: {energy: S, young: 4e5, poisson: 0.45}}\neffects:\n"
          "  - gravity: {acceleration: [0, 2, -9.81]}\n"
          "  - force: {force: [30000, 0, 10000], box: [[3.9, -1, 0.9], [5, 2, 2]]}\n"
          "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}\nsolver: {newton_tolerance: 1e-12}\n",
          elements[e], all | FLESH_FIELD_REACTION, &s);
    const size_t n = 3 * (size_t)s.nodes;
    const double *reaction = array(&s.fields.nodes, "reaction"), *x = s.state.x;
    double *loads = calloc(n, sizeof *loads), force[3] = {0};
    const flesh_point point = flesh_point_at(s.state.t, x, s.state.v, s.state.v);
    CHECK_OK(flesh_system_load(flesh_scene_system(s.scene), &point, loads));
    for (int k = 0; k < 6; k++) {
      double acting = 0, inside = 0;
      for (size_t i = 0; i < n; i += 3)
        acting += (reaction[i + stress_row[k]] - loads[i + stress_row[k]]) * x[i + stress_column[k]];
      for (int t = 0; t < s.tets; t++)
        inside += flesh_mesh_tet_volumes(s.mesh)[t] * s.J_mean[t] *
                  array(&s.fields.tets, "stress")[6 * t + k];
      CHECK_NEAR(inside, acting, 1e-4); /* of 2e5 J */
    }
    for (size_t i = 0; i < n; i++) force[i % 3] += reaction[i] - loads[i];
    for (int d = 0; d < 3; d++) CHECK_NEAR(force[d], 0, 1e-5);
    free(loads);
    forget(&s);
  }
}

/* Returns the root mean square error, over mu, of the pressures at corners in a box of 1 m with frictionless walls, in
 * which the weight of an incompressible body of tet10-mean, 2 mu/m, causes a hydrostatic pressure. */
static double error_under_weight(int cells)
{
  seen s = {0};
  char text[1000];
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_box((int[]){cells, cells, cells}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_mesh_write(mesh, file_path("box.mesh")));
  flesh_mesh_destroy(&mesh);
  snprintf(text, sizeof text,
           "body: {mesh: box.mesh, density: 1000, material: {energy: S, young: 30000, poisson: 0.5}}\n"
           "effects:\n  - gravity: {acceleration: [0, 0, -20]}\n"
           "  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]], axes: [x]}\n  - pin: {box: [[0.99, -1, -1], [2, 2, 2]], axes: [x]}\n"
           "  - pin: {box: [[-1, -1, -1], [2, 1e-9, 2]], axes: [y]}\n  - pin: {box: [[-1, 0.99, -1], [2, 2, 2]], axes: [y]}\n"
           "  - pin: {box: [[-1, -1, -1], [2, 2, 1e-9]], axes: [z]}\n"
           "time: {method: static}\nsolver: {newton_tolerance: 1e-9}\n");
  solve(text, "tet10-mean", FLESH_FIELD_PRESSURE, &s);
  const double *pressure = array(&s.fields.nodes, "pressure"), *X = flesh_mesh_positions(s.mesh);
  double square = 0, count = 0;
  for (int k = 0; k < 4 * s.tets; k++) {
    const int corner = flesh_mesh_tets(s.mesh)[k];
    square += pow(pressure[corner] - 20000 * (1 - X[3 * corner + 2]), 2), count++;
  }
  forget(&s);
  return sqrt(square / count) / 1e4;
}

static void pressures_under_weight_are_of_second_order(void)
{
  const double coarse = error_under_weight(2), fine = error_under_weight(4);
  printf("# pressures at corners off by %.4f and %.4f of mu\n", coarse, fine);
  CHECK_BELOW(fine, 0.03);
  CHECK_BELOW(fine, coarse / 3);
}

static void what_a_body_has_not_is_refused(void)
{
  static const char *const bad[][2] = {
      {"body: {mesh: bar.node}\neffects: [gravity]\noutput: {fields: [J, stress]}\n",
       "bad.yaml:3:18: output.fields has stress, but the body has no material"},
      {TWO_MATERIALS "output: {fields: [contact_force]}\n",
       "bad.yaml:4:18: output.fields has contact_force, but nothing touches the body"},
      {TWO_MATERIALS "output: {fields: [strain]}\n", "it must be a list of some of displacement, velocity, J, stretch"},
      {TWO_MATERIALS "output: {fields_at: [faces]}\n", "it must be a list of some of nodes, tets, points"}};
  for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
    flesh_scene *scene = NULL;
    CHECK(read_scene("bad.yaml", bad[k][0], 0, NULL, &scene) == FLESH_ERR_ARGUMENT && !scene);
    CHECK_TEXT(flesh_error_text(), bad[k][1]);
  }
}

/* A tet whose F has no stress shows NaN, and so do its nodes; all other values are kept. */
static void inside_out(const double X[3], double x[3])
{
  memcpy(x, X, 3 * sizeof *x);
  if (X[0] > 3.9) x[0] = 2.5;
}

static void a_stress_that_does_not_exist_is_nan(void)
{
  seen s = {0};
  see("body: {mesh: bar.node, material: {energy: Neo, young: 1e4, poisson: 0.3}}\neffects: [elasticity]\n", "tet4",
      inside_out, &s);
  const double *stress = array(&s.fields.tets, "stress"), *J = s.J_mean;
  const double *nodal = array(&s.fields.nodes, "von_mises"), *X = flesh_mesh_positions(s.mesh);
  int inverted = 0;
  for (int t = 0; t < s.tets; t++) {
    inverted += J[t] < 0;
    CHECK((J[t] > 0) == (isfinite(stress[6 * t]) != 0));
  }
  CHECK(inverted >= 1 && inverted < s.tets);
  for (int i = 0; i < s.nodes; i++) CHECK((isfinite(nodal[i]) != 0) == (X[3 * i] < 2.9));
  forget(&s);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  write_bar();
  int failed = RUN_TESTS(
      argc, argv, TEST(uniaxial_tension_is_that_of_the_formula), TEST(uniform_strain_has_the_stress_of_each_material),
      TEST(stress_in_bending_is_linear_up_to_the_surface), TEST(fields_have_the_integrals_of_their_points),
      TEST(mean_stress_is_that_of_loads_and_reactions),
      TEST(pressures_under_weight_are_of_second_order), TEST(what_a_body_has_not_is_refused),
      TEST(a_stress_that_does_not_exist_is_nan));
  test_folder_remove(folder);
  return failed;
}
