/* bar_ranks.h: the body of the examples with ranks of MPI: a soft bar of 2 m x 0.25 m x 0.25 m along x, held at x = 0.
 * Every rank has the whole mesh and its part of it. */
#ifndef FLESH_EXAMPLES_BAR_RANKS_H
#define FLESH_EXAMPLES_BAR_RANKS_H

#include <flesh/flesh.h>
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Ends all ranks when a call fails. */
#define TRY(call)                                                                              \
  do {                                                                                         \
    if (call) {                                                                                \
      fprintf(stderr, "%s:%d: %s fails: %s\n", __FILE__, __LINE__, #call, flesh_error_text()); \
      MPI_Abort(MPI_COMM_WORLD, 1);                                                            \
    }                                                                                          \
  } while (0)

typedef struct bar_ranks {
  flesh_communicator *communicator;
  int first;              /* 1 on the first rank, which prints */
  flesh_mesh *whole;
  int tip;                /* node of the whole mesh in the middle of the free end */
  flesh_rank_part *part;
  const flesh_mesh *mesh; /* of the part */
  double *density;
  flesh_material material;
  flesh_body body;        /* on the part's mesh */
  flesh_system *system;
} bar_ranks;

/* Makes the system of the rank's part: elasticity and gravity, inertia if `moves`, and pins on its nodes at x = 0. */
static inline void bar_ranks_make_system(bar_ranks *b, int moves, double gravity)
{
  const int nodes = flesh_mesh_node_count(b->mesh);
  flesh_effect *effect;
  TRY(flesh_system_create(b->mesh, &b->system));
  TRY(flesh_system_set_part(b->system, b->part));
  if (moves) {
    TRY(flesh_effect_inertia(&b->body, &effect));
    TRY(flesh_system_add_effect(b->system, &effect));
  }
  TRY(flesh_effect_elasticity(&b->body, &effect));
  TRY(flesh_system_add_effect(b->system, &effect));
  TRY(flesh_effect_gravity(&b->body, (double[]){0, 0, -gravity}, &effect));
  TRY(flesh_system_add_effect(b->system, &effect));
  int *held = malloc((size_t)nodes * sizeof *held), count = 0;
  for (int i = 0; i < nodes; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] < 1e-9) held[count++] = i;
  if (count) TRY(flesh_system_add_pin(b->system, count, held, FLESH_AXES_ALL, -INFINITY, INFINITY));
  TRY(flesh_system_finalize(b->system));
  free(held);
}

/* Makes the bar. To be called after MPI_Init; flesh duplicates MPI's communicator. */
static inline void bar_ranks_begin(bar_ranks *b, int moves, double gravity)
{
  MPI_Comm world = MPI_COMM_WORLD;
  TRY(flesh_communicator_create(&world, &b->communicator));
  b->first = flesh_communicator_rank(b->communicator) == 0;
  TRY(flesh_mesh_box((int[]){16, 2, 2}, (double[]){2, 0.25, 0.25}, (double[]){0, 0, 0}, &b->whole));
  b->tip = (1 * 3 + 1) * 17 + 16; /* node (16,1,1) of the grid */
  TRY(flesh_rank_part_create(b->communicator, b->whole, NULL, &b->part));
  if (b->first)
    printf("%d tets on %d ranks\n", flesh_mesh_tet_count(b->whole), flesh_communicator_size(b->communicator));
  b->mesh = flesh_rank_part_mesh(b->part);
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &b->material));
  const int tets = flesh_mesh_tet_count(b->mesh);
  b->density = malloc((size_t)tets * sizeof *b->density);
  for (int e = 0; e < tets; e++) b->density[e] = 1000; /* kg/m^3 */
  b->body = (flesh_body){.mesh = b->mesh, .density = b->density, .materials = &b->material};
  bar_ranks_make_system(b, moves, gravity);
}

/* Returns a new state of the part, at rest. */
static inline flesh_state bar_ranks_rest(const bar_ranks *b)
{
  const size_t bytes = (size_t)flesh_system_unknowns(b->system) * sizeof(double);
  flesh_state state = {.x = malloc(bytes), .v = calloc(1, bytes)};
  memcpy(state.x, flesh_mesh_positions(b->mesh), bytes);
  return state;
}

/* Prints on the first rank where the tip is. x [3*nodes of the part]; only entries of the rank's own nodes are read. */
static inline void bar_ranks_print_tip(const bar_ranks *b, const char *when, const double *x)
{
  double *whole = malloc(3 * (size_t)flesh_mesh_node_count(b->whole) * sizeof *whole);
  TRY(flesh_rank_part_gather(b->part, x, whole));
  const double *tip = whole + 3 * (size_t)b->tip;
  if (b->first) printf("%s tip at (%.3f, %.3f, %.3f) m\n", when, tip[0], tip[1], tip[2]);
  free(whole);
}

/* Before MPI_Finalize. */
static inline void bar_ranks_end(bar_ranks *b)
{
  flesh_system_destroy(&b->system);
  flesh_rank_part_destroy(&b->part);
  flesh_mesh_destroy(&b->whole);
  free(b->density);
  flesh_communicator_destroy(&b->communicator);
}

#endif
