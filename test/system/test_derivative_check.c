// TEST quick
/* test_derivative_check.c: the derivative check of effects accepts correct ones and detects small errors in wrong
 * ones. */
#include <stdlib.h>

#include "flesh/contact.h"
#include "flesh/effects.h"
#include "flesh/system.h"
#include "effect/environment.h"
#include "effect/private.h"
#include "grids.h"
#include "linear/block_matrix.h"
#include "system/derivative_check.h"
#include "system/proximity.h"
#include "test.h"

/* An effect that changes another one's results by one part in ten thousand. */
typedef enum spoiled {
  SPOIL_NOTHING,
  SPOIL_RESIDUAL,
  SPOIL_POTENTIAL,
  SPOIL_ENERGY,
  SPOIL_JACOBIAN,
  SPOIL_SHIFTS, /* treats the position as the unknown */
  SPOIL_EVALUATE,
  SPOIL_ANEW,
  SPOIL_PROJECTION
} spoiled;

typedef struct spoiler {
  const flesh_effect *inner;
  spoiled what;
} spoiler;

static void raise(const void *height, double x[3]) { x[2] += *(const double *)height; }

static const spoiler *of(const flesh_effect *effect) { return effect->data; }

static const flesh_cells *cells(const flesh_effect *effect)
{
  return of(effect)->inner->operations->cells(of(effect)->inner);
}

static int residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  int status = of(effect)->inner->operations->residual(of(effect)->inner, point, r);
  if (of(effect)->what == SPOIL_RESIDUAL) r[4] *= 1.0001;
  return status;
}

static int potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                     double *phi, double *magnitude)
{
  const flesh_shift used = {of(effect)->what == SPOIL_SHIFTS ? 1 : shift->x, shift->v, shift->a, shift->filter};
  int status = of(effect)->inner->operations->potential(of(effect)->inner, point, &used, phi, magnitude);
  if (of(effect)->what == SPOIL_POTENTIAL) *phi *= 1.0001;
  return status;
}

static int energy(const flesh_effect *effect, const flesh_point *point, double *value)
{
  int status = of(effect)->inner->operations->energy(of(effect)->inner, point, value);
  if (of(effect)->what == SPOIL_ENERGY) *value *= 1.0001;
  return status;
}

static int evaluate(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                    double *r, double *phi, double *magnitude)
{
  const flesh_effect *inner = of(effect)->inner;
  int status = inner->operations->library->evaluate(inner, point, shift, r, phi, magnitude);
  if (of(effect)->what == SPOIL_RESIDUAL || of(effect)->what == SPOIL_EVALUATE) r[4] *= 1.0001;
  if (of(effect)->what == SPOIL_POTENTIAL) *phi *= 1.0001;
  return status;
}

static int jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                    flesh_block_matrix *K, const int *slots)
{
  flesh_shift used = *shift;
  if (of(effect)->what == SPOIL_PROJECTION) used.filter = 0;
  if (of(effect)->what == SPOIL_SHIFTS) used.x = 1;
  int status = of(effect)->inner->operations->jacobian(of(effect)->inner, point, &used, K, slots);
  if (of(effect)->what == SPOIL_JACOBIAN) K->values[1] += 1e-4 * K->values[0];
  return status;
}

static int jacobian_assign(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const flesh_effect *inner = of(effect)->inner;
  int status = inner->operations->library->jacobian_assign(inner, point, shift, K, slots);
  if (of(effect)->what == SPOIL_ANEW) K->values[9 * slots[3] + 1] *= 1.0001;
  if (of(effect)->what == SPOIL_JACOBIAN) K->values[1] += 1e-4 * K->values[0];
  return status;
}

static const flesh_effect_operations spoiled_operations = {
    .name = "spoiled",
    .cells = cells,
    .residual = residual,
    .jacobian = jacobian,
    .potential = potential,
    .energy = energy,
    .library = &(const flesh_effect_private){.jacobian_assign = jacobian_assign, .evaluate = evaluate},
};

typedef struct set_up {
  flesh_mesh *mesh;
  flesh_material material;
  double *density, *x;
  flesh_body body;
  flesh_effect *elasticity;
} set_up;

