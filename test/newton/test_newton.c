// TEST quick
/* test_newton.c: the parts of a Newton iteration, one by one, on potentials with known values: each node has its own
 * spring along x. */
#include "base/error.h"
#include "body.h"
#include "newton/stage.h"
#include "test.h"

/* Node i has the potential f(x_i - X_i); the other two directions have springs of stiffness 1. */
typedef struct wells {
  int nodes;
  const double *X;
  double (*f)(double x, int derivative);
} wells;

static int wells_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const wells *w = effect->data;
  for (int d = 0; d < 3 * w->nodes; d++) {
    const double x = point->x[d] - w->X[d];
    r[d] += d % 3 ? x : w->f(x, 1);
  }
  return FLESH_OK;
}

static int wells_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                          flesh_block_matrix *K, const int *slots)
{
  const wells *w = effect->data;
  (void)slots;
  for (int d = 0; d < 3 * w->nodes; d++) {
    double k = d % 3 ? 1 : w->f(point->x[d] - w->X[d], 2);
    if (shift->filter == FLESH_FILTER_CLAMP) k = fmax(k, 0);
    if (shift->filter == FLESH_FILTER_ABSOLUTE) k = fabs(k);
    K->values[9 * (size_t)K->row_start[d / 3] + 4 * (size_t)(d % 3)] += shift->x * k;
  }
  return FLESH_OK;
}

static int wells_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                           double *magnitude)
{
  const wells *w = effect->data;
  for (int d = 0; d < 3 * w->nodes; d++) {
    const double x = point->x[d] - w->X[d], value = (d % 3 ? x * x / 2 : w->f(x, 0)) / shift->x;
    *phi += value;
    *magnitude += fabs(value);
  }
  return FLESH_OK;
}

static const flesh_effect_operations operations = {.name = "wells", .residual = wells_residual,
                                                   .jacobian = wells_jacobian, .potential = wells_potential};

/* x^2/2: Newton's step is exact. */
static double quadratic(double x, int derivative) { return derivative == 0 ? x * x / 2 : derivative == 1 ? x : 1; }

/* x^4/4 - x^2/2: a hill at 0 and minima at 1 and -1. */
static double double_well(double x, int derivative)
{
  return derivative == 0 ? x * x * x * x / 4 - x * x / 2 : derivative == 1 ? x * x * x - x : 3 * x * x - 1;
}

/* x^4/4: a full Newton step goes a third of the way. */
static double flat(double x, int derivative)
{
  return derivative == 0 ? x * x * x * x / 4 : derivative == 1 ? x * x * x : 3 * x * x;
}

typedef struct bench {
  flesh_mesh *mesh;
  flesh_system *system;
  wells w;
  flesh_newton newton;
  int n;
  double *u, *r, *p; /* [n] */
} bench;

/* Starts every node at `start` of its potential, in statics. */
static void make(bench *b, double (*f)(double x, int derivative), const flesh_solver_options *options, double start)
{
  flesh_effect *effect = NULL;
  memset(b, 0, sizeof *b);
  b->mesh = test_box(3, 2, 2, 3, 2, 2);
  b->w = (wells){flesh_mesh_node_count(b->mesh), flesh_mesh_positions(b->mesh), f};
  b->n = 3 * b->w.nodes;
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_create(&operations, b->mesh, &b->w, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_system_finalize(b->system));
  CHECK_OK(flesh_newton_init(b->system, options, (flesh_stage_solver){0}, &b->newton));
  b->u = calloc(3 * (size_t)b->n, sizeof *b->u);
  b->r = b->u + b->n;
  b->p = b->u + 2 * b->n;
  const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = b->w.X};
  flesh_newton_set_stage(&b->newton, &stage);
  for (int d = 0; d < b->n; d += 3) b->u[d] = start;
  CHECK_OK(flesh_equations_residual(&b->newton.equations, b->u, b->r));
}

static void discard(bench *b)
{
  flesh_newton_clear(&b->newton);
  flesh_system_destroy(&b->system);
  flesh_mesh_destroy(&b->mesh);
  free(b->u);
}

static double potential_at(bench *b, double length)
{
  double phi, magnitude, *at = calloc((size_t)b->n, sizeof *at);
  for (int d = 0; d < b->n; d++) at[d] = b->u[d] + length * b->p[d];
  CHECK_OK(flesh_equations_potential(&b->newton.equations, at, &phi, &magnitude));
  free(at);
  return phi;
}

