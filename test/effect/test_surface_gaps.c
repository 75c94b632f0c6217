// TEST quick seconds=20
/* test_surface_gaps.c: first iterates that would bring bodies into each other keep the gaps of touching features, node
 * by node, and solves begin there. */
#include "effect/surface_contact.h"
#include "flesh/integrator.h"
#include "flesh/scene.h"
#include "system/feasible_step.h"
#include "time/integrator.h"
#include "welded.h"

static const double edge = 0.1, thickness = 0.01;

/* Makes a slab and a smaller one `gap` above its middle. */
static void begin(double gap, test_body *b)
{
  const int cells[3] = {8, 6, 1}, fewer[3] = {4, 3, 1};
  const double size[3] = {8 * edge, 6 * edge, edge}, smaller[3] = {3.7 * edge, 2.9 * edge, edge};
  flesh_contact_options options;
  flesh_effect *contact = NULL;
  const double place[3] = {2.2 * edge, 1.7 * edge, edge + gap};
  flesh_mesh *mesh = joined(box(cells, size, (double[]){0, 0, 0}), box(fewer, smaller, place));
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 1, b));
  flesh_contact_options_default(&options);
  options.thickness = thickness;
  CHECK_OK(flesh_effect_surface_contact(&b->body, &options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Moves from one gap to another, over the thickness, and checks the one that is kept: the least of all pairs within
 * reach, 1 if there is none. Nodes that did not touch stay at the guess. */
static void gaps_are_kept(void)
{
  const struct {
    double from, to, kept;
    int changed;
  } cases[] = {{0.5, -1, 0.5, 1}, {0.5, 0.1, 0.5, 1}, {0.5, 1.2, 0.5, 1}, {0.5, 1.8, 1, 0}, {2, 0.3, 0.3, 0}, {2, 1.5, 1, 0}};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    const flesh_solver_options options = test_options(1e-6);
    flesh_integrator *integrator = NULL;
    test_body b;
    begin(cases[k].from * thickness, &b);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    const flesh_proximity *proximity = &integrator->evaluation->proximity;
    flesh_surface_near *near = flesh_proximity_of(proximity, 2);
    double *x = malloc((size_t)b.n * sizeof *x), mean[2] = {0};
    for (int d = 0; d < b.n; d++)
      x[d] = b.state.x[d] + (d < 3 * 9 * 7 * 2 || d % 3 < 2 ? 0 : (cases[k].to - cases[k].from) * thickness);
    for (int d = 2; d < b.n; d += 3) mean[0] += x[d];
    const int changed = flesh_system_keep_gaps(b.system, proximity, NULL, b.state.x, x);
    for (int d = 2; d < b.n; d += 3) mean[1] += x[d];
    CHECK_OK(flesh_surface_near_update_pairs(near, x));
    CHECK(changed == cases[k].changed);
    CHECK_NEAR(fmin(near->set.distance / thickness, 1), cases[k].kept, 0.06);
    CHECK(flesh_system_max_feasible_step(b.system, proximity, NULL, 0, b.state.x, 0, x) == 1);
    CHECK_NEAR(mean[1], mean[0], 1e-9); /* half of it by each body */
    free(x);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Computes x [n] with the smaller slab displaced this far along y and up. */
static void slide(const test_body *b, double along, double up, double *x)
{
  for (int d = 0; d < b->n; d++)
    x[d] = b->state.x[d] + (d < 3 * 9 * 7 * 2 || d % 3 == 0 ? 0 : d % 3 == 2 ? up : along);
}

/* Gaps are those of features near where the step begins, not of what a search elsewhere has found: a resumed run has
 * searched there. The upper slab slides onto faces that a search at another position lacks, or exclusively has. */
static void gaps_do_not_depend_on_searches(void)
{
  const double cases[][2] = {{-3.5, 4.5}, {-2, 4.5}, {2, 4.5}}; /* thicknesses: where the search was, where the slab goes */
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
    double *x[2];
    for (int searched = 0; searched < 2; searched++) {
      const flesh_solver_options options = test_options(1e-6);
      flesh_integrator *integrator = NULL;
      test_body b;
      begin(0.5 * thickness, &b);
      CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
      const flesh_proximity *proximity = &integrator->evaluation->proximity;
      x[searched] = malloc((size_t)b.n * sizeof *x[searched]);
      if (searched) {
        slide(&b, cases[k][0] * thickness, 0, x[searched]);
        CHECK_OK(flesh_surface_near_update_pairs(flesh_proximity_of(proximity, 2), x[searched]));
      }
      slide(&b, cases[k][1] * thickness, -thickness, x[searched]);
      CHECK(flesh_system_keep_gaps(b.system, proximity, NULL, b.state.x, x[searched]) == 1);
      flesh_integrator_destroy(&integrator);
      CHECK(!memcmp(x[0], x[searched], (size_t)b.n * sizeof *x[0]));
      test_body_destroy(&b);
    }
    for (int j = 0; j < 2; j++) free(x[j]);
  }
}

/* A ball pushed through a tight tube: 452 Newton iterations if guesses are accepted or refused as a whole, 385 if nodes
 * keep their gaps to faces that they have slid off, 285 if they keep them to those that they are above. */
static void solves_begin_at_these_gaps(void)
{
  flesh_scene *scene = NULL;
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(flesh_scene_read("../data/scenes/tube.yaml", 0, NULL, &scene));
  const size_t n = 3 * (size_t)flesh_mesh_node_count(flesh_scene_mesh(scene));
  flesh_state state = {.x = calloc(n, sizeof *state.x), .v = calloc(n, sizeof *state.v)};
  flesh_scene_start(scene, &state);
  CHECK_OK(flesh_integrator_create(flesh_scene_system(scene), FLESH_METHOD_BACKWARD_EULER, flesh_scene_solver(scene),
                                   &integrator));
  for (int s = 0; s < 50; s++) CHECK_OK(flesh_integrator_step(integrator, &state, 1. / 100, &stats));
  printf("# %ld Newton iterations\n", (long)stats.newton);
  CHECK(stats.newton > 50 && stats.newton <= 310);
  flesh_integrator_destroy(&integrator);
  flesh_scene_destroy(&scene);
  free(state.x);
  free(state.v);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(gaps_are_kept), TEST(gaps_do_not_depend_on_searches), TEST(solves_begin_at_these_gaps));
}