static void make(set_up *s, double stretch)
{
  static const double size[3] = {2, 1, 1}, origin[3] = {0};
  static const int counts[3] = {3, 2, 2};
  *s = (set_up){0};
  CHECK_OK(flesh_mesh_box(counts, size, origin, &s->mesh));
  CHECK_OK(
      flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &s->material));
  int nodes = flesh_mesh_node_count(s->mesh), tets = flesh_mesh_tet_count(s->mesh);
  s->density = malloc(sizeof(double) * (size_t)tets);
  for (int t = 0; t < tets; t++) s->density[t] = 1000;
  s->x = malloc(sizeof(double) * 3 * (size_t)nodes);
  unsigned long long random = 5;
  for (int d = 0; d < 3 * nodes; d++)
    s->x[d] = flesh_mesh_positions(s->mesh)[d] * (d % 3 ? 1 : stretch) +
              0.1 * (test_uniform(&random) - 0.5);
  s->body = (flesh_body){.mesh = s->mesh, .density = s->density, .materials = &s->material,
                        .mass = FLESH_MASS_CONSISTENT};
  CHECK_OK(flesh_effect_elasticity(&s->body, &s->elasticity));
}

static void drop(set_up *s)
{
  flesh_effect_destroy(&s->elasticity);
  flesh_mesh_destroy(&s->mesh);
  free(s->density);
  free(s->x);
}

static flesh_derivative_report report_of(const flesh_effect *effect, const set_up *s)
{
  flesh_derivative_report report;
  CHECK_OK(flesh_effect_check_derivatives(effect, s->mesh, 0, s->x, 7, &report));
  return report;
}

static flesh_derivative_report report_spoiled(const set_up *s, spoiled what)
{
  spoiler data = {s->elasticity, what};
  flesh_effect effect = *s->elasticity;
  effect.operations = &spoiled_operations;
  effect.data = &data;
  return report_of(&effect, s);
}

static void right_effects_pass(void)
{
  set_up s;
  make(&s, 1);
  flesh_effect *inertia = NULL, *gravity = NULL;
  CHECK_OK(flesh_effect_inertia(&s.body, &inertia));
  const double g[3] = {1, 2, -9.81};
  CHECK_OK(flesh_effect_gravity(&s.body, g, &gravity));
  const flesh_effect *effects[] = {s.elasticity, inertia, gravity};
  for (int e = 0; e < 3; e++) {
    flesh_derivative_report report = report_of(effects[e], &s);
    for (int k = 0; k < FLESH_CHECK_SHIFTS; k++) {
      CHECK_BELOW(report.potential[k], 1e-9);
      CHECK_BELOW(report.jacobian[k], 1e-9);
    }
    CHECK(flesh_derivative_report_passes(&report, 1e-9));
  }
  flesh_effect_destroy(&inertia);
  flesh_effect_destroy(&gravity);
  drop(&s);
}

static void a_wrong_residual_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_NOTHING);
  CHECK(flesh_derivative_report_passes(&report, 1e-8));
  report = report_spoiled(&s, SPOIL_RESIDUAL);
  CHECK(report.potential[0] > 1e-8 && report.potential[1] > 1e-8 && report.jacobian[0] > 1e-8);
  CHECK(!flesh_derivative_report_passes(&report, 1e-8));
  drop(&s);
}

static void a_wrong_evaluation_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_NOTHING);
  CHECK(report.evaluate[0] == 0 && report.evaluate[1] == 0);
  report = report_spoiled(&s, SPOIL_EVALUATE);
  CHECK(report.evaluate[0] > 1e-8 && report.evaluate[1] > 1e-8);
  CHECK(report.potential[0] < 1e-8 && report.jacobian[0] < 1e-8);
  CHECK(!flesh_derivative_report_passes(&report, 1e-8));
  drop(&s);
}

static void a_wrong_potential_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_POTENTIAL);
  CHECK(report.potential[0] > 1e-6 && report.jacobian[0] < 1e-8);
  CHECK(!flesh_derivative_report_passes(&report, 1e-8));
  report = report_spoiled(&s, SPOIL_ENERGY);
  CHECK(report.potential[0] > 1e-6 && report.potential[1] < 1e-8 && report.jacobian[0] < 1e-8);
  drop(&s);
}

static void a_forgotten_shift_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_SHIFTS);
  CHECK(report.potential[0] < 1e-8 && report.potential[1] > 1e-3);
  CHECK(report.jacobian[0] < 1e-8 && report.jacobian[1] > 0.4);
  drop(&s);
}

static void a_wrong_jacobian_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_JACOBIAN);
  CHECK(report.jacobian[0] > 1e-8 && report.asymmetry > 1e-6 && report.potential[0] < 1e-8);
  CHECK(!flesh_derivative_report_passes(&report, 1e-8));
  drop(&s);
}

