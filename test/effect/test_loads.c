// TEST quick seconds=60
/* test_loads.c: dead and follower loads against closed forms, balance, and the radial boundary-value problem of an
 * inflated thick sphere. */
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <gsl/gsl_roots.h>
#include <stdlib.h>

#include "body.h"
#include "material/form.h"
#include "scene/selection.h"
#include "test.h"

static void make(flesh_mesh *mesh, double poisson, int inertia, test_body *b)
{
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, poisson), 1000, FLESH_MASS_LUMPED, inertia, b));
}

static const flesh_selection nothing = {.box = {NAN}, .sphere = {.radius = NAN}};

/* Lists the surface triangles in the box. */
static int triangles_in(const flesh_mesh *mesh, const double box[6], int **triangles)
{
  int count = 0;
  flesh_selection selection = nothing;
  memcpy(selection.box, box, sizeof selection.box);
  CHECK_OK(flesh_selection_triangles(&selection, &(flesh_body){.mesh = mesh}, &count, triangles));
  return count;
}

static void add(test_body *b, flesh_effect *effect)
{
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

/* Computes the equilibrium at t, starting from the state. */
static void settle(test_body *b, double t)
{
  flesh_solver_options options;
  flesh_integrator *integrator = NULL;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-10;
  options.linear_solver = FLESH_LINEAR_KLU;
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b->state, t - b->state.t, NULL));
  flesh_integrator_destroy(&integrator);
}

/* Returns the first Piola-Kirchhoff stress along a of diag(a, b, c). */
static double stress_along(const flesh_material *material, double a, double b, double c)
{
  double P[9];
  CHECK_OK(flesh_material_stress(material, (const double[]){a, 0, 0, 0, b, 0, 0, 0, c}, P));
  return P[0];
}

typedef struct axial {
  const flesh_material *material;
  double along, traction, across;
} axial;

static double across_stress(double across, void *data)
{
  axial *a = data;
  return stress_along(a->material, across, a->along, across);
}

/* Finds a root between low and high. */
static double root(double (*function)(double, void *), void *data, double low, double high)
{
  gsl_root_fsolver *solver = gsl_root_fsolver_alloc(gsl_root_fsolver_brent);
  gsl_function f = {function, data};
  CHECK(!gsl_root_fsolver_set(solver, &f, low, high));
  for (int k = 0; k < 200; k++) {
    gsl_root_fsolver_iterate(solver);
    low = gsl_root_fsolver_x_lower(solver);
    high = gsl_root_fsolver_x_upper(solver);
    if (high - low < 1e-14 * fabs(high)) break;
  }
  double found = gsl_root_fsolver_root(solver);
  gsl_root_fsolver_free(solver);
  return found;
}

static double along_stress(double along, void *data)
{
  axial *a = data;
  a->along = along;
  a->across = root(across_stress, a, 0.3, 2);
  return stress_along(a->material, along, a->across, a->across) - a->traction;
}

