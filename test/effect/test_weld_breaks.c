// TEST full memory seconds=60
/* test_weld_breaks.c: breaking welds: where, when, what is released and conserved; refused steps, states,
 * compression. */
#include "temporary.h" /* first */
#include "effect/effect.h"

#include "flesh/ida.h"
#include "methods.h"
#include "welded.h"

static const double young = 1e5;

/* Two cubes of 1 m, one on the other. */
static void two_cubes(int order, const int lower[3], const int upper[3], int inertia, test_body *b)
{
  flesh_mesh *mesh = joined(box(lower, (double[]){1, 1, 1}, (double[]){0, 0, 0}),
                            box(upper, (double[]){1, 1, 1}, (double[]){0, 0, 1}));
  CHECK_OK(test_body_create(of_order(order, mesh), test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, inertia,
                            b));
}

static void hold_corner(test_body *b, double x, double z, unsigned axes, const flesh_motion *motion)
{
  for (int i = 0; i < b->n / 3; i++) {
    const double *X = flesh_mesh_positions(b->mesh) + 3 * i;
    if (X[0] != x || X[1] != 0 || X[2] != z) continue;
    if (!motion) CHECK_OK(flesh_system_add_pin(b->system, 1, &i, axes, -INFINITY, INFINITY));
    else CHECK_OK(flesh_system_add_prescribed_motion(b->system, 1, &i, axes, motion, -INFINITY, INFINITY));
  }
}

/* Makes internal variables for the state. */
static void give_internal(test_body *b)
{
  b->state.internal_count = flesh_system_internal_count(b->system);
  b->state.internal = calloc((size_t)b->state.internal_count + 1, sizeof *b->state.internal);
}

static void end(test_body *b)
{
  free(b->state.internal);
  test_body_destroy(b);
}

/* Pulls the top up by `most` m in a second; the bars can contract laterally. */
static void begin_pull(int order, const int lower[3], const int upper[3], double most, double breaks_at, test_body *b)
{
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {0, 0, most}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  two_cubes(order, lower, upper, 0, b);
  flesh_effect *effect = welded(b, 1e-9, NAN, breaks_at);
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(test_body_hold(b, 2, 0, FLESH_AXIS_Z, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 2, 2, FLESH_AXIS_Z, &motion, -INFINITY, INFINITY));
  for (int end = 0; end < 2; end++) {
    hold_corner(b, 0, 2 * end, FLESH_AXIS_X | FLESH_AXIS_Y, NULL);
    hold_corner(b, 1, 2 * end, FLESH_AXIS_Y, NULL);
  }
  CHECK_OK(flesh_system_finalize(b->system));
  give_internal(b);
}

/* Returns the force that pulls at the top, N. */
static double pull_of(const test_body *b)
{
  double *r = calloc(2 * (size_t)b->n, sizeof *r), *zeros = r + b->n, force = 0;
  flesh_point point = flesh_point_at(b->state.t, b->state.x, zeros, zeros);
  point.internal = b->state.internal;
  CHECK_OK(flesh_system_residual(b->system, &point, r));
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i + 2] == 2) force += r[3 * i + 2];
  free(r);
  return force;
}

static double broken_of(const test_body *b)
{
  const flesh_effect *weld = flesh_system_effect(b->system, flesh_system_effect_count(b->system) - 1);
  double values[3];
  flesh_point point = flesh_point_at(0, b->state.x, b->state.v, NULL);
  point.internal = b->state.internal;
  weld->operations->figures->report(weld, &point, values);
  return values[0];
}

static flesh_integrator *integrator_of(const test_body *b, flesh_method method, double tolerance)
{
  flesh_solver_options options = test_options(tolerance);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  return integrator;
}

/* A weld that breaks far beyond its limit, because the step is long, reports that. */
static void long_steps_tell_what_they_release_in_excess(void)
{
  for (int steps = 1; steps <= 20; steps += 19) {
    test_body b;
    char words[300] = "";
    begin_pull(1, (const int[]){2, 2, 1}, (const int[]){2, 2, 1}, 0.5, 0.13 * young, &b);
    flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-10);
    for (int s = 0; s < steps; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / steps, NULL));
    const flesh_effect *weld = flesh_system_effect(b.system, 1);
    weld->operations->internal->tell(weld, b.state.internal, sizeof words, words);
    printf("# in %d: %s\n", steps, words);
    CHECK_TEXT(words, "100 % of 1 m^2 broke");
    CHECK((strstr(words, "times the toughness of that area: shorter steps or a finer mesh release less") != NULL) == (steps == 1));
    flesh_integrator_destroy(&integrator);
    end(&b);
  }
}

