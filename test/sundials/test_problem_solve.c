// TEST quick seconds=5
/* test_problem_solve.c: flesh_problem_solve solves with the true derivative of the residual: along its solution the
 * residual changes by the right-hand side, with every linear solver, also if K is indefinite and if contact has
 * secants. */
#include "busy_bar.h"
#include "flesh/kinsol.h"
#include "sundials/problem.h"
#include "touching.h"

/* Returns a right-hand side of random forces on the free dofs, allocated. */
static double *forces(int n, int seed)
{
  double *b = calloc((size_t)n, sizeof *b);
  test_jitter(n, 1, (unsigned long long)seed, b);
  return b;
}

/* Returns the difference of the residual's derivative along p from b on the free dofs, over b; fourth-order differences
 * of `longest` [m] at u. */
static double departure(flesh_problem *problem, const double *u, const double *b, const double *p, double longest)
{
  flesh_equations *equations = &problem->newton.equations;
  const int n = equations->n;
  const double weights[] = {1. / 12, -2. / 3, 2. / 3, -1. / 12}, at[] = {-2, -1, 1, 2};
  double *x = calloc((size_t)n, sizeof *x), *r = calloc((size_t)n, sizeof *r), *sum = calloc((size_t)n, sizeof *sum);
  double largest = 0, off = 0, size = 0;
  for (int d = 0; d < n; d++) largest = fmax(largest, fabs(p[d]));
  const double step = longest / largest;
  for (int k = 0; k < 4; k++) {
    for (int d = 0; d < n; d++) x[d] = u[d] + at[k] * step * p[d];
    CHECK_OK(flesh_equations_residual(equations, x, r));
    for (int d = 0; d < n; d++) sum[d] += weights[k] * r[d] / step;
  }
  for (int d = 0; d < n; d++) {
    if (equations->constrained.is[d]) CHECK(p[d] == 0);
    else off += (sum[d] - b[d]) * (sum[d] - b[d]), size += b[d] * b[d];
  }
  free(x), free(r), free(sum);
  return sqrt(off / size);
}

static void the_residual_changes_by_the_right_hand_side(void)
{
  const flesh_linear_solver solvers[] = {FLESH_LINEAR_PCG, FLESH_LINEAR_KLU};
  for (int k = 0; k < 2; k++) {
    test_body b;
    flesh_problem *problem;
    flesh_solver_options options = test_options(1e-8);
    options.linear_solver = solvers[k];
    make_busy_bar(FLESH_MASS_CONSISTENT, &b);
    CHECK_OK(flesh_problem_create(b.system, &options, &problem));
    double *two = calloc(2 * (size_t)b.n, sizeof *two), *first = forces(b.n, 3), *second = forces(b.n, 4),
           *u = calloc((size_t)b.n, sizeof *u);
    CHECK(flesh_problem_solve(problem, u, 1, two, 1e-10) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "flesh_problem_set_stage comes first");
    const flesh_stage stage = {.t = 0.01, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 60, .a = 3600},
                               .x0 = b.state.x};
    CHECK_OK(flesh_problem_set_stage(problem, &stage));
    CHECK(flesh_problem_solve(problem, NULL, 1, two, 1e-10) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "u is NULL");
    CHECK(flesh_problem_solve(problem, u, 1, two, 2) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "tolerance of a solve is 2; it must be in [1e-13, 1)");
    CHECK(flesh_problem_solve(problem, u, -1, two, 1e-10) == FLESH_ERR_ARGUMENT);
    test_jitter(b.n, 0.02, 9, u);
    memcpy(two, first, (size_t)b.n * sizeof *two);
    memcpy(two + b.n, second, (size_t)b.n * sizeof *two);
    CHECK_OK(flesh_problem_solve(problem, u, 2, two, 1e-11));
    CHECK_BELOW(departure(problem, u, first, two, 1e-6), 1e-8);
    CHECK_BELOW(departure(problem, u, second, two + b.n, 1e-6), 1e-8);
    /* K is reused, and is symmetric: second . K^-1 first = first . K^-1 second. */
    double left = 0, right = 0;
    const uint8_t *is = problem->newton.equations.constrained.is;
    for (int d = 0; d < b.n; d++)
      if (!is[d]) left += second[d] * two[d], right += first[d] * two[b.n + d];
    CHECK_NEAR(left, right, 1e-9 * fabs(left));
    const int assemblies = flesh_problem_stats(problem)->assemblies;
    memcpy(u, first, (size_t)b.n * sizeof *u);
    CHECK_OK(flesh_problem_solve(problem, NULL, 1, first, 1e-11));
    for (int d = 0; d < b.n; d++) first[d] -= two[d];
    CHECK_BELOW(test_norm(b.n, first), 1e-9 * test_norm(b.n, two));
    CHECK(flesh_problem_stats(problem)->assemblies == assemblies);
    free(two), free(first), free(second), free(u);
    flesh_problem_destroy(&problem);
    test_body_destroy(&b);
  }
}

