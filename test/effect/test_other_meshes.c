// TEST quick
/* test_other_meshes.c: objects made for one mesh are refused with another one. */
#include "scene_files.h"

#include "body.h"
#include "effect_sample.h"
#include "test.h"

/* The unit cube; its system is empty. */
static void make_cube(test_body *b)
{
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 0, b));
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
}

static int own_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  (void)point;
  for (int i = 0; i < effect->nodes; i++) r[3 * i] += 1;
  return FLESH_OK;
}

/* A mesh of the same nodes without the last tet. */
static flesh_mesh *without_a_tet(const flesh_mesh *mesh)
{
  flesh_mesh *made = NULL;
  CHECK_OK(flesh_mesh_create(flesh_mesh_node_count(mesh), flesh_mesh_positions(mesh), flesh_mesh_tet_count(mesh) - 1,
                             flesh_mesh_tets(mesh), NULL, &made));
  return made;
}

/* Checks that neither a system nor the derivative check of this mesh accepts the effect `name`, which is the last of
 * b's system, and which `row` (NULL: `own`) makes for the body of b. */
static void check_refused(const test_body *b, const flesh_effect_row *row, const flesh_effect_operations *own,
                          const flesh_mesh *mesh)
{
  flesh_system *system = NULL;
  flesh_effect *effect = NULL;
  flesh_derivative_report report;
  const flesh_effect *had = flesh_system_effect(b->system, flesh_system_effect_count(b->system) - 1);
  CHECK_OK(flesh_system_create(mesh, &system));
  if (own) CHECK_OK(flesh_effect_create(own, b->mesh, NULL, &effect));
  CHECK((own ? flesh_system_add_effect(system, &effect) : test_try_sample(row, &b->body, system)) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), had->operations->name);
  CHECK_TEXT(flesh_error_text(), "is made for a mesh of 27 nodes and 48 tets; this mesh has ");
  CHECK(!effect && flesh_system_effect_count(system) == 0);
  CHECK_OK(flesh_system_finalize(system));
  CHECK(flesh_effect_check_derivatives(had, mesh, 0, flesh_mesh_positions(mesh), 1, &report) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "is made for a mesh of 27 nodes and 48 tets; this mesh has ");
  flesh_system_destroy(&system);
}

/* Every effect, those of the registry and a user-defined one, on meshes with more nodes, fewer nodes, fewer tets. */
static void other_meshes_are_refused(void)
{
  static const flesh_effect_operations own = {.name = "own", .residual = own_residual};
  int rows, tried = 0;
  const flesh_effect_row *const *row = flesh_effect_registry(&rows);
  for (int k = 0; k <= rows; k++) {
    test_body b;
    flesh_effect *effect = NULL;
    make_cube(&b);
    if (k < rows) test_add_sample(row[k], &b);
    else CHECK_OK(flesh_effect_create(&own, b.mesh, NULL, &effect));
    if (effect) CHECK_OK(flesh_system_add_effect(b.system, &effect));
    flesh_mesh *others[] = {test_box(1, 1, 1, 1, 1, 1), test_box(4, 4, 4, 1, 1, 1), without_a_tet(b.mesh)};
    for (int m = 0; m < 3; m++) {
      if (flesh_system_effect_count(b.system)) /* otherwise a constraint, which names nodes of the system's mesh */
        check_refused(&b, k < rows ? row[k] : NULL, k < rows ? NULL : &own, others[m]), tried++;
      flesh_mesh_destroy(&others[m]);
    }
    test_body_destroy(&b);
  }
  CHECK(tried == 3 * (rows + 1 - 2)); /* pins and prescribed motions are constraints */
}

/* Observers on the mesh of `of`, and the body and system of `run`, which they are given. */
typedef struct observed {
  test_body of, run;
  flesh_integrator *integrator;
} observed;

static void open_observed(observed *o)
{
  const flesh_solver_options options = test_options(1e-6);
  const flesh_material material = test_material(FLESH_ENERGY_S, 0.4);
  CHECK_OK(test_body_create(test_box(4, 4, 4, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &o->of));
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, &o->run));
  CHECK_OK(flesh_system_finalize(o->of.system));
  CHECK_OK(flesh_system_finalize(o->run.system));
  CHECK_OK(flesh_integrator_create(o->run.system, FLESH_METHOD_BACKWARD_EULER, &options, &o->integrator));
}