/* Searches along p; r is the residual at u. */
static int search(bench *b, flesh_step *found)
{
  double *minus = malloc((size_t)b->n * sizeof *minus);
  for (int d = 0; d < b->n; d++) minus[d] = -b->r[d];
  *found = (flesh_step){.u = b->u, .b = minus, .p = b->p, .kind = FLESH_DIRECTION_NEWTON};
  const int status = flesh_search_run(&b->newton.search, found);
  free(minus);
  return status;
}

static flesh_solver_options defaults(void)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  return options;
}

/* A step that lowers the potential by less than 1e-4 times the slope, as Armijo's condition requires, is cut, even if
 * the potential rises only a little. */
static void steps_without_sufficient_decrease_are_cut(void)
{
  const flesh_solver_options options = defaults();
  /* p = -s u on x^2/2: the decrease is s (1 - s/2) of u^2, the slope is s times u^2. */
  static const struct {
    double s;
    int cut;
  } cases[] = {{1, 0}, {1.99, 0}, {2 - 3e-4, 0}, {2 - 1e-4, 1}, {2 - 1e-7, 1}, {2, 1}, {2 + 1e-9, 1}, {5, 1}};
  for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
    bench b;
    flesh_step found;
    make(&b, quadratic, &options, 1);
    for (int d = 0; d < b.n; d++) b.p[d] = -cases[k].s * b.u[d];
    const double before = potential_at(&b, 0), slope = -cases[k].s * 2 * before;
    CHECK_OK(search(&b, &found));
    if ((found.cut < 1) != cases[k].cut) printf("# s = %.9g is cut to %g\n", cases[k].s, found.cut);
    CHECK((found.cut < 1) == cases[k].cut);
    CHECK(before - potential_at(&b, 1) >= 0.999999e-4 * -slope * found.length);
    discard(&b);
  }
}

/* The first trial that is cut moves to the minimum of a parabola; if that is too near or too far, the step is cut to a
 * tenth or a half. */
static void cuts_go_to_the_minimum_of_the_parabola(void)
{
  const flesh_solver_options options = defaults();
  /* p = -s u on x^2/2 has its minimum at the length 1/s. */
  static const double cases[][2] = {{2.5, 0.4}, {4, 0.25}, {8, 0.125}, {2.0001, 0.49997500124993756}};
  for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
    bench b;
    flesh_step found;
    make(&b, quadratic, &options, 1);
    for (int d = 0; d < b.n; d++) b.p[d] = -cases[k][0] * b.u[d];
    CHECK_OK(search(&b, &found));
    CHECK_NEAR(found.length, cases[k][1], 1e-12);
    CHECK(b.newton.stats.backtracks == 1);
    discard(&b);
  }
  bench b; /* the parabola's minimum, at 1/40, is nearer than a tenth, from where the next one is exact */
  flesh_step found;
  make(&b, quadratic, &options, 1);
  for (int d = 0; d < b.n; d++) b.p[d] = -40 * b.u[d];
  CHECK_OK(search(&b, &found));
  CHECK_NEAR(found.length, 0.025, 1e-12);
  CHECK(b.newton.stats.backtracks == 2);
  discard(&b);
}

static void predictions_are_those_of_the_quadratic_model(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  flesh_step found;
  make(&b, quadratic, &options, 2);
  for (int d = 0; d < b.n; d++) b.p[d] = -b.u[d];
  const double before = potential_at(&b, 0);
  CHECK_OK(search(&b, &found));
  CHECK_NEAR(found.predicted, before, 1e-12 * before);
  CHECK_NEAR(found.actual, before, 1e-12 * before);
  CHECK(!found.unpredicted && found.length == 1 && isnan(found.model_ratio));
  discard(&b);
}

static void ascent_and_hopeless_directions_are_told(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  flesh_step found;
  make(&b, quadratic, &options, 1);
  for (int d = 0; d < b.n; d++) b.p[d] = b.u[d];
  CHECK(search(&b, &found) == FLESH_NOT_POSITIVE);
  /* A residual that is not the potential's gradient: the step points uphill. */
  for (int d = 0; d < b.n; d++) b.r[d] = -b.r[d];
  CHECK(search(&b, &found) == FLESH_NOT_CONVERGED);
  discard(&b);
}