/* The force at which the weld must break is that of a body with an unbreakable weld: in the first increment that ends
 * beyond breaks_at times the area, and not before, it breaks all at once, however the meshes meet. */
static void two_bars_break_at_the_force(void)
{
  enum { STEPS = 20 };
  const double most = 0.5, breaks_at = 0.13 * young;
  for (int run = 0; run < 3; run++) {
    const int order = run == 2 ? 2 : 1, lower[3] = {2, 2, 1}, upper[3] = {run ? 3 : 2, run ? 1 : 2, 1};
    test_body b, twin;
    begin_pull(order, lower, upper, most, breaks_at, &b);
    begin_pull(order, lower, upper, most, NAN, &twin);
    CHECK(b.state.internal_count > 0 && twin.state.internal_count == 0);
    flesh_integrator *breaks = integrator_of(&b, FLESH_METHOD_STATIC, 1e-10);
    flesh_integrator *holds = integrator_of(&twin, FLESH_METHOD_STATIC, 1e-10);
    int beyond = 0;
    double held = 0;
    const double k = force_per_metre(&b, flesh_system_effect(b.system, 1)); /* of 1 m^2 */
    for (int s = 0; s < STEPS && beyond < 3; s++) {
      CHECK_OK(flesh_integrator_step(breaks, &b.state, 1. / STEPS, NULL));
      CHECK_OK(flesh_integrator_step(holds, &twin.state, 1. / STEPS, NULL));
      const double force = pull_of(&b), wanted = pull_of(&twin);
      beyond += wanted > breaks_at;
      if (beyond == 1) /* energy of this traction stored in springs of stiffness k, per area */
        CHECK_NEAR(flesh_integrator_energy_balance(breaks)->released, wanted * wanted / (2 * k), 1e-6 * breaks_at * breaks_at / k);
      CHECK_NEAR(force, beyond ? 0 : wanted, 1e-6 * breaks_at);
      CHECK(broken_of(&b) == (beyond ? 1 : 0));
      if (beyond == 1) printf("# run %d: %.6g N held, %.6g N did not, of %.6g N\n", run, held, wanted, breaks_at);
      held = force;
    }
    CHECK(beyond == 3);
    flesh_integrator_destroy(&breaks);
    flesh_integrator_destroy(&holds);
    end(&b);
    end(&twin);
  }
}


/* A rotation by an angle about an axis of length 1. */
static void turn(const double axis[3], double angle, const double *p, double *q)
{
  const double along = axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2], s = sin(angle), c = cos(angle);
  for (int k = 0; k < 3; k++)
    q[k] = c * p[k] + (1 - c) * along * axis[k] + s * (axis[(k + 1) % 3] * p[(k + 2) % 3] - axis[(k + 2) % 3] * p[(k + 1) % 3]);
}

/* [nodes] Marks the nodes of the upper cube with 1. */
static char *nodes_of_upper(const test_body *b)
{
  char *upper = calloc((size_t)b->n / 3, 1);
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++)
    for (int a = 0; flesh_mesh_regions(b->mesh)[e] && a < (flesh_mesh_order(b->mesh) == 2 ? 10 : 4); a++)
      upper[a < 4 ? flesh_mesh_tets(b->mesh)[4 * e + a] : flesh_mesh_tet_edges(b->mesh)[6 * e + a - 4]] = 1;
  return upper;
}

/* The upper cube is shifted as a whole, which gives a uniform traction; then everything is rotated. The root of
 * tension^2 + shear^2 decides, to rounding, for tension, compression and all ratios of shear to them. */
