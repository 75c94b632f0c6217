// TEST quick seconds=60
/* test_elasticity.c: the batched kernels (elasticity, damping, viscosity, mass), with every instruction set of this
 * machine, against one tet at a time through flesh/material.h; tiles and threads. */
#include <stdlib.h>

#include "effect/effect.h"
#include "kernel_problem.h"
#include "test_matrix.h"
#include "material/form.h"

/* A user-defined psi. */
static int own_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const double *constants = m->user;
  *psi = (flesh_psi){.value = constants[0] * I_C + constants[1] * J * J,
                     .I = constants[0],
                     .J = 2 * constants[1] * J, .JJ = 2 * constants[1]};
  return FLESH_OK;
}

static flesh_material material_number(int n, double young)
{
  static const double own_constants[2] = {2, 3};
  flesh_material m;
  if (n == FLESH_ENERGY_USER) {
    CHECK_OK(flesh_material_from_psi(own_psi, own_constants, &m));
    return m;
  }
  CHECK_OK(flesh_material_from_young((flesh_energy)n, FLESH_CONSTANTS_RAW, young, 0.45, &m));
  return m;
}

/* Takes the mesh. */
static void problem_of(int energy, flesh_mesh *mesh, problem *p)
{
  *p = (problem){.mesh = mesh};
  p->materials[0] = material_number(energy, 10);
  p->materials[1] = material_number(energy == FLESH_ENERGY_USER ? FLESH_ENERGY_S : energy, 20);
  problem_make(p);
  p->K = malloc((size_t)p->n * (size_t)p->n * sizeof *p->K);
}

static void problem_open(int energy, const int cells[3], problem *p)
{
  flesh_mesh *mesh;
  CHECK_OK(flesh_mesh_box(cells, (double[]){cells[0], cells[1], cells[2]}, (double[]){1, -2, 0.5}, &mesh));
  problem_of(energy, mesh, p);
}

/* Whether the form has a derivative for every F: co-rotational forms have none if the polar rotation is not unique. */
static int is_smooth(int energy) { return energy != FLESH_ENERGY_CR && energy != FLESH_ENERGY_FCR; }

/* Deformations mild enough for J > 0, or with inverted and flat tets and, for smooth forms, tets shrunk to a line and
 * to a point. */
static void deform(problem *p, int wild)
{
  const int smooth = is_smooth(p->materials[0].energy);
  const double *X = flesh_mesh_positions(p->mesh);
  double R[9];
  random_rotation(R);
  for (int i = 0; i < p->n / 3; i++) {
    double y[3] = {0.6 * X[3 * i], 1.3 * X[3 * i + 1] + 0.4 * X[3 * i], X[3 * i + 2]};
    flesh_mat3_times(R, y, p->x + 3 * i);
    for (int c = 0; c < 3; c++) p->x[3 * i + c] += (wild ? 0.8 : 0.04) * uniform();
    for (int c = 0; c < 3; c++) p->v[3 * i + c] = uniform();
  }
  const int *nodes = flesh_mesh_tets(p->mesh);
  for (int a = 0; a < 4 && wild; a++) {
    for (int c = 0; c < 3 && smooth; c++) p->x[3 * nodes[a] + c] = c;            /* to a point */
    p->x[3 * nodes[4 * 9 + a] + 1] = 0.5;                                        /* flat */
    for (int c = 0; c < 2 && smooth; c++) p->x[3 * nodes[4 * 30 + a] + c] = 0.1; /* to a line */
  }
  for (int d = 0; d < p->n; d++) {
    const double way = 0.1 * uniform();
    p->x_frozen[d] = p->x[d] + viscous_shift.x * way;
    p->v_frozen[d] = p->v[d] + viscous_shift.v * way;
  }
}

/* Computes d2 psi / dF2 [9][9], with its negative eigenvalues treated according to `project`. */
static void projected_hessian(const flesh_material *m, const double F[9], flesh_eigenvalue_filter project, double H[81])
{
  double values[9], vectors[81];
  CHECK_OK(flesh_material_hessian(m, F, H));
  if (!project) return;
  CHECK_OK(flesh_material_eigen(m, F, values, vectors));
  memset(H, 0, 81 * sizeof *H);
  for (int e = 0; e < 9; e++)
    for (int q = 0; q < 81; q++)
      H[q] += (values[e] > 0 ? values[e] : project == FLESH_FILTER_CLAMP ? 0 : -values[e]) *
              vectors[9 * e + q / 9] * vectors[9 * e + q % 9];
}

