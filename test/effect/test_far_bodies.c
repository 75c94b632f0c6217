// TEST quick seconds=60
/* test_far_bodies.c: bodies far from each other need no search while they move, and still collide without
 * interpenetration. */
#include "crossings.h"
#include "effect/surface_contact.h"
#include "flesh/integrator.h"
#include "system/feasible_step.h"
#include "system/proximity.h"
#include "time/integrator.h"
#include "welded.h"

/* Makes two blocks of 0.3 m, this far apart, the second of which approaches at `speed` and turns. */
static void begin(double apart, double speed, test_body *b)
{
  const double size[3] = {0.3, 0.3, 0.3};
  const int cells[3] = {2, 2, 2};
  flesh_contact_options options;
  flesh_effect *contact = NULL;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){0.3 + apart, 0.05, 0.02}));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, b));
  flesh_contact_options_default(&options);
  CHECK_OK(flesh_effect_surface_contact(&b->body, &options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int d = b->n / 2; d < b->n; d += 3) {
    b->state.v[d] = -speed;
    b->state.v[d + 1] = -2 * (b->state.x[d + 2] - 0.15);
    b->state.v[d + 2] = 2 * (b->state.x[d + 1] - 0.15);
  }
}

/* Relative motions of parts of surfaces are bounded, cube by cube, only if something is near. */
static void what_is_far_is_not_looked_at(void)
{
  for (int m = 0; m < FLESH_METHOD_IDA; m++) {
    if (m == FLESH_METHOD_STATIC) continue; /* a free body has no equilibrium */
    const flesh_solver_options options = test_options(1e-6);
    test_body b;
    flesh_integrator *integrator = NULL;
    begin(100, 40, &b);
    CHECK_OK(flesh_integrator_create(b.system, (flesh_method)m, &options, &integrator));
    for (int s = 0; s < 10; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 200, NULL));
    const flesh_surface_near *near = flesh_proximity_of(integrator->evaluation->environment.proximity, 2);
    CHECK(near->static_known && near->pieces == 2 && near->group[0] != near->group[1]);
    CHECK(near->drift.leaf_room == 0);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

static void what_comes_from_afar_is_met(void)
{
  const double aways[] = {0.5, 5};
  for (int k = 0; k < 2; k++) {
    const flesh_solver_options options = test_options(1e-8);
    test_body b;
    flesh_contact_surface surface;
    flesh_integrator *integrator = NULL;
    int crossings = 0;
    begin(aways[k], 20, &b);
    CHECK_OK(flesh_contact_surface_of_mesh(b.mesh, NULL, &surface));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int s = 0; s < 90; s++) {
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 200, NULL));
      crossings += crossings_count(&surface, b.state.x);
    }
    double first = 0;
    for (int d = 0; d < b.n / 2; d += 3) first += b.state.v[d] / (b.n / 6);
    printf("# from %g m: the first one is pushed to %.3g m/s\n", aways[k], first);
    CHECK(crossings == 0);
    CHECK(first < -5); /* it was pushed, by at least half of the other's speed except for rotation */
    flesh_contact_surface_clear(&surface);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Two sheets 0.15 m apart: the upper one is to go 4 m down, with its nodes moved aside individually, as first
 * directions of a solve move them. */
static void of_a_long_way_only_the_beginning_is_searched(void)
{
  const int cells[3] = {10, 10, 1};
  const double size[3] = {1, 1, 0.1};
  const flesh_solver_options options = test_options(1e-6);
  flesh_contact_options contact_options;
  flesh_effect *contact = NULL;
  flesh_integrator *integrator = NULL;
  test_body b;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){0.03, 0.02, 0.25}));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, &b));
  flesh_contact_options_default(&contact_options);
  CHECK_OK(flesh_effect_surface_contact(&b.body, &contact_options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b.system, &contact));
  CHECK_OK(flesh_system_finalize(b.system));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  const flesh_proximity *proximity = &integrator->evaluation->proximity;
  flesh_surface_near *near = flesh_proximity_of(proximity, 2);
  double *x_to = malloc((size_t)b.n * sizeof *x_to);
  for (int d = 0; d < b.n; d++) x_to[d] = b.state.x[d] - (d < b.n / 2 ? 0 : d % 3 == 2 ? 4 : 2 * sin(d));
  const double fraction = flesh_system_max_feasible_step(b.system, proximity, NULL, 0, b.state.x, 0, x_to);
  const int searched = near->swept_pairs.point_count + near->swept_pairs.edge_count;
  flesh_near_pairs all = {0};
  const double *to = flesh_surface_near_without_mean(near, b.state.x, x_to);
  CHECK_OK(flesh_near_pairs_find(near->finder, b.state.x, to, 0, NULL, &all));
  const double whole = flesh_near_pairs_feasible_step(near->finder, &all, b.state.x, to, 0.1, INFINITY, NULL);
  printf("# %d pairs in place of %d, %.6g of the way\n", searched, all.point_count + all.edge_count, fraction);
  CHECK(fraction == whole && fraction > 0.01 && fraction < 0.15 / 4);
  CHECK(searched > 0 && 5 * searched < all.point_count + all.edge_count);
  flesh_near_pairs_clear(&all);
  free(x_to);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

