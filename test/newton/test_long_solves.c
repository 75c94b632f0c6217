// TEST quick
/* test_long_solves.c: measures that shorten long solves, or prevent giving up too early or going on for ever: steps
 * that are lengthened, and batches of 300 iterations that must make progress. Springs hold all nodes except one, whose
 * potential or feasible step is the case's. */
#include "body.h"
#include "test.h"

typedef struct spring {
  int nodes, special;
  double power;                      /* potential |d|^power / power of the special node's x, starting at d = 1 */
  double pace, wall;                 /* at most the fraction `pace` of the distance to the wall is feasible */
} spring;

static double distance(const spring *s, const double *x) { return x[3 * s->special]; }

static int spring_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const spring *s = effect->data;
  const double d = distance(s, point->x);
  r[3 * s->special] += copysign(pow(fabs(d), s->power - 1), d);
  return FLESH_OK;
}

static int spring_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  const spring *s = effect->data;
  (void)slots;
  for (int i = 0; i < s->nodes; i++)
    for (int c = 0; c < 3; c++) {
      const double d = distance(s, point->x), own = (s->power - 1) * pow(fabs(d), s->power - 2);
      K->values[9 * (size_t)K->row_start[i] + 4 * c] += shift->x * (i == s->special && c == 0 ? own : 1);
    }
  return FLESH_OK;
}

static int spring_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  const spring *s = effect->data;
  const double value = pow(fabs(distance(s, point->x)), s->power) / s->power / shift->x;
  *phi += value;
  *magnitude += value;
  return FLESH_OK;
}

static double spring_max_feasible_step(const flesh_effect *effect, void *near, const double *internal, double t_from,
                                       const double *x_from, double t_to, const double *x_to)
{
  const spring *s = effect->data;
  const double from = distance(s, x_from), change = fabs(distance(s, x_to) - from);
  (void)near, (void)internal, (void)t_from, (void)t_to;
  const double most = s->pace * (from - s->wall);
  return change > most ? most / change : 1;
}

static const flesh_effect_operations unlimited = {.name = "spring",
                                                 .residual = spring_residual,
                                                 .jacobian = spring_jacobian,
                                                 .potential = spring_potential};
static const flesh_effect_operations barred = {.name = "spring",
                                               .residual = spring_residual,
                                               .jacobian = spring_jacobian,
                                               .potential = spring_potential,
                                               .barrier = &(const flesh_effect_barrier){
                                                   .max_feasible_step = spring_max_feasible_step}};

/* Takes one step with the special node at 1. */
static int solve(const flesh_effect_operations *operations, spring *s, const flesh_solver_options *options,
                 flesh_solve_stats *stats, double *end)
{
  flesh_mesh *mesh = test_box(6, 4, 4, 6, 4, 4);
  flesh_system *system = NULL;
  flesh_effect *effect = NULL;
  flesh_integrator *integrator = NULL;
  s->nodes = flesh_mesh_node_count(mesh);
  s->special = 1; /* the mesh's node with x = 1 */
  flesh_state state = {.x = malloc(3 * (size_t)s->nodes * sizeof(double)),
                       .v = calloc(3 * (size_t)s->nodes, sizeof(double))};
  memcpy(state.x, flesh_mesh_positions(mesh), 3 * (size_t)s->nodes * sizeof *state.x);
  CHECK_OK(flesh_system_create(mesh, &system));
  CHECK_OK(flesh_effect_create(operations, mesh, s, &effect));
  CHECK_OK(flesh_system_add_effect(system, &effect));
  CHECK_OK(flesh_system_finalize(system));
  CHECK_OK(flesh_integrator_create(system, FLESH_METHOD_BACKWARD_EULER, options, &integrator));
  CHECK_NEAR(state.x[3 * s->special], 1, 0);
  int status = flesh_integrator_step(integrator, &state, 1, stats);
  *end = state.x[3 * s->special];
  flesh_integrator_destroy(&integrator);
  flesh_system_destroy(&system);
  flesh_mesh_destroy(&mesh);
  free(state.x);
  free(state.v);
  return status;
}

static flesh_solver_options options_with(int halvings)
{
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = 1e-6;
  options.max_cutbacks = halvings;
  return options;
}

