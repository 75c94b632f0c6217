// TEST quick seconds=60
/* test_ode.c: the right-hand side for CVODE and ARKODE: against IDA's residual, differences, GSL's integration and,
 * with CVODE, through all events. */
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <sunmatrix/sunmatrix_sparse.h>
#ifdef HAVE_CVODE
#include <cvode/cvode.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#endif
#ifdef HAVE_ARKODE
#include <arkode/arkode_arkstep.h>
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701 /* functions bear the name of the stepper */
#define ARK(function) ARKStep##function
#else
#define ARK(function) ARKode##function
#endif
#endif

#include "busy_bar.h"
#include "flesh/ida.h"
#include "flesh/ode.h"
#include "motion_reference.h"
#include "sundials/compatibility.h"

typedef struct owned {
  test_body b;
  SUNContext context;
  flesh_ode_problem *problem;
  N_Vector y, f;
  int N; /* length of y */
} owned;

static void open_owned(flesh_mass mass, flesh_linear_solver linear, owned *o)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.linear_solver = linear;
  *o = (owned){0};
  make_busy_bar(mass, &o->b);

  o->N = 2 * o->b.n;
  CHECK(!flesh_suncontext_create(&o->context));
  CHECK_OK(flesh_ode_problem_create(o->b.system, &options, &o->problem));
  o->y = N_VNew_Serial(o->N, o->context);
  o->f = N_VClone(o->y);
}

static void close_owned(owned *o)
{
  N_VDestroy(o->y);
  N_VDestroy(o->f);
  flesh_ode_problem_destroy(&o->problem);
  test_body_destroy(&o->b);
  SUNContext_Free(&o->context);
}

/* A resistance to velocities that couples neighbours along a chain: r_i += c (2 v_i - v_{i-1} - v_{i+1}), and so on. */
static const double resistance = 30;

static int chain_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const flesh_cells *cells = effect->data;
  for (int c = 0; c < cells->count; c++)
    for (int k = 0; k < 3; k++) {
      int i = 3 * cells->nodes[2 * c] + k, j = 3 * cells->nodes[2 * c + 1] + k;
      r[i] += resistance * (point->v[i] - point->v[j]);
      r[j] += resistance * (point->v[j] - point->v[i]);
    }
  return FLESH_OK;
}

static int chain_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                          flesh_block_matrix *K, const int *slots)
{
  (void)point;
  const flesh_cells *cells = effect->data;
  for (int c = 0; c < cells->count; c++)
    for (int k = 0; k < 3; k++)
      for (int pair = 0; pair < 3; pair++)
        K->values[9 * slots[3 * c + pair] + 4 * k] += (pair == 1 ? -1 : 1) * resistance * shift->v;
  return FLESH_OK;
}

static const flesh_cells *chain_cells(const flesh_effect *effect) { return effect->data; }

static const flesh_effect_operations chain = {
    .name = "chain", .cells = chain_cells, .residual = chain_residual, .jacobian = chain_jacobian};

static void open_damped(flesh_mass mass, owned *o)
{
  static const int nodes[] = {0, 1, 1, 2, 2, 3, 3, 7};
  static flesh_cells cells = {.count = 4, .nodes_per_cell = 2, .nodes = nodes};
  flesh_solver_options options;
  flesh_effect *effect;
  flesh_derivative_report report;
  flesh_solver_options_default(&options);
  options.linear_solver = FLESH_LINEAR_KLU;
  *o = (owned){0};
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, mass, 1, &o->b));
  CHECK_OK(test_body_clamp(&o->b, 1e-9));
  CHECK_OK(flesh_effect_create(&chain, o->b.mesh, &cells, &effect));
  CHECK_OK(flesh_effect_check_derivatives(effect, o->b.mesh, 0, o->b.state.x, 1, &report));
  CHECK(flesh_derivative_report_passes(&report, 1e-6));
  CHECK_OK(flesh_system_add_effect(o->b.system, &effect));
  CHECK_OK(flesh_system_finalize(o->b.system));
  o->N = 2 * o->b.n;
  CHECK(!flesh_suncontext_create(&o->context));
  CHECK_OK(flesh_ode_problem_create(o->b.system, &options, &o->problem));
  o->y = N_VNew_Serial(o->N, o->context);
  o->f = N_VClone(o->y);
}