/* The true Hessian at the top of a hill is negative: it is refused, or followed downhill, or filtered. */
static void directions_tell_their_kind(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  flesh_direction_kind kind = FLESH_DIRECTION_NEWTON;
  make(&b, double_well, &options, 0.1);
  flesh_direction *direction = &b.newton.direction;
  double *right = calloc((size_t)b.n, sizeof *right);
  for (int d = 0; d < b.n; d++) right[d] = -b.r[d];
  flesh_direction_request request = {.tolerance = 1e-10, .max_iterations = 100};
  CHECK_OK(flesh_direction_assemble(direction, b.u, FLESH_FILTER_NONE));
  CHECK_OK(flesh_matrix_policy_refresh(&b.newton.policy));
  CHECK(flesh_direction_solve(direction, &request, right, b.p, &kind) == FLESH_NOT_POSITIVE);
  request.follow_curvature = 1;
  CHECK_OK(flesh_direction_solve(direction, &request, right, b.p, &kind));
  CHECK(kind == FLESH_DIRECTION_NEGATIVE_CURVATURE && flesh_dot(NULL, b.n, b.r, b.p) < 0);
  static const flesh_eigenvalue_filter filters[] = {FLESH_FILTER_ABSOLUTE, FLESH_FILTER_NONE};
  static const double starts[] = {0.1, 2};
  for (int k = 0; k < 2; k++) {
    for (int d = 0; d < b.n; d += 3) b.u[d] = starts[k];
    CHECK_OK(flesh_equations_residual(&b.newton.equations, b.u, b.r));
    for (int d = 0; d < b.n; d++) right[d] = -b.r[d];
    CHECK_OK(flesh_direction_assemble(direction, b.u, filters[k]));
    CHECK_OK(flesh_matrix_policy_refresh(&b.newton.policy));
    CHECK_OK(flesh_direction_solve(direction, &request, right, b.p, &kind));
    CHECK(kind == (k ? FLESH_DIRECTION_NEWTON : FLESH_DIRECTION_FILTERED));
    const double x = starts[k];
    CHECK_NEAR(b.p[0], -double_well(x, 1) / fabs(double_well(x, 2)), 1e-9);
  }
  free(right);
  discard(&b);
}

/* Takes one iteration, from the matrix to the step. */
static int iterate(bench *b)
{
  double *right = calloc((size_t)b->n, sizeof *right);
  CHECK_OK(flesh_newton_matrix(&b->newton, b->u, b->r));
  int status = flesh_newton_prepare(&b->newton, 1);
  for (int d = 0; d < b->n; d++) right[d] = -b->r[d];
  if (!status) status = flesh_newton_step(&b->newton, NULL, right, 1e-10, b->p);
  free(right);
  return status;
}

/* A factor's solve has no residual, although conjugate gradients had left one before, so its full step ends a solve
 * with a given target. */
static void a_factor_leaves_no_residual(void)
{
  const flesh_solver_options options = defaults();
  const flesh_direction_request given_up = {.tolerance = 1e-10, .max_iterations = 0};
  bench b;
  flesh_direction_kind kind;
  make(&b, quadratic, &options, 1);
  flesh_newton *newton = &b.newton;
  newton->goal.target = newton->policy.target = 1e-3;
  newton->goal.node_mass = 1;
  CHECK_OK(flesh_newton_matrix(newton, b.u, b.r));
  CHECK_OK(flesh_newton_prepare(newton, 1));
  CHECK(flesh_direction_solve(&newton->direction, &given_up, b.r, b.p, &kind) == FLESH_NOT_CONVERGED);
  CHECK_NEAR(newton->direction.residual, flesh_norm(NULL, b.n, b.r), 1e-12);
  CHECK_OK(flesh_direction_solve_directly(&newton->direction, b.r, b.p));
  CHECK_BELOW(test_distance(b.n, b.p, b.u), 1e-12);
  CHECK_BELOW(newton->direction.residual, 1e-12);
  CHECK_OK(iterate(&b));
  CHECK(newton->stats.direct == 2 && newton->iterations.converged_by_step);
  discard(&b);
}

