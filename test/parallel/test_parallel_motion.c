// TEST full memory needs=ranks,nvecparallel,cvode,arkode,sunlinsolspgmr ranks=1,2,3,5
/* test_parallel_motion.c: programs on several ranks that own IDA, CVODE or ARKODE and pass vectors of N_VNew_Parallel
 * to callbacks: products, and motions compared with the same program on one rank. */
#include "ranks.h"

#include <arkode/arkode_arkstep.h>
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <ida/ida.h>
#include <nvector/nvector_parallel.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "body.h"
#include "flesh/ida.h"
#include "flesh/ode.h"
#include "sundials/compatibility.h"
#include "sundials/ida_problem.h"

/* Before SUNDIALS 7.1, the names of ARKODE's functions contain that of the stepper. */
#if SUNDIALS_VERSION_MAJOR * 100 + SUNDIALS_VERSION_MINOR < 701
#define ARK(stepper, function) stepper##function
#else
#define ARK(stepper, function) ARKode##function
#endif

/* A body as seen by one of the programs: the whole with serial vectors, or the part of this rank with parallel ones. */
typedef struct side {
  test_body body;
  flesh_rank_part *part; /* NULL: the whole */
  SUNContext context;
} side;

/* The whole body, which every rank has, and this rank's part of it. */
typedef struct sides {
  side whole, own;
} sides;

static const double release = 0.06, end = 0.12;

/* Makes a damped bar held at x = 0, and moved sideways at x = 1 until it is released. */
static int add_effects(test_body *b)
{
  static const flesh_keyframe keyframes[] = {{.t = 0}, {.t = 1, .translation = {0, 0.5, 0}}};
  const flesh_motion motion = {.count = 2, .keyframes = keyframes};
  flesh_effect *effect = NULL;
  int *nodes = malloc((size_t)b->n * sizeof *nodes), status = test_body_gravity(b, 0, 0, -9.81);
  if (!status) status = flesh_effect_damping(&b->body, 0.5, 1e-3, FLESH_STIFFNESS_CURRENT, &effect);
  if (!status) status = flesh_system_add_effect(b->system, &effect);
  for (int at = 0; at < 2 && !status; at++) {
    int count = 0;
    for (int i = 0; i < b->n / 3; i++)
      if (fabs(flesh_mesh_positions(b->mesh)[3 * i] - at) < 1e-9) nodes[count++] = i;
    if (at) status = flesh_system_add_prescribed_motion(b->system, count, nodes, FLESH_AXES_ALL, &motion, 0, release);
    else status = flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY);
  }
  free(nodes);
  return status ? status : flesh_system_finalize(b->system);
}

static void open_side(flesh_mesh *mesh, flesh_mass mass, flesh_rank_part *part, side *s)
{
  *s = (side){.part = part};
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, mass, 1, &s->body));
  if (part) CHECK_OK(flesh_system_set_part(s->body.system, part));
  CHECK_OK(add_effects(&s->body));
  CHECK(flesh_suncontext_create(&s->context) == 0);
}

static void open_sides(flesh_mass mass, sides *s)
{
  flesh_mesh *mesh = test_box(6, 2, 2, 1, 0.3, 0.3);
  flesh_rank_part *part = ranks_cut(mesh);
  open_side(mesh, mass, NULL, &s->whole);
  open_side((flesh_mesh *)flesh_rank_part_mesh(part), mass, part, &s->own);
}

static void close_sides(sides *s)
{
  SUNContext_Free(&s->whole.context);
  SUNContext_Free(&s->own.context);
  s->own.body.mesh = NULL; /* the part's */
  test_body_destroy(&s->own.body);
  test_body_destroy(&s->whole.body);
  flesh_rank_part_destroy(&s->own.part);
}

/* for y = (x, v) */
static N_Vector new_vector(const side *s)
{
  const flesh_team *team = s->part ? flesh_rank_part_team(s->part) : NULL;
  return team ? N_VNew_Parallel(MPI_COMM_WORLD, 6 * team->own, (sunindextype)(6 * team->all), s->context)
              : N_VNew_Serial(2 * s->body.n, s->context);
}