/* Makes a state in the middle of a motion. */
static void start_disturbed(owned *o)
{
  test_jitter(o->b.n, 0.05, 5, o->b.state.x);
  test_jitter(o->b.n, 1, 6, o->b.state.v);
  o->b.state.t = 0.14;
  CHECK_OK(flesh_ode_start(o->problem, &o->b.state, o->y));
}

/* y' = f makes IDA's residual vanish on free dofs, for any y. */
static void agrees_with_the_residual(void)
{
  for (int mass = 0; mass < 2; mass++) {
    owned o;
    flesh_ida_problem *ida;
    flesh_solver_options options;
    flesh_solver_options_default(&options);
    open_owned((flesh_mass)mass, FLESH_LINEAR_PCG, &o);
    start_disturbed(&o);
    N_Vector y = N_VClone(o.y), yp = N_VClone(o.y), F = N_VClone(o.y);
    CHECK_OK(flesh_ida_problem_create(o.b.system, &options, &ida));
    CHECK_OK(flesh_ida_start(ida, &o.b.state, y, yp));
    CHECK(test_distance(o.N, N_VGetArrayPointer(y), N_VGetArrayPointer(o.y)) == 0);
    const double t = 0.15;
    test_jitter(o.N, 0.02, 7, N_VGetArrayPointer(o.y)); /* also off the constraints */
    CHECK_OK(flesh_ode_rhs(t, o.y, o.f, o.problem));
    CHECK_OK(flesh_ida_residual(t, o.y, o.f, F, ida));
    uint8_t *fixed = malloc((size_t)o.b.n);
    double *v = calloc((size_t)o.b.n, sizeof *v), *a = calloc((size_t)o.b.n, sizeof *a);
    flesh_system_fixed(o.b.system, t, fixed);
    flesh_system_prescribe_velocity(o.b.system, t, v, a);
    const double *r = N_VGetArrayPointer(F), *f = N_VGetArrayPointer(o.f);
    double kinematic = 0, force = 0, held = 0;
    for (int d = 0; d < o.b.n; d++)
      if (fixed[d]) {
        held = fmax(held, fmax(fabs(f[d] - v[d]), fabs(f[o.b.n + d] - a[d])));
      } else {
        kinematic = fmax(kinematic, fabs(r[d]));
        force = fmax(force, fabs(r[o.b.n + d]));
      }
    printf("# mass %d: rows off by %.3g m/s, %.3g N, constrained %.3g\n", mass, kinematic, force, held);
    CHECK(kinematic == 0);
    CHECK_BELOW(force, 1e-8); /* of some 1e4 */
    CHECK(held == 0);
    free(fixed);
    free(v);
    free(a);
    N_VDestroy(y);
    N_VDestroy(yp);
    N_VDestroy(F);
    flesh_ida_problem_destroy(&ida);
    close_owned(&o);
  }
}