static void traction_pulls_a_bar_as_the_closed_form(void)
{
  for (int k = 0; k < 2; k++) {
    test_body b;
    flesh_effect *effect = NULL;
    int *triangles;
    const double traction = k ? 8e4 : -3e4;
    make(test_box(3, 2, 2, 1.5, 1, 1), 0.4, 0, &b);
    for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(&b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
    int count = triangles_in(b.mesh, (double[]){1.5, -1, -1, 2, 2, 2}, &triangles);
    CHECK(count == 8);
    /* Half of it now, the whole at t = 2. */
    const flesh_curve_point points[] = {{0, 0}, {1, 0.5}, {2, 1}};
    const flesh_amplitude amplitude = {3, points, 0, -INFINITY, INFINITY};
    CHECK_OK(flesh_effect_traction(&b.body, count, triangles, (double[]){traction, 0, 0}, &amplitude, &effect));
  add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK(flesh_system_moves(b.system) && flesh_system_next_event(b.system, 1) == 2);
    for (int t = 1; t <= 2; t++) {
      axial a = {.material = &b.material, .traction = traction * t / 2};
      double along = root(along_stress, &a, 0.3, 4), worst = 0;
      settle(&b, t);
      for (int d = 0; d < b.n; d++)
        worst = fmax(worst, fabs(b.state.x[d] - flesh_mesh_positions(b.mesh)[d] * (d % 3 ? a.across : along)));
      printf("# %g Pa: stretch %.8g, across %.8g, off by %.2g m\n", a.traction, along, a.across, worst);
      CHECK_BELOW(worst, 1e-8);
    }
    free(triangles);
    test_body_destroy(&b);
  }
}

/* With Poisson's ratio -1/2 a bar of every form that allows it is undeformed at rest, and widens when pulled. */
static void auxetic_bars_widen_as_the_closed_form(void)
{
  int forms = 0;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    if (!flesh_form_takes((flesh_energy)e, FLESH_CONSTANTS_MATCHED)) continue;
    flesh_material material;
    if (flesh_material_from_young((flesh_energy)e, FLESH_CONSTANTS_MATCHED, 1e5, -0.5, &material)) {
      printf("# %s\n", flesh_error_text());
      continue;
    }
    test_body b;
    flesh_effect *effect = NULL;
    flesh_derivative_report report;
    int *triangles;
    CHECK_OK(test_body_create(test_box(3, 2, 2, 1.5, 1, 1), material, 1000,
                              FLESH_MASS_LUMPED, 0, &b));
    for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(&b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
    CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
    test_jitter(b.n, 0.05, 7, b.state.x);
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-7));
    flesh_effect_destroy(&effect);
    memcpy(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof *b.state.x);
    const double traction = 5e3;
    int count = triangles_in(b.mesh, (double[]){1.5, -1, -1, 2, 2, 2}, &triangles);
    CHECK_OK(flesh_effect_traction(&b.body, count, triangles, (double[]){traction, 0, 0}, NULL, &effect));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    settle(&b, 1);
    /* The last node is the corner (1.5, 1, 1): the whole bar has its stretch, with the load's stress along it and none
     * across. */
    const double along = b.state.x[b.n - 3] / 1.5, across = b.state.x[b.n - 2];
    double worst = 0, off = fabs(stress_along(&b.material, along, across, across) - traction);
    off = fmax(off, fabs(stress_along(&b.material, across, along, across)));
    for (int d = 0; d < b.n; d++)
      worst = fmax(worst, fabs(b.state.x[d] - flesh_mesh_positions(b.mesh)[d] * (d % 3 ? across : along)));
    printf("# %s: stretch %.6g, across %.6g, off by %.2g m, %.2g Pa\n", flesh_energy_name((flesh_energy)e), along, across,
           worst, off);
    CHECK_BELOW(worst, 1e-8);
    CHECK_BELOW(off, 1e-3);
    CHECK(along > 1.03 && across > 1.015);
    forms++;
    free(triangles);
    test_body_destroy(&b);
  }
  CHECK(forms >= 4);
}