/* Returns the difference of the ranks' y from the whole's, over its largest number in either half. */
static double difference(const sides *s, N_Vector own_vector, N_Vector whole_vector)
{
  const size_t n = (size_t)s->whole.body.n, own = 3 * (size_t)flesh_rank_part_own(s->own.part);
  const double *y = N_VGetArrayPointer(own_vector), *whole = N_VGetArrayPointer(whole_vector);
  double *gathered = malloc(n * sizeof *gathered), *room = calloc((size_t)s->own.body.n, sizeof *room), worst = 0;
  for (size_t half = 0; half < 2; half++) {
    double largest = 0, off = 0;
    memcpy(room, y + half * own, own * sizeof *y);
    CHECK_OK(flesh_rank_part_gather(s->own.part, room, gathered));
    for (size_t d = 0; d < n; d++) {
      off = fmax(off, fabs(gathered[d] - whole[half * n + d]));
      largest = fmax(largest, fabs(whole[half * n + d]));
    }
    worst = fmax(worst, off / largest);
  }
  free(gathered);
  free(room);
  return worst;
}

/* Fills in the same numbers for the same node and half on both sides. */
static void fill(const side *s, double size, N_Vector y)
{
  const int own = s->part ? flesh_rank_part_own(s->part) : s->body.n / 3;
  for (int half = 0; half < 2; half++)
    for (int i = 0; i < own; i++)
      for (int c = 0; c < 3; c++) {
        unsigned long long seed = (unsigned long long)(6 * (s->part ? flesh_rank_part_nodes(s->part)[i] : i) + 3 * half + c);
        test_uniform(&seed);
        N_VGetArrayPointer(y)[3 * (half * own + i) + c] = size * (test_uniform(&seed) - 0.5);
      }
}

/* Everything that a program can ask of IDA's problem at a disturbed start. */
enum { IDA_Y, IDA_YP, IDA_ATOL, IDA_RESIDUAL, IDA_TIMES, IDA_MATVEC, IDA_SOLVED, IDA_PRODUCTS };

static double ask_ida(const side *s, N_Vector results[IDA_PRODUCTS])
{
  flesh_ida_problem *problem = NULL;
  flesh_solver_options options = test_options(1e-9);
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  const double cj = 300;
  options.linear_tolerance = 1e-12;
  CHECK_OK(flesh_ida_problem_create(s->body.system, &options, &problem));
  for (int k = 0; k < IDA_PRODUCTS; k++) results[k] = new_vector(s);
  N_Vector y = results[IDA_Y], yp = results[IDA_YP], x = N_VClone(y);
  CHECK_OK(flesh_ida_start(problem, &s->body.state, y, yp));
  const double curvature = flesh_ida_curvature(problem, 1, y, yp);
  CHECK_OK(flesh_ida_tolerances(problem, 1e-3, results[IDA_ATOL]));
  fill(s, 0.02, x);
  N_VLinearSum(1, x, 1, y, y);
  CHECK_OK(flesh_ida_residual(0.01, y, yp, results[IDA_RESIDUAL], problem));
  CHECK_OK(flesh_ida_preconditioner_setup(0.01, y, yp, NULL, cj, problem));
  CHECK_OK(flesh_ida_jacobian_times(0.01, y, yp, NULL, x, results[IDA_TIMES], cj, problem, NULL, NULL));
  CHECK_OK(flesh_ida_sunmatrix_create(problem, s->context, &A));
  CHECK_OK(flesh_ida_sunlinsol_create(problem, s->context, &solver));
  CHECK_OK(flesh_ida_jacobian(0.01, cj, y, yp, NULL, A, problem, NULL, NULL, NULL));
  CHECK(SUNLinSolSetup(solver, A) == 0);
  CHECK(SUNLinSolSolve(solver, A, results[IDA_SOLVED], results[IDA_RESIDUAL], 0) == 0);
  CHECK(SUNMatScaleAddI(1, A) == 0); /* modifies the condensed matrix */
  CHECK(SUNMatMatvec(A, x, results[IDA_MATVEC]) == 0);
  N_VDestroy(x);
  SUNMatDestroy(A);
  SUNLinSolFree(solver);
  flesh_ida_problem_destroy(&problem);
  return curvature;
}

