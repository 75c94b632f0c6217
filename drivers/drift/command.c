/* command.c: `flesh drift SCENE...`: compares how well the energies keep the volume, and which of them survive; a
 * study, whose records are the figures of its cases. */
#include "commands.h"

#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "cli/json_memory.h"
#include "cli/path.h"
#include "drift/drift.h"
#include "flesh/version.h"
#include "mesh/mesh.h"
#include "plot/curves.h"
#include "scene/scene.h"
#include "study/study.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/lists.h"
#include "run/ranks.h"
#include "material/form.h"
#include "study/embedded.h"

/* Writes the scene's file name without suffix, with its number if `clash`; it becomes part of file names, and a field. */
static void name_scene(const char *path, int index, int clash, char name[64])
{
  const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path, *dot = strrchr(base, '.');
  int length = dot && dot != base ? (int)(dot - base) : (int)strlen(base);
  if (length > 48) length = 48;
  snprintf(name, 64, "%.*s", length, base);
  if (clash) flesh_text_add(name, 64, "_%d", index + 1);
  flesh_safe_name(name);
}

/* Makes plan->scenes of the files, with every element and refinement of the lists, which may be empty. */
static int make_scenes(int count, char *const *paths, const char *elements, const char *refine, flesh_drift_plan *plan)
{
  static const char *const times[] = {"0", "1", "2", "3", "4", NULL};
  flesh_element chosen[FLESH_ELEMENT_COUNT];
  char names[64][64];
  int refined[sizeof times / sizeof *times], element_count = 0, times_count = 0, status = FLESH_OK;
  if (*elements) status = flesh_list_elements(elements, chosen, &element_count);
  if (!status && *refine) status = flesh_list_words("refine", refine, times, refined, &times_count);
  if (status) return status;
  for (int s = 0; s < count; s++) {
    name_scene(paths[s], s, 0, names[s]);
    for (int other = 0; other < s; other++)
      if (!strcmp(names[s], names[other])) name_scene(paths[s], s, 1, names[s]);
  }
  const int cuts = times_count ? times_count : 1, meshes = cuts * (element_count ? element_count : 1); /* of each file */
  plan->scenes = calloc((size_t)(count * meshes), sizeof *plan->scenes);
  if (!plan->scenes) return flesh_no_memory();
  for (plan->scene_count = 0; plan->scene_count < count * meshes; plan->scene_count++) {
    const int k = plan->scene_count;
    flesh_drift_scene *to = &plan->scenes[k];
    *to = (flesh_drift_scene){.path = paths[k / meshes],
                              .element = element_count ? flesh_element_name(chosen[k % meshes / cuts]) : "",
                              .refine = times_count ? times[refined[k % cuts]] : ""};
    snprintf(to->name, sizeof to->name, "%.63s", names[k / meshes]);
    if (element_count > 1) flesh_text_add(to->name, sizeof to->name, "_%s", to->element);
    if (times_count > 1) flesh_text_add(to->name, sizeof to->name, "_refined%s", to->refine);
  }
  return FLESH_OK;
}

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

/* Checks every scene, on every rank, before hours are spent; the constants are checked by the cases. */
static int check_scenes(flesh_drift_plan *plan)
{
  static const char *const names[] = {"drift.csv", "verdict.txt", NULL};
  flesh_inputs inputs = {0};
  int status = FLESH_OK;
  for (int s = 0; s < plan->scene_count && !status; s++) {
    flesh_scene *scene = NULL;
    const char *path = plan->scenes[s].path;
    const int again = s && path == plan->scenes[s - 1].path;
    status = flesh_drift_read(plan, &plan->scenes[s], &scene);
    if (!status && flesh_scene_material_count(scene) > 1 && !again && flesh_ranks_first(plan->options.ranks))
      printf("%s: body.material alone is varied; the materials of its regions stay\n", path);
    if (!status) status = flesh_study_fingerprint(scene, path, plan->scenes[s].fingerprint);
    if (!status && !again) flesh_inputs_add_scene(&inputs, path, scene);
    flesh_scene_destroy(&scene);
  }
  if (!status) status = flesh_inputs_spare_in(&inputs, plan->options.out, names, NULL);
  flesh_inputs_close(&inputs);
  return status;
}