static void tension_and_shear_count_together(void)
{
  const double stiffness = 1e6, breaks_at = 1e4, axis[3] = {2. / 3, -1. / 3, 2. / 3};
  for (int order = 1; order <= 2; order++) {
    test_body b;
    two_cubes(order, (int[]){2, 3, 1}, (int[]){3, 2, 1}, 0, &b);
    flesh_effect *weld = welded(&b, 1e-9, stiffness, breaks_at);
    CHECK_OK(flesh_system_add_effect(b.system, &weld));
    CHECK_OK(flesh_system_finalize(b.system));
    give_internal(&b);
    double *x = malloc((size_t)b.n * sizeof *x);
    char *upper = nodes_of_upper(&b);
    const double *X = flesh_mesh_positions(b.mesh);
    for (int run = 0; run < 72; run++) {
      const double elevation = (run / 2 % 12 - 5.5) / 6 * M_PI / 2, azimuth = 2.1 * (run / 2), normal = sin(elevation);
      const double counts = normal > 0 ? 1 : cos(elevation), size = (1 + (run % 2 ? 1e-7 : -1e-7)) * breaks_at / stiffness;
      const double shift[3] = {cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), normal};
      for (int i = 0; i < b.n / 3; i++) {
        double p[3];
        for (int c = 0; c < 3; c++) p[c] = X[3 * i + c] + (upper[i] ? size / counts * shift[c] : 0);
        turn(axis, 0.3 * run, p, x + 3 * i);
      }
      int changed;
      const flesh_point point = flesh_point_at(7, x, x, x);
      memset(b.state.internal, 0, (size_t)b.state.internal_count * sizeof *b.state.internal);
      CHECK_OK(flesh_system_update_internal(b.system, &point, b.state.internal, &changed));
      CHECK(changed == run % 2);
      CHECK(broken_of(&b) == run % 2);
    }
    free(x);
    free(upper);
    end(&b);
  }
}

/* Returns the energy of all effects, J, above that of the rest shape at rest; *rounding: from the sum of its terms. */
static double energy_of(const test_body *b, double *rounding)
{
  double energies[3], rest[3], sum = 0, phi, *zeros = calloc((size_t)b->n, sizeof *zeros);
  flesh_point point = flesh_point_at(b->state.t, b->state.x, b->state.v, b->state.v);
  point.internal = b->state.internal;
  const flesh_point at_rest = flesh_point_at(0, flesh_mesh_positions(b->mesh), zeros, zeros);
  CHECK_OK(flesh_system_energies(b->system, &point, energies));
  CHECK_OK(flesh_system_energies(b->system, &at_rest, rest));
  CHECK_OK(flesh_system_potential(b->system, &at_rest, &(flesh_shift){.x = 1}, &phi, rounding));
  *rounding *= 1e-14;
  for (int e = 0; e < 3; e++) sum += energies[e] - rest[e];
  free(zeros);
  return sum;
}

/* Makes two cubes that move apart, turning: the peel begins at an edge. They are free, or held at the other edge;
 * `further` (may be NULL) is an effect that is added. */
static void begin_peel(double breaks_at, int held, const flesh_effect_operations *further, test_body *b)
{
  two_cubes(1, (int[]){2, 2, 1}, (int[]){3, 3, 1}, 1, b);
  flesh_effect *effect = NULL;
  if (further) CHECK_OK(flesh_effect_create(further, b->mesh, NULL, &effect));
  if (further) CHECK_OK(flesh_system_add_effect(b->system, &effect));
  effect = welded(b, 1e-9, NAN, breaks_at);
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  if (held) CHECK_OK(test_body_hold(b, 0, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  give_internal(b);
  for (int i = 0; i < b->n / 3; i++) {
    const double *X = flesh_mesh_positions(b->mesh) + 3 * i;
    const double apart = flesh_mesh_positions(b->mesh)[3 * i + 2] > 1 ? 0.2 * (0.5 + X[0]) : 0;
    b->state.v[3 * i] = 0.1 * X[1], b->state.v[3 * i + 1] = -0.1 * X[0], b->state.v[3 * i + 2] = apart;
  }
}

/* With every method of fixed steps part of the weld breaks first, momenta are conserved, and the energy plus the
 * released energy is that of the start if the method conserves it (strains are small, so that the midpoint rule and
 * Newmark's do to 1e-5). The integrator's count is the sum over the weld's parts. */
static void broken_welds_keep_momenta_and_books(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    const int midpoint = method == FLESH_METHOD_MIDPOINT;
    test_body b;
    double before[6], after[6], first = 0, last = 0, rounding;
    begin_peel(600, 0, NULL, &b);
    test_momenta(&b, before);
    const double start = energy_of(&b, &rounding);
    flesh_integrator *integrator = integrator_of(&b, method, 1e-11);
    for (int s = 0; s < 60; s++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.004, NULL));
      last = broken_of(&b);
      if (first == 0) first = last;
    }
    const double size = test_momenta(&b, after);
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    const double *of_all = b.state.internal + b.state.internal_count - 5, released = of_all[0];
    const double left = energy_of(&b, &rounding) + released - start;
    printf("# %s: %.3g then %.3g broken, first at %g s at (%g, %g, %g); %.6g J of %.6g J released, %.3g left over\n",
           flesh_method_name(method), first, last, of_all[1], of_all[2], of_all[3], of_all[4], released, start,
           left / start);
    CHECK(first > 0 && first < last);
    CHECK(of_all[1] > 0 && of_all[1] < 0.24 && of_all[2] > 0.5 && of_all[4] == 1);
    double off = 0;
    for (int c = 0; c < (midpoint ? 6 : 3); c++) off = fmax(off, fabs(after[c] - before[c]) / size);
    printf("# momenta are off by %.2g of their terms\n", off);
    CHECK_BELOW(off, 1e-11);
    CHECK_NEAR(balance->released, released, rounding);
    CHECK_BELOW(fabs(balance->supplied), rounding);
    if (midpoint || method == FLESH_METHOD_NEWMARK) CHECK_NEAR(left, 0, 1e-5 * start); /* these keep energy */
    flesh_integrator_destroy(&integrator);
    end(&b);
  }
}

