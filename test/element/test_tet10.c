// TEST full memory seconds=120
/* test_tet10.c: the batched kernels of ten-node tets (elasticity, damping, viscosity, mass), with every instruction set
 * of this machine, against one tet at a time (tet10_reference.h); straight and curved, numbered in any order; tiles and
 * threads; refusals. */
#include "tet10_reference.h"

static void compare(problem *p, kind kind, flesh_instructions instructions, const char *what)
{
  const comparison found = measure(p, kind, instructions);
  printf("# %s %s %s %s: matrices %.1g, residual %.1g, energy %.1g\n", kind_names[kind],
         flesh_instructions_name(instructions), flesh_element_name(p->element), what, found.matrix, found.residual,
         fabs(found.energy - 1));
  CHECK_BELOW(found.matrix, 1e-12);
  /* Fung's exponential magnifies the rounding of I_C. */
  CHECK_BELOW(found.residual, 1e-12);
  CHECK_NEAR(found.energy, 1, 1e-11);
}

/* Compares the first `kinds` kinds, on every instruction set. */
static void compare_all(problem *p, int kinds, const char *what)
{
  for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
    for (int kind = 0; kind < kinds && available(set); kind++)
      compare(p, (enum kind)kind, (flesh_instructions)set, what);
}

static void check_form(int energy, flesh_element element, double bend, int how)
{
  static const char *const names[] = {"", " wild", " inverted", " reflected", " flat"};
  problem p;
  char what[64];
  matrix_seed = 20240607; /* whatever forms come before it */
  problem_open(energy, element, (int[]){2, 1, 1}, bend, &p);
  deform(&p, how);
  snprintf(what, sizeof what, "%s%s", flesh_energy_name((flesh_energy)energy), names[how]);
  compare_all(&p, energy == FLESH_ENERGY_S ? KINDS : VISCOUS, what); /* the other cases do not use the form */
  problem_close(&p);
}

/* Forms of the singular values have no second derivative for tets shrunk to a point. */
static void check_forms(double bend)
{
  for (int energy = 0; energy <= FLESH_ENERGY_USER; energy++) {
    const int of_stretches = flesh_form_of_stretches((flesh_energy)energy);
    for (int element = FLESH_ELEMENT_TET10; element <= FLESH_ELEMENT_TET10_MEAN; element++)
      for (int how = MILD; how < DEFORMATIONS; how++) {
        if (how != MILD && flesh_psi_needs_volume((flesh_energy)energy)) continue;
        if (how == WILD ? of_stretches : how > WILD && !of_stretches) continue;
        check_form(energy, (flesh_element)element, bend, how);
      }
  }
}

static void straight_batches_agree_with_single_tets(void) { check_forms(0); }

static void curved_batches_agree_with_single_tets(void) { check_forms(0.02); }

/* Makes tets that share only their first `shared` corners: tiles run out of room for nodes or pairs. */
static void tiles_run_out_of_room(void)
{
  for (int shared = 0; shared < 4; shared += 2) {
    problem p;
    problem_of(FLESH_ENERGY_S, FLESH_ELEMENT_TET10_MEAN, tets_apart(70, shared), 0, &p);
    p.K = malloc((size_t)p.n * (size_t)p.n * sizeof *p.K);
    deform(&p, 1);
    compare(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, "apart");
    compare(&p, CONSISTENT, FLESH_INSTRUCTIONS_PORTABLE, "apart");
    problem_close(&p);
  }
}

/* A body of many pieces. */
static void threads_give_the_same_bits(void)
{
  flesh_mesh *mesh;
  problem p;
  CHECK_OK(flesh_mesh_box((int[]){9, 8, 8}, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &mesh));
  problem_of(FLESH_ENERGY_S, FLESH_ELEMENT_TET10_MEAN, mesh, 0, &p);
  p.K = NULL;
  deform(&p, 1);
  for (int kind = 0; kind < KINDS; kind++) check_threads(&p, (enum kind)kind);
  p.element = FLESH_ELEMENT_TET10;
  check_threads(&p, ELASTIC);
  problem_close(&p);
}

