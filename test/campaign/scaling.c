/* scaling.c: the data that ranks exchange in an iteration of conjugate gradients, for test/campaign/scaling.py.
 *
 *   mpirun -n 4 build/test/scaling 20
 *
 * The argument is the number of cells along an edge of a cube, six tets each, held at one face, in statics. Prints a
 * line for each rank: the nodes that it owns, that it has, and in its overlap; how many of its nodes are in overlaps of
 * others, and how many of its overlap others have, counted once per rank; its neighbours; and the messages, bytes and
 * reductions of one iteration, from the difference of two solves. */
#include "ranks.h"

#include "base/parallel_vector.h"
#include "body.h"
#include "linear/block_matrix.h"
#include "linear/linear.h"

static int cells;

typedef struct problem {
  test_body b;
  flesh_rank_part *part;
  flesh_threads *threads;
  flesh_block_matrix *K;
  flesh_preconditioner_data *preconditioner;
  flesh_pcg_space *space;
  double *load, *x;
} problem;

static const flesh_linear *linear;

static void make(const flesh_mesh *whole, problem *p)
{
  *p = (problem){.part = ranks_cut(whole)};
  test_body *b = &p->b;
  CHECK_OK(flesh_threads_create(1, &p->threads));
  flesh_threads_set_team(p->threads, flesh_rank_part_team(p->part));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(p->part), test_material(FLESH_ENERGY_S, 0.45), 1000,
                            FLESH_MASS_LUMPED, 0, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  int held = 0;
  for (int i = 0; i < b->n / 3; i++) held += b->state.x[3 * i] <= 1e-9;
  if (held) CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
  p->load = calloc((size_t)b->n, sizeof *p->load);
  p->x = calloc((size_t)b->n, sizeof *p->x);
  uint8_t *fixed = calloc((size_t)b->n + 1, 1);
  const flesh_point point = flesh_point_at(0, b->state.x, b->state.v, b->state.v);
  CHECK_OK(flesh_system_matrix_create(b->system, &p->K));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){.x = 1}, p->K));
  CHECK_OK(flesh_system_load(b->system, &point, p->load));
  flesh_system_fixed(b->system, 0, fixed);
  flesh_block_fix(p->K, fixed, 1e4, NULL);
  flesh_team_add_ghosts(flesh_rank_part_team(p->part), p->load);
  CHECK_OK(linear->preconditioner_create(FLESH_PRECONDITIONER_AUTO, p->K, flesh_mesh_positions(b->mesh), 1, p->threads,
                                         &p->preconditioner));
  CHECK_OK(linear->preconditioner_setup(p->preconditioner, p->K, fixed));
  CHECK_OK(linear->pcg_space_create(p->K, 0, p->threads, &p->space));
  free(fixed);
}

static void drop(problem *p)
{
  linear->pcg_space_destroy(&p->space);
  linear->preconditioner_destroy(&p->preconditioner);
  flesh_block_matrix_destroy(&p->K);
  flesh_threads_destroy(&p->threads);
  free(p->load), free(p->x);
  p->b.mesh = NULL; /* the part's */
  test_body_destroy(&p->b);
  flesh_rank_part_destroy(&p->part);
}

/* Counts the exchanges of a solve of this many iterations. */
static flesh_communicator_figures solve(problem *p, int iterations)
{
  flesh_pcg_result result = {0};
  const flesh_communicator_figures before = flesh_communicator_exchanged(ranks);
  const flesh_pcg_request request = {.A = p->K, .preconditioner = p->preconditioner, .b = p->load,
                                     .max_iterations = iterations};
  CHECK(linear->pcg(p->space, &request, p->x, &result) == FLESH_NOT_CONVERGED);
  CHECK(result.iterations == iterations);
  const flesh_communicator_figures now = flesh_communicator_exchanged(ranks);
  return (flesh_communicator_figures){now.reductions - before.reductions, now.messages - before.messages,
                                      now.bytes - before.bytes};
}

static void counts(void)
{
  flesh_mesh *whole = NULL;
  problem p;
  enum { FEW = 3, MORE = 8 };
  CHECK_OK(flesh_mesh_box((int[]){cells, cells, cells}, (double[]){1, 1, 1}, (double[]){0, 0, 0}, &whole));
  make(whole, &p);
  const flesh_team *team = flesh_rank_part_team(p.part);
  const flesh_communicator_figures few = solve(&p, FEW), more = solve(&p, MORE);
  const int size = flesh_communicator_size(ranks), rank = flesh_communicator_rank(ranks), steps = MORE - FEW;
  const flesh_team_neighbours *others = &team->neighbours;
  double line[] = {team->own, team->nodes, team->overlap, others->count ? others->first_given[others->count] : 0,
                   others->count ? others->first_taken[others->count] : 0, others->count,
                   (double)(more.messages - few.messages) / steps, (more.bytes - few.bytes) / steps, (double)(more.reductions - few.reductions) / steps};
  enum { WIDTH = sizeof line / sizeof *line };
  double *all = calloc((size_t)(WIDTH * size), sizeof *all);
  memcpy(all + WIDTH * rank, line, sizeof line);
  flesh_communicator_sum(ranks, WIDTH * size, all);
  for (int r = 0; rank == 0 && r < size; r++) {
    printf("# rank %d of %d, cells %d:", r, size, cells);
    for (int k = 0; k < WIDTH; k++) printf(" %.10g", all[WIDTH * r + k]);
    printf("\n");
  }
  free(all);
  drop(&p);
  flesh_mesh_destroy(&whole);
}

int main(int argc, char **argv)
{
  cells = argc > 1 ? atoi(argv[1]) : 12;
  linear = flesh_linear_for(FLESH_INSTRUCTIONS_AUTO);
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(counts));
}