/* The transitions from an indefinite matrix, with either linear solver. */
static void indefinite_matrices_are_filtered_where_that_is_asked_for(void)
{
  static const flesh_linear_solver solvers[] = {FLESH_LINEAR_PCG, FLESH_LINEAR_KLU};
  static const flesh_eigenvalue_filter filters[] = {FLESH_FILTER_AUTO, FLESH_FILTER_TRUST_REGION_ALWAYS,
                                                    FLESH_FILTER_NONE};
  for (int s = 0; s < 2; s++)
    for (int k = 0; k < 3; k++) {
      bench b;
      flesh_solver_options options = defaults();
      options.linear_solver = solvers[s];
      options.eigenvalue_filter = filters[k];
      make(&b, double_well, &options, 0.1);
      const int status = iterate(&b);
      if (filters[k] == FLESH_FILTER_NONE) {
        CHECK(status == FLESH_NOT_POSITIVE && b.newton.stats.newton == 0);
      } else {
        CHECK_OK(status);
        CHECK(b.newton.direction.filter != FLESH_FILTER_NONE && b.newton.stats.newton == 1);
        CHECK(potential_at(&b, 1) < potential_at(&b, 0));
      }
      CHECK(b.newton.stats.assemblies == 1 + (k == 0));
      discard(&b);
    }
}

/* A filter that leaves negative eigenvalues unchanged is none. */
static void without_a_filter_indefinite_matrices_are_refused(void)
{
  bench b;
  flesh_solver_options options = defaults();
  options.eigenvalue_filter = FLESH_FILTER_NONE;
  make(&b, double_well, &options, 0.1);
  CHECK(iterate(&b) == FLESH_NOT_POSITIVE && b.newton.stats.assemblies == 1);
  discard(&b);
}

static int no_preconditioner(flesh_preconditioner kind, const flesh_block_matrix *A, const double *positions,
                             int order, flesh_threads *threads, flesh_preconditioner_data **preconditioner)
{
  (void)kind, (void)A, (void)positions, (void)order, (void)threads, (void)preconditioner;
  return flesh_fail(FLESH_ERR_MEMORY, "no memory for a preconditioner");
}

/* A preconditioner that lacked memory is made by the next attempt. */
static void solvers_that_could_not_be_made_are_made_later(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  make(&b, quadratic, &options, 1);
  flesh_direction *direction = &b.newton.direction;
  const flesh_linear *linear = direction->linear;
  flesh_linear without = *linear;
  without.preconditioner_create = no_preconditioner;
  b.newton.equations.patterns++;
  direction->linear = &without;
  CHECK(flesh_direction_follow_pattern(direction) == FLESH_ERR_MEMORY && !direction->preconditioner);
  direction->linear = linear;
  CHECK_OK(flesh_direction_follow_pattern(direction));
  CHECK(direction->preconditioner != NULL);
  discard(&b);
}

/* Nothing is solved if the residual is at round-off. */
static void no_step_is_made_at_round_off(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  make(&b, quadratic, &options, 1e-17);
  CHECK_OK(iterate(&b));
  CHECK(b.newton.iterations.at_round_off && flesh_norm(NULL, b.n, b.p) == 0 && b.newton.stats.newton == 0);
  discard(&b);
}

/* Falls down to x = 1e-10, by a force of 1e-9 that a step of `kink` removes; half of that step ends on a bump. */
static double kink;

static double bump(double x, int derivative)
{
  const double from = 1e-10, force = 1e-9;
  const int inside = x > from - 2 * kink && x < from - 0.1 * kink;
  return derivative == 0 ? 1 + (inside ? 1e-12 : 0) : derivative == 1 ? (inside ? -10 : 1) * force : force / kink;
}

/* A residual at round-off is also accepted after a step that had to be cut but was too short to change any digit. */
static void no_step_is_made_below_the_last_digit(void)
{
  const flesh_solver_options options = defaults();
  static const double kinks[] = {1e-18, 1e-12};
  for (int k = 0; k < 2; k++) {
    bench b;
    kink = kinks[k];
    make(&b, bump, &options, 1e-10);
    CHECK_OK(iterate(&b));
    CHECK(b.newton.stats.newton == 1 && b.newton.stats.backtracks > 0);
    CHECK(b.newton.iterations.moved_nothing == (k == 0));
    CHECK_OK(iterate(&b));
    CHECK(b.newton.iterations.at_round_off == (k == 0) && b.newton.stats.newton == 1 + k);
    discard(&b);
  }
}

/* It is also accepted if the residual is within a few times of its round-off and falls no more, or returns to its old
 * value; a larger one, or one that falls fast, must still be solved. */