/* Two plates 0.15 m apart: the upper one, at the lower one's rim, comes down. */
static void begin_plates(test_body *b)
{
  const int cells[3] = {4, 4, 1};
  const double size[3] = {0.4, 0.4, 0.05};
  flesh_contact_options contact_options;
  flesh_effect *contact = NULL;
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(cells, size, (double[]){0.3, 0.05, 0.2}));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, b));
  flesh_contact_options_default(&contact_options);
  CHECK_OK(flesh_effect_surface_contact(&b->body, &contact_options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int d = b->n / 2 + 2; d < b->n; d += 3) b->state.v[d] = -40;
}

/* A solve can find a path over the rim, of which inertia knows nothing: the upper plate would end below, as if
 * alone. */
static void a_step_does_not_lead_around_what_is_in_its_way(void)
{
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_BDF2, FLESH_METHOD_MIDPOINT, FLESH_METHOD_NEWMARK};
  for (int m = 0; m < 4; m++) {
    const flesh_solver_options options = test_options(1e-4);
    test_body b;
    flesh_integrator *integrator = NULL;
    double low = INFINITY, first = 0, second = 0;
    begin_plates(&b);
    CHECK_OK(flesh_integrator_create(b.system, methods[m], &options, &integrator));
    for (int s = 0; s < 2; s++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 50, NULL));
    for (int d = 2; d < b.n; d += 3) *(d < b.n / 2 ? &first : &second) += b.state.v[d] / (b.n / 6);
    for (int d = b.n / 2 + 2; d < b.n; d += 3) low = fmin(low, b.state.x[d]);
    printf("# method %d: %.3g and %.3g m/s, down to %.3g m\n", methods[m], first, second, low);
    CHECK(first < -0.3 && second > -39.7 && second < -20); /* 1e-4 m/s if it goes around */
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Whether the upper plate, raised this far, would have passed through the lower one on its path. */
static int is_tunnelled(const test_body *b, flesh_integrator *integrator, double up, double along, double down)
{
  double *x[2] = {malloc((size_t)b->n * sizeof **x), malloc((size_t)b->n * sizeof **x)};
  for (int d = 0; d < b->n; d++) {
    const int c = d < b->n / 2 ? 1 : d % 3;
    x[0][d] = b->state.x[d] + (c == 2 ? up : 0);
    x[1][d] = x[0][d] + (c == 0 ? along : c == 2 ? -down : 0);
  }
  const int passed = flesh_system_tunnelled(b->system, &integrator->evaluation->proximity, NULL, 0, x[0], 1. / 50, x[1]);
  free(x[0]);
  free(x[1]);
  return passed;
}

/* A body beside the path, or touched only at its end, is no obstacle to it; one that is touched from the other side is.
 * A body touched where the path begins and where it ends may be slid along. */
static void what_is_passed_is_told(void)
{
  const flesh_solver_options options = test_options(1e-4);
  test_body b;
  flesh_integrator *integrator = NULL;
  begin_plates(&b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  CHECK(is_tunnelled(&b, integrator, 0, 0, 0.8) && is_tunnelled(&b, integrator, 0, 0.4, 0.8));
  CHECK(is_tunnelled(&b, integrator, 0, 0, 50) && is_tunnelled(&b, integrator, 30, 0, 50) &&
        is_tunnelled(&b, integrator, -50, 0, -60));
  CHECK(!is_tunnelled(&b, integrator, 0, 0, 0.1) && !is_tunnelled(&b, integrator, 0, 0, 0.149));
  CHECK(!is_tunnelled(&b, integrator, 0, 1, 0.8) && !is_tunnelled(&b, integrator, 30, 40, 50));
  CHECK(!is_tunnelled(&b, integrator, 0, 0, -5) && !is_tunnelled(&b, integrator, 30, 0, 30.149));
  CHECK(!is_tunnelled(&b, integrator, 0, 0, 0.15 - 1e-5)); /* touched as hard as possible */
  CHECK(is_tunnelled(&b, integrator, 0, 0, 0.253) && is_tunnelled(&b, integrator, 30, 0, 30.253));
  CHECK(!is_tunnelled(&b, integrator, -0.253, 0, 0.5) && !is_tunnelled(&b, integrator, -0.149, 0, 0.104));
  CHECK(is_tunnelled(&b, integrator, -0.149, 0, 0.5)); /* touched only where the path begins */
  CHECK(is_tunnelled(&b, integrator, 0, 0, 0.8)); /* whatever was asked before */
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(what_is_far_is_not_looked_at), TEST(what_comes_from_afar_is_met),
                   TEST(of_a_long_way_only_the_beginning_is_searched),
                   TEST(a_step_does_not_lead_around_what_is_in_its_way), TEST(what_is_passed_is_told));
}