static void what_ida_asks_for_is_that_of_one_rank(void)
{
  static const double limits[IDA_PRODUCTS] = {[IDA_Y] = 1e-13,     [IDA_YP] = 1e-10,    [IDA_ATOL] = 1e-12,
                                              [IDA_RESIDUAL] = 1e-11, [IDA_TIMES] = 1e-11, [IDA_MATVEC] = 1e-11,
                                              [IDA_SOLVED] = 1e-8};
  for (int mass = 0; mass < 2; mass++) {
    sides s;
    N_Vector whole[IDA_PRODUCTS], own[IDA_PRODUCTS];
    open_sides((flesh_mass)mass, &s);
    const double curvature = ask_ida(&s.whole, whole);
    CHECK_NEAR(ask_ida(&s.own, own), curvature, 1e-4 * curvature); /* a difference over 1e-7 of the motion */
    for (int k = 0; k < IDA_PRODUCTS; k++) {
      CHECK_BELOW(difference(&s, own[k], whole[k]), limits[k]);
      N_VDestroy(own[k]);
      N_VDestroy(whole[k]);
    }
    close_sides(&s);
  }
}

/* Results of the functions for y' = f(t, y). */
enum { ODE_F, ODE_TIMES, ODE_MATVEC, ODE_SOLVED, ODE_PRODUCTS };

static void ask_ode(const side *s, N_Vector results[ODE_PRODUCTS])
{
  flesh_ode_problem *problem = NULL;
  flesh_solver_options options = test_options(1e-9);
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  options.linear_tolerance = 1e-12;
  CHECK_OK(flesh_ode_problem_create(s->body.system, &options, &problem));
  for (int k = 0; k < ODE_PRODUCTS; k++) results[k] = new_vector(s);
  N_Vector y = new_vector(s), x = N_VClone(y);
  CHECK_OK(flesh_ode_start(problem, &s->body.state, y));
  fill(s, 0.02, x);
  N_VLinearSum(1, x, 1, y, y);
  CHECK_OK(flesh_ode_rhs(0.01, y, results[ODE_F], problem));
  CHECK_OK(flesh_ode_jacobian_times_setup(0.01, y, results[ODE_F], problem));
  CHECK_OK(flesh_ode_jacobian_times(x, results[ODE_TIMES], 0.01, y, results[ODE_F], problem, NULL));
  CHECK_OK(flesh_ode_sunmatrix_create(problem, s->context, &A));
  CHECK_OK(flesh_ode_sunlinsol_create(problem, s->context, &solver));
  CHECK_OK(flesh_ode_jacobian(0.01, y, results[ODE_F], A, problem, NULL, NULL, NULL));
  CHECK(SUNMatScaleAddI(-1e-3, A) == 0);
  CHECK(SUNMatMatvec(A, x, results[ODE_MATVEC]) == 0);
  CHECK(SUNLinSolSetup(solver, A) == 0);
  CHECK(SUNLinSolSolve(solver, A, results[ODE_SOLVED], results[ODE_MATVEC], 0) == 0);
  N_VLinearSum(1, results[ODE_SOLVED], -1, x, y);
  CHECK_BELOW(N_VMaxNorm(y), 1e-7 * N_VMaxNorm(x)); /* it is the inverse */
  N_VDestroy(x);
  N_VDestroy(y);
  SUNMatDestroy(A);
  SUNLinSolFree(solver);
  flesh_ode_problem_destroy(&problem);
}

static void what_cvode_asks_for_is_that_of_one_rank(void)
{
  static const double limits[ODE_PRODUCTS] = {[ODE_F] = 1e-10, [ODE_TIMES] = 1e-10, [ODE_MATVEC] = 1e-10,
                                              [ODE_SOLVED] = 1e-7};
  for (int mass = 0; mass < 2; mass++) {
    sides s;
    N_Vector whole[ODE_PRODUCTS], own[ODE_PRODUCTS];
    open_sides((flesh_mass)mass, &s);
    ask_ode(&s.whole, whole);
    ask_ode(&s.own, own);
    for (int k = 0; k < ODE_PRODUCTS; k++) {
      CHECK_BELOW(difference(&s, own[k], whole[k]), limits[k]);
      N_VDestroy(own[k]);
      N_VDestroy(whole[k]);
    }
    close_sides(&s);
  }
}