/* psi with the second derivative by J that damping uses. */
static int damped_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const flesh_material *whole = m->user;
  const int status = whole->psi(I_C, J, whole, psi);
  psi->JJ -= excess_of(whole);
  return status;
}

/* Computes energy, stress and its derivative at a point of a tet, for F, the rate F', and the frozen F and F'. */
static void law(kind kind, const flesh_material *m, const double F[9], const double rate[9], const double frozen[9],
                const double frozen_rate[9], flesh_eigenvalue_filter project, double *value, double P[9], double H[81])
{
  static const double at_rest[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (kind == ELASTIC) {
    CHECK_OK(flesh_material_energy(m, F, value));
    CHECK_OK(flesh_material_stress(m, F, P));
    projected_hessian(m, F, project, H);
    return;
  }
  if (kind == VISCOUS || kind == FROZEN) {
    viscous_law(F, kind == VISCOUS ? F : frozen, kind == VISCOUS ? rate : frozen_rate, project, value, P, H);
    return;
  }
  flesh_material damped = *m;
  if (!flesh_form_of_stretches(m->energy)) CHECK_OK(flesh_material_from_psi(damped_psi, (void *)m, &damped));
  projected_hessian(&damped, kind == REST ? at_rest : F, FLESH_FILTER_CLAMP, H);
  law_of_rates(rate, value, P, H);
}

/* Adds (M v) and M of a tet: rho V/20 (1 + [a = b]), or lumped, rho V/4. */
static void reference_mass(problem *p, int lumped, const int *node, double mass)
{
  for (int a = 0; a < 4; a++)
    for (int b = 0; b < 4; b++)
      for (int i = 0; i < 3; i++) {
        const double m = lumped ? mass / 4 * (a == b) : mass / 20 * (1 + (a == b));
        p->r[3 * node[a] + i] += m * p->v[3 * node[b] + i];
        p->K[(size_t)(3 * node[a] + i) * (size_t)p->n + (size_t)(3 * node[b] + i)] += m;
        p->energy += m * p->v[3 * node[a] + i] * p->v[3 * node[b] + i] / 2;
      }
}

/* Computes the gradient of the vectors y in a tet. */
static void gradient_of(const double *y, const int *node, const double inverse[9], double G[9])
{
  double d[9];
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++) d[3 * i + a] = y[3 * node[a + 1] + i] - y[3 * node[0] + i];
  flesh_mat3_multiply(d, inverse, G);
}

/* Computes energy, residual and dense matrix tet by tet from the material's functions. */
static void reference(problem *p, kind kind, flesh_eigenvalue_filter project)
{
  const double *X = flesh_mesh_positions(p->mesh);
  const int *nodes = flesh_mesh_tets(p->mesh);
  size_t n = (size_t)p->n;
  p->energy = 0;
  memset(p->r, 0, n * sizeof *p->r);
  memset(p->K, 0, n * n * sizeof *p->K);
  for (int k = 0; k < flesh_mesh_tet_count(p->mesh); k++) {
    const int *node = nodes + 4 * k;
    double D[9], g[4][3], F[9], rate[9] = {0}, frozen[9] = {0}, frozen_rate[9] = {0}, P[9], H[81], value;
    for (int i = 0; i < 3; i++)
      for (int a = 0; a < 3; a++) D[3 * i + a] = X[3 * node[a + 1] + i] - X[3 * node[0] + i];
    double inverse[9], volume = fabs(flesh_mat3_inverse(D, inverse)) / 6;
    if (kind >= CONSISTENT) {
      reference_mass(p, kind == LUMPED, node, p->density[k] * volume);
      continue;
    }
    memcpy(g[1], inverse, sizeof inverse);
    for (int j = 0; j < 3; j++) g[0][j] = -g[1][j] - g[2][j] - g[3][j];
    gradient_of(p->x, node, inverse, F);
    if (kind != ELASTIC) gradient_of(p->v, node, inverse, rate);
    if (kind == FROZEN) gradient_of(p->x_frozen, node, inverse, frozen);
    if (kind == FROZEN) gradient_of(p->v_frozen, node, inverse, frozen_rate);
    law(kind, &p->materials[p->tet_material[k]], F, rate, frozen, frozen_rate, project, &value, P, H);
    p->energy += volume * value;
    for (int a = 0; a < 4; a++)
      for (int i = 0; i < 3; i++) {
        p->r[3 * node[a] + i] += volume * flesh_vec3_dot(P + 3 * i, g[a]);
        for (int b = 0; b < 4; b++)
          for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int q = 0; q < 9; q++)
              sum += H[9 * (3 * i + q / 3) + 3 * j + q % 3] * g[a][q / 3] * g[b][q % 3];
            p->K[(size_t)(3 * node[a] + i) * n + (size_t)(3 * node[b] + j)] += volume * sum;
          }
      }
  }
}