/* Reports a step to an observer of the other mesh. */
static void check_observer(observed *o, int (*observe)(void *, const flesh_step_record *), void *data)
{
  const flesh_observer observer = {observe, data};
  const flesh_run_options run = {.h = 0.01, .end = o->run.state.t + 0.01, .observer_count = 1, .observers = &observer};
  CHECK(flesh_run(o->run.system, o->integrator, &run, &o->run.state, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), observe == flesh_history_observe
                                     ? "the history is made for another system than the run's"
                                     : "is made for a mesh of 125 nodes and 384 tets; this mesh has 27 nodes and 48 tets");
}

/* Bodies, histories, frames, skins, probes and integrators of another mesh. */
static void what_observes_another_mesh_is_refused(void)
{
  observed o;
  flesh_history *history = NULL;
  flesh_frames *frames = NULL;
  flesh_probes *probes = NULL;
  flesh_surface *surfaces[2] = {NULL, NULL};
  flesh_skin *skin = NULL;
  flesh_skin_frames *skins = NULL;
  open_observed(&o);
  CHECK_OK(flesh_history_create(file_path("h.csv"), o.of.system, &history));
  check_observer(&o, flesh_history_observe, history);
  CHECK_OK(flesh_history_close(&history));
  CHECK_OK(flesh_frames_create(file_path("frames"), o.of.mesh, 1, &frames));
  CHECK(flesh_frames_set_fields(frames, &o.of.body, o.run.system, FLESH_METHOD_BACKWARD_EULER, FLESH_FIELD_REACTION,
                                FLESH_AT_NODES) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the body is made for a mesh of 125 nodes");
  CHECK(flesh_frames_set_fields(frames, &o.run.body, o.run.system, FLESH_METHOD_BACKWARD_EULER, FLESH_FIELD_J,
                                FLESH_AT_TETS) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "frames is made for a mesh of 125 nodes");
  for (int k = 0; k < 2; k++) {
    CHECK(flesh_frames_set_fields(frames, &o.of.body, o.of.system, FLESH_METHOD_BACKWARD_EULER, k ? FLESH_FIELD_J : 1024,
                                  k ? 8 : FLESH_AT_NODES) == FLESH_ERR_ARGUMENT);
    CHECK_TEXT(flesh_error_text(), k ? "fields are 0x4 at 0x8; valid bits are those of 0x3ff at 0x7" : "fields are 0x400 at 0x1");
  }
  check_observer(&o, flesh_frames_observe, frames);
  CHECK_OK(flesh_frames_close(&frames));

  flesh_probe probe = {.name = "p", .quantities = FLESH_PROBE_POSITION, .point = {NAN}, .about = {NAN},
                       .nodes = (int[]){124}, .node_count = 1};
  CHECK(flesh_probe_prepare(&probe, &o.of.body, o.run.system) == FLESH_ERR_ARGUMENT);
  CHECK_OK(flesh_probe_prepare(&probe, &o.of.body, o.of.system));
  CHECK(flesh_probes_create(file_path("p.csv"), &o.run.body, o.run.system, FLESH_METHOD_BACKWARD_EULER, 1, &probe,
                            &probes) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "nodes[0] is 124");
  CHECK_OK(flesh_probes_create(file_path("p.csv"), &o.of.body, o.of.system, FLESH_METHOD_BACKWARD_EULER, 1, &probe,
                               &probes));
  check_observer(&o, flesh_probes_observe, probes);
  CHECK_OK(flesh_probes_close(&probes));

  CHECK_OK(flesh_surface_of_mesh(o.of.mesh, &surfaces[0]));
  CHECK_OK(flesh_surface_of_mesh(o.run.mesh, &surfaces[1]));
  CHECK_OK(flesh_skin_bind(o.of.mesh, surfaces[0], &skin));
  CHECK(flesh_skin_frames_create(file_path("skin"), skin, surfaces[1], FLESH_SKIN_OBJ, 1, &skins) == FLESH_ERR_ARGUMENT);
  CHECK_OK(flesh_skin_frames_create(file_path("skin"), skin, surfaces[0], FLESH_SKIN_OBJ, 1, &skins));
  check_observer(&o, flesh_skin_frames_observe, skins);
  CHECK_OK(flesh_skin_frames_close(&skins));

  const flesh_run_options run = {.h = 0.01, .end = 1};
  CHECK(flesh_run(o.of.system, o.integrator, &run, &o.of.state, NULL) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "another system");
  flesh_skin_destroy(&skin);
  flesh_surface_destroy(&surfaces[0]);
  flesh_surface_destroy(&surfaces[1]);
  flesh_integrator_destroy(&o.integrator);
  test_body_destroy(&o.of);
  test_body_destroy(&o.run);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  const int failed = RUN_TESTS(argc, argv, TEST(other_meshes_are_refused), TEST(what_observes_another_mesh_is_refused));
  test_folder_remove(folder);
  return failed;
}
