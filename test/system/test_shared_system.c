// TEST quick
/* test_shared_system.c: a finished system is const: evaluations of one system by several threads, or one within
 * another, do not disturb each other, also if effects need sums over ranks. */
#include <pthread.h>
#include <stdlib.h>

#include "base/team.h"
#include "body.h"
#include "system/parts.h"
#include "test.h"

/* An evaluation at a point of its own. */
typedef struct evaluation {
  const flesh_system *system;
  int n;
  double *v, *r, *expected;
  int wrong;
} evaluation;

static void evaluate(evaluation *e)
{
  const double *X = flesh_mesh_positions(e->system->mesh);
  const flesh_point point = flesh_point_at(0.5, X, e->v, e->v);
  if (flesh_system_residual(e->system, &point, e->r)) e->wrong++;
  if (e->expected) e->wrong += memcmp(e->r, e->expected, (size_t)e->n * sizeof *e->r) != 0;
}

/* A team of only this rank, whose sums may be interrupted by another evaluation. */
typedef struct lone {
  evaluation *between; /* NULL: none; reset after its use */
} lone;

static void sum(const void *data, int count, double *numbers)
{
  lone *self = (lone *)data;
  evaluation *between = self->between;
  (void)count, (void)numbers;
  self->between = NULL;
  if (between) evaluate(between);
}

static void sum_alone(const void *data, int count, double *numbers) { (void)data, (void)count, (void)numbers; }
static int agree(const void *data, int status) { return (void)data, status; }
static void exchange(const void *data, const flesh_team_vector *vector) { (void)data, (void)vector; }

/* Makes a cube with inertia and two settling dampings, each of which needs the body's speed over all ranks. */
static void make(test_body *b, const flesh_team *team)
{
  flesh_effect *effect = NULL;
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, b));
  for (int k = 0; k < 2; k++) {
    CHECK_OK(flesh_effect_settling_damping(&b->body, 20, 1.5 + k, 0, 2, &effect));
    CHECK_OK(flesh_system_add_effect(b->system, &effect));
  }
  b->system->team = team;
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Evaluations at this many velocities, with the separate result of each. */
static void make_evaluations(const test_body *b, int count, evaluation *all)
{
  for (int k = 0; k < count; k++) {
    all[k] = (evaluation){.system = b->system, .n = b->n};
    all[k].v = malloc((size_t)b->n * sizeof *all[k].v);
    all[k].r = malloc((size_t)b->n * sizeof *all[k].r);
    double *expected = malloc((size_t)b->n * sizeof *expected);
    for (int d = 0; d < b->n; d++) all[k].v[d] = (1 + 2 * k) * (1 + 0.1 * (d % 5));
    evaluate(&all[k]);
    memcpy(expected, all[k].r, (size_t)b->n * sizeof *expected);
    all[k].expected = expected;
  }
}

static void free_evaluations(int count, evaluation *all)
{
  for (int k = 0; k < count; k++) {
    free(all[k].v);
    free(all[k].r);
    free(all[k].expected);
  }
}

static void an_evaluation_within_another_changes_nothing(void)
{
  lone data = {NULL};
  const flesh_team_operations operations = {.sum = sum, .largest = sum_alone, .agree = agree, .update_ghosts = exchange,
                                            .add_ghosts = exchange};
  flesh_team team = {.ranks = 1, .nodes = 27, .own = 27, .overlap = 27, .all = 27, .data = &data,
                     .operations = &operations};
  evaluation all[2];
  test_body b;
  make(&b, &team);
  make_evaluations(&b, 2, all);
  CHECK(test_distance(b.n, all[0].r, all[1].r) > 1);
  for (int k = 0; k < 2; k++) {
    data.between = &all[1 - k];
    evaluate(&all[k]);
    CHECK(data.between == NULL && all[0].wrong == 0 && all[1].wrong == 0);
  }
  free_evaluations(2, all);
  test_body_destroy(&b);
}

static pthread_barrier_t both;

static void *evaluate_often(void *data)
{
  pthread_barrier_wait(&both);
  for (int k = 0; k < 30000; k++) evaluate(data);
  return NULL;
}

static void threads_evaluate_one_system(void)
{
  const flesh_team_operations operations = {.sum = sum_alone, .largest = sum_alone, .agree = agree, .update_ghosts = exchange,
                                            .add_ghosts = exchange};
  const flesh_team team = {.ranks = 1, .nodes = 27, .own = 27, .overlap = 27, .all = 27, .operations = &operations};
  evaluation all[2];
  pthread_t other;
  test_body b;
  make(&b, &team);
  make_evaluations(&b, 2, all);
  CHECK(!pthread_barrier_init(&both, NULL, 2));
  CHECK(!pthread_create(&other, NULL, evaluate_often, &all[1]));
  evaluate_often(&all[0]);
  CHECK(!pthread_join(other, NULL));
  pthread_barrier_destroy(&both);
  printf("# wrong: %d and %d of 30000\n", all[0].wrong, all[1].wrong);
  CHECK(all[0].wrong == 0 && all[1].wrong == 0);
  free_evaluations(2, all);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(an_evaluation_within_another_changes_nothing),
                   TEST_OF_THREADS(threads_evaluate_one_system));
}
