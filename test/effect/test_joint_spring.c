// TEST quick seconds=60
/* test_joint_spring.c: springs between points of two groups of nodes: energy, Hessian, momenta, and the frequency of
 * two oscillating blocks. */
#include <stdlib.h>

#include "body.h"
#include "flesh/effects.h"
#include "methods.h"
#include "test.h"
#include "test_matrix.h"

enum { EACH = 8, UNKNOWNS = 2 * 3 * EACH };

static const int low[EACH] = {0, 1, 2, 3, 4, 5, 6, 7}, high[EACH] = {8, 9, 10, 11, 12, 13, 14, 15};
static const double under[3] = {0.5, 0.5, 1}, over[3] = {0.5, 0.5, 2};

/* Two blocks: 1 m^3 below, half of that from z = 2 above: 1000 and 500 kg. */
static void make(double young, test_body *b)
{
  flesh_mesh *part[2] = {NULL}, *mesh = NULL;
  flesh_material material;
  double X[UNKNOWNS];
  int tets[2 * 6 * 4];
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_mesh_box((int[]){1, 1, 1}, (double[]){1, 1, k ? 0.5 : 1}, (double[]){0, 0, 2. * k}, &part[k]));
    CHECK(flesh_mesh_tet_count(part[k]) == 6 && flesh_mesh_node_count(part[k]) == EACH);
    memcpy(X + 3 * EACH * k, flesh_mesh_positions(part[k]), 3 * EACH * sizeof *X);
    for (int i = 0; i < 24; i++) tets[24 * k + i] = EACH * k + flesh_mesh_tets(part[k])[i];
    flesh_mesh_destroy(&part[k]);
  }
  CHECK_OK(flesh_mesh_create(2 * EACH, X, 12, tets, NULL, &mesh));
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, young, 0.3, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, b));
}

/* Adds a spring between points carried by `first` and `second`. */
static int make_spring(const flesh_body *body, flesh_nodes first, flesh_nodes second, const double p[3], const double q[3],
                       double stiffness, double length, flesh_effect **effect)
{
  const flesh_carried_point ends[2] = {{first, {p[0], p[1], p[2]}}, {second, {q[0], q[1], q[2]}}};
  return flesh_effect_joint_spring(body, &ends[0], &ends[1], stiffness, length, effect);
}

static flesh_effect *join(const test_body *b, const double p[3], const double q[3], double stiffness, double length)
{
  flesh_effect *effect = NULL;
  CHECK_OK(make_spring(&b->body, (flesh_nodes){EACH, low}, (flesh_nodes){EACH, high}, p, q, stiffness, length, &effect));
  return effect;
}

static double energy_at(const flesh_effect *effect, const double *x)
{
  double energy = NAN;
  const flesh_point point = flesh_point_at(0, x, NULL, NULL);
  CHECK_OK(effect->operations->energy(effect, &point, &energy));
  return energy;
}

/* Turns the upper block about p by an angle in the plane of x and z, and moves it by (0, shift, 0). */
static void turn(test_body *b, const double p[3], double angle, double shift)
{
  const double *X = flesh_mesh_positions(b->mesh);
  for (int i = EACH; i < 2 * EACH; i++) {
    const double dx = X[3 * i] - p[0], dz = X[3 * i + 2] - p[2];
    b->state.x[3 * i] = p[0] + cos(angle) * dx - sin(angle) * dz;
    b->state.x[3 * i + 1] = X[3 * i + 1] + shift;
    b->state.x[3 * i + 2] = p[2] + sin(angle) * dx + cos(angle) * dz;
  }
}

/* The points lie outside the blocks; the second is carried 0.7 m away from its block. */
static void energy_is_that_of_the_distance(void)
{
  test_body b;
  const double k = 300, p[3] = {1.2, 0.5, 0.3}, q[3] = {0.5, 0.5, 3.2}, rest = sqrt(0.7 * 0.7 + 2.9 * 2.9);
  make(1e5, &b);
  for (int kind = 0; kind < 3; kind++) {
    const double length = kind == 0 ? NAN : kind == 1 ? 0 : 4, L = kind == 0 ? rest : length;
    flesh_effect *effect = join(&b, p, q, k, length);
    for (int s = 0; s < 4; s++) {
      turn(&b, q, 0.4 * s, 0.5 * s);
      const double wanted = k / 2 * pow(sqrt(rest * rest + 0.25 * s * s) - L, 2), energy = energy_at(effect, b.state.x);
      CHECK_NEAR(energy, wanted, 1e-10 * k);
    }
    flesh_effect_destroy(&effect);
  }
  test_body_destroy(&b);
}

