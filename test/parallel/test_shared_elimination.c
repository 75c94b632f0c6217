// TEST full memory needs=ranks ranks=1,2,3,5
/* test_shared_elimination.c: nonlinear elimination of a body shared by ranks: each rank solves for the nodes that only
 * it has, the results form one step, and solves take fewer iterations to the same solution. */
#include "ranks.h"

#include "base/parallel_vector.h"
#include "body.h"
#include "newton/newton.h"
#include "sundials/kinsol.h"

/* The whole body, which every rank has, and this rank's part of it. */
typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body own;
} bodies;

/* A free bar. */
static void open_bar(bodies *b)
{
  flesh_effect *effect = NULL;
  b->mesh = test_box(60, 9, 9, 0.6, 0.09, 0.09);
  b->part = ranks_cut(b->mesh);
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(b->part), test_material(FLESH_ENERGY_S, 0.45), 1000,
                            FLESH_MASS_CONSISTENT, 1, &b->own));
  CHECK_OK(flesh_effect_damping(&b->own.body, 2, 0.02, FLESH_STIFFNESS_CURRENT, &effect));
  CHECK_OK(flesh_system_add_effect(b->own.system, &effect));
  CHECK_OK(flesh_system_set_part(b->own.system, b->part));
  CHECK_OK(flesh_system_finalize(b->own.system));
}

static void close_bar(bodies *b)
{
  b->own.mesh = NULL; /* the part's */
  test_body_destroy(&b->own);
  flesh_rank_part_destroy(&b->part);
  flesh_mesh_destroy(&b->mesh);
}

/* Displaces nodes around one to three positions along the bar, through which no cut between two, three or five ranks
 * passes, by up to `amplitude`, m; the same ones on all ranks that have them. */
static void throw_about(const bodies *b, int places, double radius, double amplitude, double *x)
{
  static const double along[] = {0.1, 0.26, 0.5};
  const double *X = flesh_mesh_positions(b->mesh);
  const size_t n = 3 * (size_t)flesh_mesh_node_count(b->mesh);
  double *thrown = calloc(n, sizeof *thrown);
  test_jitter((int)n, amplitude, 7, thrown);
  for (int i = 0; i < b->own.n / 3; i++) {
    const size_t node = 3 * (size_t)flesh_rank_part_nodes(b->part)[i];
    double nearest = INFINITY;
    for (int k = 0; k < places; k++)
      nearest = fmin(nearest, hypot(hypot(X[node] - along[k], X[node + 1] - 0.04), X[node + 2] - 0.04));
    for (size_t c = 0; c < 3 && nearest < radius; c++) x[3 * (size_t)i + c] += thrown[node + c];
  }
  free(thrown);
}

static flesh_stage stage_of(const test_body *b)
{
  return (flesh_stage){.t = 1. / 60, .load = 1, .prescribed_fraction = 1, .shift = {.x = 1, .v = 60, .a = 3600},
                       .x0 = b->state.x, .x_lag = b->state.x, .v_lag = b->state.v};
}

/* The whole's solver of few nodes, with its own memory. */
static int solve_stage(void *data, const flesh_system *system, const flesh_solver_options *options, const flesh_stage *stage,
                       flesh_stop stop, flesh_solve_stats *stats, double *u)
{
  flesh_nonlinear *nonlinear = NULL;
  flesh_reserve *reserve = flesh_reserve_enter(NULL);
  int status = flesh_nonlinear_create(system, options, &nonlinear);
  (void)stop;
  CHECK(!flesh_newton_uses_elimination(system, options));
  ++*(int *)data;
  if (!status) status = flesh_nonlinear_solve(nonlinear, stage, NULL, 0, stats);
  if (status >= 0) memcpy(u, nonlinear->u, (size_t)flesh_system_unknowns(system) * sizeof *u);
  flesh_nonlinear_destroy(&nonlinear);
  flesh_reserve_enter(reserve);
  return status;
}

