// TEST quick
/* test_system.c: the sum of effects, its pattern, constraints and events, and what a system refuses. */
#include <stdlib.h>

#include "body.h"
#include "sundials/problem.h"
#include "system/edge_force.h"
#include "system/one_effect.h"
#include "test.h"

static void make(flesh_mesh *mesh, flesh_mass mass, int inertia, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.4, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, mass, inertia, b));
}

static flesh_point point_of(const test_body *b)
{
  return flesh_point_at(0, b->state.x, b->state.v, b->state.v);
}

/* A user-defined effect, written against effect.h alone: springs between pairs of nodes that no tet couples. */
typedef struct springs {
  flesh_cells cells;
  double stiffness;
} springs;

static const flesh_cells *spring_cells(const flesh_effect *effect)
{
  return &((const springs *)effect->data)->cells;
}

static int spring_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const springs *s = effect->data;
  for (int e = 0; e < s->cells.count; e++)
    for (int c = 0; c < 3; c++) {
      int i = 3 * s->cells.nodes[2 * e] + c, j = 3 * s->cells.nodes[2 * e + 1] + c;
      double pull = s->stiffness * (point->x[j] - point->x[i]);
      r[i] -= pull;
      r[j] += pull;
    }
  return FLESH_OK;
}

static int spring_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  (void)point;
  const springs *s = effect->data;
  for (int e = 0; e < s->cells.count; e++)
    for (int p = 0; p < 3; p++) /* (0,0) (0,1) (1,1) */
      for (int c = 0; c < 3; c++)
        K->values[9 * (size_t)slots[3 * e + p] + 4 * c] += (p == 1 ? -1 : 1) * shift->x * s->stiffness;
  return FLESH_OK;
}

static const flesh_effect_operations spring_operations = {.name = "springs",
                                                          .cells = spring_cells,
                                                          .residual = spring_residual,
                                                          .jacobian = spring_jacobian};

static flesh_effect *springs_create(const test_body *b, springs *data)
{
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_create(&spring_operations, b->mesh, data, &effect));
  return effect;
}

/* The upper triangle of exactly the pairs that share a cell; the diagonal first, columns ascending. */
static void check_pattern(const test_body *b, const flesh_cells *extra)
{
  int nodes = b->n / 3;
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  CHECK(K->rows == nodes);
  char *wanted = calloc((size_t)nodes * nodes, 1);
  for (int i = 0; i < nodes; i++) wanted[i * nodes + i] = 1;
  for (int e = 0; e < flesh_mesh_tet_count(b->mesh); e++)
    for (int p = 0; p < 16; p++)
      wanted[flesh_mesh_tets(b->mesh)[4 * e + p / 4] * nodes + flesh_mesh_tets(b->mesh)[4 * e + p % 4]] = 1;
  for (int e = 0; extra && e < extra->count; e++) wanted[extra->nodes[2 * e] * nodes + extra->nodes[2 * e + 1]] = 1;
  int bad = 0, expected = 0;
  for (int i = 0; i < nodes; i++) {
    bad += K->column[K->row_start[i]] != i;
    for (int j = i; j < nodes; j++) expected += wanted[i * nodes + j];
    for (int k = K->row_start[i]; k < K->row_end[i]; k++) {
      bad += K->column[k] < i || K->column[k] >= nodes || !wanted[i * nodes + K->column[k]];
      bad += k > K->row_start[i] && K->column[k] <= K->column[k - 1];
    }
  }
  CHECK(bad == 0);
  CHECK(K->row_start[nodes] == expected);
  free(wanted);
  flesh_block_matrix_destroy(&K);
  CHECK(K == NULL);
  flesh_block_matrix_destroy(&K);
  flesh_block_matrix_destroy(NULL);
}

