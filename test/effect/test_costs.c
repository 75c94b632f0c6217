// TEST quick
/* test_costs.c: the cost of effects is counted by those who evaluate them, and absent effects cost nothing: no
 * allocation, no entry of the pattern, no call, no column. */
#include <stdlib.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include "body.h"
#include "effect/private.h"
#include "flesh/contact.h"
#include "scene/effect_registry.h"
#include "flesh/observer.h"
#include "system/system.h"
#include "test.h"
#include "time/integrator.h"

/* Counts the calls and the memory of malloc; a sanitizer's own malloc is left alone. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#endif

static size_t requests, requested, held;
#if defined(__GLIBC__) && !defined(SANITIZED)
enum { COUNTS_MEMORY = 1 };
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t),
    *__libc_memalign(size_t, size_t), __libc_free(void *);
static void *counted(size_t size, void *taken)
{
  requests++;
  requested += size;
  held += malloc_usable_size(taken);
  return taken;
}
void *malloc(size_t size) { return counted(size, __libc_malloc(size)); }
void *calloc(size_t count, size_t size) { return counted(count * size, __libc_calloc(count, size)); }
void *aligned_alloc(size_t alignment, size_t size) { return counted(size, __libc_memalign(alignment, size)); }
void *realloc(void *old, size_t size)
{
  held -= malloc_usable_size(old);
  return counted(size, __libc_realloc(old, size));
}
void free(void *taken)
{
  held -= malloc_usable_size(taken);
  __libc_free(taken);
}
#else
enum { COUNTS_MEMORY = 0 };
#endif

static void make_of(double poisson, test_body *b)
{
  CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), test_material(FLESH_ENERGY_S, poisson), 1000, FLESH_MASS_LUMPED,
                            1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(b, 1e-9));
}

static void make(test_body *b) { make_of(0.4, b); }

static flesh_integrator *integrator_of(const test_body *b, flesh_method method)
{
  flesh_integrator *integrator = NULL;
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(b->system, method, &options, &integrator));
  return integrator;
}

static void calls_are_counted_by_the_caller(void)
{
  test_body b;
  make(&b);
  CHECK_OK(flesh_system_finalize(b.system));
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_IDA};
  for (int m = 0; m < 2; m++) {
    flesh_integrator *one = integrator_of(&b, methods[m]), *idle = integrator_of(&b, methods[m]);
    const flesh_costs *costs = flesh_integrator_costs(one);
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(one, &b.state, 0.01, &stats));
    printf("# %ld residuals in the statistics, %ld counted\n", (long)stats.residuals, costs->effects[0].residuals);
    for (int e = 0; e < 3; e++) {
      CHECK(costs->effects[e].residuals >= stats.residuals && stats.residuals > 0);
      CHECK(costs->effects[e].cpu_s == 0);
      CHECK(flesh_integrator_costs(idle)->effects[e].residuals == 0);
    }
    /* The energy is evaluated at the start and at the step's end, where the strain energy is known from the solve. */
    CHECK(costs->effects[0].energies >= 2 && costs->effects[2].energies >= 2);
    if (m == 0) CHECK(costs->effects[0].energies == 2 && costs->effects[1].energies == 1);
    /* Inertia and elasticity have Jacobians, gravity none. */
    CHECK(costs->effects[0].jacobians >= stats.assemblies && costs->effects[1].jacobians >= stats.assemblies);
    CHECK(costs->effects[2].jacobians == 0 && stats.assemblies > 0);
    flesh_integrator_costs(one)->timed = 1;
    CHECK_OK(flesh_integrator_step(one, &b.state, 0.01, NULL));
    for (int e = 0; e < 3; e++) CHECK(costs->effects[e].cpu_s > 0);
    flesh_integrator_destroy(&one);
    flesh_integrator_destroy(&idle);
  }
  test_body_destroy(&b);
}

/* An effect that only counts its evaluations. */
static long asked_residual, asked_potential, asked_both;

static int count_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)effect, (void)point, (void)r;
  asked_residual++;
  return FLESH_OK;
}

static int count_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                           double *magnitude)
{
  (void)effect, (void)point, (void)shift, (void)phi, (void)magnitude;
  asked_potential++;
  return FLESH_OK;
}

static int count_both(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *r,
                      double *phi, double *magnitude)
{
  (void)effect, (void)point, (void)shift, (void)r, (void)phi, (void)magnitude;
  asked_both++;
  return FLESH_OK;
}

static const flesh_effect_operations counting_operations = {
    .name = "counting",
    .traits = FLESH_IS_PASSIVE,
    .residual = count_residual,
    .potential = count_potential,
    .library = &(const flesh_effect_private){.evaluate = count_both},
};