/* Adaptive steps also conserve momenta and balance energies; the first part breaks where and when short steps say. */
static void errors_choose_steps_of_a_weld_that_breaks(void)
{
  double first[2][5];
  for (int controlled = 0; controlled < 2; controlled++) {
    test_body b;
    double before[6], after[6], rounding;
    begin_peel(600, 0, NULL, &b);
    test_momenta(&b, before);
    const double start = energy_of(&b, &rounding);
    flesh_integrator *integrator = integrator_of(&b, controlled ? FLESH_METHOD_RUNGE_KUTTA : FLESH_METHOD_NEWMARK, 1e-11);
    flesh_adaptive_options options;
    flesh_adaptive_options_default(&options);
    options.control = controlled;
    options.tolerance = 1e-8; /* fraction of the length, because welds break at small openings */
    CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
    flesh_solve_stats stats = {0};
    for (int s = 0; s < (controlled ? 60 : 300); s++)
      CHECK_OK(flesh_integrator_step(integrator, &b.state, controlled ? 0.004 : 0.0008, &stats));
    const double size = test_momenta(&b, after), *of_all = b.state.internal + b.state.internal_count - 5;
    const double left = energy_of(&b, &rounding) + of_all[0] - start;
    memcpy(first[controlled], of_all, 5 * sizeof *of_all);
    printf("# %d steps, %d rejected: %.3g broken, first at %g s; %.6g J released, %.3g of the energy left over\n", stats.steps,
           stats.rejected, broken_of(&b), of_all[1], of_all[0], left / start);
    double off = 0;
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(after[c] - before[c]) / size);
    CHECK_BELOW(off, 1e-6);
    CHECK_NEAR(flesh_integrator_energy_balance(integrator)->released, of_all[0], rounding);
    CHECK(left < 1e-3 * start && left > -0.05 * start);
    CHECK(!controlled || stats.steps > 60);
    flesh_integrator_destroy(&integrator);
    end(&b);
  }
  CHECK_NEAR(first[1][1], first[0][1], 4e-3);
  for (int c = 2; c < 5; c++) CHECK_NEAR(first[1][c], first[0][c], 1e-9);
  CHECK_NEAR(first[1][0], first[0][0], 0.1 * first[0][0]);
}

/* Takes adaptive steps to h; returns new positions [n]. */
static double *run_by_error(test_body *b, flesh_method method, double tolerance, double h)
{
  flesh_integrator *integrator = integrator_of(b, method, 1e-4);
  flesh_adaptive_options options;
  flesh_adaptive_options_default(&options);
  options.control = 1;
  options.max_steps = 2000;
  options.tolerance = tolerance;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &options));
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_integrator_step(integrator, &b->state, h, &stats));
  double *x = malloc((size_t)b->n * sizeof *x);
  memcpy(x, b->state.x, (size_t)b->n * sizeof *x);
  printf("# tolerance %g: %d steps, %d rejected, %d Newton, %.3g broken\n", tolerance, stats.steps, stats.rejected, stats.newton,
         broken_of(b));
  flesh_integrator_destroy(&integrator);
  return x;
}