static void forces_are_what_holds_against_them(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  const double force[3] = {300, -200, 500};
  make(test_box(4, 2, 2, 4, 1, 1), 0.4, 0, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  const int nodes[] = {4, 9, 14, 24};
  CHECK_OK(flesh_effect_force(&b.body, 4, nodes, force, NULL, &effect));
  add(&b, effect);
  CHECK_OK(flesh_system_finalize(b.system));
  settle(&b, 0);
  double *r = malloc((size_t)b.n * sizeof *r), reaction[3] = {0}, energies[2], work = 0;
  const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
  CHECK_OK(flesh_system_residual(b.system, &point, r));
  for (int i = 0; i < b.n / 3; i++)
    for (int c = 0; c < 3; c++) reaction[c] += r[3 * i + c] * (flesh_mesh_positions(b.mesh)[3 * i] < 1e-9);
  for (int c = 0; c < 3; c++) CHECK_NEAR(reaction[c], -force[c], 1e-6);
  CHECK_OK(flesh_system_energies(b.system, &point, energies));
  for (int k = 0; k < 4; k++)
    for (int c = 0; c < 3; c++)
      work += force[c] / 4 * (b.state.x[3 * nodes[k] + c] - flesh_mesh_positions(b.mesh)[3 * nodes[k] + c]);
  CHECK_NEAR(energies[1], -work, 1e-9 * work);
  free(r);
  test_body_destroy(&b);
}

/* Adds -p times the normals of the deformed triangles to r. */
static void push(int count, const int *triangles, double p, const double *x, double *r)
{
  for (int k = 0; k < count; k++) {
    const int *n = triangles + 3 * k;
    double d[2][3], normal[3];
    for (int c = 0; c < 3; c++) {
      d[0][c] = x[3 * n[1] + c] - x[3 * n[0] + c];
      d[1][c] = x[3 * n[2] + c] - x[3 * n[0] + c];
    }
    for (int c = 0; c < 3; c++)
      normal[c] = d[0][(c + 1) % 3] * d[1][(c + 2) % 3] - d[0][(c + 2) % 3] * d[1][(c + 1) % 3];
    for (int a = 0; a < 3; a++)
      for (int c = 0; c < 3; c++) r[3 * n[a] + c] += p * normal[c] / 6;
  }
}

static void pressure_follows_the_faces(void)
{
  const double boxes[][6] = {{-1, -1, -1, 2, 2, 2}, {-1, -1, 1, 2, 2, 2}, {-1, -1, 0.5, 0.5, 2, 2}};
  for (int k = 0; k < 3; k++) {
    test_body b;
    flesh_effect *effect = NULL;
    int *triangles;
    flesh_derivative_report report;
    make(test_box(2, 2, 2, 1, 1, 1), 0.4, 0, &b);
    flesh_system_destroy(&b.system);
    CHECK_OK(flesh_system_create(b.mesh, &b.system));
    int count = triangles_in(b.mesh, boxes[k], &triangles);
    CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 700, NULL, &effect));
    CHECK(!effect->operations->energy == (k > 0) && !(effect->operations->traits & FLESH_IS_FOLLOWER_LOAD) == (k == 0));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    test_jitter(b.n, 0.2, 3 + (unsigned)k, b.state.x);
    double *r = malloc((size_t)b.n * sizeof *r), *expected = calloc((size_t)b.n, sizeof *r),
           *x_lag = malloc((size_t)b.n * sizeof *x_lag), energy;
    memcpy(x_lag, b.state.x, (size_t)b.n * sizeof *x_lag);
    if (k == 0) test_jitter(b.n, 0.3, 9, x_lag); /* a closed surface does not depend on the lag */
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    point.load = 0.5;
    point.lagged.x = x_lag;
    CHECK_OK(flesh_system_residual(b.system, &point, r));
    push(count, triangles, 350, b.state.x, expected);
    CHECK_BELOW(test_distance(b.n, r, expected), 1e-13 * test_norm(b.n, expected));
    CHECK_OK(flesh_system_energies(b.system, &point, &energy));
    if (k == 0)
      CHECK_NEAR(energy, 350 * (flesh_mesh_volume(b.mesh, b.state.x) - 1), 1e-10);
    CHECK_OK(flesh_effect_check_derivatives(flesh_system_effect(b.system, 0), b.mesh, 0, b.state.x, 1, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-8));
    free(r);
    free(expected);
    free(x_lag);
    free(triangles);
    test_body_destroy(&b);
  }
}

/* The pressure on an open surface with a moving rim is in balance with the final shape, not the initial one: on top of
 * a block, and on half of the end of a bar, whose shape and load would diverge if each only followed the other; then
 * most of the load is applied after a part of it. */