/* Compares products with differences of f, and a direct "preconditioner" with the products. */
static void products_are_derivatives(void)
{
  for (int kind = 0; kind < 4; kind++) {
    owned o;
    const double t = 0.15, s = 1e-5, gamma = 0.004;
    const double offsets[4] = {-2, -1, 1, 2}, weights[4] = {1. / 12, -2. / 3, 2. / 3, -1. / 12};
    if (kind < 2) open_owned((flesh_mass)kind, FLESH_LINEAR_KLU, &o);
    else open_damped((flesh_mass)(kind - 2), &o);
    start_disturbed(&o);
    N_Vector w = N_VClone(o.y), Jw = N_VClone(o.y), moved = N_VClone(o.y), slope = N_VClone(o.y);
    N_VConst(0, w);
    test_jitter(o.N, 1, 11, N_VGetArrayPointer(w));
    N_VConst(0, slope);
    for (int k = 0; k < 4; k++) {
      N_VLinearSum(1, o.y, offsets[k] * s, w, moved);
      CHECK_OK(flesh_ode_rhs(t, moved, o.f, o.problem));
      N_VLinearSum(weights[k] / s, o.f, 1, slope, slope);
    }
    CHECK(flesh_ode_jacobian_times(w, Jw, t, o.y, o.f, o.problem, NULL) == FLESH_ERR_ARGUMENT); /* no set-up yet */
    CHECK_OK(flesh_ode_jacobian_times_setup(t, o.y, o.f, o.problem));
    CHECK_OK(flesh_ode_jacobian_times(w, Jw, t, o.y, o.f, o.problem, NULL));
    double off = test_distance(o.N, N_VGetArrayPointer(Jw), N_VGetArrayPointer(slope));
    double size = test_norm(o.N, N_VGetArrayPointer(Jw));
    printf("# %s, mass %d: Jw off by %.3g of %.3g\n", kind < 2 ? "undamped" : "damped", kind % 2, off, size);
    CHECK_BELOW(off, 1e-8 * size);

    /* The sparse matrix gives the same products, twice, so that nothing of the first remains. */
    SUNMatrix J = SUNSparseMatrix(o.N, o.N, flesh_ode_entries(o.problem), CSC_MAT, o.context);
    if (kind % 2 == FLESH_MASS_LUMPED) {
      for (int again = 0; again < 2; again++)
        CHECK_OK(flesh_ode_jacobian(t, o.y, o.f, J, o.problem, NULL, NULL, NULL));
      CHECK(!SUNMatMatvec(J, w, moved));
      CHECK_BELOW(test_distance(o.N, N_VGetArrayPointer(Jw), N_VGetArrayPointer(moved)), 1e-12 * size);
    } else {
      CHECK(flesh_ode_jacobian(t, o.y, o.f, J, o.problem, NULL, NULL, NULL) == FLESH_ERR_ARGUMENT);
      CHECK_TEXT(flesh_error_text(), "consistent mass");
    }
    SUNMatDestroy(J);

    flesh_sunboolean current = 0;
    N_Vector z = slope;
    CHECK_OK(flesh_ode_preconditioner_setup(t, o.y, o.f, 0, &current, gamma, o.problem));
    CHECK(current);
    CHECK_OK(flesh_ode_preconditioner_solve(t, o.y, o.f, w, z, gamma, 0, 1, o.problem));
    CHECK_OK(flesh_ode_jacobian_times(z, Jw, t, o.y, o.f, o.problem, NULL));
    N_VLinearSum(1, z, -gamma, Jw, moved); /* (I - gamma J) z = w */
    off = test_distance(o.N, N_VGetArrayPointer(moved), N_VGetArrayPointer(w));
    printf("# (I - gamma J) z off by %.3g of 1\n", off);
    CHECK_BELOW(off, 1e-9);
    N_VDestroy(w);
    N_VDestroy(Jw);
    N_VDestroy(moved);
    N_VDestroy(slope);
    close_owned(&o);
  }
}

#ifdef HAVE_CVODE
/* Follows the sequence of ode.h through all events, with user_data a struct of the program's own. */
enum { BY_GMRES, BY_KLU, BY_OWN, WAYS };
static const char *const ways[] = {"GMRES", "KLU", "own solver"};

typedef struct costs {
  long steps, setups, jacobians, linear;
} costs;

/* Sets, slot by slot, one of the linear solvers. */
static void set_solver(owned *o, int way, void *cvode, SUNLinearSolver *solver, SUNMatrix *J)
{
  *J = NULL;
  if (way == BY_GMRES) {
    *solver = SUNLinSol_SPGMR(o->y, SUN_PREC_LEFT, 30, o->context);
  } else if (way == BY_KLU) {
    *J = SUNSparseMatrix(o->N, o->N, flesh_ode_entries(o->problem), CSC_MAT, o->context);
    *solver = SUNLinSol_KLU(o->y, *J, o->context);
  } else {
    CHECK_OK(flesh_ode_sunmatrix_create(o->problem, o->context, J));
    CHECK_OK(flesh_ode_sunlinsol_create(o->problem, o->context, solver));
  }
  CHECK(!CVodeSetLinearSolver(cvode, *solver, *J));
  if (*J) {
    CHECK(!CVodeSetJacFn(cvode, flesh_ode_jacobian));
  } else {
    CHECK(!CVodeSetPreconditioner(cvode, flesh_ode_preconditioner_setup, flesh_ode_preconditioner_solve));
    CHECK(!CVodeSetJacTimes(cvode, flesh_ode_jacobian_times_setup, flesh_ode_jacobian_times));
  }
}