/* The residual vanishes at free nodes, whichever rank solved for them; nodes of several ranks stay. */
static void find_together(int places)
{
  bodies b;
  flesh_newton newton;
  flesh_equations *equations = &newton.equations;
  flesh_solver_options options = test_options(1e-8);
  int asked = 0;
  open_bar(&b);
  const flesh_team *team = flesh_rank_part_team(b.part);
  const int n = b.own.n;
  CHECK_OK(flesh_newton_init(b.own.system, &options, (flesh_stage_solver){&asked, solve_stage}, &newton));
  double *u = calloc((size_t)n, sizeof *u), *r = malloc(3 * (size_t)n * sizeof *r), *w = r + n, *after = r + 2 * n;
  const flesh_stage stage = stage_of(&b.own);
  flesh_newton_set_stage(&newton, &stage);
  CHECK_OK(flesh_newton_matrix(&newton, u, NULL));
  throw_about(&b, places, 0.006, 0.002, u);
  double before, lower, size, found[2] = {0};
  CHECK_OK(flesh_equations_residual(equations, u, r));
  CHECK_OK(flesh_equations_potential(equations, u, &before, &size));
  CHECK_OK(flesh_subdomain_solve(&newton, u, r, w));
  for (int k = 0; k < team->neighbours.first_taken[team->neighbours.count]; k++) /* what others have */
    for (int c = 0; c < 3 && team->neighbours.taken[k] < team->nodes; c++) CHECK(w[3 * team->neighbours.taken[k] + c] == 0);
  for (int d = 0; d < n; d++) {
    u[d] += w[d];
    found[0] += w[d] != 0;
  }
  found[1] = asked;
  flesh_communicator_sum(ranks, 2, found);
  CHECK(newton.stats.subdomains == found[1] && found[1] > 0 && found[0] > 300 * places);
  CHECK(newton.stats.subdomain_share > 0 && newton.stats.subdomain_share < newton.stats.subdomain_newton);
  CHECK_OK(flesh_equations_residual(equations, u, after));
  CHECK_OK(flesh_equations_potential(equations, u, &lower, &size));
  CHECK(lower < before);
  for (int d = 0; d < n; d++)
    if (w[d] == 0) after[d] = r[d] = 0;
  const double left = flesh_norm(newton.threads, n, after), was = flesh_norm(newton.threads, n, r);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %g unknowns of %g subdomains moved, residual %.3g, then %.3g\n", found[0], found[1], was, left);
  CHECK_BELOW(left, 0.03 * was);
  free(u), free(r);
  flesh_newton_clear(&newton);
  close_bar(&b);
}

/* Also if all but one find nothing. */
static void what_ranks_find_adds_up(void)
{
  for (int places = 1; places <= 3; places += 2) find_together(places);
}

/* Takes a step of backward Euler from there, by the solve of its stage only; x [n] is its end. */
static flesh_solve_stats step(const bodies *b, const flesh_solver_options *options, double *x)
{
  flesh_nonlinear *nonlinear = NULL;
  flesh_solve_stats stats = {0};
  const flesh_stage stage = stage_of(&b->own);
  CHECK_OK(flesh_nonlinear_create(b->own.system, options, &nonlinear));
  CHECK_OK(flesh_nonlinear_solve(nonlinear, &stage, NULL, 0, &stats));
  for (int d = 0; d < b->own.n; d++) x[d] = b->own.state.x[d] + nonlinear->u[d];
  flesh_nonlinear_destroy(&nonlinear);
  return stats;
}

static void tangles_cost_less_and_end_the_same(void)
{
  bodies b;
  flesh_solver_options options = test_options(1e-8);
  open_bar(&b);
  throw_about(&b, 3, 0.012, 0.02, b.own.state.x);
  double *ends[2] = {malloc((size_t)b.own.n * sizeof(double)), malloc((size_t)b.own.n * sizeof(double))};
  const flesh_solve_stats alone = step(&b, &options, ends[0]);
  options.techniques &= ~(unsigned)FLESH_TECHNIQUE_NONLINEAR_ELIMINATION;
  const flesh_solve_stats together = step(&b, &options, ends[1]);
  double apart = test_distance(b.own.n, ends[0], ends[1]);
  flesh_communicator_largest(ranks, 1, &apart);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %d Newton iterations and %d in %d subdomains (as much as %.2f), else %d; ends %.2g m apart\n", alone.newton,
           alone.subdomain_newton, alone.subdomains, alone.subdomain_share, together.newton, apart);
  double counts[] = {alone.subdomains, alone.subdomain_newton, -alone.subdomains, -alone.subdomain_newton};
  flesh_communicator_largest(ranks, 4, counts);
  CHECK(counts[0] == -counts[2] && counts[1] == -counts[3]); /* the same on all */
  CHECK(alone.subdomains > 0 && together.subdomains == 0);
  CHECK(alone.newton < together.newton);
  CHECK_BELOW(apart, 1e-6);
  free(ends[0]), free(ends[1]);
  close_bar(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(what_ranks_find_adds_up), TEST(tangles_cost_less_and_end_the_same));
}