static void compare(problem *p, kind kind, flesh_instructions instructions, int energy, int wild)
{
  const comparison found = measure(p, kind, instructions);
  printf("# %s %s %s%s: matrices %.1g, residual %.1g, energy %.1g\n", kind_names[kind],
         flesh_instructions_name(instructions), flesh_energy_name((flesh_energy)energy),
         wild ? " wild" : "", found.matrix, found.residual, fabs(found.energy - 1));
  CHECK_BELOW(found.matrix, 1e-13);
  CHECK_BELOW(found.residual, kind == ELASTIC ? 1e-14 : 1e-13);
  CHECK_NEAR(found.energy, 1, kind == ELASTIC ? 1e-14 : 1e-13);
}

static void batches_agree_with_single_tets(void)
{
  for (int energy = 0; energy <= FLESH_ENERGY_USER; energy++)
    for (int wild = 0; wild < (flesh_psi_needs_volume((flesh_energy)energy) ? 1 : 2); wild++) {
      problem p;
      problem_open(energy, (int[]){3, 2, 2}, &p);
      deform(&p, wild);
      for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
        for (int kind = 0; kind < KINDS && available(set); kind++)
          compare(&p, (enum kind)kind, (flesh_instructions)set, energy, wild);
      problem_close(&p);
    }
}

static void tiles_run_out_of_room(void)
{
  for (int shared = 0; shared < 4; shared += 2) {
    problem p;
    problem_of(FLESH_ENERGY_S, tets_apart(shared ? 230 : 130, shared), &p);
    deform(&p, 1);
    for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
      for (int kind = 0; kind < KINDS && available(set); kind++)
        compare(&p, (enum kind)kind, (flesh_instructions)set, FLESH_ENERGY_S, 1);
    problem_close(&p);
  }
}

/* Tets flattened until their gradients are nearly parallel: a matrix is as accurate as the gradients, not as their
 * determinant. */
static void slivers(void)
{
  static const double along[3] = {0.5, 0.7, 0.509901951359278}, flat = 1e-7;
  problem p;
  problem_open(FLESH_ENERGY_S, (int[]){3, 2, 2}, &p);
  const double *X = flesh_mesh_positions(p.mesh);
  for (int i = 0; i < p.n / 3; i++)
    for (int c = 0; c < 3; c++)
      p.x[3 * i + c] = X[3 * i + c] - (1 - flat) * flesh_vec3_dot(along, X + 3 * i) * along[c];
  flesh_mesh *sliver;
  CHECK_OK(flesh_mesh_create(p.n / 3, p.x, flesh_mesh_tet_count(p.mesh), flesh_mesh_tets(p.mesh), NULL, &sliver));
  flesh_mesh_destroy(&p.mesh);
  p.mesh = sliver;
  for (int d = 0; d < p.n; d++) p.x[d] *= 1.1;
  reference(&p, ELASTIC, FLESH_FILTER_NONE);
  for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++) {
    flesh_system *system;
    flesh_block_matrix *A;
    if (!available(set)) continue;
    CHECK_OK(make_system(&p, ELASTIC, (flesh_instructions)set, &system));
    CHECK_OK(flesh_system_matrix_create(system, &A));
    const flesh_point point = point_of(&p, ELASTIC);
    const flesh_shift shift = shift_of(ELASTIC, FLESH_FILTER_NONE);
    CHECK_OK(flesh_system_jacobian(system, &point, &shift, A));
    printf("# %s: %.1g\n", flesh_instructions_name((flesh_instructions)set), matrix_error(&p, A));
    CHECK_BELOW(matrix_error(&p, A), 1e-8);
    flesh_block_matrix_destroy(&A);
    flesh_system_destroy(&system);
  }
  problem_close(&p);
}