static void statics_follow_an_open_pressure(void)
{
  static const struct { double length, box[6], pressure, deflection; } cases[] = {
      {2, {1, -1, 1, 3, 2, 2}, 3000, 0.2}, {6, {5.9, -1, 0.5, 7, 2, 2}, 4000, 0.05},
      {6, {5.9, -1, 0.5, 7, 2, 2}, 9000, 0.05}, {6, {5.9, -1, 0.5, 7, 2, 2}, -9000, 0.05}};
  for (int k = 0; k < 4; k++) {
    const double length = cases[k].length, pressure = cases[k].pressure;
    test_body b;
    flesh_effect *effect = NULL;
    int *triangles;
    make(test_box((int)(2 * length), 2, 2, length, 1, 1), 0.4, 0, &b);
    CHECK_OK(test_body_clamp(&b, 1e-9));
    int count = triangles_in(b.mesh, cases[k].box, &triangles);
    CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, pressure, NULL, &effect));
    add(&b, effect);
    CHECK_OK(flesh_system_finalize(b.system));
    settle(&b, 0);
    double *r = malloc((size_t)b.n * sizeof *r), *load = calloc((size_t)b.n, sizeof *load), worst = 0;
    flesh_effect *elasticity = (flesh_effect *)flesh_system_effect(b.system, 0);
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    memset(r, 0, (size_t)b.n * sizeof *r);
    CHECK_OK(elasticity->operations->residual(elasticity, &point, r));
    push(count, triangles, pressure, b.state.x, load);
    double deflection = b.state.x[b.n - 1] - 1;
    for (int d = 0; d < b.n; d++)
      if (flesh_mesh_positions(b.mesh)[3 * (d / 3)] > 1e-9) worst = fmax(worst, fabs(r[d] + load[d]));
    printf("# deflection %.4g m; out of balance by %.2g of %.3g N\n", deflection, worst, test_norm(b.n, load));
    CHECK(fabs(deflection) > cases[k].deflection);
    CHECK_BELOW(worst, 1e-9 * test_norm(b.n, load));
    free(r);
    free(load);
    free(triangles);
    test_body_destroy(&b);
  }
}

typedef struct asked {
  int count, last;
} asked;

static int stop_at(void *data)
{
  asked *self = data;
  return ++self->count == self->last ? FLESH_ERR_BUDGET : FLESH_OK;
}

/* A caller may also end a step while it finds directions for follower loads; the state is then unchanged. */
static void check_that_following_ends(flesh_linear_solver linear_solver, int least)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_solver_options options = test_options(1e-10);
  flesh_integrator *integrator = NULL;
  asked all = {0}, one = {0};
  int *triangles;
  options.linear_solver = linear_solver;
  make(test_box(4, 2, 2, 2, 1, 1), 0.4, 0, &b);
  CHECK_OK(test_body_clamp(&b, 1e-9));
  const int count = triangles_in(b.mesh, (const double[]){1, -1, 1, 3, 2, 2}, &triangles);
  CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, 3000, NULL, &effect));
  add(&b, effect);
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  flesh_solve_stats stats = {0};
  const size_t bytes = (size_t)b.n * sizeof(double);
  double *x = malloc(bytes);
  memcpy(x, b.state.x, bytes);
  flesh_integrator_set_stop(integrator, stop_at, &all);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1, &stats));
  printf("# asked %d times in %d iterations of Newton's, %d linear ones\n", all.count, stats.newton, stats.linear);
  CHECK(all.count >= least); /* of 13 in iterations, and more within the linear solves, several times in long ones */
  for (int last = 1; last <= all.count; last++) {
    one = (asked){0, last};
    memcpy(b.state.x, x, bytes);
    b.state.t = 0;
    flesh_integrator_set_stop(integrator, stop_at, &one);
    CHECK(flesh_integrator_step(integrator, &b.state, 1, NULL) == FLESH_ERR_BUDGET);
    CHECK(one.count == last && b.state.t == 0 && !memcmp(b.state.x, x, bytes));
  }
  free(x);
  free(triangles);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void following_ends_when_it_is_told_to(void)
{
  check_that_following_ends(FLESH_LINEAR_PCG, 40);
  check_that_following_ends(FLESH_LINEAR_KLU, 20);
}

/* --- the thick sphere --- */

static const double inner = 1, outer = 1.6;

/* Makes an eighth of the sphere: the triangle between the three axes, divided into n*n, in `layers` shells; prisms are
 * divided into three tets by the order of their nodes, so that neighbours agree. */