static void round_off_is_what_was_measured(void)
{
  const flesh_solver_options options = defaults();
  bench b;
  make(&b, quadratic, &options, 1);
  const double measured = flesh_equations_residual_round_off(&b.newton.equations, b.u);
  CHECK(measured > 1e-17 && measured < 1e-13);
  static const double multiples[] = {1, 3.9, 4.1, 40, 400, 1e4, 1e6};
  for (size_t k = 0; k < sizeof multiples / sizeof multiples[0]; k++) {
    const double norm = multiples[k] * measured;
    b.newton.policy.previous_norm = 2 * norm;
    CHECK(flesh_matrix_policy_at_round_off(&b.newton.policy, norm, b.u) == (multiples[k] <= 4));
    b.newton.policy.previous_norm = 10 * norm;
    b.newton.policy.smallest_norm = norm;
    CHECK(flesh_matrix_policy_at_round_off(&b.newton.policy, norm, b.u) == (multiples[k] <= 4));
    b.newton.policy.previous_norm = b.newton.policy.smallest_norm = 10 * norm;
    CHECK(!flesh_matrix_policy_at_round_off(&b.newton.policy, norm, b.u));
  }
  /* Round-off is not measured again if the residual is far above its old value. */
  for (int far = 0; far < 2; far++) {
    const double norm = (far ? 1.1e4 : 0.9e4) * measured / 2;
    b.newton.policy.round_off = measured / 2;
    b.newton.policy.previous_norm = 2 * norm;
    CHECK(!flesh_matrix_policy_at_round_off(&b.newton.policy, norm, b.u));
    CHECK((b.newton.policy.round_off == measured / 2) == far);
  }
  /* Nor is it in the next stage of a motion with the same shift. */
  for (int k = 0; k < 3; k++) {
    const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .a = k < 2}, .x0 = b.w.X};
    b.newton.policy.round_off = measured;
    b.newton.policy.prepared_for = (flesh_shift){.x = 1, .a = k == 0};
    flesh_newton_set_stage(&b.newton, &stage);
    CHECK(b.newton.policy.round_off == (k == 0 ? measured : 0));
  }
  discard(&b);
}

/* Solves of adaptive steps start at their first guess, even if u = 0 has a lower potential, after a solve without cuts
 * or near the solution; other solves start at the lower one. */
static void trusted_guesses_are_not_compared(void)
{
  const flesh_solver_options options = defaults();
  static const struct {
    double target; /* N; the guess has a residual of 6 N */
    int cuts, taken;
  } cases[] = {{1e-9, 0, 1}, {1e-9, 1, 0}, {1, 0, 1}, {1, 1, 1}, {0, 0, 0}};
  for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
    bench b;
    make(&b, quadratic, &options, 1);
    const flesh_stage stage = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = b.w.X};
    const double *guesses[] = {b.u, NULL};
    flesh_solve_stats stats = {0};
    flesh_stage_solve solve;
    b.newton.goal.target = cases[k].target;
    b.newton.goal.node_mass = b.newton.goal.of_first = 1;
    b.newton.stats.backtracks = cases[k].cuts;
    flesh_stage_begin(&b.newton, &stage, guesses, b.p, &stats, &solve);
    CHECK_OK(solve.status);
    CHECK_NEAR(flesh_norm(NULL, b.n, b.p), cases[k].taken ? flesh_norm(NULL, b.n, b.u) : 0, 0);
    discard(&b);
  }
}

/* The tolerance of a solve is never below half of the residual that the iteration may leave. */
static void solves_go_no_deeper_than_half_the_target(void)
{
  const flesh_solver_options options = defaults();
  static const double norms[] = {1, 1e-1, 1e-2, 1e-3, 1e-5};
  for (size_t k = 0; k < sizeof norms / sizeof norms[0]; k++)
    for (int kept = 0; kept < 2; kept++) {
      bench b;
      make(&b, quadratic, &options, 1);
      flesh_matrix_policy *policy = &b.newton.policy;
      policy->target = 1e-3;
      policy->kept = kept;
      policy->smallest_norm = 1;
      policy->predicted_error = 1e-9;
      const double asked = flesh_matrix_policy_tolerance(policy, norms[k], 1e-1);
      CHECK(asked >= 0.5e-3);
      if (norms[k] == 1e-2 || kept) CHECK_NEAR(asked, 0.5e-3, 1e-15); /* and exactly that if the target is near */
      discard(&b);
    }
}

/* A preconditioner of one step is reused in another with the same shift, in x, v and a. */
static void another_shift_needs_another_preconditioner(void)
{
  const flesh_solver_options options = defaults();
  for (int other = 0; other < 4; other++) {
    bench b;
    make(&b, quadratic, &options, 1);
    flesh_matrix_policy *policy = &b.newton.policy;
    const flesh_shift shift = b.newton.equations.stage.shift;
    policy->prepared_for = shift;
    policy->prepared_for.x += other == 1;
    policy->prepared_for.v += other == 2;
    policy->prepared_for.a += other == 3;
    policy->age = 3;
    policy->stage_continues = 1;
    flesh_matrix_policy_begin_stage(policy, 0, &(flesh_solve_stats){0});
    CHECK(policy->age == (other ? -1 : 4));
    discard(&b);
  }
}