/* How a program steps: with each integrator by flesh's matrix and solver, then by GMRES without a matrix. */
typedef enum way { IDA, IDA_GMRES, CVODE, CVODE_GMRES, ARK_IMPLICIT, ARK_EXPLICIT, WAYS } way;
static const char *const names[WAYS] = {"IDA", "IDA by GMRES", "CVODE", "CVODE by GMRES", "ARKODE, implicit", "ARKODE, explicit"};

static const double tolerance = 1e-5;

/* Runs IDA from the state to the next event or the end. Returns IDA's steps. */
static long run_ida(const side *s, int gmres, flesh_ida_problem *problem, flesh_state *state)
{
  long steps = 0;
  double t = state->t;
  N_Vector y = new_vector(s), yp = N_VClone(y), atol = N_VClone(y);
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  void *ida = IDACreate(s->context);
  CHECK_OK(flesh_ida_start(problem, state, y, yp));
  CHECK_OK(flesh_ida_tolerances(problem, tolerance, atol));
  CHECK(!IDAInit(ida, flesh_ida_residual, t, y, yp) && !IDASVtolerances(ida, 0, atol) && !IDASetUserData(ida, problem));
  CHECK(!IDASetMaxOrd(ida, 2) && !IDASetMaxNumSteps(ida, 100000));
  if (gmres) solver = SUNLinSol_SPGMR(y, SUN_PREC_LEFT, 30, s->context);
  else CHECK_OK(flesh_ida_sunmatrix_create(problem, s->context, &A));
  if (!gmres) CHECK_OK(flesh_ida_sunlinsol_create(problem, s->context, &solver));
  CHECK(!IDASetLinearSolver(ida, solver, A));
  if (gmres) {
    CHECK(!IDASetPreconditioner(ida, flesh_ida_preconditioner_setup, flesh_ida_preconditioner_solve));
    CHECK(!IDASetJacTimes(ida, NULL, flesh_ida_jacobian_times));
  } else {
    CHECK(!IDASetJacFn(ida, flesh_ida_jacobian));
  }
  CHECK(!IDASetStopTime(ida, fmin(end, flesh_ida_event(problem))));
  CHECK(IDASolve(ida, end, &t, y, yp, IDA_NORMAL) >= 0);
  IDAGetNumSteps(ida, &steps);
  CHECK_OK(flesh_ida_get_state(problem, t, y, state));
  IDAFree(&ida);
  SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(atol);
  return steps;
}

/* Runs CVODE or ARKODE to `stop`. */
static long run_cvode(int gmres, flesh_ode_problem *problem, double stop, N_Vector y, N_Vector atol, SUNMatrix A,
                      SUNLinearSolver solver, SUNContext context, double *t)
{
  long steps = 0;
  void *cvode = CVodeCreate(CV_BDF, context);
  CHECK(!CVodeInit(cvode, flesh_ode_rhs, *t, y) && !CVodeSetUserData(cvode, problem) && !CVodeSVtolerances(cvode, 0, atol));
  CHECK(!CVodeSetMaxOrd(cvode, 2) && !CVodeSetMaxNumSteps(cvode, 100000));
  CHECK(!CVodeSetLinearSolver(cvode, solver, A));
  if (gmres) {
    CHECK(!CVodeSetPreconditioner(cvode, flesh_ode_preconditioner_setup, flesh_ode_preconditioner_solve));
    CHECK(!CVodeSetJacTimes(cvode, flesh_ode_jacobian_times_setup, flesh_ode_jacobian_times));
  } else {
    CHECK(!CVodeSetJacFn(cvode, flesh_ode_jacobian));
  }
  CHECK(!CVodeSetStopTime(cvode, stop));
  CHECK(CVode(cvode, end, y, t, CV_NORMAL) >= 0);
  CVodeGetNumSteps(cvode, &steps);
  CVodeFree(&cvode);
  return steps;
}