/* Computes the positions 0.2 s after two cubes began to move apart, [n]. */
static double *positions_of_peel(int held, double tolerance, int *n)
{
  test_body b;
  begin_peel(600, held, NULL, &b);
  double *x = run_by_error(&b, FLESH_METHOD_RUNGE_KUTTA, tolerance, 0.2);
  *n = b.n;
  end(&b);
  return x;
}

/* The error follows the tolerance, although a step finds out only at its end what has broken. */
static void see_when_a_weld_breaks(int held, double finest)
{
  int n;
  double *exact = positions_of_peel(held, finest / 100, &n);
  for (double tolerance = 1e-3; tolerance > finest / 2; tolerance *= 0.1) {
    double square = 0, *x = positions_of_peel(held, tolerance, &n);
    for (int d = 0; d < n; d++) square += (x[d] - exact[d]) * (x[d] - exact[d]) / n * 3;
    printf("# error %.2g tolerances\n", sqrt(square) / (2 * tolerance));
    CHECK_BELOW(sqrt(square), 4 * 2 * tolerance);
    free(x);
  }
  free(exact);
}

static void errors_see_when_a_weld_breaks(void)
{
  see_when_a_weld_breaks(0, 1e-6);
  see_when_a_weld_breaks(1, 1e-4); /* no step resolves the forces that breaking leaves at constrained dofs */
}

/* Computes the positions [n] 0.1 s after a bar of two incompressible pieces, whose weld breaks, began to be pulled. */
static double *positions_of_bar(const int cells[3], flesh_method method, double tolerance, int *n)
{
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 0.2, .translation = {0.02, 0, 0.08}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys, .smooth = 1};
  const double size[3] = {0.05, 0.05, 0.2};
  test_body b;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){0, 0, 0.2}));
  CHECK_OK(test_body_create(of_order(2, mesh), test_material(FLESH_ENERGY_S, 0.5), 1000, FLESH_MASS_LUMPED, 1, &b));
  flesh_effect *effect = welded(&b, 1e-9, NAN, 0.04 * young);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_hold(&b, 2, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(&b, 2, 0.4, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  give_internal(&b);
  double *x = run_by_error(&b, method, tolerance, 0.1);
  *n = b.n;
  CHECK(broken_of(&b) == 1);
  end(&b);
  return x;
}

/* A step closes the gaps of incompressible tets that the previous one has left, however short it is: short ones leave
 * less, and errors do not contain them. */
static void gaps_do_not_shorten_steps_where_a_weld_breaks(void)
{
  int n;
  static const flesh_method methods[] = {FLESH_METHOD_NEWMARK, FLESH_METHOD_HHT};
  static const int cells[2][3] = {{1, 1, 2}, {2, 2, 3}};
  for (int k = 0; k < 2; k++) {
    double *exact = positions_of_bar(cells[k], FLESH_METHOD_RUNGE_KUTTA, 1e-4, &n);
    double *x = positions_of_bar(cells[k], methods[k], 1e-3, &n);
    const double off = test_distance(n, x, exact) * sqrt(3. / n);
    printf("# %s: off by %.2g tolerances\n", flesh_method_name(methods[k]), off / 0.4e-3);
    CHECK_BELOW(off, 0.4e-3);
    free(exact);
    free(x);
  }
}

/* An effect that is undefined at the stage of a whole step, so that each step is halved. If a stage is the end of its
 * step, the second half ends there too, and comes less than a step after the lagged state. */
static double whole_stage, farthest;

static int refuse_long(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)effect, (void)r;
  return fabs(point->t - whole_stage) < 1e-9 && point->t - point->lagged.t > farthest ? FLESH_UNDEFINED : FLESH_OK;
}

static const flesh_effect_operations refusing = {.name = "refusing", .traits = FLESH_IS_PASSIVE, .residual = refuse_long};

/* Steps that are refused and halved break the same parts at the same time as steps of half the length; a failed step
 * leaves the weld unchanged. */