/* The groups are disjoint, or share nodes. */
static void derivatives_and_balances_hold(void)
{
  const int all[2 * EACH] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const double lengths[] = {NAN, 0, 0.4, 5};
  test_body b;
  make(1e5, &b);
  test_jitter(b.n, 0.2, 5, b.state.x);
  for (int kind = 0; kind < 4; kind++) {
    double sums[6], r[UNKNOWNS] = {0};
    flesh_derivative_report report;
    flesh_effect *effect = NULL;
    const flesh_nodes others = kind < 2 ? (flesh_nodes){EACH, high} : (flesh_nodes){2 * EACH, all};
    CHECK_OK(make_spring(&b.body, (flesh_nodes){EACH, low}, others, (double[]){0.3, 0.2, 0.8}, (double[]){0.9, 0.4, 2.1},
                         700, lengths[kind], &effect));
    const flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    const double size = test_sums(&b, r, sums);
    CHECK(size > 1);
    for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-12 * size);
    CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
    printf("# length %g: potential %.1e, Jacobian %.1e, negative %.1e\n", lengths[kind], report.potential[0],
           report.jacobian[0], report.negative);
    CHECK(flesh_derivative_report_passes(&report, 1e-6));
    flesh_effect_destroy(&effect);
  }
  test_body_destroy(&b);
}

static double form(const double u[3], const double *H, int row, int column, const double v[3])
{
  double sum = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) sum += u[i] * H[(3 * row + i) * UNKNOWNS + 3 * column + j] * v[j];
  return sum;
}

/* Between two nodes: k along the spring, k (1 - L/|d|) across it, filtered. */
static void hessian_is_the_closed_form(void)
{
  const double k = 50, lengths[] = {0, 0.6, 3}; /* |d| is 1.5 */
  const double n[3] = {2. / 3, 2. / 3, 1. / 3}, t[3] = {-1 / 3., 2 / 3., -2 / 3.};
  for (int kind = 0; kind < 3; kind++) {
    test_body b;
    flesh_effect *effect = NULL;
    flesh_system *system = NULL;
    flesh_block_matrix *K = NULL;
    make(1e5, &b);
    const double *X = flesh_mesh_positions(b.mesh);
    CHECK_OK(make_spring(&b.body, (flesh_nodes){1, (int[]){12}}, (flesh_nodes){1, (int[]){3}}, X + 36, X + 9, k,
                         lengths[kind], &effect));
    CHECK_OK(flesh_system_create(b.mesh, &system));
    CHECK_OK(flesh_system_add_effect(system, &effect));
    CHECK_OK(flesh_system_finalize(system));
    CHECK_OK(flesh_system_matrix_create(system, &K));
    for (int c = 0; c < 3; c++) b.state.x[36 + c] = b.state.x[9 + c] + 1.5 * n[c];
    const flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    const double across = k * (1 - lengths[kind] / 1.5);
    const flesh_eigenvalue_filter filters[] = {FLESH_FILTER_NONE, FLESH_FILTER_CLAMP, FLESH_FILTER_ABSOLUTE};
    for (int f = 0; f < 3; f++) {
      const double wanted = f == 0 ? across : f == 1 ? fmax(across, 0) : fabs(across);
      CHECK_OK(flesh_system_jacobian(system, &point, &(flesh_shift){.x = 2, .filter = filters[f]}, K));
      double *H = test_dense(K);
      for (int pair = 0; pair < 3; pair++) {
        const int row = pair == 1 ? 12 : 3, column = pair ? 12 : 3, sign = pair == 2 ? -1 : 1;
        CHECK_NEAR(form(n, H, row, column, n), sign * 2 * k, 1e-12 * k);
        CHECK_NEAR(form(t, H, row, column, t), sign * 2 * wanted, 1e-12 * k);
        CHECK_NEAR(form(t, H, row, column, n), 0, 1e-12 * k);
      }
      free(H);
    }
    flesh_block_matrix_destroy(&K);
    flesh_system_destroy(&system);
    test_body_destroy(&b);
  }
}