/* Values that the batched logarithm and decomposition leave to the scalar functions, and large ones for an
 * exponential. */
static void extreme_sizes(void)
{
  static const struct {
    flesh_energy energy;
    double size;
  } rows[] = {{FLESH_ENERGY_S, 1e-40},   {FLESH_ENERGY_S, 1e-18},   {FLESH_ENERGY_S, 1e18},   {FLESH_ENERGY_S, 1e30},
              {FLESH_ENERGY_CR, 1e-40},  {FLESH_ENERGY_CR, 1e-18},  {FLESH_ENERGY_CR, 1e18},  {FLESH_ENERGY_CR, 1e30},
              {FLESH_ENERGY_FCR, 1e-40}, {FLESH_ENERGY_FCR, 1e-18}, {FLESH_ENERGY_FCR, 1e18}, {FLESH_ENERGY_FCR, 1e30},
              {FLESH_ENERGY_STVK, 1e18}, {FLESH_ENERGY_STVK, 1e30}, {FLESH_ENERGY_FUNG, 15},  {FLESH_ENERGY_AB, 1e20}};
  for (unsigned s = 0; s < sizeof rows / sizeof *rows; s++) {
    problem p;
    problem_open(rows[s].energy, (int[]){2, 1, 1}, &p);
    deform(&p, 0);
    for (int d = 0; d < p.n; d++) p.x[d] *= rows[s].size;
    for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
      if (available(set)) compare(&p, ELASTIC, (flesh_instructions)set, rows[s].energy, 0);
    problem_close(&p);
  }
}

static void bad_states_are_told_apart(void)
{
  for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
    for (int energy = 0; energy < FLESH_ENERGY_COUNT && available(set); energy++)
      for (int bad = 0; bad < 6; bad++) {
        const kind kind = bad < 3 ? ELASTIC : CURRENT;
        problem p;
        flesh_system *system;
        flesh_block_matrix *A;
        problem_open(energy, (int[]){3, 2, 2}, &p);
        CHECK_OK(make_system(&p, kind, (flesh_instructions)set, &system));
        CHECK_OK(flesh_system_matrix_create(system, &A));
        deform(&p, 0);
        memcpy(p.x, flesh_mesh_positions(p.mesh), (size_t)p.n * sizeof *p.x);
        int node = flesh_mesh_tets(p.mesh)[4 * 17];
        if (bad % 3 == 0) p.x[3 * node] += 10; /* inverts some of its tets */
        else p.x[3 * node + 1] = bad % 3 == 1 ? NAN : 1e200;
        const flesh_point point = point_of(&p, kind);
        const flesh_shift shift = shift_of(kind, 0), projected = shift_of(kind, 1);
        double V, size;
        int expected = bad % 3                    ? FLESH_NONFINITE
                       : flesh_psi_needs_volume((flesh_energy)energy) ? FLESH_UNDEFINED
                                                  : FLESH_OK;
        CHECK(flesh_system_residual(system, &point, p.r) == expected);
        CHECK(flesh_system_jacobian(system, &point, &shift, A) == expected);
        CHECK(flesh_system_jacobian(system, &point, &projected, A) == expected);
        CHECK(flesh_system_potential(system, &point, &shift, &V, &size) == expected);
        if (kind == ELASTIC) CHECK(flesh_system_energies(system, &point, &V) == expected);
        CHECK(test_evaluate(system, &point, &shift, p.r, &V, &size) == expected);
        flesh_block_matrix_destroy(&A);
        flesh_system_destroy(&system);
        problem_close(&p);
      }
}