static costs run_cvode(owned *o, int way, double tolerance, double end, flesh_state *state)
{
  struct {
    flesh_ode_problem *problem;
    int mine;
  } mine = {o->problem, 7};
  void *cvode = CVodeCreate(CV_BDF, o->context);
  N_Vector atol = N_VClone(o->y);
  SUNMatrix J = NULL;
  SUNLinearSolver solver = NULL;
  costs all = {0};
  for (int begun = 0; state->t < end; begun = 1) {
    double t = state->t;
    costs more = {0};
    CHECK_OK(flesh_ode_start(o->problem, state, o->y));
    CHECK_OK(flesh_ode_tolerances(o->problem, tolerance, atol));
    if (!begun) {
      CHECK(!CVodeInit(cvode, flesh_ode_rhs, state->t, o->y));
      CHECK(!CVodeSetUserData(cvode, &mine) && !CVodeSetMaxNumSteps(cvode, 100000));
      CHECK(!CVodeSVtolerances(cvode, 0, atol));
      set_solver(o, way, cvode, &solver, &J);
    } else {
      CHECK(!CVodeReInit(cvode, state->t, o->y) && !CVodeSVtolerances(cvode, 0, atol));
    }
    if (flesh_ode_event(o->problem) < INFINITY) CHECK(!CVodeSetStopTime(cvode, flesh_ode_event(o->problem)));
    int flag = CVode(cvode, end, o->y, &t, CV_NORMAL);
    CHECK(flag == CV_SUCCESS || flag == CV_TSTOP_RETURN);
    if (flag < 0) break;
    CHECK_OK(flesh_ode_get_state(o->problem, t, o->y, state));
    CVodeGetNumSteps(cvode, &more.steps);
    CVodeGetNumLinSolvSetups(cvode, &more.setups);
    CVodeGetNumJacEvals(cvode, &more.jacobians);
    CVodeGetNumLinIters(cvode, &more.linear);
    all.steps += more.steps;
    all.setups += more.setups;
    all.jacobians += more.jacobians;
    all.linear += more.linear;
  }
  N_VDestroy(atol);
  SUNLinSolFree(solver);
  if (J) SUNMatDestroy(J);
  CVodeFree(&cvode);
  return all;
}

static void cvode_finds_the_motion(void)
{
  for (int way = 0; way < WAYS + 1; way++) { /* the last one: the own solver, direct */
    owned o;
    const int direct = way == WAYS, kind = direct ? BY_OWN : way;
    open_owned(FLESH_MASS_LUMPED, direct ? FLESH_LINEAR_KLU : FLESH_LINEAR_PCG, &o);
    flesh_state exact = state_copy(o.b.n, &o.b.state);
    motion_reference_run(&o.b, 0.5, 1e-12, &exact);
    const costs all = run_cvode(&o, kind, 1e-8, 0.5, &o.b.state);
    double off = test_distance(o.b.n, o.b.state.x, exact.x);
    printf("# lumped, %s%s: %ld steps, %d residuals, %ld set-ups with %ld Jacobians, %ld linear iterations, from GSL "
           "%.3g m\n",
           ways[kind], direct ? " by KLU" : "", all.steps, flesh_ode_stats(o.problem)->residuals, all.setups,
           all.jacobians, all.linear, off);
    CHECK_BELOW(off, 1e-5);
    if (kind == BY_OWN) {
      CHECK(all.jacobians > 0 && all.jacobians < all.setups); /* df/dy is kept if only gamma changes */
      CHECK(flesh_ode_stats(o.problem)->assemblies == all.jacobians);
      CHECK(direct ? all.linear == 0 : all.linear > 0 && all.linear <= flesh_ode_stats(o.problem)->linear);
    }
    state_free(&exact);
    close_owned(&o);
  }
}

/* Consistent mass: CVODE's result against IDA's, each with its own tight tolerance. */
static void cvode_agrees_with_ida(int way)
{
  owned o;
  flesh_solver_options options;
  flesh_integrator *integrator;
  flesh_adaptive_options adaptive;
  flesh_solver_options_default(&options);
  options.linear_tolerance = 1e-8;
  flesh_adaptive_options_default(&adaptive);
  adaptive.tolerance = 1e-5;
  open_owned(FLESH_MASS_CONSISTENT, FLESH_LINEAR_PCG, &o);
  flesh_state other = state_copy(o.b.n, &o.b.state);
  CHECK_OK(flesh_integrator_create(o.b.system, FLESH_METHOD_IDA, &options, &integrator));
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
  CHECK_OK(flesh_integrator_step(integrator, &other, 0.5, NULL));
  const costs all = run_cvode(&o, way, 1e-7, 0.5, &o.b.state);
  double off = test_distance(o.b.n, o.b.state.x, other.x);
  printf("# consistent, %s: %ld steps, %ld linear iterations, from IDA %.3g m\n", ways[way], all.steps, all.linear,
         off);
  CHECK_BELOW(off, 1e-4);
  flesh_integrator_destroy(&integrator);
  state_free(&other);
  close_owned(&o);
}