static long run_implicit(flesh_ode_problem *problem, double stop, N_Vector y, N_Vector atol, SUNMatrix A,
                         SUNLinearSolver solver, SUNContext context, double *t)
{
  long steps = 0;
  void *ark = ARKStepCreate(NULL, flesh_ode_rhs, *t, y, context);
  CHECK(!ARK(ARKStep, SetUserData)(ark, problem) && !ARK(ARKStep, SVtolerances)(ark, 0, atol));
  CHECK(!ARK(ARKStep, SetMaxNumSteps)(ark, 100000) && !ARK(ARKStep, SetLinearSolver)(ark, solver, A));
  CHECK(!ARK(ARKStep, SetJacFn)(ark, flesh_ode_jacobian) && !ARK(ARKStep, SetNonlinCRDown)(ark, 1));
  CHECK(!ARK(ARKStep, SetStopTime)(ark, stop));
  CHECK(ARK(ARKStep, Evolve)(ark, end, y, t, ARK_NORMAL) >= 0);
  ARK(ARKStep, GetNumSteps)(ark, &steps);
  ARK(ARKStep, Free)(&ark);
  return steps;
}

static long run_explicit(flesh_ode_problem *problem, double stop, N_Vector y, N_Vector atol, SUNContext context, double *t)
{
  long steps = 0;
  void *ark = ERKStepCreate(flesh_ode_rhs, *t, y, context);
  CHECK(!ARK(ERKStep, SetUserData)(ark, problem) && !ARK(ERKStep, SVtolerances)(ark, 0, atol));
  CHECK(!ARK(ERKStep, SetMaxNumSteps)(ark, 100000) && !ARK(ERKStep, SetStopTime)(ark, stop));
  CHECK(ARK(ERKStep, Evolve)(ark, end, y, t, ARK_NORMAL) >= 0);
  ARK(ERKStep, GetNumSteps)(ark, &steps);
  ARK(ERKStep, Free)(&ark);
  return steps;
}

static long run_ode(const side *s, way how, flesh_ode_problem *problem, flesh_state *state)
{
  const int gmres = how == CVODE_GMRES;
  double t = state->t;
  N_Vector y = new_vector(s), atol = N_VClone(y);
  SUNMatrix A = NULL;
  SUNLinearSolver solver = NULL;
  CHECK_OK(flesh_ode_start(problem, state, y));
  CHECK_OK(flesh_ode_tolerances(problem, tolerance, atol));
  if (gmres) solver = SUNLinSol_SPGMR(y, SUN_PREC_LEFT, 30, s->context);
  if (how == CVODE || how == ARK_IMPLICIT) {
    CHECK_OK(flesh_ode_sunmatrix_create(problem, s->context, &A));
    CHECK_OK(flesh_ode_sunlinsol_create(problem, s->context, &solver));
  }
  const double stop = fmin(end, flesh_ode_event(problem));
  const long steps = how == ARK_IMPLICIT   ? run_implicit(problem, stop, y, atol, A, solver, s->context, &t)
                     : how == ARK_EXPLICIT ? run_explicit(problem, stop, y, atol, s->context, &t)
                                           : run_cvode(gmres, problem, stop, y, atol, A, solver, s->context, &t);
  CHECK_OK(flesh_ode_get_state(problem, t, y, state));
  if (solver) SUNLinSolFree(solver);
  if (A) SUNMatDestroy(A);
  N_VDestroy(y);
  N_VDestroy(atol);
  return steps;
}

/* Runs from the body's start to the end, across the event; returns a new state. */
static long run(const side *s, way how, flesh_state *state)
{
  const int n = s->body.n, by_ida = how == IDA || how == IDA_GMRES;
  flesh_ida_problem *ida = NULL;
  flesh_ode_problem *ode = NULL;
  flesh_solver_options options = test_options(1e-9);
  long steps = 0;
  *state = (flesh_state){.x = malloc((size_t)n * sizeof(double)), .v = malloc((size_t)n * sizeof(double))};
  memcpy(state->x, s->body.state.x, (size_t)n * sizeof(double));
  memcpy(state->v, s->body.state.v, (size_t)n * sizeof(double));
  if (by_ida) CHECK_OK(flesh_ida_problem_create(s->body.system, &options, &ida));
  else CHECK_OK(flesh_ode_problem_create(s->body.system, &options, &ode));
  for (int piece = 0; piece < 2; piece++)
    steps += by_ida ? run_ida(s, how == IDA_GMRES, ida, state) : run_ode(s, how, ode, state);
  CHECK_NEAR(state->t, end, 1e-12);
  flesh_ida_problem_destroy(&ida);
  flesh_ode_problem_destroy(&ode);
  return steps;
}