static flesh_mesh *eighth(int n, int layers)
{
  int columns = (n + 1) * (n + 2) / 2, *number = malloc((size_t)((n + 1) * (n + 1)) * sizeof *number), count = 0,
      tets = 0;
  double *X = malloc(sizeof(double) * 3 * (size_t)(columns * (layers + 1)));
  int *nodes = malloc(sizeof(int) * 12 * (size_t)(n * n * layers));
  for (int i = 0; i <= n; i++)
    for (int j = 0; i + j <= n; j++) {
      number[i * (n + 1) + j] = count;
      /* Distributes the nodes nearly evenly on the sphere. */
      double d[3] = {tan(acos(-1) / 4 * i / n), tan(acos(-1) / 4 * j / n), tan(acos(-1) / 4 * (n - i - j) / n)},
             length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      for (int l = 0; l <= layers; l++)
        for (int c = 0; c < 3; c++)
          X[3 * (l * columns + count) + c] = d[c] / length * (inner + (outer - inner) * l / layers);
      count++;
    }
  for (int l = 0; l < layers; l++)
    for (int i = 0; i < n; i++)
      for (int j = 0; i + j < n; j++)
        for (int up = 0; up < 2; up++) {
          if (up && i + j + 2 > n) continue;
          int t[3] = {number[(i + up) * (n + 1) + j + up], number[(i + 1) * (n + 1) + j], number[i * (n + 1) + j + 1]};
          for (int p = 0; p < 3; p++)
            for (int q = 0; q < 2; q++)
              if (t[q] > t[q + 1]) {
                int swap = t[q];
                t[q] = t[q + 1];
                t[q + 1] = swap;
              }
          int low = l * columns, high = low + columns, *tet = nodes + 4 * tets;
          const int three[12] = {low + t[0],  low + t[1],  low + t[2],  high + t[2], low + t[0],  low + t[1],
                                 high + t[1], high + t[2], low + t[0],  high + t[0], high + t[1], high + t[2]};
          memcpy(tet, three, sizeof three);
          tets += 3;
        }
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_create(columns * (layers + 1), X, tets, nodes, NULL, &mesh));
  free(number);
  free(X);
  free(nodes);
  return mesh;
}

typedef struct sphere {
  const flesh_material *material;
  double pressure, hoop, stress;
} sphere;

static double radial_stress(double stretch, void *data)
{
  sphere *s = data;
  return stress_along(s->material, stretch, s->hoop, s->hoop) - s->stress;
}

/* (r, P_rr) over R: r' from P_rr(r', r/R), dP_rr/dR = -2 (P_rr - P_hoop)/R. */
static int radial(double R, const double y[2], double dy[2], void *data)
{
  sphere *s = data;
  s->hoop = y[0] / R;
  s->stress = y[1];
  dy[0] = root(radial_stress, s, 0.05, 3);
  dy[1] = -2 / R * (y[1] - stress_along(s->material, s->hoop, s->hoop, dy[0]));
  return GSL_SUCCESS;
}

/* Returns the radial stress at the outside when the inside is at `a`. */
static double miss(double a, void *data)
{
  sphere *s = data;
  gsl_odeiv2_system system = {radial, NULL, 2, s};
  gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-2, 1e-10, 1e-10);
  double R = inner, y[2] = {a, -s->pressure * a * a / (inner * inner)};
  CHECK(gsl_odeiv2_driver_apply(driver, &R, outer, y) == GSL_SUCCESS);
  gsl_odeiv2_driver_free(driver);
  return y[1];
}

/* Returns the mean radius of the inside. */
static double inflated(int n, double pressure)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_selection selection = nothing;
  int count = 0, *triangles = NULL, nodes = 0;
  make(eighth(n, n), 0.3, 0, &b);
  for (int c = 0; c < 3; c++) CHECK_OK(test_body_hold(&b, c, 0, 1u << c, NULL, -INFINITY, INFINITY));
  selection.sphere.radius = inner * (1 + 1e-9);
  for (int c = 0; c < 3; c++) selection.sphere.centre[c] = 0;
  CHECK_OK(flesh_selection_triangles(&selection, &b.body, &count, &triangles));
  CHECK(count == n * n);
  CHECK_OK(flesh_effect_pressure(&b.body, count, triangles, pressure, NULL, &effect));
  add(&b, effect);
  CHECK_OK(flesh_system_finalize(b.system));
  settle(&b, 0);
  double sum = 0;
  for (int i = 0; i < b.n / 3; i++) {
    const double *X = flesh_mesh_positions(b.mesh) + 3 * i, *x = b.state.x + 3 * i;
    if (X[0] * X[0] + X[1] * X[1] + X[2] * X[2] > inner * inner * (1 + 1e-9)) continue;
    sum += sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    nodes++;
  }
  free(triangles);
  test_body_destroy(&b);
  return sum / nodes;
}