static void cvode_by_gmres_agrees_with_ida(void) { cvode_agrees_with_ida(BY_GMRES); }

static void cvode_by_the_own_solver_agrees_with_ida(void) { cvode_agrees_with_ida(BY_OWN); }
#endif

#ifdef HAVE_ARKODE
/* Returns how far the far end of a bar clamped at the other end falls until `end`, by ARKODE. */
static double fall_by_arkode(const test_body *b, double end, double tolerance, SUNContext context)
{
  flesh_solver_options options;
  flesh_ode_problem *problem;
  SUNMatrix J;
  SUNLinearSolver solver;
  double t;
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_ode_problem_create(b->system, &options, &problem));
  N_Vector y = N_VNew_Serial(2 * b->n, context), atol = N_VClone(y);
  CHECK_OK(flesh_ode_start(problem, &b->state, y));
  CHECK_OK(flesh_ode_tolerances(problem, tolerance, atol));
  CHECK_OK(flesh_ode_sunmatrix_create(problem, context, &J));
  CHECK_OK(flesh_ode_sunlinsol_create(problem, context, &solver));
  void *ark = ARKStepCreate(NULL, flesh_ode_rhs, 0, y, context);
  CHECK(!ARK(SetUserData)(ark, problem) && !ARK(SVtolerances)(ark, 0, atol) && !ARK(SetOrder)(ark, 4));
  CHECK(!ARK(SetLinearSolver)(ark, solver, J) && !ARK(SetJacFn)(ark, flesh_ode_jacobian));
  CHECK(!ARK(SetNonlinCRDown)(ark, 1) && !ARK(SetStopTime)(ark, end));
  CHECK(ARK(Evolve)(ark, end, y, &t, ARK_NORMAL) >= 0);
  const double fallen = b->state.x[b->n - 1] - N_VGetArrayPointer(y)[b->n - 1];
  ARK(Free)(&ark);
  SUNLinSolFree(solver);
  SUNMatDestroy(J);
  N_VDestroy(y);
  N_VDestroy(atol);
  flesh_ode_problem_destroy(&problem);
  return fallen;
}

/* Waves from the clamp have not reached the far end, which falls by g t^2/2. ARKODE predicts the stages of a fall so
 * well that the rate of convergence it remembers becomes tiny (ode.h): the later stages would stop at their first
 * iterate. */
static void arkode_solves_the_stages_of_a_fall(void)
{
  static const double ratios[] = {0, 0.2};
  const double g = 9.81, end = 0.1;
  SUNContext context;
  CHECK(!flesh_suncontext_create(&context));
  for (int k = 0; k < 2; k++) {
    test_body b;
    double worst = 0;
    CHECK_OK(test_body_create(test_box(8, 2, 2, 2, 0.5, 0.5), test_material(FLESH_ENERGY_S, ratios[k]), 1000,
                              FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -g));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(flesh_system_finalize(b.system));
    for (int j = 0; j < 24; j++) {
      const double tolerance = 1e-5 * pow(10, -j / 12.);
      worst = fmax(worst, fabs(fall_by_arkode(&b, end, tolerance, context) - g * end * end / 2) / tolerance);
    }
    printf("# Poisson's ratio %g: off by at most %.3g tolerances\n", ratios[k], worst);
    CHECK_BELOW(worst, 1);
    test_body_destroy(&b);
  }
  SUNContext_Free(&context);
}
#endif

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(agrees_with_the_residual), TEST(products_are_derivatives)
#ifdef HAVE_CVODE
                   , TEST(cvode_finds_the_motion), TEST(cvode_by_gmres_agrees_with_ida),
                   TEST(cvode_by_the_own_solver_agrees_with_ida)
#endif
#ifdef HAVE_ARKODE
                   , TEST(arkode_solves_the_stages_of_a_fall)
#endif
  );
}