/* A column compressed to four fifths of its length stays straight, with an indefinite stiffness; an unconstrained one
 * has a singular one. */
static void indefinite_and_singular_matrices(void)
{
  for (int held = 0; held < 2; held++) {
    test_body b;
    flesh_problem *problem;
    const flesh_solver_options options = test_options(1e-8);
    CHECK_OK(test_body_create(test_box(16, 2, 2, 8, 1, 1), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0, &b));
    if (held) {
      CHECK_OK(test_body_hold(&b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
      CHECK_OK(test_body_hold(&b, 0, 8, FLESH_AXIS_X, NULL, -INFINITY, INFINITY));
    }
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_problem_create(b.system, &options, &problem));
    const flesh_stage stage = {.load = 1, .prescribed_fraction = 0, .shift = {.x = 1}, .x0 = b.state.x};
    double *u = calloc((size_t)b.n, sizeof *u), *right = forces(b.n, 5), *p = calloc((size_t)b.n, sizeof *p);
    for (int d = 0; d < b.n && held; d++) {
      const double X = flesh_mesh_positions(b.mesh)[d];
      b.state.x[d] = d % 3 ? X : 0.8 * X;
    }
    CHECK_OK(flesh_problem_set_stage(problem, &stage));
    memcpy(p, right, (size_t)b.n * sizeof *p);
    const int status = flesh_problem_solve(problem, u, 1, p, 1e-11);
    CHECK(status == (held ? FLESH_OK : FLESH_ERR_SOLVE));
    if (held) {
      CHECK(problem->newton.tangent.has_pivots); /* it was indefinite */
      CHECK_BELOW(departure(problem, u, right, p, 1e-6), 1e-7);
      problem->newton.tangent.most = 1e4; /* a number of operations that its factors exceed */
      memcpy(p, right, (size_t)b.n * sizeof *p);
      CHECK_OK(flesh_problem_solve(problem, u, 1, p, 1e-11));
      CHECK(problem->newton.tangent.indefinite);
      CHECK_BELOW(departure(problem, u, right, p, 1e-6), 1e-7);
      problem->newton.options.max_linear = 2;
      CHECK(flesh_problem_solve(problem, u, 1, right, 1e-11) == FLESH_ERR_SOLVE);
      CHECK_TEXT(flesh_error_text(), "the tangent is indefinite: its solves do not converge");
    } else CHECK_TEXT(flesh_error_text(), "singular");
    free(u), free(right), free(p);
    flesh_problem_destroy(&problem);
    test_body_destroy(&b);
  }
}

/* Newton's matrix of touching bodies has secants to the expected end of the iteration; this matrix has none. */
static void contact_has_its_tangent(void)
{
  touching m;
  flesh_problem *problem;
  CHECK_OK(touching_begin("body: {name: low, mesh: ../meshes/cube_3x3x3.mesh, density: 1000, " TOUCHING_MATERIAL "}\n"
                          "bodies:\n  - {name: up, mesh: ../meshes/cube_3x3x3.mesh, translation: [0.013, 0.007, 0.1012], "
                          "density: 1000, " TOUCHING_MATERIAL "}\n"
                          "effects:\n  - inertia: {}\n  - gravity: {}\n"
                          "  - pin: {body: low, box: [[-1, -1, -0.001], [1, 1, 0.001]]}\n"
                          "  - contact: {between: all, friction: 0.3, thickness: 0.002}\n"
                          "time: {method: backward-euler, step: 1/100, end: 1}\n", NULL, 1000, &m));
  const flesh_solver_options options = test_options(1e-8);
  CHECK_OK(flesh_problem_create(flesh_scene_system(m.scene), &options, &problem));
  const flesh_stage stage = {.t = 0.01, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 100, .a = 1e4},
                             .x0 = m.state.x};
  CHECK_OK(flesh_problem_set_stage(problem, &stage));
  double *u = calloc((size_t)m.n, sizeof *u), *b = forces(m.n, 6), *p = calloc((size_t)m.n, sizeof *p);
  for (int k = 0; k < 3; k++) { /* like iterates of Newton's method */
    for (int d = m.n / 2 + 2; d < m.n; d += 3) u[d] = -1e-4 * (k + 1);
    CHECK_OK(flesh_newton_matrix(&problem->newton, u, NULL));
  }
  memcpy(p, b, (size_t)m.n * sizeof *p);
  CHECK_OK(flesh_problem_solve(problem, u, 1, p, 1e-11));
  CHECK_BELOW(departure(problem, u, b, p, 1e-8), 1e-5);
  free(u), free(b), free(p);
  flesh_problem_destroy(&problem);
  touching_end(&m);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(the_residual_changes_by_the_right_hand_side), TEST(indefinite_and_singular_matrices),
                   TEST(contact_has_its_tangent));
}