/* Newton's iteration on d^4 reduces d to 2/3 each time, so that r falls to 1e-6 of itself in 12 iterations. */
static void steps_that_fall_short_are_lengthened(void)
{
  spring s = {.power = 4};
  flesh_solver_options options = options_with(0);
  flesh_solve_stats with = {0}, without = {0};
  double end;
  CHECK_OK(solve(&unlimited, &s, &options, &with, &end));
  CHECK_BELOW(fabs(end), 0.0101);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_LONGER_STEPS;
  CHECK_OK(solve(&unlimited, &s, &options, &without, &end));
  CHECK_BELOW(fabs(end), 0.0101);
  printf("# %d and %d iterations\n", with.newton, without.newton);
  CHECK(without.newton == 12 && with.newton <= 6);
  CHECK(with.potential_rises == 0);
}

/* Half a thousandth of the distance at a time: each batch makes progress, and the solve must not be given up after
 * one. */
static void what_gains_goes_on(void)
{
  spring s = {.power = 2, .pace = 0.002, .wall = -1e-3};
  flesh_solver_options options = options_with(0);
  flesh_solve_stats stats = {0};
  double end;
  options.newton_tolerance = 0.3;
  CHECK_OK(solve(&barred, &s, &options, &stats, &end));
  printf("# %d iterations\n", stats.newton);
  CHECK(stats.solves == 1 && stats.convergence_failures == 0);
  CHECK(stats.newton > 600 && stats.newton < 900); /* 0.9 of the pace is gone: ln 0.3 / ln(1 - 0.0018) = 668 */
  CHECK_BELOW(fabs(end), 0.3);
}

/* Against a wall it makes no progress: the third batch gains less than a tenth of the total. */
static void what_gains_nothing_ends(void)
{
  spring s = {.power = 2, .pace = 0.01, .wall = 0.5};
  flesh_solver_options options = options_with(0);
  flesh_solve_stats stats = {0};
  double end;
  CHECK(solve(&barred, &s, &options, &stats, &end) == FLESH_ERR_SOLVE);
  printf("# %d iterations\n", stats.newton);
  CHECK(stats.newton == 600);
  CHECK_NEAR(end, 1, 0); /* as before the solve */
}

/* Near nu = 1/2, without a preconditioner, solves take more iterations than a factor costs. One long solve shows that:
 * later ones end early and are solved by a factor, identically on one thread and on two, with the same solution as long
 * ones. The residual after a factor's step is an error of the model, not of the solve: matrices are kept as after other
 * solves. */
static void long_linear_solves_give_way(void)
{
  double *long_solution = NULL;
  flesh_solve_stats total[3] = {{0}};
  for (int k = 0; k < 3; k++) {
    test_body b;
    flesh_solver_options options = test_options(1e-11);
    flesh_integrator *integrator = NULL;
    options.preconditioner = FLESH_PRECONDITIONER_NONE;
    options.threads = k == 2 ? 2 : 1;
    if (!k) options.techniques &= ~(unsigned)FLESH_TECHNIQUE_DIRECT_FALLBACK;
    CHECK_OK(test_body_create(test_box(6, 3, 3, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4999), 1000, FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int step = 0; step < 3; step++) {
      flesh_solve_stats stats = {0};
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, &stats));
      total[k].linear += stats.linear, total[k].direct += stats.direct;
      total[k].newton += stats.newton, total[k].assemblies += stats.assemblies;
    }
    printf("# %d linear iterations, %d solves by factors; %d Newton iterations with %d matrices\n", total[k].linear,
           total[k].direct, total[k].newton, total[k].assemblies);
    if (!k) {
      long_solution = malloc((size_t)b.n * sizeof *long_solution);
      memcpy(long_solution, b.state.x, (size_t)b.n * sizeof *long_solution);
    }
    CHECK_BELOW(test_distance(b.n, b.state.x, long_solution), 1e-8);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  CHECK(total[0].direct == 0 && total[1].direct > 0 && 4 * total[1].linear < total[0].linear);
  CHECK(total[1].newton < total[0].newton && total[1].assemblies < total[1].newton + 4);
  CHECK(total[2].linear == total[1].linear && total[2].direct == total[1].direct);
  free(long_solution);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(steps_that_fall_short_are_lengthened), TEST(what_gains_goes_on),
                   TEST(what_gains_nothing_ends), TEST_OF_THREADS(long_linear_solves_give_way));
}
