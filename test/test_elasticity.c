/* test_elasticity.c: the batched kernels, with every set of instructions that this machine has,
 * against one tet at a time through flesh/material.h; pieces, colours and threads. */
#include <stdlib.h>

#include "body.h"
#include "effect/tet_order.h"
#include "test.h"
#include "test_matrix.h"

/* A user's own psi. */
static int own_psi(double I_C, double J, const flesh_material *m, flesh_psi *psi)
{
  const double *constants = m->user;
  *psi = (flesh_psi){.value = constants[0] * I_C + constants[1] * J * J,
                     .I = constants[0],
                     .J = 2 * constants[1] * J,
                     .JJ = 2 * constants[1]};
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

typedef struct problem {
  flesh_mesh *mesh;
  flesh_material materials[2];
  int *tet_material;
  double *x, *r, *K; /* K dense [3n][3n] */
  double energy;
  int n; /* unknowns */
} problem;

static void problem_open(int energy, const int cells[3], problem *p)
{
  *p = (problem){0};
  CHECK_OK(flesh_mesh_box(cells, (double[]){cells[0], cells[1], cells[2]}, (double[]){1, -2, 0.5},
                          &p->mesh));
  int tets = flesh_mesh_tet_count(p->mesh);
  p->n = 3 * flesh_mesh_node_count(p->mesh);
  p->materials[0] = material_number(energy, 10);
  p->materials[1] = material_number(energy == FLESH_ENERGY_USER ? FLESH_ENERGY_S : energy, 20);
  p->tet_material = malloc((size_t)tets * sizeof *p->tet_material);
  for (int k = 0; k < tets; k++) p->tet_material[k] = k % 7 == 3 || k > tets - 4;
  p->x = malloc((size_t)p->n * sizeof *p->x);
  p->r = malloc((size_t)p->n * sizeof *p->r);
  p->K = malloc((size_t)p->n * (size_t)p->n * sizeof *p->K);
}

static void problem_close(problem *p)
{
  flesh_mesh_destroy(&p->mesh);
  free(p->tet_material);
  free(p->x);
  free(p->r);
  free(p->K);
}

/* Mild enough for J > 0, or with tets inverted, flat, drawn to a line and to a point. */
static void deform(problem *p, int wild)
{
  const double *X = flesh_mesh_positions(p->mesh);
  double R[9];
  random_rotation(R);
  for (int i = 0; i < p->n / 3; i++) {
    double y[3] = {0.6 * X[3 * i], 1.3 * X[3 * i + 1] + 0.4 * X[3 * i], X[3 * i + 2]};
    flesh_mat3_times(R, y, p->x + 3 * i);
    for (int c = 0; c < 3; c++) p->x[3 * i + c] += (wild ? 0.8 : 0.04) * uniform();
  }
  if (!wild) return;
  const int *nodes = flesh_mesh_tets(p->mesh);
  for (int a = 0; a < 4; a++) {
    for (int c = 0; c < 3; c++) p->x[3 * nodes[a] + c] = c;            /* to a point */
    p->x[3 * nodes[4 * 9 + a] + 1] = 0.5;                              /* flat */
    for (int c = 0; c < 2; c++) p->x[3 * nodes[4 * 30 + a] + c] = 0.1; /* to a line */
  }
}

/* Energy, residual and dense Hessian tet by tet from the material's functions. */
static void reference(problem *p, flesh_projected project)
{
  const double *X = flesh_mesh_positions(p->mesh);
  const int *nodes = flesh_mesh_tets(p->mesh);
  size_t n = (size_t)p->n;
  p->energy = 0;
  memset(p->r, 0, n * sizeof *p->r);
  memset(p->K, 0, n * n * sizeof *p->K);
  for (int k = 0; k < flesh_mesh_tet_count(p->mesh); k++) {
    const flesh_material *m = &p->materials[p->tet_material[k]];
    const int *node = nodes + 4 * k;
    double D[9], d[9], g[4][3], F[9], P[9], H[81], psi;
    for (int i = 0; i < 3; i++)
      for (int a = 0; a < 3; a++) {
        D[3 * i + a] = X[3 * node[a + 1] + i] - X[3 * node[0] + i];
        d[3 * i + a] = p->x[3 * node[a + 1] + i] - p->x[3 * node[0] + i];
      }
    double inverse[9], volume = fabs(flesh_mat3_inverse(D, inverse)) / 6;
    memcpy(g[1], inverse, sizeof inverse);
    for (int j = 0; j < 3; j++) g[0][j] = -g[1][j] - g[2][j] - g[3][j];
    flesh_mat3_multiply(d, inverse, F);
    CHECK_OK(flesh_material_energy(m, F, &psi));
    CHECK_OK(flesh_material_stress(m, F, P));
    p->energy += volume * psi;
    if (project) {
      double values[9], vectors[81];
      CHECK_OK(flesh_material_eigen(m, F, values, vectors));
      memset(H, 0, sizeof H);
      for (int e = 0; e < 9; e++)
        for (int q = 0; q < 81; q++)
          H[q] += (values[e] > 0                      ? values[e]
                   : project == FLESH_PROJECTED_CLAMP ? 0
                                                      : -values[e]) *
                  vectors[9 * e + q / 9] * vectors[9 * e + q % 9];
    } else {
      CHECK_OK(flesh_material_hessian(m, F, H));
    }
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

/* A system of this body's elasticity alone. */
static void make_system(problem *p, flesh_instructions instructions, flesh_system **system)
{
  flesh_body body = {.mesh = p->mesh,
                     .materials = p->materials,
                     .tet_material = p->tet_material,
                     .instructions = instructions};
  flesh_effect *effect;
  CHECK_OK(flesh_system_create(p->mesh, system));
  CHECK_OK(flesh_effect_elasticity(&body, &effect));
  CHECK_OK(flesh_system_add_effect(*system, &effect));
  CHECK_OK(flesh_system_finish(*system));
}

static double largest_of(const double *a, size_t n)
{
  double largest = 0;
  for (size_t k = 0; k < n; k++) largest = fmax(largest, fabs(a[k]));
  return largest;
}

/* The largest difference from the reference, over the largest entry. */
static double residual_error(const problem *p, const double *r)
{
  double worst = 0;
  for (int d = 0; d < p->n; d++) worst = fmax(worst, fabs(r[d] - p->r[d]));
  return worst / largest_of(p->r, (size_t)p->n);
}

static double matrix_error(const problem *p, const flesh_block_matrix *A)
{
  double worst = 0;
  size_t n = (size_t)p->n, found = 0, expected = 0;
  for (int i = 0; i < A->rows; i++)
    for (int k = A->row_start[i]; k < A->row_start[i + 1]; k++, found += 9)
      for (int c = 0; c < 9; c++) {
        size_t row = (size_t)(3 * i + c / 3), column = (size_t)(3 * A->column[k] + c % 3);
        worst = fmax(worst, fabs(A->values[9 * (size_t)k + c] - p->K[row * n + column]));
      }
  for (size_t q = 0; q < n * n; q++) expected += q / n / 3 <= q % n / 3 && p->K[q] != 0;
  CHECK(expected <= found); /* nothing of the reference lies outside the pattern */
  return worst / largest_of(p->K, n * n);
}

/* The same bits by one pass. */
static void check_both(const flesh_system *system, const flesh_point *point, const double *r, double V)
{
  size_t bytes = (size_t)flesh_system_unknowns(system) * sizeof *r;
  double *both = malloc(bytes), phi, magnitude;
  CHECK_OK(flesh_system_evaluate(system, point, &(flesh_shift){.x = 1}, both, &phi, &magnitude));
  CHECK(phi == V && magnitude >= fabs(V) * (1 - 1e-14));
  CHECK(!memcmp(both, r, bytes));
  free(both);
}

static void compare(problem *p, flesh_instructions instructions, int energy, int wild)
{
  flesh_system *system;
  flesh_block_matrix *A;
  make_system(p, instructions, &system);
  CHECK_OK(flesh_system_matrix_create(system, &A));
  flesh_point point = {.load = 1, .x = p->x, .v = p->x, .a = p->x};
  double *r = malloc((size_t)p->n * sizeof *r), V, worst = 0;
  for (int project = FLESH_PROJECTED_NOT; project <= FLESH_PROJECTED_ABSOLUTE; project++) {
    flesh_shift shift = {.x = 1, .project = project};
    reference(p, (flesh_projected)project);
    CHECK_OK(flesh_system_jacobian(system, &point, &shift, A));
    worst = fmax(worst, matrix_error(p, A));
  }
  CHECK_OK(flesh_system_residual(system, &point, r));
  CHECK_OK(flesh_system_energies(system, &point, &V));
  check_both(system, &point, r, V);
  printf("# %s %s%s: matrices %.1g, residual %.1g, energy %.1g\n",
         flesh_instructions_name(instructions), flesh_energy_name((flesh_energy)energy),
         wild ? " wild" : "", worst, residual_error(p, r), fabs(V / p->energy - 1));
  CHECK_BELOW(worst, 1e-13);
  CHECK_BELOW(residual_error(p, r), 1e-14);
  CHECK_NEAR(V / p->energy, 1, 1e-14);
  free(r);
  flesh_block_matrix_destroy(&A);
  flesh_system_destroy(&system);
}

static int available(int instructions)
{
  flesh_instructions usable;
  return flesh_instructions_find((flesh_instructions)instructions, &usable) == FLESH_OK;
}

static void batches_agree_with_single_tets(void)
{
  for (int energy = 0; energy <= FLESH_ENERGY_USER; energy++)
    for (int wild = 0; wild < (energy <= FLESH_ENERGY_C ? 1 : 2); wild++) {
      problem p;
      problem_open(energy, (int[]){3, 2, 2}, &p);
      deform(&p, wild);
      for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
        if (available(set)) compare(&p, (flesh_instructions)set, energy, wild);
      problem_close(&p);
    }
}

/* Sizes that the batched logarithm and decomposition leave to the single ones. */
static void extreme_sizes(void)
{
  static const double sizes[] = {1e-40, 1e-18, 1e18, 1e30};
  for (int s = 0; s < 4; s++) {
    problem p;
    problem_open(FLESH_ENERGY_S, (int[]){2, 1, 1}, &p);
    deform(&p, 0);
    for (int d = 0; d < p.n; d++) p.x[d] *= sizes[s];
    for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
      if (available(set)) compare(&p, (flesh_instructions)set, FLESH_ENERGY_S, 0);
    problem_close(&p);
  }
}

static void bad_states_are_told_apart(void)
{
  for (int set = FLESH_INSTRUCTIONS_PORTABLE; set < FLESH_INSTRUCTIONS_COUNT; set++)
    for (int energy = 0; energy < FLESH_ENERGY_COUNT && available(set); energy++)
      for (int bad = 0; bad < 3; bad++) {
        problem p;
        flesh_system *system;
        flesh_block_matrix *A;
        problem_open(energy, (int[]){3, 2, 2}, &p);
        make_system(&p, (flesh_instructions)set, &system);
        CHECK_OK(flesh_system_matrix_create(system, &A));
        memcpy(p.x, flesh_mesh_positions(p.mesh), (size_t)p.n * sizeof *p.x);
        int node = flesh_mesh_tets(p.mesh)[4 * 17];
        if (bad == 0) p.x[3 * node] += 10; /* inverts some of its tets */
        else p.x[3 * node + 1] = bad == 1 ? NAN : 1e200;
        flesh_point point = {.load = 1, .x = p.x, .v = p.x, .a = p.x};
        flesh_shift shift = {.x = 1}, projected = {.x = 1, .project = 1};
        double V, size;
        int expected = bad                        ? FLESH_NONFINITE
                       : energy <= FLESH_ENERGY_C ? FLESH_UNDEFINED
                                                  : FLESH_OK;
        CHECK(flesh_system_residual(system, &point, p.r) == expected);
        CHECK(flesh_system_jacobian(system, &point, &shift, A) == expected);
        CHECK(flesh_system_jacobian(system, &point, &projected, A) == expected);
        CHECK(flesh_system_energies(system, &point, &V) == expected);
        CHECK(flesh_system_evaluate(system, &point, &shift, p.r, &V, &size) == expected);
        flesh_block_matrix_destroy(&A);
        flesh_system_destroy(&system);
        problem_close(&p);
      }
}

static void pieces_of_a_colour_share_no_node(void)
{
  flesh_mesh *mesh;
  flesh_tet_order order;
  CHECK_OK(flesh_mesh_box((int[]){13, 12, 11}, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_tet_order_create(mesh, NULL, &order));
  int tets = flesh_mesh_tet_count(mesh), nodes = flesh_mesh_node_count(mesh);
  int *owner = malloc((size_t)nodes * sizeof *owner), conflicts = 0, twice = 0;
  char *seen = calloc((size_t)tets, 1);
  CHECK(order.pieces > 20 && order.colours > 1 && order.colours < 30);
  CHECK(order.colour_first[order.colours] == order.pieces);
  CHECK(order.piece_first[order.pieces] == tets);
  for (int c = 0; c < order.colours; c++) {
    for (int i = 0; i < nodes; i++) owner[i] = -1;
    for (int p = order.colour_first[c]; p < order.colour_first[c + 1]; p++)
      for (int k = order.piece_first[p]; k < order.piece_first[p + 1]; k++) {
        twice += seen[order.tet[k]]++;
        for (int a = 0; a < 4; a++) {
          int *own = &owner[flesh_mesh_tets(mesh)[4 * order.tet[k] + a]];
          conflicts += *own >= 0 && *own != p;
          *own = p;
        }
      }
  }
  CHECK(conflicts == 0 && twice == 0);
  free(owner);
  free(seen);
  flesh_tet_order_clear(&order);
  flesh_mesh_destroy(&mesh);
}

static void threads_give_the_same_bits(void)
{
  problem p;
  flesh_system *system;
  flesh_block_matrix *A[2];
  problem_open(FLESH_ENERGY_S, (int[]){3, 2, 2}, &p);
  flesh_mesh_destroy(&p.mesh);
  CHECK_OK(flesh_mesh_box((int[]){13, 12, 11}, (double[]){1, 2, 3}, (double[]){0, 0, 0}, &p.mesh));
  p.n = 3 * flesh_mesh_node_count(p.mesh);
  free(p.tet_material);
  p.tet_material = calloc((size_t)flesh_mesh_tet_count(p.mesh), sizeof(int));
  p.x = realloc(p.x, (size_t)p.n * sizeof *p.x);
  deform(&p, 1);
  make_system(&p, FLESH_INSTRUCTIONS_AUTO, &system);
  double *r[2], V[2];
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_system_matrix_create(system, &A[k]));
    r[k] = malloc((size_t)p.n * sizeof *r[k]);
  }
  for (int count = 1; count <= 3; count++) {
    int k = count > 1;
    flesh_threads *threads;
    CHECK_OK(flesh_threads_create(count, &threads));
    flesh_point point = {.load = 1, .x = p.x, .v = p.x, .a = p.x, .threads = threads};
    flesh_shift shift = {.x = 1, .project = 1};
    CHECK_OK(flesh_system_residual(system, &point, r[k]));
    CHECK_OK(flesh_system_jacobian(system, &point, &shift, A[k]));
    CHECK_OK(flesh_system_energies(system, &point, &V[k]));
    check_both(system, &point, r[k], V[k]);
    flesh_threads_destroy(&threads);
    if (!k) continue;
    CHECK(!memcmp(r[0], r[1], (size_t)p.n * sizeof *r[0]));
    CHECK(!memcmp(A[0]->values, A[1]->values,
                  (size_t)A[0]->row_start[A[0]->rows] * 9 * sizeof(double)));
    CHECK(V[0] == V[1]);
  }
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix_destroy(&A[k]);
    free(r[k]);
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
  return RUN_TESTS(argc, argv, TEST(batches_agree_with_single_tets), TEST(extreme_sizes),
                   TEST(bad_states_are_told_apart), TEST(pieces_of_a_colour_share_no_node),
                   TEST(threads_give_the_same_bits), TEST(instructions_by_name));
}
