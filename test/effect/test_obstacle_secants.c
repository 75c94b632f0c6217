// TEST quick seconds=60
/* test_obstacle_secants.c: solves of bodies pressed by obstacles take few Newton iterations, however deep in the
 * barrier they begin. */
#include "body.h"
#include "geometry/barrier.h"
#include "geometry/obstacle.h"
#include "linear/block_matrix.h"
#include "system/proximity.h"
#include "test.h"
#include "time/integrator.h"

typedef struct scene {
  test_body b;
  flesh_integrator *integrator;
} scene;

/* Makes a cube of 1 m on a floor at z = `below`, which follows the motion. */
static void begin(double below, const flesh_motion *motion, scene *s)
{
  flesh_solver_options options;
  flesh_contact_options contact_options;
  flesh_material material;
  flesh_obstacle *floor = NULL;
  flesh_effect *contact = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(test_body_create(test_box(4, 4, 4, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &s->b));
  CHECK_OK(flesh_obstacle_plane((const double[]){0, 0, below}, (const double[]){0, 0, 1}, &floor));
  if (motion) CHECK_OK(flesh_obstacle_move(floor, motion));
  flesh_contact_options_default(&contact_options);
  contact_options.thickness = 0.01;
  CHECK_OK(flesh_effect_obstacle_contact(&s->b.body, &contact_options, &floor, &contact));
  CHECK_OK(flesh_system_add_effect(s->b.system, &contact));
  CHECK_OK(flesh_system_finalize(s->b.system));
  flesh_solver_options_default(&options);
  CHECK_OK(flesh_integrator_create(s->b.system, FLESH_METHOD_BACKWARD_EULER, &options, &s->integrator));
}

static void finish(scene *s)
{
  flesh_integrator_destroy(&s->integrator);
  test_body_destroy(&s->b);
}

/* A floor that rises by 0.02 m until it touches 25 nodes, or stops just below: the nodes start at the gap given by the
 * expected force. With tangents each Newton iteration widens a gap that is far too small by only half of itself. */
static void nodes_that_would_touch_begin_apart(void)
{
  static const double gaps[] = {0, 1e-15, 1e-12, 1e-8, 1e-5};
  static const flesh_keyframe keys[] = {{.t = 0}, {.t = 0.01, .translation = {0, 0, 0.02}}};
  for (int k = 0; k < 5; k++) {
    flesh_solve_stats stats = {0};
    scene s;
    begin(-0.02 - gaps[k], &(flesh_motion){2, keys, {0, 0, 0}, 0}, &s);
    CHECK_OK(flesh_integrator_step(s.integrator, &s.b.state, 0.01, &stats));
    printf("# %g m: %d Newton iterations, %d backtracks\n", gaps[k], stats.newton, stats.backtracks);
    CHECK(stats.newton <= 12 && stats.steps == 1);
    finish(&s);
  }
}

static double pressure_at(double gap)
{
  double value, first, second;
  flesh_barrier_law(gap, &value, &first, &second);
  return -first;
}

/* Returns the stiffness that the floor adds to the cube's first node, at a gap over the thickness. */
static double stiffness_at(const scene *s, double gap, double gap_lag, flesh_block_matrix *K, int predicts)
{
  const flesh_evaluation *evaluation = s->integrator->evaluation;
  static double x[375], x_lag[375], v[375];
  for (int d = 0; d < s->b.n; d++) {
    x[d] = s->b.state.x[d] + (d % 3 == 2 ? 0.01 * gap : 0);
    x_lag[d] = s->b.state.x[d] + (d % 3 == 2 ? 0.01 * gap_lag : 0);
  }
  flesh_point point = flesh_evaluation_point(evaluation, 0, x, v, v);
  point.lagged.x = x_lag;
  if (predicts) flesh_proximity_predict((flesh_proximity *)&evaluation->proximity, &point);
  CHECK_OK(flesh_system_jacobian(s->b.system, &point, &(flesh_shift){.x = 1}, K));
  return K->values[9 * (size_t)K->row_start[0] + 8];
}

/* The first matrix of a solve has the secant to the force at the lagged state; the next one that to the force predicted
 * by the first; without a prediction, or elsewhere, the matrix has the tangent. */
static void stiffness_leads_to_the_expected_force(void)
{
  scene s;
  flesh_block_matrix *K;
  begin(0, NULL, &s);
  CHECK_OK(flesh_system_matrix_create(s.b.system, &K));
  flesh_proximity *proximity = (flesh_proximity *)&s.integrator->evaluation->proximity;
  const double none = stiffness_at(&s, 2, 2, K, 0), tangent = stiffness_at(&s, 0.3, 0.8, K, 0) - none;
  double value, first, second;
  flesh_barrier_law(0.3, &value, &first, &second);
  const double weight = tangent / second; /* k A/w */
  const double slope = (pressure_at(0.3) - pressure_at(0.8)) / 0.5;
  flesh_proximity_begin(proximity);
  CHECK_NEAR(stiffness_at(&s, 0.3, 0.8, K, 1) - none, weight * slope, 1e-9 * tangent);
  CHECK_NEAR(stiffness_at(&s, 0.3, 0.8, K, 1) - none, weight * slope, 1e-9 * tangent); /* filtered, for example */
  flesh_barrier_law(0.2, &value, &first, &second);
  CHECK_NEAR(stiffness_at(&s, 0.2, 0.8, K, 0) - none, weight * second, 1e-9 * weight * second);
  /* At the expected gap the force is the expected one: the tangent is used. */
  flesh_barrier_law(0.8, &value, &first, &second);
  CHECK_NEAR(stiffness_at(&s, 0.8, 0.7, K, 1) - none, weight * second, 1e-6 * tangent);
  const double expected = pressure_at(0.8), gap = 0.6; /* and the next prediction uses that tangent */
  const double predicted = expected + second * (0.8 - gap);
  double low = 0, high = 1;
  for (int k = 0; k < 60; k++) *(pressure_at((low + high) / 2) > predicted ? &low : &high) = (low + high) / 2;
  CHECK_NEAR(stiffness_at(&s, gap, 0.7, K, 1) - none, weight * (pressure_at(gap) - predicted) / (high - gap), 1e-6 * tangent);
  /* Another solve forgets the predictions. */
  flesh_proximity_begin(proximity);
  CHECK_NEAR(stiffness_at(&s, gap, 0.9, K, 1) - none, weight * (pressure_at(gap) - pressure_at(0.9)) / 0.3, 1e-9 * tangent);
  flesh_block_matrix_destroy(&K);
  finish(&s);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(nodes_that_would_touch_begin_apart), TEST(stiffness_leads_to_the_expected_force));
}