/* An effect that assigns wrongly, and one that adds to old contents. */
static void a_wrong_beginning_is_seen(void)
{
  set_up s;
  make(&s, 1);
  flesh_derivative_report report = report_spoiled(&s, SPOIL_ANEW);
  CHECK(report.jacobian[0] > 1e-8 && report.jacobian[1] > 1e-8 && report.potential[0] < 1e-8);
  CHECK(!flesh_derivative_report_passes(&report, 1e-8));
  flesh_effect_operations adds = *s.elasticity->operations;
  flesh_effect_private library = *adds.library;
  library.jacobian_assign = adds.jacobian;
  adds.library = &library;
  flesh_effect other = *s.elasticity;
  other.operations = &adds;
  report = report_of(&other, &s);
  CHECK(report.jacobian[0] == INFINITY && report.jacobian[1] == INFINITY);
  drop(&s);
}

static void negative_curvature_is_seen(void)
{
  set_up s;
  make(&s, 0.3); /* flattened: the true Hessian is indefinite */
  flesh_derivative_report report = report_of(s.elasticity, &s);
  CHECK_BELOW(report.negative, 1e-12);
  report = report_spoiled(&s, SPOIL_PROJECTION);
  CHECK(report.negative > 1e-6);
  drop(&s);
}

/* Two boxes within the barrier of each other, at a position where a solve may begin and at one where it goes. */
typedef struct touching {
  flesh_mesh *mesh;
  flesh_material material;
  flesh_body body;
  flesh_effect *contact;
  double *x;
} touching;

static void bring_together(touching *t)
{
  flesh_body_part parts[2];
  flesh_contact_options options;
  const double low = 0, up = 1.03;
  *t = (touching){0};
  t->mesh = grids_join(grid_of(2, 2, 1, raise, &low), grid_of(3, 2, 1, raise, &up), parts);
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &t->material));
  t->body = (flesh_body){.mesh = t->mesh, .materials = &t->material};
  flesh_contact_options_default(&options);
  options.thickness = 0.1;
  options.friction = 0.3;
  options.slip_speed = 1;
  CHECK_OK(flesh_effect_surface_contact(&t->body, &options, 0, NULL, &t->contact));
  const int n = 3 * flesh_mesh_node_count(t->mesh);
  unsigned long long random = 11;
  t->x = malloc((size_t)n * sizeof *t->x);
  for (int d = 0; d < n; d++) t->x[d] = flesh_mesh_positions(t->mesh)[d] + 0.02 * (test_uniform(&random) - 0.5);
}

static void part(touching *t)
{
  flesh_effect_destroy(&t->contact);
  flesh_mesh_destroy(&t->mesh);
  free(t->x);
}

/* Predicts whenever a matrix is made. */
static int jacobian_of_the_calls(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                                 flesh_block_matrix *K, const int *slots)
{
  const flesh_effect_operations *own = of(effect)->inner->operations;
  if (flesh_environment_of(point)->near) own->library->predict(effect, point);
  return own->jacobian(of(effect)->inner, point, shift, K, slots);
}

static int inner_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  return of(effect)->inner->operations->residual(of(effect)->inner, point, r);
}

static int create_inner(const flesh_effect *effect, flesh_threads *threads, void **near)
{
  return of(effect)->inner->operations->barrier->remember(of(effect)->inner, threads, near);
}

/* The matrix of contact between bodies is the one that solves assemble, and no other after other calls. */
static void contact_of_surfaces_is_checked_as_solves_see_it(void)
{
  touching t;
  flesh_derivative_report report;
  bring_together(&t);
  CHECK_OK(flesh_effect_check_derivatives(t.contact, t.mesh, 0, t.x, 3, &report));
  printf("# contact of surfaces: %.2g, %.2g, asymmetry %.2g, negative %.2g\n", report.jacobian[0], report.jacobian[1],
         report.asymmetry, report.negative);
  CHECK(flesh_derivative_report_passes(&report, 1e-6));
  flesh_effect_barrier barrier = *t.contact->operations->barrier;
  barrier.remember = create_inner;
  const flesh_effect_operations operations = {.name = "by the calls", .residual = inner_residual,
                                              .jacobian = jacobian_of_the_calls, .barrier = &barrier};
  spoiler data = {t.contact, SPOIL_NOTHING};
  flesh_effect spoiled = {.operations = &operations, .data = &data, .nodes = flesh_mesh_node_count(t.mesh),
                          .tets = flesh_mesh_tet_count(t.mesh)};
  CHECK_OK(flesh_effect_check_derivatives(&spoiled, t.mesh, 0, t.x, 3, &report));
  CHECK(!flesh_derivative_report_passes(&report, 1e-6));
  part(&t);
}