static void pattern_is_that_of_the_cells(void)
{
  test_body b;
  make(test_box(3, 2, 2, 3, 2, 2), FLESH_MASS_CONSISTENT, 1, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  check_pattern(&b, NULL);
  test_body_destroy(&b);

  /* An effect with its own cells extends the pattern, and its blocks get to the right positions. */
  static const int ends[] = {0, 35, 1, 34, 0, 1};
  springs data = {{.count = 3, .nodes_per_cell = 2, .nodes = ends}, 700};
  make(test_box(3, 2, 2, 3, 2, 2), FLESH_MASS_LUMPED, 0, &b);
  flesh_effect *effect = springs_create(&b, &data);
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK(effect == NULL);
  CHECK_OK(flesh_system_finalize(b.system));
  check_pattern(&b, &data.cells);
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_matrix_create(b.system, &K));
  flesh_point point = point_of(&b);
  /* The old content of the matrix does not matter, whatever elasticity writes or leaves. */
  const size_t numbers = 9 * (size_t)K->row_start[K->rows];
  for (int x = 0; x < 2; x++) {
    double wrong = 0;
    for (size_t k = 0; k < numbers; k++) K->values[k] = NAN;
    CHECK_OK(flesh_system_jacobian(b.system, &point, &(flesh_shift){.x = x, .a = 1 - x}, K));
    for (size_t k = 0; k < numbers; k++) wrong += !isfinite(K->values[k]);
    CHECK(wrong == 0);
  }
  double *J = test_dense(K), s = 1e-4;
  double *low = malloc((size_t)b.n * sizeof *low), *high = malloc((size_t)b.n * sizeof *high);
  for (int d = 0; d < b.n; d++) {
    double before = b.state.x[d];
    b.state.x[d] = before + s;
    CHECK_OK(flesh_system_residual(b.system, &point, high));
    b.state.x[d] = before - s;
    CHECK_OK(flesh_system_residual(b.system, &point, low));
    b.state.x[d] = before;
    for (int e = 0; e < b.n; e++) CHECK_NEAR(J[e * b.n + d], (high[e] - low[e]) / (2 * s), 1);
  }
  CHECK_NEAR(J[0 * b.n + 3 * 35], -700, 1e-12);
  free(J);
  free(low);
  free(high);
  flesh_block_matrix_destroy(&K);
  test_body_destroy(&b);
}

static void sums_and_loads(void)
{
  test_body b;
  make(test_box(2, 2, 2, 1, 1, 1), FLESH_MASS_LUMPED, 1, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -10));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK(flesh_system_mesh(b.system) == b.mesh);
  CHECK(flesh_system_unknowns(b.system) == b.n);
  CHECK(flesh_system_effect_count(b.system) == 3);
  CHECK(flesh_system_has_role(b.system, FLESH_ROLE_INERTIA) && flesh_system_has_role(b.system, FLESH_ROLE_ELASTICITY));
  CHECK(flesh_system_has_role(b.system, FLESH_ROLE_LOAD) && !flesh_system_has_role(b.system, FLESH_ROLE_DAMPING));
  test_jitter(b.n, 0.1, 1, b.state.x);
  test_jitter(b.n, 1, 2, b.state.v);
  double *whole = calloc((size_t)b.n, sizeof *whole), *parts = calloc((size_t)b.n, sizeof *parts),
         *load = calloc((size_t)b.n, sizeof *load), energies[3], phi, magnitude, sum = 0, size = 0, weight = 0;
  flesh_point point = point_of(&b);
  for (int k = 0; k < b.n; k++) whole[k] = load[k] = 1e9; /* old content is overwritten */
  CHECK_OK(flesh_system_residual(b.system, &point, whole));
  CHECK_OK(flesh_system_load(b.system, &point, load));
  flesh_shift shift = {.x = 1, .v = 10, .a = 100};
  for (int k = 0; k < 3; k++) {
    const flesh_effect *effect = flesh_system_effect(b.system, k);
    CHECK_OK(effect->operations->residual(effect, &point, parts));
    CHECK_OK(effect->operations->potential(effect, &point, &shift, &sum, &size));
  }
  CHECK_BELOW(test_distance(b.n, whole, parts), 1e-12 * test_norm(b.n, whole));
  CHECK_OK(flesh_system_potential(b.system, &point, &shift, &phi, &magnitude));
  CHECK_NEAR(phi, sum, 1e-14 * size);
  CHECK_NEAR(magnitude, size, 1e-14 * size);
  CHECK_OK(flesh_system_energies(b.system, &point, energies));
  for (int k = 0; k < 3; k++) {
    double energy;
    const flesh_effect *effect = flesh_system_effect(b.system, k);
    CHECK_OK(effect->operations->energy(effect, &point, &energy));
    CHECK(energies[k] == energy && energy != 0);
  }
  for (int d = 0; d < b.n; d++) {
    CHECK(d % 3 == 2 || load[d] == 0);
    weight += load[d];
  }
  CHECK_NEAR(weight, 1e4, 1e-8); /* minus m g of a cube of a ton */
  point.load = 0.5;
  CHECK_OK(flesh_system_load(b.system, &point, parts));
  for (int d = 0; d < b.n; d++) CHECK_NEAR(parts[d], load[d] / 2, 1e-12);
  free(whole);
  free(parts);
  free(load);
  test_body_destroy(&b);
}

