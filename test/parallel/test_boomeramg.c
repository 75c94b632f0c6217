// TEST full memory needs=ranks,hypre ranks=1,2,3,5
/* test_boomeramg.c: hypre's BoomerAMG as a preconditioner, on one rank and on several: symmetric and positive definite, as
 * good on ranks as on one, and equilibria and motions that are those of flesh's own preconditioner. */
#include "ranks.h"

#include "base/parallel_vector.h"
#include "body.h"
#include "linear/block_matrix.h"
#include "linear/linear.h"

static const int cells[3] = {12, 4, 3};

/* A bar that is held at one end, as the whole or as this rank's part of it. */
static void make(flesh_mesh *mesh, const flesh_rank_part *part, test_body *b)
{
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 1, -9.81));
  int count = 0, *nodes = malloc((size_t)b->n * sizeof *nodes);
  for (int i = 0; i < b->n / 3; i++)
    if (b->state.x[3 * i] <= 1e-9) nodes[count++] = i;
  if (count) CHECK_OK(flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
  free(nodes);
  CHECK_OK(flesh_system_finalize(b->system));
  if (part) CHECK_OK(flesh_system_set_part(b->system, part));
}

typedef struct problem {
  test_body b;
  flesh_threads *threads;
  const flesh_team *team;
  flesh_block_matrix *K;
  uint8_t *fixed;
  double *load;
} problem;

/* The matrix at rest and the load, with constraints; of the whole where `part` is NULL. */
static void make_problem(flesh_mesh *mesh, const flesh_rank_part *part, problem *p)
{
  *p = (problem){.team = part ? flesh_rank_part_team(part) : NULL};
  make(mesh, part, &p->b);
  p->fixed = calloc((size_t)p->b.n, 1);
  p->load = calloc((size_t)p->b.n, sizeof *p->load);
  CHECK_OK(flesh_threads_create(1, &p->threads));
  flesh_threads_set_team(p->threads, p->team);
  const flesh_point point = flesh_point_at(0, p->b.state.x, p->b.state.v, p->b.state.v);
  CHECK_OK(flesh_system_matrix_create(p->b.system, &p->K));
  CHECK_OK(flesh_system_jacobian(p->b.system, &point, &(flesh_shift){.x = 1}, p->K));
  CHECK_OK(flesh_system_load(p->b.system, &point, p->load));
  flesh_system_fixed(p->b.system, 0, p->fixed);
  for (int d = 0; d < p->b.n; d++)
    if (p->fixed[d]) p->load[d] = 0;
  flesh_block_fix(p->K, p->fixed, 1e4, NULL);
  flesh_team_collect(p->team, p->load);
}

static void drop_problem(problem *p)
{
  flesh_block_matrix_destroy(&p->K);
  flesh_threads_destroy(&p->threads);
  free(p->fixed), free(p->load);
  p->b.mesh = NULL;
  test_body_destroy(&p->b);
}

static void create(problem *p, flesh_preconditioner kind, flesh_preconditioner_data **m)
{
  const flesh_linear *linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  CHECK_OK(linear->preconditioner_create(kind, p->K, flesh_mesh_positions(p->b.mesh), p->threads, m));
  CHECK_OK(linear->preconditioner_setup(*m, p->K, p->fixed));
}

/* Iterations of one solve. */
static int solve(problem *p, flesh_preconditioner kind)
{
  const flesh_linear *linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  flesh_preconditioner_data *m = NULL;
  flesh_pcg_space *space = NULL;
  flesh_pcg_result result = {0};
  double *x = calloc((size_t)p->b.n, sizeof *x);
  create(p, kind, &m);
  CHECK_OK(linear->pcg_space_create(p->K, 0, p->threads, &space));
  const flesh_pcg_request request = {.A = p->K, .preconditioner = m, .b = p->load,
                                     .tolerance = 1e-6 * flesh_norm(p->threads, p->b.n, p->load),
                                     .max_iterations = 2000};
  CHECK_OK(linear->pcg(space, &request, x, &result));
  linear->pcg_space_destroy(&space);
  linear->preconditioner_destroy(&m);
  free(x);
  return result.iterations;
}

typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
} bodies;

static void make_bodies(bodies *b)
{
  *b = (bodies){0};
  CHECK_OK(flesh_mesh_box(cells, (const double[]){1, 0.4, 0.3}, (const double[]){0, 0, 0}, &b->mesh));
  b->part = ranks_cut(b->mesh);
}

static void drop_bodies(bodies *b)
{
  flesh_rank_part_destroy(&b->part);
  flesh_mesh_destroy(&b->mesh);
}

static flesh_mesh *mesh_of(const bodies *b) { return (flesh_mesh *)flesh_rank_part_mesh(b->part); }