/* A body of many pieces, and of many blocks of nodes. */
static void open_large(problem *p)
{
  const int cells[3] = {13, 12, 11};
  *p = (problem){0};
  CHECK_OK(flesh_mesh_box(cells, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &p->mesh));
  int tets = flesh_mesh_tet_count(p->mesh);
  p->n = 3 * flesh_mesh_node_count(p->mesh);
  for (int m = 0; m < 2; m++) p->materials[m] = material_number(FLESH_ENERGY_S, 10 + m);
  p->tet_material = malloc((size_t)tets * sizeof *p->tet_material);
  p->density = malloc((size_t)tets * sizeof *p->density);
  for (int k = 0; k < tets; k++) p->tet_material[k] = k % 1000 < 300, p->density[k] = 1 + k % 5;
  p->x = malloc((size_t)p->n * sizeof *p->x);
  p->v = malloc((size_t)p->n * sizeof *p->v);
  p->x_frozen = malloc((size_t)p->n * sizeof *p->x_frozen);
  p->v_frozen = malloc((size_t)p->n * sizeof *p->v_frozen);
  deform(p, 1);
}

static void threads_give_the_same_bits(void)
{
  problem p;
  open_large(&p);
  for (int kind = 0; kind < KINDS; kind++) check_threads(&p, (enum kind)kind);
  problem_close(&p);
}

/* An effect of the same cells that asks for all pairs. */
static const flesh_cells *all_pairs(const flesh_effect *effect) { return effect->data; }
static size_t no_memory(const flesh_effect *effect) { return (void)effect, 0; }

/* Effects of one body have the same cells; the system stores their positions in the matrix once. */
static void places_are_kept_once(void)
{
  static const flesh_effect_figures empty = {.memory = no_memory};
  static const flesh_effect_operations operations = {.name = "all pairs", .cells = all_pairs, .figures = &empty};
  problem p;
  problem_open(FLESH_ENERGY_S, (int[]){3, 2, 2}, &p);
  flesh_body body = {.mesh = p.mesh, .density = p.density, .materials = p.materials,
                     .tet_material = p.tet_material, .mass = FLESH_MASS_CONSISTENT};
  flesh_effect *effects[5];
  CHECK_OK(flesh_effect_elasticity(&body, &effects[0]));
  CHECK_OK(flesh_effect_damping(&body, 1, 1, FLESH_STIFFNESS_CURRENT, &effects[1]));
  CHECK_OK(flesh_effect_viscosity(&body, 1, 1, &effects[2]));
  CHECK_OK(flesh_effect_inertia(&body, &effects[3]));
  flesh_cells cells = *effects[0]->operations->cells(effects[0]);
  CHECK(cells.pairs && cells.pair_count > cells.count && cells.pair_count < 5 * cells.count);
  const size_t slots = (size_t)cells.pair_count * sizeof(int);
  cells.pairs = NULL;
  CHECK_OK(flesh_effect_create(&operations, p.mesh, &cells, &effects[4]));
  flesh_system *system;
  CHECK_OK(flesh_system_create(p.mesh, &system));
  for (int k = 0; k < 5; k++) CHECK_OK(flesh_system_add_effect(system, &effects[k]));
  CHECK_OK(flesh_system_finalize(system));
  for (int k = 0; k < 5; k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    const size_t beside = flesh_system_effect_memory(system, k) - effect->operations->figures->memory(effect);
    CHECK((beside >= slots) == (k == 0 || k == 4));
    if (k == 4) CHECK(beside >= (size_t)cells.count * 10 * sizeof(int));
  }
  flesh_system_destroy(&system);
  problem_close(&p);
}

static void instructions_by_name(void)
{
  flesh_instructions usable = FLESH_INSTRUCTIONS_COUNT;
  CHECK(!strcmp(flesh_instructions_name(FLESH_INSTRUCTIONS_AVX512), "avx512"));
  CHECK(!strcmp(flesh_instructions_name((flesh_instructions)77), "unknown"));
  CHECK(flesh_instructions_find((flesh_instructions)77, &usable) == FLESH_ERR_ARGUMENT);
  CHECK(usable == FLESH_INSTRUCTIONS_COUNT);
  CHECK_OK(flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &usable));
  CHECK(usable > FLESH_INSTRUCTIONS_AUTO && usable < FLESH_INSTRUCTIONS_COUNT);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(batches_agree_with_single_tets), TEST(tiles_run_out_of_room), TEST(slivers),
                   TEST(extreme_sizes), TEST(bad_states_are_told_apart), TEST_OF_THREADS(threads_give_the_same_bits),
                   TEST(places_are_kept_once), TEST(instructions_by_name));
}
