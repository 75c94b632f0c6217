/* bar_ranks.c: a bar that swings, shared out among ranks of MPI: mpirun -n 3 example_bar_ranks
 *
 * M a + dV/dx = M g, held at one end. Every rank makes the whole mesh and a part of it, and builds a system on its part
 * as a program of one rank would. Steps are collective; each rank has x and v of its own nodes and of those that it
 * shares with others.
 *
 * Sample output:
 *   384 tets on 3 ranks
 *   t = 0.1667 s: tip at (2.000, 0.125, -0.025) m
 *   t = 0.3333 s: tip at (1.976, 0.107, -0.468) m
 *   t = 0.5000 s: tip at (1.743, 0.072, -1.330) m
 */
#include <flesh/flesh.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Ends all ranks where a call fails. */
#define TRY(call)                                                                              \
  do {                                                                                         \
    if (call) {                                                                                \
      fprintf(stderr, "%s:%d: %s fails: %s\n", __FILE__, __LINE__, #call, flesh_error_text()); \
      MPI_Abort(MPI_COMM_WORLD, 1);                                                            \
    }                                                                                          \
  } while (0)

/* The system of a part: inertia, elasticity and gravity on its tets, and pins where it has nodes of the held end. */
static flesh_system *make_system(const flesh_rank_part *part, const flesh_body *body)
{
  const flesh_mesh *mesh = flesh_rank_part_mesh(part);
  const int nodes = flesh_mesh_node_count(mesh);
  flesh_system *system;
  flesh_effect *effect;
  TRY(flesh_system_create(mesh, &system));
  TRY(flesh_system_set_part(system, part));
  TRY(flesh_effect_inertia(body, &effect));
  TRY(flesh_system_add_effect(system, &effect));
  TRY(flesh_effect_elasticity(body, &effect));
  TRY(flesh_system_add_effect(system, &effect));
  TRY(flesh_effect_gravity(body, (double[]){0, 0, -9.81}, &effect));
  TRY(flesh_system_add_effect(system, &effect));
  int *held = malloc((size_t)nodes * sizeof *held), count = 0;
  for (int i = 0; i < nodes; i++)
    if (flesh_mesh_positions(mesh)[3 * i] < 1e-9) held[count++] = i;
  if (count) TRY(flesh_system_add_pin(system, count, held, FLESH_AXES_ALL, -INFINITY, INFINITY));
  TRY(flesh_system_finalize(system));
  free(held);
  return system;
}

/* Steps of backward Euler; the first rank prints where the middle of the free end is. */
static void swing(const flesh_system *system, const flesh_rank_part *part, const flesh_mesh *whole, int first)
{
  const int n = flesh_system_unknowns(system), tip = (1 * 3 + 1) * 17 + 16; /* node (16,1,1) of the whole */
  flesh_state state = {.t = 0, .x = malloc((size_t)n * sizeof(double)), .v = calloc((size_t)n, sizeof(double))};
  double *x = malloc(3 * (size_t)flesh_mesh_node_count(whole) * sizeof *x);
  memcpy(state.x, flesh_mesh_positions(flesh_rank_part_mesh(part)), (size_t)n * sizeof *state.x);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_integrator *integrator;
  TRY(flesh_integrator_create(system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int step = 1; step <= 30; step++) {
    TRY(flesh_integrator_step(integrator, &state, 1. / 60, NULL));
    TRY(flesh_rank_part_gather(part, state.x, x));
    if (step % 10 == 0 && first)
      printf("t = %.4f s: tip at (%.3f, %.3f, %.3f) m\n", state.t, x[3 * tip], x[3 * tip + 1], x[3 * tip + 2]);
  }
  flesh_integrator_destroy(&integrator);
  free(state.x);
  free(state.v);
  free(x);
}

int main(int argc, char **argv)
{
  /* 1. MPI is the program's. Flesh takes a duplicate of the communicator. */
  MPI_Init(&argc, &argv);
  MPI_Comm world = MPI_COMM_WORLD;
  flesh_communicator *communicator;
  TRY(flesh_communicator_create(&world, &communicator));
  const int first = flesh_communicator_rank(communicator) == 0;

  /* 2. The whole, and this rank's part of it. */
  flesh_mesh *whole;
  flesh_rank_part *part;
  TRY(flesh_mesh_box((int[]){16, 2, 2}, (double[]){2, 0.25, 0.25}, (double[]){0, 0, 0}, &whole));
  TRY(flesh_rank_part_create(communicator, whole, NULL, &part));
  if (first) printf("%d tets on %d ranks\n", flesh_mesh_tet_count(whole), flesh_communicator_size(communicator));

  /* 3. The body on the part's tets. */
  const int tets = flesh_mesh_tet_count(flesh_rank_part_mesh(part));
  flesh_material material;
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  double *density = malloc((size_t)tets * sizeof *density);
  for (int e = 0; e < tets; e++) density[e] = 1000; /* kg/m^3 */
  const flesh_body body = {.mesh = flesh_rank_part_mesh(part), .density = density, .materials = &material};
  flesh_system *system = make_system(part, &body);

  /* 4. The motion. */
  swing(system, part, whole, first);

  /* 5. The communicator goes before MPI does. */
  flesh_system_destroy(&system);
  flesh_rank_part_destroy(&part);
  flesh_mesh_destroy(&whole);
  free(density);
  flesh_communicator_destroy(&communicator);
  MPI_Finalize();
  return 0;
}