/* The guard's first trial and KINSOL's residual are one evaluation: no point is evaluated twice. */
static void guarded_steps_evaluate_once(void)
{
  test_body b;
  make(&b);
  flesh_effect *counting = NULL;
  CHECK_OK(flesh_effect_create(&counting_operations, b.mesh, NULL, &counting));
  CHECK_OK(flesh_system_add_effect(b.system, &counting));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_BACKWARD_EULER);
  const flesh_effect_cost *elasticity = &flesh_integrator_costs(integrator)->effects[1];
  for (int k = 0; k < 5; k++) {
    const flesh_effect_cost before = *elasticity;
    asked_residual = asked_potential = asked_both = 0;
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.005, &stats));
    CHECK(stats.newton > 0 && stats.backtracks == 0 && stats.solves == 1);
    const int guesses = k > 0; /* the alternative to the first iterate, the state itself, needs only its potential */
    CHECK(stats.residuals == stats.newton + 1 && stats.potentials == stats.newton + 1 + guesses);
    CHECK(elasticity->residuals - before.residuals == stats.residuals);
    /* Elasticity's potential there is known from the step before. */
    CHECK(elasticity->potentials - before.potentials == stats.potentials - guesses);
    const int sizes = k == 0; /* of the potential's terms, for the rounding of the monitored energies */
    CHECK(asked_both == stats.newton + 1 && asked_potential == guesses + sizes && asked_residual == 0);
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Shortened steps need no further evaluations: every trial is one potential, and the accepted one's serves the next
 * iteration. Solves with softer materials come before the true ones; each but the first, and the true one, has the
 * previous end as an alternative to its first iterate. */
static void tries_are_one_potential_each(void)
{
  const double ratios[] = {0.4, 0.4985, 0.4999};
  const int softer[] = {1, 2, 3};
  int backtracks = 0;
  for (int k = 0; k < 3; k++) {
    test_body b;
    make_of(ratios[k], &b);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options options;
    flesh_integrator *integrator = NULL;
    flesh_solve_stats stats = {0};
    flesh_solver_options_default(&options);
    options.techniques &= ~(unsigned)(FLESH_TECHNIQUE_NEGATIVE_CURVATURE | FLESH_TECHNIQUE_LONGER_STEPS |
                                      FLESH_TECHNIQUE_NONLINEAR_ELIMINATION | FLESH_TECHNIQUE_WATCHDOG |
                                      FLESH_TECHNIQUE_UNTANGLE);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    test_jitter(b.n, 1, 3, b.state.x); /* many tets inverted */
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.1, &stats));
    printf("# ratio %g: %d iterations, %d backtracks, %d potentials\n", ratios[k], stats.newton,
           stats.backtracks, stats.potentials);
    backtracks += stats.backtracks;
    CHECK(stats.solves == 1);
    const int starts = softer[k] + 1, rivals = softer[k];
    CHECK(stats.potentials == stats.newton + starts + rivals + stats.backtracks);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  CHECK(backtracks > 0);
}