static void constraints_hold_and_release(void)
{
  test_body b;
  make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, 0, &b);
  flesh_keyframe keys[] = {{.t = 2}, {.t = 4, .translation = {0, 1, 0}, .rotation = {0, 0, M_PI}}};
  flesh_motion motion = {.count = 2, .keyframes = keys};
  CHECK_OK(flesh_system_add_pin(b.system, 2, (int[]){0, 3}, FLESH_AXIS_X | FLESH_AXIS_Z, -INFINITY, 3));
  CHECK_OK(flesh_system_add_prescribed_motion(b.system, 1, (int[]){7}, FLESH_AXES_ALL, &motion, 1, INFINITY));
  CHECK_OK(flesh_system_add_pin(b.system, 1, (int[]){3}, FLESH_AXIS_Y, 5, 6));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK(flesh_system_moves(b.system));
  /* 1 start, 2 and 4 keyframes, 3 release, 5 and 6 the second pin. */
  double t = -INFINITY;
  for (int k = 1; k <= 6; k++) CHECK((t = flesh_system_next_event(b.system, t)) == k);
  CHECK(flesh_system_next_event(b.system, t) == INFINITY);
  CHECK(flesh_system_next_event(b.system, 2.5) == 3);
  uint8_t fixed[24];
  const double times[] = {0, 1, 2.999, 3, 5, 6};
  const int counts[] = {4, 7, 7, 3, 4, 3};
  for (int k = 0; k < 6; k++) {
    CHECK(flesh_system_fixed(b.system, times[k], fixed) == counts[k]);
    int held = times[k] < 3;
    CHECK(fixed[0] == held && fixed[1] == 0 && fixed[2] == held && fixed[9] == held);
    CHECK(fixed[10] == (times[k] == 5) && fixed[21] == (times[k] >= 1) && fixed[3] == 0);
    double x[24];
    for (int d = 0; d < 24; d++) x[d] = 100 + d;
    flesh_system_prescribe(b.system, times[k], x);
    for (int d = 0; d < 24; d++) {
      double turn = M_PI * fmin(fmax((times[k] - 2) / 2, 0), 1), share = turn / M_PI; /* node 7 is (1,1,1) */
      double handle[3] = {cos(turn) - sin(turn), sin(turn) + cos(turn) + share, 1};
      double expected = !fixed[d] ? 100 + d : d / 3 == 7 ? handle[d % 3] : flesh_mesh_positions(b.mesh)[d];
      CHECK_NEAR(x[d], expected, 1e-15);
    }
  }
  test_body_destroy(&b);

  /* A permanent pin and a constant prescribed motion are no events. */
  make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, 0, &b);
  motion.count = 1;
  CHECK_OK(flesh_system_add_prescribed_motion(b.system, 1, (int[]){7}, FLESH_AXES_ALL, &motion, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK(!flesh_system_moves(b.system));
  CHECK(flesh_system_next_event(b.system, 0) == INFINITY);
  test_body_destroy(&b);
}

/* Nodes that no tet uses are constrained at their positions. */
static void unused_nodes_are_fixed(void)
{
  test_body b;
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_create(6, (double[]){9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5, 0, 0, 1}, 1,
                             (int[]){1, 2, 3, 5}, NULL, &mesh));
  make(mesh, FLESH_MASS_LUMPED, 1, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  uint8_t fixed[18];
  CHECK(flesh_system_fixed(b.system, 0, fixed) == 6);
  for (int d = 0; d < 18; d++) CHECK(fixed[d] == (d < 3 || (d >= 12 && d < 15)));
  test_body_destroy(&b);
}

#define REFUSED(call, part)               \
  do {                                    \
    CHECK((call) == FLESH_ERR_ARGUMENT);  \
    CHECK_TEXT(flesh_error_text(), part); \
  } while (0)

static void bad_arguments_are_sentences(void)
{
  test_body b;
  make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, 0, &b);
  const int node = 3, none = 8, negative = -1;
  flesh_keyframe keys[] = {{.t = 1}, {.t = 0.5}};
  flesh_motion motion = {.count = 2, .keyframes = keys};
  REFUSED(flesh_system_add_pin(b.system, 1, &none, 7, 0, 1), "node 8 is constrained; the mesh has the nodes 0 to 7");
  REFUSED(flesh_system_add_pin(b.system, 1, &negative, 7, 0, 1), "node -1 is constrained");
  REFUSED(flesh_system_add_pin(b.system, 0, &node, 7, 0, 1), "at least one node and one axis");
  REFUSED(flesh_system_add_pin(b.system, 1, &node, 0, 0, 1), "at least one node and one axis");
  REFUSED(flesh_system_add_pin(b.system, 1, &node, 8, 0, 1), "at least one node and one axis");
  REFUSED(flesh_system_add_pin(b.system, 1, &node, 7, 1, 1), "until is 1 s; it must be after from, 1 s");
  REFUSED(flesh_system_add_pin(b.system, 1, &node, 7, NAN, 1), "until is 1 s");
  REFUSED(flesh_system_add_prescribed_motion(b.system, 1, &node, 7, &motion, 0, 1), "times must ascend");
  motion.count = 0;
  REFUSED(flesh_system_add_prescribed_motion(b.system, 1, &node, 7, &motion, 0, 1), "at least one keyframe");
  /* Refused constraints leave nothing behind. */
  uint8_t fixed[24];
  CHECK(flesh_system_fixed(b.system, 0.5, fixed) == 0);

  /* A system that is not finished has no pattern to solve with. */
  flesh_block_matrix *K = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  REFUSED(flesh_system_matrix_create(b.system, &K), "not finished");
  REFUSED(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator), "not finished");
  CHECK(K == NULL && integrator == NULL);

  CHECK_OK(flesh_system_finalize(b.system));
  REFUSED(flesh_system_add_pin(b.system, 1, &node, 7, 0, 1), "finished");
  REFUSED(flesh_system_finalize(b.system), "finished");
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
  REFUSED(flesh_system_add_effect(b.system, &effect), "finished");
  CHECK(effect == NULL); /* consumed nevertheless */
  test_body_destroy(&b);
  flesh_system_destroy(NULL);

  static const int wrong[][2] = {{4, 2}, {3, 3}, {0, 8}, {-1, 2}};
  for (int k = 0; k < 4; k++) {
    springs data = {{.count = 1, .nodes_per_cell = 2, .nodes = wrong[k]}, 1};
    make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, 0, &b);
    effect = springs_create(&b, &data);
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    REFUSED(flesh_system_finalize(b.system), "effect springs: cell 0 has node");
    test_body_destroy(&b);
  }
  static const int ends[] = {3, 4}, pairs[][2] = {{0, 3}, {0, -1}};
  for (int k = 0; k < 2; k++) {
    springs data = {{.count = 1, .nodes_per_cell = 2, .nodes = ends, .pair_count = 2, .pairs = pairs[k]}, 1};
    flesh_derivative_report report;
    make(test_box(1, 1, 1, 1, 1, 1), FLESH_MASS_LUMPED, 0, &b);
    effect = springs_create(&b, &data);
    REFUSED(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 1, &report), "effect springs: pair 1 is");
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    REFUSED(flesh_system_finalize(b.system), "its cells have the pairs 0 to 2");
    test_body_destroy(&b);
  }
}

