// TEST quick needs=ranks,nvecparallel,cvode,arkode ranks=1,2,3,5
/* test_parallel_newton.c: flesh's Newton in an IDA, ARKODE or CVODE on several ranks, with vectors of N_VNew_Parallel:
 * the same motion as on one rank, also onto an obstacle. */
#include "ranks.h"

#include <nvector/nvector_parallel.h>
#include <nvector/nvector_serial.h>

#include "body.h"
#include "effect/private.h"
#include "owned_integrator.h"

static const double end = 0.06, tolerance = 1e-5;

/* A whole bar on every rank, and the part of this rank. */
typedef struct bodies {
  test_body whole, own;
  flesh_rank_part *part;
} bodies;

/* Makes a bar held at x = 0; its free end falls on a plane. */
static void add_effects(bodies *b)
{
  test_body *const both[] = {&b->whole, &b->own};
  flesh_contact_options options;
  flesh_obstacle *plane = NULL;
  flesh_effect *contact = NULL, *own = NULL;
  flesh_contact_options_default(&options);
  options.thickness = 2e-2;
  CHECK_OK(flesh_obstacle_plane((double[]){0, 0, -0.05}, (double[]){0, 0, 1}, &plane));
  CHECK_OK(flesh_effect_obstacle_contact(&b->whole.body, &options, &plane, &contact));
  CHECK_OK(flesh_effect_private_of(contact)->ranks->restrict_to_part(contact, b->part, &b->own.body, &own));
  CHECK_OK(flesh_system_add_effect(b->own.system, &own));
  CHECK_OK(flesh_system_add_effect(b->whole.system, &contact));
  for (int k = 0; k < 2; k++) {
    int *nodes = malloc((size_t)both[k]->n * sizeof *nodes), count = 0;
    CHECK_OK(test_body_gravity(both[k], 0, 0, -40));
    for (int i = 0; i < both[k]->n / 3; i++)
      if (flesh_mesh_positions(both[k]->mesh)[3 * i] <= 1e-9) nodes[count++] = i;
    if (count) CHECK_OK(flesh_system_add_pin(both[k]->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
    CHECK_OK(flesh_system_finalize(both[k]->system));
    free(nodes);
  }
}

static void open_bodies(bodies *b)
{
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.4);
  flesh_mesh *mesh = test_box(6, 2, 2, 1, 0.3, 0.3);
  b->part = ranks_cut(mesh);
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b->whole));
  CHECK_OK(test_body_create((flesh_mesh *)flesh_rank_part_mesh(b->part), material, 1000, FLESH_MASS_LUMPED, 1, &b->own));
  CHECK_OK(flesh_system_set_part(b->own.system, b->part));
  add_effects(b);
}

static owned_integrator fall(owned_kind kind, test_body *b, N_Vector y, SUNContext context)
{
  owned_integrator o = owned_new(kind, tolerance, context, y);
  CHECK(owned_run(&o, b->system, end, &b->state) >= 0);
  N_VDestroy(y);
  return o;
}

static void motions_are_those_of_one_rank(void)
{
  SUNContext context;
  CHECK(flesh_suncontext_create(&context) == 0);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    bodies b;
    open_bodies(&b);
    test_body *const whole = &b.whole, *const own = &b.own;
    const flesh_team *team = flesh_rank_part_team(b.part);
    const owned_integrator one = fall((owned_kind)kind, whole, N_VNew_Serial(2 * whole->n, context), context),
                           all = fall((owned_kind)kind, own,
                                      N_VNew_Parallel(MPI_COMM_WORLD, 6 * team->own, (sunindextype)(6 * team->all), context),
                                      context);
    double *x = malloc((size_t)whole->n * sizeof *x), lowest = 0;
    CHECK_OK(flesh_rank_part_gather(b.part, own->state.x, x));
    const double off = test_distance(whole->n, x, whole->state.x);
    for (int d = 2; d < whole->n; d += 3) lowest = fmin(lowest, x[d]);
    if (flesh_communicator_rank(ranks) == 0)
      printf("# %s: %ld steps, %ld Newton iterations, on one rank %ld and %ld; %.2g m apart, lowest node at %.4f m\n",
             owned_names[kind], all.steps, all.newton, one.steps, one.newton, off, lowest);
    CHECK(lowest > -0.05 && lowest < -0.03); /* it has come near the plane */
    CHECK_BELOW(off, 100 * tolerance);
    CHECK_BELOW((double)all.newton, 1.3 * (double)one.newton + 20);
    free(x);
    own->mesh = NULL; /* the part's */
    test_body_destroy(own);
    test_body_destroy(whole);
    flesh_rank_part_destroy(&b.part);
  }
  SUNContext_Free(&context);
}

int main(int argc, char **argv) { return RUN_TESTS_ON_RANKS(argc, argv, TEST(motions_are_those_of_one_rank)); }