static void bad_states_are_told_apart(void)
{
  for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
    for (int energy = 0; energy < FLESH_ENERGY_COUNT && available(set); energy++)
      for (int bad = 0; bad < 3; bad++) {
        problem p;
        flesh_system *system;
        flesh_block_matrix *A;
        double V, size;
        problem_open(energy, FLESH_ELEMENT_TET10_MEAN, (int[]){2, 1, 1}, 0, &p);
        CHECK_OK(make_system(&p, ELASTIC, (flesh_instructions)set, &system));
        CHECK_OK(flesh_system_matrix_create(system, &A));
        deform(&p, 0);
        memcpy(p.x, flesh_mesh_positions(p.mesh), (size_t)p.n * sizeof *p.x);
        double *moved = p.x + 3 * flesh_mesh_tet_edges(p.mesh)[6 * 7];
        if (bad == 0) moved[0] += 10; /* inverts some of its tets */
        else moved[1] = bad == 1 ? NAN : 1e200;
        const flesh_point point = point_of(&p, ELASTIC);
        const flesh_shift shift = shift_of(ELASTIC, 0), projected = shift_of(ELASTIC, 1);
        const int needs_volume = flesh_psi_needs_volume((flesh_energy)energy);
        const int expected = bad ? FLESH_NONFINITE : needs_volume ? FLESH_UNDEFINED : FLESH_OK;
        CHECK(flesh_system_residual(system, &point, p.r) == expected);
        CHECK(flesh_system_jacobian(system, &point, &shift, A) == expected);
        CHECK(flesh_system_jacobian(system, &point, &projected, A) == expected);
        CHECK(flesh_system_potential(system, &point, &shift, &V, &size) == expected);
        flesh_block_matrix_destroy(&A);
        flesh_system_destroy(&system);
        problem_close(&p);
      }
}

/* Elements that do not suit the mesh, and a user-defined psi without its volume term. */
static void misfits_are_refused(void)
{
  problem p;
  flesh_system *system = NULL;
  problem_open(FLESH_ENERGY_USER, FLESH_ELEMENT_TET4, (int[]){1, 1, 1}, 0, &p);
  CHECK(make_system(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, &system) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the element is tet4");
  flesh_system_destroy(&system);
  p.element = FLESH_ELEMENT_COUNT;
  CHECK(make_system(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, &system) == FLESH_ERR_ARGUMENT);
  flesh_system_destroy(&system);
  p.element = FLESH_ELEMENT_AUTO; /* with the mean of J */
  CHECK_OK(make_system(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, &system));
  flesh_system_destroy(&system);
  p.materials[0].lambda = NAN;
  CHECK(make_system(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, &system) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "lambda");
  flesh_system_destroy(&system);
  p.element = FLESH_ELEMENT_TET10;
  CHECK_OK(make_system(&p, ELASTIC, FLESH_INSTRUCTIONS_AUTO, &system));
  flesh_system_destroy(&system);
  problem_close(&p);
  flesh_mesh *box = test_box(1, 1, 1, 1, 1, 1);
  flesh_material m = test_material(FLESH_ENERGY_S, 0.4);
  flesh_effect *effect = NULL;
  const double density[6] = {1, 1, 1, 1, 1, 1};
  flesh_body body = {.mesh = box, .materials = &m, .density = density, .element = FLESH_ELEMENT_TET10};
  CHECK(flesh_effect_elasticity(&body, &effect) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "order 1");
  CHECK(!strcmp(flesh_element_name(FLESH_ELEMENT_TET10_MEAN), "tet10-mean"));
  CHECK(!strcmp(flesh_element_name(FLESH_ELEMENT_COUNT), "unknown"));
  flesh_mesh_destroy(&box);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(straight_batches_agree_with_single_tets),
                   TEST(curved_batches_agree_with_single_tets), TEST(tiles_run_out_of_room),
                   TEST_OF_THREADS(threads_give_the_same_bits), TEST(bad_states_are_told_apart),
                   TEST(misfits_are_refused));
}