/* Returns the linear solver's instruction set for a body with these for elasticity and inertia. */
static const flesh_linear *linear_of(flesh_instructions elasticity, flesh_instructions inertia)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_problem *problem = NULL;
  const flesh_solver_options options = test_options(1e-8);
  make(test_box(2, 1, 1, 1, 0.5, 0.5), FLESH_MASS_CONSISTENT, 0, &b);
  flesh_system_destroy(&b.system);
  CHECK_OK(flesh_system_create(b.mesh, &b.system));
  b.body.instructions = elasticity;
  CHECK_OK(flesh_effect_elasticity(&b.body, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  b.body.instructions = inertia;
  CHECK_OK(flesh_effect_inertia(&b.body, &effect));
  CHECK_OK(flesh_system_add_effect(b.system, &effect));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_problem_create(b.system, &options, &problem));
  const flesh_linear *linear = problem ? problem->newton.direction.linear : NULL;
  flesh_problem_destroy(&problem);
  test_body_destroy(&b);
  return linear;
}

static void linear_solvers_use_the_instructions_of_effects(void)
{
  flesh_instructions best, set;
  CHECK_OK(flesh_instructions_find(FLESH_INSTRUCTIONS_AUTO, &best));
  CHECK(flesh_linear_for(FLESH_INSTRUCTIONS_AUTO) == flesh_linear_for(best));
  CHECK(linear_of(FLESH_INSTRUCTIONS_AUTO, FLESH_INSTRUCTIONS_AUTO) == flesh_linear_for(best));
  for (set = FLESH_INSTRUCTIONS_PORTABLE; set <= best; set++) {
    CHECK(set == FLESH_INSTRUCTIONS_PORTABLE || flesh_linear_for(set) != flesh_linear_for(set - 1));
    CHECK(linear_of(set, FLESH_INSTRUCTIONS_AUTO) == flesh_linear_for(set));
    CHECK(linear_of(best, set) == flesh_linear_for(set)); /* the least */
  }
}

