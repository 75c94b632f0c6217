/* study.c: a drift comparison as a study: its cases, and their figures as records. */
#include <stdlib.h>

#include "base/error.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "drift/drift.h"
#include "flesh/version.h"
#include "material/form.h"
#include "mesh/mesh.h"
#include "scene/scene.h"
#include "study/csv.h"
#include "study/embedded.h"
#include "study/fields.h"

typedef flesh_drift_figures figures;
#define FIGURE(kind, name) {#name, FLESH_FIELD_##kind, offsetof(figures, name)}
#define OF_RUN(kind, name) {#name, FLESH_FIELD_##kind, offsetof(figures, run.name)}
static const flesh_study_field fields[] = {
    {"status_code", FLESH_FIELD_INT, offsetof(figures, status)},
    {"element_kind", FLESH_FIELD_INT, offsetof(figures, element)},
    {"tet_count", FLESH_FIELD_INT, offsetof(figures, tets)},
    {"node_count", FLESH_FIELD_INT, offsetof(figures, nodes)},
    OF_RUN(INT, steps), OF_RUN(INT, final_inverted), FIGURE(INT, first_inverted_step), FIGURE(INT, first_bound_step),
    OF_RUN(DOUBLE, J_bound), OF_RUN(DOUBLE, max_volume_drift), OF_RUN(DOUBLE, final_volume_drift),
    FIGURE(DOUBLE, rest_volume_ratio), FIGURE(DOUBLE, rest_volume_ratio_theory), OF_RUN(DOUBLE, J_min),
    OF_RUN(INT, max_inverted), FIGURE(DOUBLE, newton_per_step), FIGURE(DOUBLE, linear_per_newton),
    OF_RUN(DOUBLE, wall_s), {"failure_t", FLESH_FIELD_DOUBLE, offsetof(figures, failed_at)},
    FIGURE(DOUBLE, distance_from_rest), OF_RUN(DOUBLE, stressed_rest), FIGURE(DOUBLE, worst_t),
    FIGURE(DOUBLE, worst_drift), FIGURE(DOUBLE, event_t), FIGURE(DOUBLE, event_drift), FIGURE(INT, point_load), {0}};

/* In the order of the values of make_case. */
static const flesh_study_column columns[] = {{.name = "scene_name", .key = "SCENE"},
                                             {.name = "element", .key = "--elements"},
                                             {.name = "refine", .key = "--refine"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "constants", .key = "--energies"},
                                             {.name = "solver", .key = "--solvers"},
                                             {.name = "inputs_sha256", .key = "SCENE"}};
enum { COLUMNS = sizeof columns / sizeof *columns };

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_drift_plan *plan = data;
  const flesh_drift_case *c = &plan->cases[number];
  const flesh_drift_scene *scene = &plan->scenes[c->scene];
  const flesh_drift_variant *v = &plan->variants[c->variant];
  char *poisson = malloc(FLESH_NUMBER_SIZE);
  *made = (flesh_study_case){.scene = scene->path,
                             .owned = poisson,
                             .values = {scene->name, scene->element, scene->refine, poisson, flesh_energy_name(v->energy),
                                        flesh_constants_name(v->constants), flesh_drift_solver_name(c->solver),
                                        scene->fingerprint}};
  if (!poisson) return flesh_no_memory();
  flesh_number_text(plan->poissons[c->poisson], poisson);
  return FLESH_OK;
}

static const char *status_word(const figures *f)
{
  if (!f->status && f->run.stressed_rest > 0) return "stressed rest";
  return flesh_fields_status(f->status, f->status == FLESH_UNDEFINED    ? "undefined"
                                        : f->status == FLESH_ERR_ENERGY ? "energy grew"
                                                                        : "not converged");
}

static json_t *do_case(const void *data, int number, const char *folder)
{
  (void)folder;
  const flesh_drift_plan *plan = data;
  figures f;
  flesh_drift_run_case(plan, &plan->cases[number], &f);
  return flesh_fields_record(status_word(&f), f.exit_code, f.message, flesh_fields_json(fields, &f));
}