/* Programs get the same motion on ranks as on one, within the tolerance of the error test, in no more steps. */
static void motions_are_those_of_one_rank(void)
{
  sides s;
  open_sides(FLESH_MASS_LUMPED, &s);
  double *gathered = malloc((size_t)s.whole.body.n * sizeof *gathered);
  for (int how = 0; how < WAYS; how++) {
    flesh_state whole, own;
    const long alone = run(&s.whole, (way)how, &whole), steps = run(&s.own, (way)how, &own);
    double moved = 0;
    for (int d = 0; d < s.whole.body.n; d++) moved = fmax(moved, fabs(whole.x[d] - s.whole.body.state.x[d]));
    CHECK_OK(flesh_rank_part_gather(s.own.part, own.x, gathered));
    const double off = test_distance(s.whole.body.n, gathered, whole.x);
    if (flesh_communicator_rank(ranks) == 0)
      printf("# %s: %ld steps, on one rank %ld; %.2g m apart after moving %.2g m\n", names[how], steps, alone, off, moved);
    CHECK(moved > 0.02);
    CHECK_BELOW(off, 10 * tolerance);
    CHECK_BELOW((double)steps, 1.2 * (double)alone + 10);
    free(own.x), free(own.v), free(whole.x), free(whole.v);
  }
  free(gathered);
  close_sides(&s);
}

/* An error of a single rank is refused on all, before any of them waits for another. */
static void what_is_of_one_rank_is_refused(void)
{
  sides s;
  flesh_ida_problem *ida = NULL;
  flesh_ode_problem *ode = NULL;
  flesh_solver_options options = test_options(1e-9);
  const int several = flesh_communicator_size(ranks) > 1;
  open_sides(FLESH_MASS_LUMPED, &s);
  options.linear_solver = FLESH_LINEAR_KLU;
  CHECK(flesh_ida_problem_create(s.own.body.system, &options, &ida) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "direct solvers do not run on several ranks");
  CHECK(flesh_ode_problem_create(s.own.body.system, &options, &ode) == FLESH_ERR_ARGUMENT && !ode);
  options.linear_solver = FLESH_LINEAR_PCG;
  CHECK_OK(flesh_ida_problem_create(s.own.body.system, &options, &ida));
  CHECK_OK(flesh_ode_problem_create(s.own.body.system, &options, &ode));
  const int n = s.own.body.n;
  N_Vector y = new_vector(&s.own), yp = N_VClone(y), serial = N_VNew_Serial(2 * n, s.own.context);
  CHECK(flesh_ida_start(ida, &s.own.body.state, serial, serial) == (several ? FLESH_ERR_ARGUMENT : FLESH_OK));
  if (several) CHECK_TEXT(flesh_error_text(), "N_VNew_Parallel");
  CHECK_OK(flesh_ida_start(ida, &s.own.body.state, y, yp));
  CHECK_OK(flesh_ode_start(ode, &s.own.body.state, y));
  SUNMatrix J = SUNSparseMatrix(2 * n, 2 * n, flesh_ida_entries(ida), CSC_MAT, s.own.context);
  CHECK(flesh_ida_jacobian(0, 100, y, yp, NULL, J, ida, NULL, NULL, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "SUNSparseMatrix is for a single rank");
  CHECK(flesh_ode_jacobian(0, y, yp, J, ode, NULL, NULL, NULL) == FLESH_ERR_ARGUMENT);
  SUNMatDestroy(J);
  N_VDestroy(y);
  N_VDestroy(yp);
  N_VDestroy(serial);
  flesh_ida_problem_destroy(&ida);
  flesh_ode_problem_destroy(&ode);
  close_sides(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(what_ida_asks_for_is_that_of_one_rank),
                            TEST(what_cvode_asks_for_is_that_of_one_rank), TEST(motions_are_those_of_one_rank),
                            TEST(what_is_of_one_rank_is_refused));
}