/* Springs to the places `data` [3*n] of the nodes, whose stiffness grows from 3e-7 m beyond them on. */
static int stiffening_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const double *place = effect->data;
  for (int d = 0; d < 3 * effect->nodes; d++) {
    const double stretch = point->x[d] - place[d];
    r[d] += stretch + 10 * pow(fmax(0, stretch - 3e-7), 2);
  }
  return FLESH_OK;
}

static int stiffening_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                               flesh_block_matrix *K, const int *slots)
{
  const double *place = effect->data;
  (void)slots;
  for (int d = 0; d < 3 * effect->nodes; d++)
    K->values[9 * (size_t)K->row_start[d / 3] + 4 * (size_t)(d % 3)] +=
        shift->x * (1 + 20 * fmax(0, point->x[d] - place[d] - 3e-7));
  return FLESH_OK;
}

/* A kink of the Jacobian beside the point, as where fibres of muscles begin to be stretched, is no error. */
static void kinks_beside_the_point_are_stepped_short_of(void)
{
  static const flesh_effect_operations operations = {.name = "stiffening", .residual = stiffening_residual,
                                                     .jacobian = stiffening_jacobian};
  set_up s;
  make(&s, 1);
  const flesh_effect effect = {&operations, s.x, flesh_mesh_node_count(s.mesh), flesh_mesh_tet_count(s.mesh)};
  const flesh_derivative_report report = report_of(&effect, &s);
  printf("# %.2g and %.2g\n", report.jacobian[0], report.jacobian[1]);
  CHECK(flesh_derivative_report_passes(&report, 1e-8));
  drop(&s);
}

/* After a prediction at a position other than x_lag the matrix differs from the derivative, only at that position; it
 * is the same when predicted again there, and the derivative at all other positions. */
static void predictions_hold_for_their_place(void)
{
  touching t;
  bring_together(&t);
  flesh_system *system = NULL;
  flesh_proximity memory, fresh;
  flesh_block_matrix *K = NULL;
  int grown;
  const int n = 3 * flesh_mesh_node_count(t.mesh);
  double *v = calloc((size_t)n, sizeof *v), *y = malloc((size_t)n * sizeof *y);
  CHECK_OK(flesh_system_create(t.mesh, &system));
  CHECK_OK(flesh_system_add_effect(system, &t.contact));
  CHECK_OK(flesh_system_finalize(system));
  CHECK_OK(flesh_proximity_create(system, NULL, &memory));
  CHECK_OK(flesh_proximity_create(system, NULL, &fresh));
  CHECK_OK(flesh_system_matrix_create(system, &K));
  for (int d = 0; d < n; d++) y[d] = t.x[d] + (d % 3 == 2 && t.x[d] > 1.01 ? 0.02 : 0);
  const flesh_environment environment = {.proximity = &memory}, without = {.proximity = &fresh};
  flesh_point at = flesh_point_at(0, t.x, v, v), other = flesh_point_at(0, y, v, v);
  at.lagged.x = y;
  at.environment = other.environment = &environment;
  CHECK_OK(flesh_proximity_cover(&memory, &at, K, &grown));
  const size_t bytes = 9 * sizeof(double) * (size_t)K->row_start[K->rows];
  double *kept[5];
  const flesh_shift shift = {.x = 1};
  for (int k = 0; k < 5; k++) {
    kept[k] = malloc(bytes);
    if (k == 1 || k == 2) flesh_proximity_predict(&memory, &at);
    CHECK_OK(flesh_system_jacobian(system, k < 3 ? &at : &other, &shift, K)); /* other: first with the same memory */
    memcpy(kept[k], K->values, bytes);
    if (k == 3) other.environment = &without;
  }
  CHECK(memcmp(kept[0], kept[1], bytes));
  CHECK(!memcmp(kept[1], kept[2], bytes));
  CHECK(!memcmp(kept[3], kept[4], bytes));
  for (int k = 0; k < 5; k++) free(kept[k]);
  flesh_block_matrix_destroy(&K);
  flesh_proximity_clear(&memory);
  flesh_proximity_clear(&fresh);
  flesh_system_destroy(&system);
  free(v);
  free(y);
  part(&t);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(right_effects_pass), TEST(a_wrong_residual_is_seen),
                   TEST(a_wrong_evaluation_is_seen),
                   TEST(a_wrong_potential_is_seen), TEST(a_forgotten_shift_is_seen), TEST(a_wrong_jacobian_is_seen),
                   TEST(a_wrong_beginning_is_seen), TEST(negative_curvature_is_seen),
                   TEST(contact_of_surfaces_is_checked_as_solves_see_it), TEST(predictions_hold_for_their_place),
                   TEST(kinks_beside_the_point_are_stepped_short_of));
}