static void pressure_inflates_a_thick_sphere(void)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.3);
  sphere s = {.material = &material, .pressure = 1.2e4};
  double exact = root(miss, &s, 1.001, 2), error[3];
  for (int k = 0; k < 3; k++) error[k] = fabs(inflated(3 << k, s.pressure) - exact);
  double orders[] = {log2(error[0] / error[1]), log2(error[1] / error[2])};
  printf("# inner radius %.6g from %g m; off by %.2e, %.2e, %.2e m: orders %.2f, %.2f\n", exact, inner, error[0],
         error[1], error[2], orders[0], orders[1]);
  CHECK(exact > 1.1);
  CHECK_BELOW(error[2], 0.015 * (exact - inner));
  CHECK(orders[0] > 1.6 && orders[1] > 1.8 && orders[1] < 2.2);
}

/* Selections choose triangles by all their nodes, or by the region of the tet. */
static void triangles_are_chosen_by_region(void)
{
  flesh_mesh *mesh = NULL, *box = test_box(2, 1, 1, 2, 1, 1);
  int *regions = malloc(sizeof(int) * 12), count, *triangles, area = 0;
  for (int t = 0; t < 12; t++) regions[t] = t < 6 ? 3 : 8;
  CHECK_OK(flesh_mesh_create(12, flesh_mesh_positions(box), 12, flesh_mesh_tets(box), regions, &mesh));
  flesh_selection selection = nothing;
  selection.regions = (flesh_integers){1, (int[]){8}};
  CHECK_OK(flesh_selection_triangles(&selection, &(flesh_body){.mesh = mesh}, &count, &triangles));
  for (int k = 0; k < 3 * count; k++) area += flesh_mesh_positions(mesh)[3 * triangles[k]] >= 1;
  CHECK(count == 10 && area == 30); /* five faces of the second cube */
  free(triangles);
  CHECK_OK(flesh_selection_nodes(&selection, &(flesh_body){.mesh = mesh}, &count, &triangles));
  CHECK(count == 8);
  free(triangles);
  selection.regions.values = (int[]){5};
  CHECK(flesh_selection_triangles(&selection, &(flesh_body){.mesh = mesh}, &count, &triangles) == FLESH_ERR_ARGUMENT);
  CHECK(!strcmp(flesh_error_text(), "regions[0] is 5; no tet of the mesh has that tag"));
  selection = nothing;
  memcpy(selection.box, (double[]){0.4, 0.4, 0.4, 0.6, 0.6, 0.6}, sizeof selection.box);
  CHECK(flesh_selection_triangles(&selection, &(flesh_body){.mesh = mesh}, &count, &triangles) == FLESH_ERR_ARGUMENT);
  CHECK(!strcmp(flesh_error_text(), "no surface triangle of the mesh lies in the given box; "
                                    "the mesh reaches from [0, 0, 0] to [2, 1, 1]"));
  free(regions);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&box);
}

int main(int argc, char **argv)
{
  gsl_set_error_handler_off();
  return RUN_TESTS(argc, argv, TEST(traction_pulls_a_bar_as_the_closed_form), TEST(auxetic_bars_widen_as_the_closed_form),
                   TEST(forces_are_what_holds_against_them), TEST(pressure_follows_the_faces),
                   TEST(statics_follow_an_open_pressure), TEST(following_ends_when_it_is_told_to),
                   TEST(pressure_inflates_a_thick_sphere), TEST(triangles_are_chosen_by_region));
}