/* If the points meet, or nearly do, everything is finite; if they meet, there is no force. */
static void points_that_meet_are_no_trouble(void)
{
  test_body b;
  make(1e5, &b);
  flesh_effect *effect = join(&b, under, over, 10, 0.5);
  for (int kind = 0; kind < 3; kind++) {
    double r[UNKNOWNS] = {0}, largest = 0;
    flesh_derivative_report report;
    for (int d = 3 * EACH; d < b.n; d++)
      b.state.x[d] = flesh_mesh_positions(b.mesh)[d] - (d % 3 == 2 ? 1 - (kind == 0 ? 0 : kind == 1 ? 1e-14 : 1e-4) : 0);
    const flesh_point point = flesh_point_at(0, b.state.x, NULL, NULL);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    for (int d = 0; d < b.n; d++) largest = fmax(largest, isnan(r[d]) ? INFINITY : fabs(r[d]));
    CHECK_BELOW(largest, 10 * 0.5); /* k L times weights of 1/8 to 3/8 */
    CHECK_NEAR(energy_at(effect, b.state.x), 10 / 2. * 0.25, 1e-3);
    if (kind == 2) CHECK_OK(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 3, &report));
  }
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

/* Along their common axis the distance of stiff blocks is L + (v/w) sin(w t), w^2 = k (1/m_1 + 1/m_2). The midpoint
 * rule advances w t by 2 atan(w h/2) in a step. The blocks deform by about k/E of the amplitude, E in N/m. */
static void stiff_blocks_swing_at_their_frequency(void)
{
  test_body b;
  const double k = 1e3, v = 0.3, omega = sqrt(k * (1 / 1000. + 1 / 500.)), h = 0.05;
  make(1e8, &b);
  flesh_effect *effect = join(&b, under, over, k, NAN);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < 2 * EACH; i++) b.state.v[3 * i + 2] = i < EACH ? -v / 3 : 2 * v / 3;
  flesh_solver_options options = test_options(1e-9);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_MIDPOINT, &options, &integrator));
  double worst = 0, middle = 0;
  for (int s = 1; s <= 90; s++) { /* 1.24 periods */
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    double d = 0;
    for (int i = 0; i < EACH; i++) d += (b.state.x[3 * (i + EACH) + 2] - b.state.x[3 * i + 2]) / EACH;
    worst = fmax(worst, fabs(d - 1.75 - v / omega * sin(2 * atan(omega * h / 2) * s)));
  }
  for (int i = 0; i < EACH; i++) middle += (b.state.v[3 * (i + EACH) + 2] + 2 * b.state.v[3 * i + 2]) / EACH;
  printf("# off by %.2g of the amplitude %.3g m; the sum of momenta is %.1g of one\n", worst * omega / v, v / omega,
         middle / v);
  CHECK_BELOW(worst, 1e-3 * v / omega);
  CHECK_BELOW(fabs(middle), 1e-4 * v); /* the residuals of the solves */
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Returns the sum of energies, and in *moving all but the elastic energy of a block at rest. */
static double total_energy(const test_body *b, double *moving)
{
  double energies[8], sum = 0;
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  for (int e = 0; e < flesh_system_effect_count(b->system); e++) sum += energies[e];
  *moving = energies[0] + energies[2];
  return sum;
}

/* Returns the largest change of energy, as a fraction of the first, of blocks that move apart and turn for 0.8 s, on a
 * spring away from their centres. */
static double tumble(flesh_method method, double h)
{
  test_body b;
  double before[6], after[6], worst = 0, size = 0, scale, now;
  make(1e6, &b);
  flesh_effect *effect = join(&b, (double[]){0.8, 0.4, 0.9}, (double[]){0.3, 0.9, 2.1}, 2e4, 1);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int i = 0; i < 2 * EACH; i++) {
    const double *X = flesh_mesh_positions(b.mesh) + 3 * i, turn = i < EACH ? 1 : -2;
    b.state.v[3 * i] = turn * (X[2] - 1.5) + 1;
    b.state.v[3 * i + 1] = turn;
    b.state.v[3 * i + 2] = -turn * (X[0] - 0.5);
  }
  flesh_solver_options options = test_options(1e-10);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  const double start = total_energy(&b, &scale);
  test_momenta(&b, before);
  for (double t = 0; t < 0.8 - h / 2; t += h) {
    CHECK_OK(flesh_integrator_step(integrator, &b.state, h, NULL));
    worst = fmax(worst, fabs(total_energy(&b, &now) - start) / scale);
  }
  test_momenta(&b, after);
  for (int c = 0; c < 6; c++) size = fmax(size, fabs(before[c]));
  for (int c = 0; c < (method == FLESH_METHOD_MIDPOINT ? 6 : 3); c++) CHECK_NEAR(after[c], before[c], 1e-7 * size);
  printf("# %s, h = %g s: energy %.4g J within %.2g, momenta of %.3g within", flesh_method_name(method), h, scale, worst, size);
  for (int c = 0; c < 6; c++) printf(" %.1g", (after[c] - before[c]) / size);
  putchar('\n');
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return worst;
}