/* Compares with the mean 2-norm of a row of K, N/m. Displacements of one length and random signs move a row by 1/sqrt 2
 * to 1 times that in the mean (Khintchine's inequality; Szarek 1976). */
static double mean_row_norm(const test_body *b)
{
  flesh_block_matrix *K = NULL;
  double *squares = calloc((size_t)b->n, sizeof *squares), sum = 0;
  const flesh_point point = point_of(b);
  CHECK_OK(flesh_system_matrix_create(b->system, &K));
  CHECK_OK(flesh_system_jacobian(b->system, &point, &(flesh_shift){.x = 1}, K));
  for (int i = 0; i < K->rows; i++)
    for (int k = K->row_start[i]; k < K->row_end[i]; k++)
      for (int c = 0; c < 9; c++) {
        const int row = 3 * i + c / 3, column = 3 * K->column[k] + c % 3;
        const double square = K->values[9 * (size_t)k + (size_t)c] * K->values[9 * (size_t)k + (size_t)c];
        squares[row] += square;
        if (K->column[k] != i) squares[column] += square;
      }
  for (int d = 0; d < b->n; d++) sum += sqrt(squares[d]) / b->n;
  flesh_block_matrix_destroy(&K);
  free(squares);
  return sum;
}

static flesh_edge_force edge_force_of(flesh_energy energy, double scale, double *row_norm)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(3, 3, 3, scale, scale, scale), test_material(energy, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(flesh_system_finalize(b.system));
  double *work = malloc(4 * (size_t)b.n * sizeof *work);
  flesh_edge_force force;
  const flesh_point rest = flesh_point_at(0, flesh_mesh_positions(b.mesh), b.state.v, b.state.v);
  flesh_evaluation evaluation;
  CHECK_OK(flesh_evaluation_create(b.system, NULL, &evaluation));
  CHECK_OK(flesh_system_edge_force(&evaluation, FLESH_ROLE_BIT(FLESH_ROLE_ELASTICITY), &rest, work, &force));
  flesh_evaluation_clear(&evaluation);
  *row_norm = mean_row_norm(&b);
  free(work);
  test_body_destroy(&b);
  return force;
}

static void edge_forces_are_those_of_the_matrix(void)
{
  double norm, larger_norm, of_D;
  const flesh_edge_force force = edge_force_of(FLESH_ENERGY_S, 1, &norm), larger = edge_force_of(FLESH_ENERGY_S, 3, &larger_norm),
                         D = edge_force_of(FLESH_ENERGY_D, 1, &of_D);
  printf("# %g N, by the matrix %g N; of the softest %g N; at three times the size %g N\n", force.mean,
         norm * force.edge, force.softest, larger.mean);
  CHECK(force.mean > 0.65 * norm * force.edge && force.mean < 1.02 * norm * force.edge);
  CHECK(force.softest > force.mean && force.softest < 3 * force.mean);
  CHECK_NEAR(larger.edge, 3 * force.edge, 1e-12 * larger.edge);
  CHECK_NEAR(larger.mean, 9 * force.mean, 1e-5 * larger.mean);
  CHECK_NEAR(larger.softest, 9 * force.softest, 1e-5 * larger.softest);
  CHECK(!force.stressed && D.stressed);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(pattern_is_that_of_the_cells), TEST(sums_and_loads), TEST(edge_forces_are_those_of_the_matrix),
                   TEST(constraints_hold_and_release), TEST(unused_nodes_are_fixed),
                   TEST(bad_arguments_are_sentences), TEST(linear_solvers_use_the_instructions_of_effects));
}