static void compare_halved_steps(flesh_method method)
{
  test_body b[2];
  flesh_integrator *integrators[2];
  double worst = 0;
  const double stage = method == FLESH_METHOD_MIDPOINT            ? 0.5
                       : method == FLESH_METHOD_HHT               ? 0.9
                       : method == FLESH_METHOD_GENERALIZED_ALPHA ? 1 / 1.8
                                                                  : 1; /* of a step */
  /* The last stage of Runge-Kutta lags behind the previous stage, by .4 of the step. */
  farthest = method == FLESH_METHOD_RUNGE_KUTTA ? 0.001 : stage < 0.7 ? 0.0015 : 0.003;
  for (int k = 0; k < 2; k++) {
    begin_peel(600, 0, k ? NULL : &refusing, &b[k]);
    integrators[k] = integrator_of(&b[k], method, 1e-11);
  }
  for (int s = 0; s < 8; s++) {
    flesh_solve_stats stats = {0};
    whole_stage = b[0].state.t + stage * 0.004;
    CHECK_OK(flesh_integrator_step(integrators[0], &b[0].state, 0.004, &stats));
    CHECK(stats.steps == 2);
    for (int half = 0; half < 2; half++) CHECK_OK(flesh_integrator_step(integrators[1], &b[1].state, 0.002, NULL));
    const int parts = b[0].state.internal_count - 5;
    for (int k = 0; k < parts; k++) CHECK(b[0].state.internal[k] == b[1].state.internal[k]);
    CHECK_NEAR(b[0].state.internal[parts + 1], b[1].state.internal[parts + 1], 1e-12);
    worst = fmax(worst, test_distance(b[0].n, b[0].state.x, b[1].state.x));
  }
  printf("# %s: %.3g broken, places are within %.2g m\n", flesh_method_name(method), broken_of(&b[0]), worst);
  /* After a failed step runge-kutta uses another table: the results agree within its error. */
  CHECK_BELOW(worst, method == FLESH_METHOD_RUNGE_KUTTA ? 1e-6 : 1e-9);
  CHECK(broken_of(&b[0]) > 0 && broken_of(&b[0]) < 1);
  flesh_solver_options options = test_options(1e-11);
  options.max_cutbacks = 0;
  flesh_integrator_destroy(&integrators[0]);
  CHECK_OK(flesh_integrator_create(b[0].system, method, &options, &integrators[0]));
  const size_t bytes = (size_t)b[0].state.internal_count * sizeof(double);
  double *before = malloc(bytes);
  memcpy(before, b[0].state.internal, bytes);
  whole_stage = b[0].state.t + stage * 0.004;
  CHECK(flesh_integrator_step(integrators[0], &b[0].state, 0.004, NULL) == FLESH_ERR_SOLVE);
  CHECK(!memcmp(before, b[0].state.internal, bytes));
  free(before);
  for (int k = 0; k < 2; k++) {
    flesh_integrator_destroy(&integrators[k]);
    end(&b[k]);
  }
}

static void halved_steps_break_the_same(void)
{
  for_every_method(method, TEST_FIXED_STEPS)
    if (method != FLESH_METHOD_BDF2) compare_halved_steps(method); /* its steps without a history are midpoint's */
}

static void check_same(const test_body *a, const test_body *b)
{
  const size_t bytes = (size_t)a->n * sizeof(double);
  CHECK(!memcmp(a->state.x, b->state.x, bytes) && !memcmp(a->state.v, b->state.v, bytes));
  if (b->state.internal)
    CHECK(!memcmp(a->state.internal, b->state.internal, (size_t)a->state.internal_count * sizeof(double)));
}

