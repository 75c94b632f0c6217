/* command.c: `flesh drift SCENE...`: compares how well the energies keep the volume, and which of them survive; a
 * study, whose records are the figures of its cases. */
#include "commands.h"

#include <stdlib.h>

#include "base/error.h"
#include "base/file.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "drift/drift.h"
#include "flesh/version.h"
#include "mesh/mesh.h"
#include "scene/scene.h"
#include "study/csv.h"
#include "study/study.h"
#include "cli/interrupt.h"
#include "cli/inputs.h"
#include "cli/lists.h"
#include "run/ranks.h"
#include "material/form.h"
#include "study/embedded.h"

/* Reads energies, and combines them with the constants that they can have. */
static int read_energies(const char *text, flesh_drift_plan *plan)
{
  flesh_energy energies[FLESH_ENERGY_COUNT];
  int count, status = flesh_list_energies(text, FLESH_ENERGY_COUNT, energies, NULL, &count);
  for (int k = 0; k < count && !status; k++) {
    plan->variants[plan->variant_count++] = (flesh_drift_variant){energies[k], flesh_form_default_constants(energies[k])};
    if (flesh_form_takes(energies[k], FLESH_CONSTANTS_AS_E))
      plan->variants[plan->variant_count++] = (flesh_drift_variant){energies[k], FLESH_CONSTANTS_AS_E};
  }
  return status;
}

static int read_solvers(const char *text, flesh_drift_plan *plan)
{
  const char *const names[] = {flesh_drift_solver_name(FLESH_DRIFT_GUARDED), flesh_drift_solver_name(FLESH_DRIFT_PLAIN),
                               NULL};
  int chosen[FLESH_DRIFT_SOLVERS];
  const int status = flesh_list_words("solvers", text, names, chosen, &plan->solver_count);
  for (int k = 0; k < plan->solver_count; k++) plan->solvers[k] = (flesh_drift_solver)chosen[k];
  return status;
}

/* Makes the cases in the order of the table. */
static int make_cases(flesh_drift_plan *plan)
{
  plan->case_count = plan->scene_count * plan->poisson_count * plan->variant_count * plan->solver_count;
  plan->cases = calloc((size_t)plan->case_count, sizeof *plan->cases);
  if (!plan->cases) return flesh_no_memory();
  flesh_drift_case *c = plan->cases;
  for (int s = 0; s < plan->scene_count; s++)
    for (int p = 0; p < plan->poisson_count; p++)
      for (int v = 0; v < plan->variant_count; v++)
        for (int g = 0; g < plan->solver_count; g++)
          *c++ = (flesh_drift_case){.scene = s, .variant = v, .poisson = p, .solver = plan->solvers[g]};
  return FLESH_OK;
}

/* Checks every scene, before hours are spent; the constants are checked by the cases. */
static int check_scenes(flesh_drift_plan *plan, flesh_inputs *inputs)
{
  for (int s = 0; s < plan->scene_count; s++) {
    flesh_scene *scene = NULL;
    const char *path = plan->scenes[s].path;
    const int again = s && path == plan->scenes[s - 1].path;
    int status = flesh_drift_read(plan, s, &scene);
    if (!status && !flesh_scene_body(scene)->materials)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: the comparison needs a scene with body.material", path);
    if (!status && flesh_scene_material_count(scene) > 1 && !again && flesh_ranks_first(plan->options.ranks))
      printf("%s: body.material alone is varied; the materials of its regions stay\n", path);
    if (!status) status = flesh_study_fingerprint(scene, path, plan->scenes[s].fingerprint);
    if (!status && !again) flesh_inputs_add_scene(inputs, path, scene);
    flesh_scene_destroy(&scene);
    if (status) return status;
  }
  return FLESH_OK;
}

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

/* Columns, in the order of the values in make_case. */
static const flesh_study_column columns[] = {{.name = "scene_name", .key = "SCENE"},
                                             {.name = "element", .key = "--elements"},
                                             {.name = "refine", .key = "--refine"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "constants", .key = "--energies"},
                                             {.name = "solver", .key = "--solvers"},
                                             {.name = "inputs_sha256", .key = "SCENE"},
                                             {0}};

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

/* Adds to `facts` the volume over that of the mesh at the times in a case's history; adds nothing for a case without a
 * history. */
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
  /* D with constants as_e has a lighter shade of D's colour: the two differ by their deflation. */
  json_t *facts = json_pack("{ssss}", "folder", folder, "colour",
                            v->constants == FLESH_CONSTANTS_AS_E ? "#d08ac8" : flesh_forms[v->energy].colour);
  add_history(flesh_path("%s/%s", plan->options.out, folder), facts);
  return facts;
}

