/* ranks.c: the cost of a body on several ranks: iterations and messages of each rank.
 *
 *   mpirun -n 4 build/test/ranks 48 13 13 [auto|ic|jacobi [POISSON]]
 *   mpirun -n 4 build/test/ranks data/meshes/finger_fine.msh [auto|ic|jacobi [POISSON]]
 *
 * A bar of so many cells in six tets each, held at one end, or a mesh, held along a tenth of its length in x, in
 * statics under gravity and in ten steps of backward Euler from rest. With Poisson's ratio they are tets of ten nodes,
 * tet10-mean, under a tenth of gravity. Prints a line of each. */
#include "ranks.h"

#include <stdlib.h>
#include <time.h>

#include "body.h"

static int cells[3];
static const char *file; /* a mesh; NULL: the bar */
static double held;      /* up to this x */
static flesh_preconditioner kind;
static double poisson; /* of ten-node tets; 0: of four nodes */

static double seconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void make(const flesh_rank_part *part, int moves, test_body *b)
{
  const flesh_material material = test_material(FLESH_ENERGY_E, poisson > 0 ? poisson : 0.45);
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(part), material, 1000, FLESH_MASS_LUMPED, moves, b));
  CHECK_OK(test_body_gravity(b, 0, 0, poisson > 0 ? -0.981 : -9.81));
  int count = 0, *nodes = malloc((size_t)b->n * sizeof *nodes);
  for (int i = 0; i < b->n / 3; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] <= held) nodes[count++] = i;
  if (count) CHECK_OK(flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
  free(nodes);
  CHECK_OK(flesh_system_finalize(b->system));
  CHECK_OK(flesh_system_set_part(b->system, part));
}

static void measure(const flesh_mesh *whole, const flesh_rank_part *part, int moves)
{
  test_body b;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  flesh_solver_options options = test_options(1e-6);
  options.preconditioner = kind;
  make(part, moves, &b);
  CHECK_OK(flesh_integrator_create(b.system, moves ? FLESH_METHOD_BACKWARD_EULER : FLESH_METHOD_STATIC, &options,
                                   &integrator));
  const flesh_communicator_figures before = flesh_communicator_exchanged(ranks);
  const double start = seconds();
  for (int k = 0; k < (moves ? 10 : 1); k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
  const flesh_communicator_figures now = flesh_communicator_exchanged(ranks);
  double most[5] = {seconds() - start, b.n / 3., (double)(now.messages - before.messages), (now.bytes - before.bytes) / 1e6,
                    (double)(now.reductions - before.reductions)};
  flesh_communicator_largest(ranks, 5, most);
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %d tets, %d ranks, %s: %d Newton, %d linear iterations, %.2f s; of a rank at most %.0f nodes, %.0f "
           "messages of %.1f MB, %.0f reductions\n", flesh_mesh_tet_count(whole), flesh_communicator_size(ranks),
           moves ? "ten steps" : "statics", stats.newton, stats.linear, most[0], most[1], most[2], most[3], most[4]);
  flesh_integrator_destroy(&integrator);
  b.mesh = NULL; /* the part's */
  test_body_destroy(&b);
}

static void hold(const flesh_mesh *whole)
{
  double low = INFINITY, high = -INFINITY;
  for (int i = 0; i < flesh_mesh_node_count(whole); i++) {
    const double x = flesh_mesh_positions(whole)[3 * i];
    low = fmin(low, x);
    high = fmax(high, x);
  }
  held = low + 0.1 * (high - low);
}

static void cost(void)
{
  flesh_mesh *whole = NULL;
  if (file) {
    CHECK_OK(flesh_mesh_read(file, &whole));
    if (!whole) return;
    hold(whole);
  } else {
    const double size[3] = {1, (double)cells[1] / cells[0], (double)cells[2] / cells[0]};
    CHECK_OK(flesh_mesh_box(cells, size, (const double[]){0, 0, 0}, &whole));
    held = 1e-9;
  }
  if (poisson > 0) {
    flesh_mesh *corners = whole;
    CHECK_OK(flesh_mesh_raise_order(corners, &whole));
    flesh_mesh_destroy(&corners);
  }
  flesh_rank_part *part = ranks_cut(whole);
  for (int moves = 0; moves <= 1; moves++) measure(whole, part, moves);
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&whole);
}

int main(int argc, char **argv)
{
  int next = 1;
  if (argc > 1 && strchr(argv[1], '.')) file = argv[next++];
  for (int k = 0; k < 3 && !file; k++) cells[k] = argc > next ? atoi(argv[next++]) : 8;
  if (!file && (cells[0] < 1 || cells[1] < 1 || cells[2] < 1))
    return fprintf(stderr, "usage: ranks NX NY NZ|MESH [KIND [POISSON]]; there is at least one cell along each axis\n"), 2;
  while (argc > next && flesh_preconditioner_name(kind) && strcmp(flesh_preconditioner_name(kind), argv[next])) kind++;
  if (argc > next + 1) poisson = atof(argv[next + 1]);
  return RUN_TESTS_ON_RANKS(argc, argv, TEST(cost));
}