/* P^-1 of random vectors: (P^-1 r) . s is (P^-1 s) . r up to single precision, and the same bits after another set-up. */
static void a_cycle_is_symmetric_definite_and_repeatable(void)
{
  const flesh_linear *linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  flesh_preconditioner_data *m = NULL;
  unsigned long long seed = 7 + (unsigned long long)flesh_communicator_rank(ranks);
  bodies b;
  problem p;
  make_bodies(&b);
  make_problem(mesh_of(&b), b.part, &p);
  const int n = p.b.n, own = 3 * flesh_rank_part_own(b.part);
  double *r[2], *z[3];
  for (int k = 0; k < 3; k++) z[k] = calloc((size_t)n, sizeof *z[k]);
  for (int k = 0; k < 2; k++) r[k] = calloc((size_t)n, sizeof *r[k]);
  for (int k = 0; k < 2; k++)
    for (int d = 0; d < own; d++) r[k][d] = 2 * test_uniform(&seed) - 1;
  create(&p, FLESH_PRECONDITIONER_BOOMERAMG, &m);
  for (int k = 0; k < 2; k++) linear->preconditioner_apply(m, r[k], z[k]);
  const double size = flesh_norm(p.threads, n, r[0]) * flesh_norm(p.threads, n, z[1]);
  CHECK_NEAR(flesh_dot(p.threads, n, z[0], r[1]), flesh_dot(p.threads, n, z[1], r[0]), 1e-6 * size);
  for (int k = 0; k < 2; k++) CHECK(flesh_dot(p.threads, n, z[k], r[k]) > 0);
  CHECK_OK(linear->preconditioner_setup(m, p.K, p.fixed));
  linear->preconditioner_apply(m, r[0], z[2]);
  CHECK(!memcmp(z[0], z[2], (size_t)own * sizeof *z[0]));
  linear->preconditioner_destroy(&m);
  for (int k = 0; k < 3; k++) free(z[k]);
  for (int k = 0; k < 2; k++) free(r[k]);
  drop_problem(&p);
  drop_bodies(&b);
}

/* Multigrid of all ranks' matrix: smoothers end at a rank's nodes, which costs some iterations, and no more. Of a matrix
 * that lacks what other ranks add, it would be as poor as the diagonal. */
static void ranks_take_as_many_iterations_as_one(void)
{
  bodies b;
  problem whole, own;
  make_bodies(&b);
  make_problem(b.mesh, NULL, &whole);
  make_problem(mesh_of(&b), b.part, &own);
  const int alone = solve(&whole, FLESH_PRECONDITIONER_BOOMERAMG), together = solve(&own, FLESH_PRECONDITIONER_BOOMERAMG),
            diagonal = solve(&own, FLESH_PRECONDITIONER_JACOBI);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %d ranks: %d iterations, %d on one, %d by the diagonal\n", flesh_communicator_size(ranks), together, alone,
           diagonal);
  CHECK_BELOW(together, 1.7 * alone);
  CHECK_BELOW(3 * together, diagonal);
  drop_problem(&whole);
  drop_problem(&own);
  drop_bodies(&b);
}

/* Moves the part to an equilibrium and, with a step > 0, by three steps from rest. */
static void march(const bodies *b, flesh_method method, double step, flesh_preconditioner kind, test_body *own)
{
  flesh_solver_options options = test_options(1e-9);
  flesh_integrator *integrator = NULL;
  options.preconditioner = kind;
  make(mesh_of(b), b->part, own);
  CHECK_OK(flesh_integrator_create(own->system, method, &options, &integrator));
  for (int k = 0; k < (step > 0 ? 3 : 1); k++) CHECK_OK(flesh_integrator_step(integrator, &own->state, step, NULL));
  if (kind == FLESH_PRECONDITIONER_BOOMERAMG) {
    size_t size;
    CHECK(flesh_integrator_save(integrator, 0, NULL, &size) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), "boomeramg");
    CHECK(flesh_integrator_memory(integrator) > 0);
  }
  flesh_integrator_destroy(&integrator);
}

static void equilibria_and_motions_are_those_of_another_preconditioner(void)
{
  bodies b;
  make_bodies(&b);
  for (int moves = 0; moves <= 1; moves++) {
    test_body own[2];
    const flesh_method method = moves ? FLESH_METHOD_BACKWARD_EULER : FLESH_METHOD_STATIC;
    double most = 0;
    march(&b, method, 0.02 * moves, FLESH_PRECONDITIONER_IC, &own[0]);
    march(&b, method, 0.02 * moves, FLESH_PRECONDITIONER_BOOMERAMG, &own[1]);
    for (int d = 0; d < own[0].n; d++) most = fmax(most, fabs(own[0].state.x[d] - own[1].state.x[d]));
    CHECK_BELOW(most, 1e-7);
    for (int k = 0; k < 2; k++) {
      own[k].mesh = NULL;
      test_body_destroy(&own[k]);
    }
  }
  drop_bodies(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(a_cycle_is_symmetric_definite_and_repeatable),
                            TEST(ranks_take_as_many_iterations_as_one),
                            TEST(equilibria_and_motions_are_those_of_another_preconditioner));
}