/* Returns the plan as a study, which borrows it. */
static flesh_study describe_study(flesh_drift_plan *plan)
{
  char budget[FLESH_NUMBER_SIZE];
  snprintf(plan->fingerprint, sizeof plan->fingerprint, "flesh %s, %s s", flesh_version(),
           flesh_number_text(plan->max_seconds, budget));
  return (flesh_study){.name = "drift",
                       .fingerprint = plan->fingerprint,
                       .different = "its runs had another --max-seconds, or were made by another version of flesh; give "
                                    "it as it was, leave out --resume to begin anew",
                       .columns = columns,
                       .case_count = plan->case_count,
                       .budget = plan->max_seconds,
                       .again = "exit_code = 3", /* the case could not write its files */
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

/* Runs the comparison on the first rank. */
static int compare(void *data)
{
  flesh_drift_plan *plan = data;
  printf("runs: %d; scenes: %d, energies: %d, Poisson's ratios: %d, solvers: %d; %d at a time\n", plan->case_count,
         plan->scene_count, plan->variant_count, plan->poisson_count, plan->solver_count,
         flesh_pool_places(plan->options.ranks, plan->options.jobs, plan->case_count));
  fflush(stdout);
  const flesh_study study = describe_study(plan);
  return flesh_study_do(&study, &plan->options);
}

/* Checks the scenes and makes the cases, on every rank. */
static int prepare(flesh_drift_plan *plan)
{
  static const char *const names[] = {"drift.csv", "verdict.txt", NULL};
  flesh_inputs inputs = {0};
  int status = check_scenes(plan, &inputs);
  if (!status) status = make_cases(plan);
  if (!status) status = flesh_inputs_spare_in(&inputs, plan->options.out, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

int flesh_command_drift(int argc, char **argv)
{
  const char *energies = "B,D,E,S", *poissons = "0.3,0.4,0.45,0.49", *solvers = "guarded,plain";
  const char *elements = "", *refine = "";
  flesh_drift_plan plan = {.options = {.out = "out/drift"}};
  const flesh_option rows[] = {
      {"energies", "LIST", FLESH_OPTION_TEXT, &energies, "forms to compare (default B,D,E,S)"},
      {"poisson", "LIST", FLESH_OPTION_TEXT, &poissons, "Poisson's ratios (default 0.3,0.4,0.45,0.49)"},
      {"solvers", "LIST", FLESH_OPTION_TEXT, &solvers, "guarded, plain or both (default guarded,plain)"},
      {"elements", "LIST", FLESH_OPTION_TEXT, &elements,
       "of tet4, tet10, tet10-mean, in place of the scene's body.element"},
      {"refine", "LIST", FLESH_OPTION_TEXT, &refine,
       "times that each tet is cut into eight, such as 0,1, in place of the scene's body.refine"},
      FLESH_STUDY_OPTION_ROWS(&plan.options, "drift", "also with further scenes, energies and ratios"),
      FLESH_STUDY_OPTION_JOBS(&plan.options),
      {"max-seconds", "S", FLESH_OPTION_POSITIVE, &plan.max_seconds, "budget of each run"},
      FLESH_STUDY_OPTION_SET(&plan.options, "a value of all scenes"),
      {0}};
  const flesh_usage usage = {"drift", "SCENE...", "Compares how well the energies keep the volume.",
                             flesh_own_text("drift_help"), 1, 64, rows, NULL, FLESH_EXITS_OF_INTERRUPTS};
  int count, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) {
    flesh_study_close(&plan.options);
    return code;
  }
  int status = flesh_drift_make_scenes(count, argv + 1, elements, refine, &plan);
  if (!status) status = read_energies(energies, &plan);
  if (!status)
    status = flesh_list_numbers("poisson", poissons, FLESH_LIST_POISSON, FLESH_DRIFT_LIST, plan.poissons,
                                &plan.poisson_count);
  if (!status) status = read_solvers(solvers, &plan);
  flesh_interrupt_watch();
  if (!status) status = prepare(&plan);
  const flesh_study study = describe_study(&plan);
  code = flesh_study_lead(&study, &plan.options, status, compare, &plan);
  flesh_study_close(&plan.options);
  free(plan.scenes);
  free(plan.cases);
  return code;
}