/* K is reused once more if it has predicted the residual, and only then. */
static void matrices_are_kept_where_they_predict_residuals(void)
{
  static double (*const potentials[])(double x, int derivative) = {quadratic, flat};
  for (int k = 0; k < 2; k++) {
    const flesh_solver_options options = defaults();
    bench b;
    make(&b, potentials[k], &options, 1);
    b.newton.policy.target = 1e-6 * flesh_norm(NULL, b.n, b.r);
    CHECK_OK(iterate(&b));
    CHECK(b.newton.stats.assemblies == 1);
    /* Slightly off the step's end, so that something is left to be solved. */
    for (int d = 0; d < b.n; d++) b.u[d] += 0.999 * b.p[d];
    CHECK_OK(flesh_equations_residual(&b.newton.equations, b.u, b.r));
    CHECK_OK(iterate(&b));
    CHECK(b.newton.stats.assemblies == (k ? 2 : 1) && b.newton.policy.kept == !k);
    discard(&b);
  }
}

/* Filtered matrices, and those of other constraints or steps, are not kept. */
static void filtered_matrices_are_not_kept(void)
{
  flesh_solver_options options = defaults();
  options.eigenvalue_filter = FLESH_FILTER_TRUST_REGION_ALWAYS;
  bench b;
  make(&b, quadratic, &options, 1);
  b.newton.policy.target = 1e-6 * flesh_norm(NULL, b.n, b.r);
  CHECK_OK(iterate(&b));
  for (int d = 0; d < b.n; d++) b.u[d] += 0.999 * b.p[d];
  CHECK_OK(flesh_equations_residual(&b.newton.equations, b.u, b.r));
  CHECK_OK(iterate(&b));
  CHECK(b.newton.stats.assemblies == 2 && !b.newton.policy.kept);
  discard(&b);
}

/* The watchdog's step is taken if it ends lower than the cut one, otherwise the cut one stays; and it is tried at the
 * second cut of a stage, not before. */
static void watchdog_steps_are_taken_where_they_end_lower(void)
{
  for (int lower = 0; lower < 2; lower++) {
    const flesh_solver_options options = defaults();
    bench b;
    make(&b, quadratic, &options, 1);
    for (int cut = 1; cut <= 2; cut++) {
      for (int d = 0; d < b.n; d++) b.p[d] = -0.01 * b.u[d];
      /* a residual 100 times as stiff as the spring's own far along the step would be: a wall */
      for (int d = 0; d < b.n; d++) b.r[d] = -1e-3 * b.u[d];
      flesh_step step = {.u = b.u, .b = b.r, .p = b.p, .start = potential_at(&b, 0), .cut = 0.01};
      step.value = lower ? potential_at(&b, 1) : -1; /* the potential's lowest value */
      flesh_newton_accelerate(&b.newton, &step);
      CHECK_NEAR(b.p[0], cut == 2 && lower ? -1 : -0.01, 1e-6);
      CHECK((b.newton.stats.newton > 0) == (cut == 2));
    }
    CHECK(b.newton.stats.watchdog_steps == lower);
    discard(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(steps_without_sufficient_decrease_are_cut),
                   TEST(cuts_go_to_the_minimum_of_the_parabola), TEST(round_off_is_what_was_measured),
                   TEST(trusted_guesses_are_not_compared),
                   TEST(solves_go_no_deeper_than_half_the_target), TEST(another_shift_needs_another_preconditioner),
                   TEST(predictions_are_those_of_the_quadratic_model), TEST(ascent_and_hopeless_directions_are_told),
                   TEST(directions_tell_their_kind), TEST(a_factor_leaves_no_residual),
                   TEST(indefinite_matrices_are_filtered_where_that_is_asked_for),
                   TEST(without_a_filter_indefinite_matrices_are_refused),
                   TEST(solvers_that_could_not_be_made_are_made_later), TEST(no_step_is_made_at_round_off),
                   TEST(no_step_is_made_below_the_last_digit),
                   TEST(matrices_are_kept_where_they_predict_residuals),
                   TEST(filtered_matrices_are_not_kept), TEST(watchdog_steps_are_taken_where_they_end_lower));
}