/* Broken welds are in the state and its file, and in what the integrator saves: runs go on with the same bits. */
static void a_broken_weld_goes_on_with_the_same_bits(void)
{
  for_every_method(method, TEST_FIXED_STEPS) {
    test_body b[3];
    flesh_integrator *integrators[3], *other;
    char folder[400], path[512];
    size_t size;
    CHECK(!test_folder_make(folder, sizeof folder));
    snprintf(path, sizeof path, "%s/state.txt", folder);
    for (int k = 0; k < 3; k++) {
      begin_peel(600, 0, NULL, &b[k]);
      integrators[k] = integrator_of(&b[k], method, 1e-9);
    }
    free(b[2].state.internal);
    b[2].state.internal = NULL;
    b[2].state.internal_count = 0;
    for (int s = 0; s < 12; s++) {
      for (int k = 0; k < 3; k++) CHECK_OK(flesh_integrator_step(integrators[k], &b[k].state, 0.004, NULL));
      check_same(&b[0], &b[1]);
      check_same(&b[0], &b[2]);
      CHECK_OK(flesh_state_write(path, b[1].n / 3, &b[1].state));
      flesh_state lacks = b[1].state;
      lacks.internal = NULL;
      CHECK(flesh_state_write(path, b[1].n / 3, &lacks) == FLESH_ERR_ARGUMENT);
      CHECK_TEXT(flesh_error_text(), "flesh_state_write: state->internal is NULL");
      lacks.v = NULL;
      CHECK(flesh_state_write(path, b[1].n / 3, &lacks) == FLESH_ERR_ARGUMENT);
      CHECK_TEXT(flesh_error_text(), "state->v is NULL");
      memset(b[1].state.internal, 0, (size_t)b[1].state.internal_count * sizeof(double));
      CHECK_OK(flesh_state_read(path, b[1].n / 3, &b[1].state));
      for (int k = 1; k < 3; k++) {
        CHECK_OK(flesh_integrator_save(integrators[k], 0, NULL, &size));
        void *data = malloc(size);
        CHECK_OK(flesh_integrator_save(integrators[k], size, data, &size));
        other = integrator_of(&b[k], method, 1e-9);
        CHECK_OK(flesh_integrator_load(other, data, size));
        flesh_integrator_destroy(&integrators[k]);
        integrators[k] = other;
        free(data);
      }
    }
    test_folder_remove(folder);
    CHECK(broken_of(&b[0]) > 0 && broken_of(&b[0]) < 1);
    for (int k = 0; k < 3; k++) {
      flesh_integrator_destroy(&integrators[k]);
      end(&b[k]);
    }
  }
}

/* Compressed to below three quarters of the height, with over a hundred times the traction that breaks it in
 * tension. */
static void compression_breaks_nothing(void)
{
  test_body b;
  begin_pull(1, (int[]){2, 2, 1}, (int[]){3, 1, 1}, -0.6, 200, &b);
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-10);
  for (int s = 0; s < 4; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.25, NULL));
  CHECK(pull_of(&b) < -100 * 200 && broken_of(&b) == 0);
  flesh_integrator_destroy(&integrator);
  end(&b);
}

/* A cube that falls off in statics has no equilibrium, which is reported; nothing is broken then. */
static void what_falls_off_has_no_equilibrium(void)
{
  test_body b;
  two_cubes(1, (int[]){2, 2, 1}, (int[]){3, 1, 1}, 0, &b);
  flesh_effect *effect = welded(&b, 1e-9, NAN, 500);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(test_body_gravity(&b, 0, 0, 1));
  CHECK_OK(test_body_hold(&b, 2, 0, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  give_internal(&b);
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_STATIC, 1e-6);
  CHECK(flesh_integrator_step(integrator, &b.state, 1, NULL) == FLESH_ERR_SOLVE);
  printf("# %s\n", flesh_error_text());
  CHECK_TEXT(flesh_error_text(), "after something broke");
  for (int k = 0; k < b.state.internal_count; k++) CHECK(b.state.internal[k] == 0);
  CHECK(b.state.t == 0 && !memcmp(b.state.x, flesh_mesh_positions(b.mesh), (size_t)b.n * sizeof(double)));
  flesh_integrator_destroy(&integrator);
  end(&b);
}

/* Methods that continue from a history of smooth steps report why they lack it. */
static void adaptive_methods_refuse_it(void)
{
  test_body b;
  flesh_solver_options options = test_options(1e-6);
  flesh_integrator *integrator = NULL;
  flesh_ida_problem *problem = NULL;
  begin_peel(600, 0, NULL, &b);
  CHECK(flesh_integrator_create(b.system, FLESH_METHOD_IDA, &options, &integrator) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "internal variables");
  CHECK(flesh_ida_problem_create(b.system, &options, &problem) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "a method of fixed steps");
  b.state.internal_count--;
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  CHECK(flesh_integrator_step(integrator, &b.state, 0.001, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "internal variables; the system has");
  flesh_integrator_destroy(&integrator);
  end(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(two_bars_break_at_the_force), TEST(long_steps_tell_what_they_release_in_excess),
                   TEST(tension_and_shear_count_together),
                   TEST(broken_welds_keep_momenta_and_books),
                   TEST(errors_choose_steps_of_a_weld_that_breaks), TEST(errors_see_when_a_weld_breaks),
                   TEST_LONG(gaps_do_not_shorten_steps_where_a_weld_breaks), TEST(halved_steps_break_the_same),
                   TEST(a_broken_weld_goes_on_with_the_same_bits), TEST(compression_breaks_nothing),
                   TEST(what_falls_off_has_no_equilibrium), TEST(adaptive_methods_refuse_it));
}