/* On a body so large that malloc's rounding is negligible. */
static void memory_is_what_was_allocated(void)
{
  test_body b;
  CHECK_OK(test_body_create(test_box(8, 4, 4, 2, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1,
                            &b));
  flesh_effect *effect = NULL;
  for (int k = 0; k < 2; k++) {
    const size_t before = held;
    CHECK_OK(k ? flesh_effect_viscosity(&b.body, 1, 1, &effect)
               : flesh_effect_damping(&b.body, 1, 1, FLESH_STIFFNESS_CURRENT, &effect));
    const size_t taken = held - before, told = effect->operations->figures->memory(effect);
    printf("# %s tells %zu bytes and holds %zu\n", effect->operations->name, told, taken);
    if (COUNTS_MEMORY) CHECK(told <= taken && (double)(taken - told) < 0.03 * (double)taken);
    flesh_effect_destroy(&effect);
  }
  /* Contact frees its temporary memory. */
  flesh_obstacle *ball = NULL;
  flesh_contact_options options;
  flesh_contact_options_default(&options);
  const size_t before_contact = requested;
  CHECK_OK(flesh_obstacle_sphere((double[]){0, 0, -3}, 1, &ball));
  CHECK_OK(flesh_effect_obstacle_contact(&b.body, &options, &ball, &effect));
  const size_t asked = requested - before_contact, contact_told = effect->operations->figures->memory(effect);
  printf("# contact tells %zu bytes and asked for %zu\n", contact_told, asked);
  if (COUNTS_MEMORY) CHECK(contact_told <= asked && contact_told > asked / 4);
  flesh_effect_destroy(&effect);
  test_body_destroy(&b);
}

/* Counts the pattern's blocks and the allocations, with their bytes, of a system and an integrator after one step;
 * `damped`: with two more effects, along existing edges. */
static void measure(int damped, int *blocks, size_t memory[2], int *effects, int *columns)
{
  test_body b;
  flesh_history *history = NULL;
  const size_t before[2] = {requests, requested};
  make(&b);
  flesh_effect *effect = NULL;
  if (damped) {
    CHECK_OK(flesh_effect_damping(&b.body, 1, 0.01, FLESH_STIFFNESS_REST, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
    const flesh_keyframe key = {.translation = {2, 1, 1}};
    CHECK_OK(
        flesh_effect_spring(&b.body, (double[]){1.9, 0.9, 0.9}, 10, &(flesh_motion){1, &key, {0}, 0}, 0, 1, &effect));
    CHECK_OK(flesh_system_add_effect(b.system, &effect));
  }
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_block_matrix *K = NULL;
  CHECK_OK(flesh_system_matrix_create(b.system, &K));
  flesh_integrator *integrator = integrator_of(&b, FLESH_METHOD_BACKWARD_EULER);
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
  memory[0] = requests - before[0];
  memory[1] = requested - before[1];
  *blocks = K->row_start[K->rows];
  *effects = flesh_system_effect_count(b.system);
  CHECK_OK(flesh_history_create("test_costs_history.csv", b.system, &history));
  CHECK_OK(flesh_history_close(&history));
  FILE *stream = fopen("test_costs_history.csv", "r");
  char line[1000] = "";
  CHECK(stream && fgets(line, sizeof line, stream));
  if (stream) fclose(stream);
  remove("test_costs_history.csv");
  *columns = 0;
  for (char *c = line; (c = strstr(c, "energy_")); c++) ++*columns;
  if (!damped)
    CHECK(strstr(line, "energy_inertia,") && strstr(line, "energy_elasticity,") && strstr(line, "energy_gravity,"));
  CHECK(!strstr(line, "damping") && !strstr(line, "contact"));
  flesh_block_matrix_destroy(&K);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void absent_effects_cost_nothing(void)
{
  int rows, blocks[3], effects[3], columns[3];
  size_t memory[3][2];
  measure(0, &blocks[0], memory[0], &effects[0], &columns[0]); /* allocated once by the library */
  measure(0, &blocks[0], memory[0], &effects[0], &columns[0]);
  flesh_effect_registry(&rows); /* how many effects there could be */
  measure(0, &blocks[1], memory[1], &effects[1], &columns[1]);
  measure(1, &blocks[2], memory[2], &effects[2], &columns[2]);
  printf("# %d of %d effects: %d blocks, %zu requests for %zu bytes, %d columns; with two more %d blocks, %zu for %zu "
         "bytes, %d columns\n",
         effects[0], rows, blocks[0], memory[0][0], memory[0][1], columns[0], blocks[2], memory[2][0], memory[2][1],
         columns[2]);
  CHECK(rows > 10 && effects[0] == 3 && effects[2] == 5);
  CHECK(blocks[0] == blocks[1] && memory[0][0] == memory[1][0] && memory[0][1] == memory[1][1] &&
        columns[0] == columns[1]);
  CHECK(columns[0] == 4 && columns[2] == 5); /* including the total; damping has no energy */
  CHECK(blocks[2] == blocks[0] && (memory[2][0] > memory[0][0] || !COUNTS_MEMORY));
  /* The pattern is that of the tets: one block per node and edge. */
  test_body b;
  make(&b);
  const int *tets = flesh_mesh_tets(b.mesh), nodes = b.n / 3;
  char *joined = calloc((size_t)nodes * nodes, 1);
  int expected = nodes;
  for (int e = 0; e < flesh_mesh_tet_count(b.mesh); e++)
    for (int i = 0; i < 4; i++)
      for (int j = 0; j < 4; j++) joined[tets[4 * e + i] * nodes + tets[4 * e + j]] = 1;
  for (int i = 0; i < nodes; i++)
    for (int j = i + 1; j < nodes; j++) expected += joined[i * nodes + j];
  CHECK(blocks[0] == expected);
  free(joined);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(calls_are_counted_by_the_caller), TEST(guarded_steps_evaluate_once),
                   TEST(tries_are_one_potential_each), TEST(memory_is_what_was_allocated),
                   TEST(absent_effects_cost_nothing));
}