/* Returns the figures that the SQL reads: first those of every run. */
static json_t *name_figures(const void *data)
{
  (void)data;
  return json_pack("[ssssssssssssssssssssssss]", "status_code", "element_kind", "steps", "final_inverted", "first_inverted_step",
                   "first_bound_step", "J_bound", "max_volume_drift", "final_volume_drift", "rest_volume_ratio",
                   "rest_volume_ratio_theory", "J_min", "max_inverted", "newton", "linear_per_newton", "wall_s", "t_end",
                   "distance_from_rest", "stressed_rest_J", "worst_t", "worst_drift", "event_t", "event_drift", "point_load");
}

/* Columns, in the order of the values in make_case. */
static const flesh_study_column columns[] = {{.name = "scene_name", .key = "SCENE"},
                                             {.name = "element", .key = "--elements"},
                                             {.name = "refine", .key = "--refine"},
                                             {.name = "poisson", .key = "--poisson"},
                                             {.name = "energy", .key = "--energies"},
                                             {.name = "constants", .key = "--energies"},
                                             {.name = "solver", .key = "--solvers"},
                                             {.name = "inputs_sha256", .key = "SCENE", .is_digest = 1},
                                             {0}};

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const flesh_drift_case c = flesh_drift_case_of(data, number);
  *made = (flesh_study_case){.scene = c.scene->path,
                             .values = {c.scene->name, c.scene->element, c.scene->refine, NULL,
                                        flesh_energy_name(c.variant.energy), flesh_constants_name(c.variant.constants),
                                        flesh_drift_solver_names[c.solver], c.scene->fingerprint}};
  made->values[3] = flesh_study_case_number(made, c.poisson);
  return FLESH_OK;
}

static int make_body(const void *data, int number, flesh_mesh **mesh, flesh_camera *camera)
{
  flesh_scene *scene = NULL;
  int status = flesh_drift_read(data, flesh_drift_case_of(data, number).scene, &scene);
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

/* Adds to `facts` the volume over that of the mesh at the times in a case's history; adds nothing for a case without a
 * history. */
static void add_history(const char *folder, json_t *facts)
{
  flesh_csv history;
  char unit[FLESH_CSV_NAME];
  if (flesh_csv_read(flesh_path("%s/history.csv", folder), FLESH_CSV_TORN, &history)) return;
  const int columns[] = {flesh_csv_find_label(&history, "t", unit), flesh_csv_find_label(&history, "volume_ratio", unit)};
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
  const flesh_drift_case c = flesh_drift_case_of(plan, number);
  const char *folder = flesh_drift_case_folder(&c);
  /* D with constants as_e has a lighter shade of D's colour: the two differ by their deflation. */
  json_t *facts = json_pack("{ssss}", "folder", folder, "colour",
                            c.variant.constants == FLESH_CONSTANTS_AS_E ? "#d08ac8" : flesh_forms[c.variant.energy].colour);
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
                       .case_count = plan->scene_count * plan->poisson_count * plan->variant_count * plan->solver_count,
                       .budget = plan->max_seconds,
                       .again = "exit_code = 3", /* the case could not write its files */
                       .data = plan,
                       .make = make_case,
                       .figures = name_figures,
                       .results = {flesh_own_text("drift"),
                                   flesh_own_text("plot_same"),
                                   flesh_own_text("drift_pictures")},
                       .facts = facts_of,
                       .body = make_body,
                       .work = flesh_drift_run_case};
}

/* Runs the comparison on the first rank. */
static int compare(const flesh_study *study, const flesh_study_options *options)
{
  const flesh_drift_plan *plan = study->data;
  printf("runs: %d; scenes: %d, energies: %d, Poisson's ratios: %d, solvers: %d; %d at a time\n", study->case_count,
         plan->scene_count, plan->variant_count, plan->poisson_count, plan->solver_count,
         flesh_pool_slots(options->ranks, options->jobs, study->case_count));
  fflush(stdout);
  return flesh_study_do(study, options);
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
  int count, status, code = flesh_study_open(&plan.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    status = make_scenes(count, argv + 1, elements, refine, &plan);
    if (!status) status = read_energies(energies, &plan);
    if (!status)
      status = flesh_list_numbers("poisson", poissons, FLESH_LIST_POISSON, FLESH_DRIFT_LIST, plan.poissons,
                                  &plan.poisson_count);
    if (!status) status = flesh_list_words("solvers", solvers, flesh_drift_solver_names, plan.solvers, &plan.solver_count);
    flesh_interrupt_watch();
    if (!status) status = check_scenes(&plan);
    const flesh_study study = describe_study(&plan);
    code = flesh_study_lead(&study, &plan.options, status, compare);
  }
  flesh_study_close(&plan.options);
  free(plan.scenes);
  return code;
}