static int make_body(const void *data, int number, flesh_mesh **mesh, flesh_camera *camera)
{
  const flesh_drift_plan *plan = data;
  flesh_scene *scene = NULL;
  int status = flesh_drift_read(plan, plan->cases[number].scene, &scene);
  if (status) return status;
  *camera = flesh_scene_outputs(scene)->camera;
  flesh_scene_up(scene, camera->up);
  const flesh_mesh *own = flesh_scene_mesh(scene);
  status = flesh_mesh_build(&(flesh_mesh_lists){.nodes = flesh_mesh_node_count(own), .tets = flesh_mesh_tet_count(own),
                                                .positions = flesh_mesh_positions(own), .tet_nodes = flesh_mesh_tets(own),
                                                .edge_nodes = flesh_mesh_tet_edges(own)}, NULL, mesh);
  flesh_scene_destroy(&scene);
  return status;
}

static void title(const void *data, int number, char *text, size_t size)
{
  const flesh_drift_plan *plan = data;
  const flesh_drift_case *c = &plan->cases[number];
  char variant[16];
  flesh_drift_variant_title(plan->variants[c->variant], variant);
  snprintf(text, size, "%s, %s, poisson %g, %s", plan->scenes[c->scene].name, variant, plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver));
}

/* The volume over that of the mesh at the times of a case's history; none of a case without one. */
static void add_history(const char *folder, json_t *facts)
{
  flesh_csv history;
  if (flesh_csv_read(flesh_path("%s/history.csv", folder), FLESH_CSV_TORN, &history)) return;
  const int columns[] = {flesh_csv_find(&history, "t"), flesh_csv_find(&history, "volume_ratio")};
  json_t *rows = json_array();
  for (int row = 0; row < history.rows && columns[0] >= 0 && columns[1] >= 0; row++) {
    double values[2];
    for (int k = 0; k < 2; k++) flesh_csv_number(&history, row, columns[k], &values[k]);
    json_array_append_new(rows, json_pack("[oo]", flesh_json_number(values[0]), flesh_json_number(values[1])));
  }
  json_object_set_new(facts, "history", rows);
  flesh_csv_clear(&history);
}

static json_t *facts_of(const void *data, int number)
{
  const flesh_drift_plan *plan = data;
  const flesh_drift_case *c = &plan->cases[number];
  const flesh_drift_variant *v = &plan->variants[c->variant];
  char folder[256];
  flesh_drift_case_folder(plan, c, folder);
  /* The two D's share a colour: the deflation sets them apart. */
  json_t *facts = json_pack("{ssss}", "folder", folder, "colour",
                            v->constants == FLESH_CONSTANTS_AS_E ? "#d08ac8" : flesh_forms[v->energy].colour);
  add_history(flesh_path("%s/%s", plan->options.out, folder), facts);
  return facts;
}

flesh_study flesh_drift_study(flesh_drift_plan *plan)
{
  char budget[FLESH_NUMBER_SIZE];
  snprintf(plan->fingerprint, sizeof plan->fingerprint, "flesh %s, %s s", flesh_version(),
           flesh_number_text(plan->max_seconds, budget));
  return (flesh_study){.name = "drift",
                       .fingerprint = plan->fingerprint,
                       .different = "its runs had another --max-seconds, or were made by another version of flesh; give "
                                    "it as it was, leave out --resume to begin anew",
                       .column_count = COLUMNS,
                       .columns = columns,
                       .case_count = plan->case_count,
                       .budget = plan->max_seconds,
                       .again = "exit_code = 3", /* it could not write its files */
                       .data = plan,
                       .make = make_case,
                       .fields = fields,
                       .results = {flesh_own_text("drift"),
                                   flesh_own_text("plot_same"),
                                   flesh_own_text("drift_pictures")},
                       .facts = facts_of,
                       .body = make_body,
                       .work = do_case,
                       .title = title};
}