static void energy_stays_by_the_order_and_momenta_stay(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    const int order = flesh_method_order(method);
    const double coarse = tumble(method, 0.008), fine = tumble(method, 0.004);
    CHECK_BELOW(coarse, order == 1 ? 0.5 : method == FLESH_METHOD_MIDPOINT ? 2e-3 : 2e-2);
    /* A half and a quarter; bdf2's damping falls faster, but only with shorter steps. */
    CHECK_BELOW(fine, coarse / (order == 1 ? 1.5 : method == FLESH_METHOD_BDF2 ? 2.2 : 3));
  }
}

/* Faces and edges of the blocks carry points that lie in them, in any orientation, under affine motions. */
static void planes_and_lines_carry_their_points(void)
{
  const double A[9] = {1.3, 0.4, -0.2, 0.1, 0.8, 0.3, -0.5, 0.2, 1.1}, k = 300;
  for (int trial = 0; trial < 40; trial++) {
    double Q[9], moved[3], X[UNKNOWNS], ends[2][3] = {{0.3, 0.6, 1}, {0.7, trial % 2, 2}};
    random_rotation(Q);
    test_body b;
    make(1e5, &b);
    for (int i = 0; i < 2 * EACH; i++) flesh_mat3_times(Q, flesh_mesh_positions(b.mesh) + 3 * i, X + 3 * i);
    flesh_mesh *turned = NULL;
    CHECK_OK(flesh_mesh_create(2 * EACH, X, 12, flesh_mesh_tets(b.mesh), NULL, &turned));
    flesh_body body = b.body;
    body.mesh = turned;
    for (int e = 0; e < 2; e++) memcpy(moved, ends[e], sizeof moved), flesh_mat3_times(Q, moved, ends[e]);
    const int line[2] = {8 + 2 * (trial % 2), 9 + 2 * (trial % 2)};
    flesh_effect *effect = NULL;
    CHECK_OK(make_spring(&body, (flesh_nodes){4, low + 4}, (flesh_nodes){2, line}, ends[0], ends[1], k, 0, &effect));
    for (int i = 0; i < 2 * EACH; i++) flesh_mat3_times(A, X + 3 * i, b.state.x + 3 * i);
    double d[3];
    for (int i = 0; i < 3; i++) d[i] = ends[1][i] - ends[0][i];
    flesh_mat3_times(A, d, moved);
    const double energy = effect ? energy_at(effect, b.state.x) : NAN;
    CHECK_NEAR(energy, k / 2 * flesh_vec3_dot(moved, moved), 1e-11 * k);
    flesh_effect_destroy(&effect);
    flesh_mesh_destroy(&turned);
    test_body_destroy(&b);
  }
}

static void nonsense_is_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  make(1e5, &b);
  const int far[1] = {16};
#define REFUSED(text, n, some, m, others, ...)                                                                         \
  CHECK(make_spring(&b.body, (flesh_nodes){n, some}, (flesh_nodes){m, others}, __VA_ARGS__, &effect) ==                 \
            FLESH_ERR_ARGUMENT && !effect);                                                                            \
  CHECK_TEXT(flesh_error_text(), text)
  REFUSED("cannot carry", 1, low, EACH, high, under, over, 1, 1);
  REFUSED("given 8 and 0 nodes", EACH, low, 0, high, under, over, 1, 1);
  REFUSED("given node 16", EACH, low, 1, far, under, over, 1, 1);
  REFUSED("stiffness is -2", EACH, low, EACH, high, under, over, -2, 1);
  REFUSED("second_point is", EACH, low, EACH, high, under, ((double[]){NAN, 0, 0}), 1, 1);
  REFUSED("length is -1", EACH, low, EACH, high, under, over, 1, -1);
  REFUSED("length is inf", EACH, low, EACH, high, under, over, 1, INFINITY);
  REFUSED("no direction", EACH, low, EACH, high, under, under, 1, 1);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(energy_is_that_of_the_distance), TEST(derivatives_and_balances_hold),
                   TEST(hessian_is_the_closed_form), TEST(points_that_meet_are_no_trouble),
                   TEST(stiff_blocks_swing_at_their_frequency), TEST(energy_stays_by_the_order_and_momenta_stay),
                   TEST(planes_and_lines_carry_their_points), TEST(nonsense_is_refused));
}
