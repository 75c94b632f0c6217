/* bar_ranks.c: computes the motion of a bar that is distributed over ranks of MPI: mpirun -n 3 example_bar_ranks
 *
 * M a + dV/dx = M g, held at one end. Every rank makes the whole mesh and its part of it, and builds a system on its
 * part, as a program without ranks would on the mesh. Steps are collective; each rank has x and v of its own nodes and
 * of those that it shares with others.
 *
 * Sample output:
 *   384 tets on 3 ranks
 *   t = 0.1667 s: tip at (2.000, 0.125, -0.025) m
 *   t = 0.3333 s: tip at (1.976, 0.107, -0.468) m
 *   t = 0.5000 s: tip at (1.743, 0.072, -1.330) m
 */
#include "bar_ranks.h"

/* Takes 30 steps of backward Euler, a collective call. */
static void swing(const bar_ranks *b)
{
  flesh_state state = bar_ranks_rest(b);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  flesh_integrator *integrator;
  TRY(flesh_integrator_create(b->system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int step = 1; step <= 30; step++) {
    TRY(flesh_integrator_step(integrator, &state, 1. / 60, NULL));
    if (step % 10) continue;
    char when[32];
    snprintf(when, sizeof when, "t = %.4f s:", state.t);
    bar_ranks_print_tip(b, when, state.x);
  }
  flesh_integrator_destroy(&integrator);
  free(state.x);
  free(state.v);
}

int main(int argc, char **argv)
{
  bar_ranks b;
  MPI_Init(&argc, &argv); /* the program, not flesh, initialises MPI */
  bar_ranks_begin(&b, 1, 9.81);
  swing(&b);
  bar_ranks_end(&b);
  MPI_Finalize();
  return 0;
}
